"""Made-up results of the learning stage: scores, predictions, curves, settings tried and reconstructions."""

import itertools
import json

import numpy as np
import pandas as pd
import xarray as xr

from isarflow.core import store as stores
from isarflow.learning.evaluation.judge import SHORT
from isarflow.learning.evaluation.scores import COLUMNS, CONFUSION, VALIDATION
from isarflow.learning.experiments import runs, split_of, train_snr_db, training
from isarflow.report.selection import decoded_snrs

# Confidence scores; else softmax.
SCORES = {"capsule": ("mse", "zncc"), "capsule_denoise": ("mse", "zncc", "noise_zncc"), "own": ("my_error", "fit")}
WORSE_HELD_OUT = ("knn", "lr_tuned")
OFFSET = 2.1  # dB, of all images on average: peak_3db over mean
PROTOCOLS = ("thesis", "blind", "kept")  # of thresholds
NO_BOUNDS = (np.nan, np.nan)


def learn(folder, settings, confidence=SCORES):
    """Accuracy that rises with SNR; every score with an interval around it; curves, and settings tried.

    confidence: the confidence scores of models that reject by others than softmax; all but FCNNs have a decoder.
    """
    rows, cells, times, every = [], [], [], runs(settings)
    for name, run in every.items():
        for place, model in enumerate(run["models"]):
            _fitted(folder / "models" / name / model, model, run["division"]["fold"], settings)
            if run["first"]:
                alike = (run["experiment"], run["snrs"])
                folds = [of["division"]["fold"] for of in every.values() if (of["experiment"], of["snrs"]) == alike]
                known = confidence.get(model, ["softmax"]) if run["open"] else ()
                scored, counted = _judged(run, place, model, known, folds, settings)
                rows += scored
                cells += counted
                times.append(_time(run, place, model))
                if known and model in confidence and model != "fcnn":
                    _decoded(folder, run, model, settings)
    timed = {"machine": {"cpu": "A processor", "cores": 2}, "threads": 1, "models": times}
    (folder / "times.json").write_text(json.dumps(timed))
    scores = pd.DataFrame(rows, columns=COLUMNS)
    pd.concat([scores, _gains(scores, settings)]).to_csv(folder / "scores.csv", index=False)
    compared = scores.query("fold == '' and (metric == 'f1_weighted' or metric == 'accuracy' and score == '')")
    compared = compared[compared["snr_definition"] == settings["noise"]["definition"]]
    # On the validation images some models do worse on known targets than others that they beat on the test images.
    worse = compared["model"].isin(WORSE_HELD_OUT) & (compared["score"] == "")
    held_out = compared.assign(value=compared["value"] - 0.2 * worse)
    held_out[VALIDATION].to_csv(folder / "validation.csv", index=False)
    pd.DataFrame(cells, columns=CONFUSION).to_csv(folder / "confusion.csv", index=False)


def right(snr, place, subset="all"):
    """The made-up accuracy by peak_3db of an experiment's model with this number."""
    return 1 - 0.5 / (1 + np.exp((snr + 6 + 3 * place) / 3)) - 0.01 * (subset == "all")


def _judged(run, place, model, known, folds, settings):
    """Rows of scores.csv, of all folds, of each, and by the other definition of SNR, and of confusion.csv of one model.

    known: its confidence scores in the open set. folds: the numbers of those that are tested, [0] of a split at random;
    one fold has no intervals.
    """
    rows, cells, noise = [], [], settings["noise"]
    roles = {name: target["role"] for name, target in settings["targets"].items()}
    labels = sorted(name for name, role in roles.items() if role == "known")
    own = noise["definition"]
    other, shift = ("mean", OFFSET) if own == "peak_3db" else ("peak_3db", -OFFSET)

    def bounded(value):
        return [value, *((value - 0.03, min(value + 0.03, 1)) if folds == [0] or len(folds) > 1 else NO_BOUNDS), 400]

    kinds = [("", ""), *itertools.product(known, PROTOCOLS)]
    subsets = ("all",) if run["elevation"] == "all" else ("all", "trained")
    for snr, subset, (score, threshold) in itertools.product(noise["snr_db"], subsets, kinds):
        head = [run["experiment"], model, split_of(run), training(run), train_snr_db(run), snr, subset]
        value, columns, classes = right(snr, place, subset), [*head, score, threshold], labels
        if score:
            classes = [*labels, "other"]
            rows.append([*columns, own, "", "threshold", 0.6, *NO_BOUNDS, 400])
        rows += [[*columns, own, "", metric, *bounded(value)] for metric in SHORT]
        for fold, metric in itertools.product(folds if len(folds) > 1 else (), ("accuracy", "f1_weighted")):
            rows.append([*columns, own, fold, metric, min(value + 0.01 * (fold - 2), 1), *NO_BOUNDS, 100])
        if min(noise["snr_db"]) <= snr + shift and snr + 2 * shift <= max(noise["snr_db"]):
            rows += [[*columns, other, "", metric, *bounded(right(snr + shift, place, subset))] for metric in SHORT]
        if threshold == PROTOCOLS[0]:  # what follows has none
            rows += [[*head, score, "", own, "", metric, *bounded(value)] for metric in ("auroc", "fpr95", "oscr")]
        for target, predicted in itertools.product(roles, classes):
            if roles[target] == "known" or (score and roles[target] == "unknown"):
                is_right = predicted == (target if target in labels else "other")
                share = value if is_right else (1 - value) / (len(classes) - 1)
                cells.append([*head, score, threshold, target, predicted, 200 * share])
    return rows, cells


def _time(run, place, model):
    times = {"experiment": run["experiment"], "run": run["name"], "model": model}
    times["single"] = {"size": 1, "repeats": 200, "milliseconds_per_observation": 0.2 * (place + 1)}
    times["batch"] = {"size": 256, "repeats": 20, "milliseconds_per_observation": 0.01 * (place + 1)}
    return times | {"training_observations": 1234 if run["split"] == "random" else 1000}


def _fitted(path, model, fold, settings):
    """The training curve of a network, and the settings tried of a model with a choice: the last fold's is its own."""
    path.mkdir(parents=True)
    if model in ("fcnn", "capsule"):
        curve = pd.DataFrame({"epoch": [1, 2, 3], "loss": [0.5, 0.1, 0.01], "accuracy": [0.7, 0.9, 1.0]})
        held_out = {"validation_loss": [0.6, 0.2, 0.02], "validation_accuracy": [0.6, 0.8, 0.9]}
        curve.assign(**held_out, learning_rate=[1e-3, 4e-4, 1e-9]).to_csv(path / "curve.csv", index=False)
        pd.DataFrame({"epoch": [1, 2, 3], "seconds": [1.5, 3.0, 4.5]}).to_csv(path / "seconds.csv", index=False)
    penalty = settings["learning"]["models"][model].get("penalty")
    if isinstance(penalty, list):
        accuracy = [0.8, 0.9] if fold < settings["learning"]["split"]["folds"] else [0.75, 0.6]
        pd.DataFrame({"penalty": penalty, "validation_accuracy": accuracy}).to_csv(path / "search.csv", index=False)


def _gains(scores, settings):
    """What every open row is better than the thesis's network trained at the same SNRs, on the folds both have.

    With an interval that now and then is all above 0, and none for one fold in common.
    """
    opened = scores.query("metric == 'f1_weighted' and threshold != '' and fold == ''")
    opened = opened[opened["snr_definition"] == settings["noise"]["definition"]]
    same = ["split", "training", "test_snr_db", "elevation", "threshold"]
    own = opened.query("model == 'capsule' and score == 'zncc'").drop_duplicates(same)
    both = opened.merge(own[[*same, "value", "low"]], on=same, suffixes=("", "_reference"))
    gain, width = both["value"] - both["value_reference"], 0.02 + 0 * (both["low"] + both["low_reference"])
    return both.assign(metric="f1_weighted_gain", value=gain, low=gain - width, high=gain + width)[COLUMNS]


def _decoded(folder, run, model, settings):
    """Reconstructions of noise."""
    random, snrs = np.random.default_rng(9), decoded_snrs(settings["noise"]["snr_db"])
    targets = sorted(settings["targets"])
    axes, sizes = ("snr", "target", "example", "range", "crossrange"), (len(snrs), len(targets), 5, 16, 16)
    azimuth = np.add.outer(5.0 * np.arange(len(targets)), [15, 30, 90, 180, 340])
    variables = {
        "truth": (axes[1:], random.uniform(size=sizes[1:]).astype(np.float32)),
        "seen": (axes, random.uniform(size=sizes).astype(np.float32)),
        "made": (axes, np.full(sizes, 0.5, np.float32)),
        "predicted": (axes[:3], np.full(sizes[:3], targets[0])),
    }
    coords = {"snr": snrs, "target": targets, "azimuth": (("target", "example"), azimuth)}
    dataset = xr.Dataset(variables, coords | {"elevation": ("example", [-30, 0, 0, 30, 30])})
    dataset.attrs = {"run": run["name"], "model": model}
    stores.write(dataset, folder / "reconstructions" / run["name"] / f"{model}.zarr")
