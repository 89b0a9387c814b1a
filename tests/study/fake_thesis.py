"""Made-up results with every experiment of the thesis, real fully connected networks and their real predictions."""

from zlib import crc32

import fake
import numpy as np
import pandas as pd

from isarflow.core.sweep import snr_label
from isarflow.learning.classifier import choices
from isarflow.learning.experiments import label, runs
from isarflow.learning.predict import Tested, predict
from isarflow.learning.train import Training, train

SNRS = [-18, -12, -6, 0, 3, 6, 12, 24]
LISTS = {
    "svm_tuned": {"C": [1, 1000], "scale": [1, 2.75]},
    "knn_tuned": {"k": [1, 3]},
    "fcnn_tuned": {"width": [4, 756]},
}
SCORES = {"fcnn": ("softmax", "openmax"), "capsule": ("mse", "zncc", "length", "mixture")}
SCORES |= {"capsule_complex": ("mse", "coherence"), "capsule_long": ("mse", "zncc"), "capsule_listing": ("mse", "zncc")}
FCNN = {"width": 6, "epochs": 2, "batch": 16, "learning_rate": 0.01, "openmax_tail": 5, "openmax_alpha": 1}


def settings():
    """The config of a run that has all that the thesis has."""
    config = fake.changed(targets={"disc": {"mesh": "disc.stl", "role": "unknown"}})
    config["noise"] |= {"snr_db": list(SNRS), "definition": "mean"}
    models, experiments = config["learning"]["models"], config["learning"]["experiments"]
    models |= {name: {"kind": name.removesuffix("_tuned"), **lists} for name, lists in LISTS.items()}
    models |= {"fcnn": dict(FCNN), "fcnn_other": {"kind": "fcnn", "other": True, **FCNN}}
    models["capsule_complex"] = {"kind": "capsule", "width": 16, "capsules": 2, "complex": True}
    clean, each = fake.CLEAN, {"elevation": "all", "snr_db": {"each": [-18, 0, 24]}}
    models["knn_magnitude"] = {"kind": "knn", "features": "magnitude"}
    models |= {name: {"kind": "capsule", **models["capsule"]} for name in ("capsule_long", "capsule_listing")}
    experiments["capsule_open"]["models"] = ["capsule", "capsule_long"]
    experiments["multi_elevation"] = {"train": clean, "models": ["lr", "lr_tuned", "svm", "knn", "knn_magnitude"]}
    experiments["multi_shuffled"] = {"train": clean, "models": ["svm", "knn"], "split": "shuffled"}
    experiments["tuning"] = {"train": clean, "models": list(LISTS)}
    experiments["noisy_training"] = {"train": each, "models": ["lr", "svm"]}
    experiments["upsampling"] = {"train": each, "models": ["lr", "svm"], "upsample": 64}
    experiments["fcnn_open"] = {"train": clean, "models": ["fcnn", "fcnn_other"], "open": True}
    listing = {"elevation": "all", "snr_db": 24}
    experiments["fcnn_listing"] = experiments["fcnn_open"] | {"train": listing}
    experiments["capsule_listing"] = {"train": listing, "models": ["capsule_listing"], "open": True, "upsample": 32}
    experiments["sector"] = {"train": clean, "models": ["lr", "knn", "fcnn"], "open": True, "split": "sector"}
    experiments["capsule_sector"]["folds"] = [1, 2, 3]
    experiments["noisy_capsule"]["train"]["snr_db"] = {"random": ["clean", 0, 24]}
    experiments["noisy_capsule"]["models"] = ["capsule", "capsule_complex"]
    for name in ("sector_fcnn", "capsule_closed"):
        del experiments[name]
    return config


def make(folder, config):
    """Fill `folder` (results/<name>) with results of the config, as far as the page of the thesis reads them."""
    fake.make(folder, config, SCORES)
    _tell_apart(folder / "learning" / "scores.csv")
    for name, run in runs(config).items():
        for model in run["models"]:
            if model in LISTS:
                _searched(folder / "learning" / "models" / name / model, model)
            elif model.startswith("fcnn") and run["split"] == "random":
                _fit(folder, run, model, config)
            elif name in ("capsule_open", "capsule_listing"):
                _capsule(folder / "learning" / "predictions", name, model)


def _tell_apart(path):
    """Make the values of every curve its own, so that a page that takes another one is found out."""
    scores = pd.read_csv(path, dtype={"fold": str}, keep_default_na=False, na_values={"low": [""], "high": [""]})
    own = scores[[column for column in scores if column not in ("test_snr_db", "value", "low", "high", "n")]]
    less = own.astype(str).agg("/".join, axis=1).map(lambda key: crc32(key.encode()) % 60 / 1000)
    less += 0.03 * ((scores["model"] == "svm") & (scores["test_snr_db"] == 24))  # whose maximum is before the end
    for column in ("value", "low", "high"):
        scores[column] = (scores[column] - less).where(scores["metric"] != "threshold", scores[column])
    scores.loc[(scores["model"] == "knn_magnitude") & (scores["metric"] == "accuracy"), ["value", "low", "high"]] = 1.0
    scores.to_csv(path, index=False)


def _searched(path, model):
    """The settings tried: each better than the one before."""
    tried = pd.DataFrame(choices({"kind": model, **LISTS[model]}))
    tried.assign(validation_accuracy=np.linspace(0.8, 0.9, len(tried))).to_csv(path / "search.csv", index=False)


def _fit(folder, run, model, config):
    """A small network, fitted; one with a class OTHER has UFOs as its examples of that. Its predictions at all SNRs."""
    own = config["learning"]["models"][model]
    roles = {name: target["role"] for name, target in config["targets"].items()}
    learned = roles | ({"ufo": "other"} if own.get("other") else {})
    trains = f"{label(run['snrs'][0])}.zarr"
    stores = [folder / "imaging" / name / trains for name, role in learned.items() if role != "unknown"]
    planes, fitted = dict.fromkeys(roles, ()), folder / "learning" / "models" / run["name"] / model
    train(stores, Training(run, model, own, learned, planes, config["seed"]), fitted)
    stores = [folder / "imaging" / name / f"{snr_label(snr)}.zarr" for name in roles for snr in SNRS]
    tables = folder / "learning" / "predictions" / run["name"] / model
    predict(stores, Tested(roles, planes, True, 1), fitted, [tables / f"{snr_label(snr)}.csv" for snr in SNRS])


def _capsule(predictions, run, model):
    """Predictions of a capsule network at all SNRs: the FCNN's, with confidence scores of its own about its softmax."""
    random, folder = np.random.default_rng(11), predictions / run / model
    folder.mkdir(parents=True, exist_ok=True)
    for snr in SNRS:
        table = pd.read_csv(predictions / "fcnn_open" / "fcnn" / f"{snr_label(snr)}.csv", keep_default_na=False)
        for score in SCORES["capsule"]:
            noise = random.normal(scale=0.2, size=len(table))
            table[f"known_{score}"] = (table["known_softmax"] + noise).round(2) - 5 * (score == "mse")
        table.to_csv(folder / f"{snr_label(snr)}.csv", index=False)
