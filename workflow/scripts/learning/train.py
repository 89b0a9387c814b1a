"""Fit one model of one run and store it."""

import contextlib
import itertools
import json
import shutil
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from core.errors import InputError
from learning import images, trial
from learning.classifier import OTHER, build, choices
from learning.descent import ANY_SNR
from learning.split import split

CONFIG, SPLIT, CURVE, SECONDS, SEARCH = "config.json", "split.json", "curve.csv", "seconds.csv", "search.csv"


class Rows(NamedTuple):
    """What a model learns from: images (n, range, crossrange), and labels, SNRs' names, views' numbers, each (n,)."""

    images: np.ndarray
    labels: np.ndarray
    snrs: np.ndarray
    views: np.ndarray


def load(folder):
    """A fitted model from the folder that `train` wrote."""
    config = json.loads((Path(folder) / CONFIG).read_text())
    return build(config["kind"], config["settings"], config["seed"]).load(Path(folder))


def run_of(folder):
    """The run, as `experiments.runs` gives it, that the model in this folder belongs to."""
    return json.loads((Path(folder) / CONFIG).read_text())["run"]


def kind_of(folder):
    """The kind of the model in this folder: the name of its file."""
    return json.loads((Path(folder) / CONFIG).read_text())["kind"]


def azimuths_of(folder, *sides):
    """The azimuths in degrees of some sides ('test', 'validation', 'train') of the model's split, ascending."""
    division = json.loads((Path(folder) / SPLIT).read_text())
    return sorted(itertools.chain(*(division[side]["azimuth"] for side in sides)))


def train(stores, roles, run, name, settings, division, aperture, seed, folder, checkpoints=None):
    """Fit model `name` to the training azimuths of the stores and write it to `folder`.

    stores: imaging/<target>/<label>.zarr, each target's at every SNR of the run, and that of pure noise where the model
    learns a class OTHER. roles: of the targets. run: one of `experiments.runs`; settings: the model's, where each list
    is a choice: the combination that is most accurate on the validation azimuths is kept, the first of equals.
    division: `learning.split`; aperture: azimuth samples of an image; seed: the config's.
    checkpoints: a folder in which a long training keeps its state, to go on after a kill; it is removed in the end.
    Writes model.npz (what was learned), config.json, split.json (indices and azimuths in degrees of each side) and,
    for a model that has one, curve.csv and the seconds until each epoch, seconds.csv; for one with choices search.csv.
    Raises InputError for a class without any image, and for a model that is not what `classifier.py` asks for.
    """
    kind, combinations = settings.get("kind", name), choices(settings)
    azimuth = images.azimuths(sorted(stores)[0])
    sides = split(azimuth, division, seed, aperture, run["split"])
    learned = _read(stores, roles, azimuth[sides["train"]], run)
    held_out = _read(stores, roles, azimuth[sides["validation"]], run)
    labels = learned.labels
    for role_name in sorted({name for name, role in roles.items() if role == "known"}):
        if not (labels == role_name).any():
            raise InputError(f"class '{role_name}' has no training image; its azimuths or elevations are empty.")
    # Every model has its own random numbers, whatever else the config holds.
    own_seed = int(np.random.SeedSequence([seed, *f"{run['name']}/{name}".encode()]).generate_state(1)[0])

    who = trial.describe(name, run["name"], kind)
    model, chosen, most, found = None, None, -1.0, []
    for choice in combinations:
        candidate = build(kind, choice, own_seed)
        trial.check_face(candidate, who)
        candidate.checkpoints = checkpoints
        known = learned if run["random_snr"] else learned._replace(snrs=None)
        candidate.fit(known.images, labels, held_out, known.snrs, known.views)
        trial.check_fitted(candidate, labels, held_out.images, who)
        judged = np.isin(held_out.labels, candidate.classes_)  # a capsule network has no class OTHER
        right = float(np.mean(candidate.predict(held_out.images[judged]) == held_out.labels[judged]))
        found.append({**choice, "validation_accuracy": right})
        if right > most:
            model, chosen, most = candidate, choice, right

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    model.save(folder)
    trial.check_restored(model, lambda: build(kind, chosen, own_seed).load(folder), held_out.images, who)
    if model.curve_ is not None:
        curve = pd.DataFrame(model.curve_)
        if "seconds" in curve:  # apart, as they are others every time
            curve[["epoch", "seconds"]].to_csv(folder / SECONDS, index=False)
        curve.drop(columns="seconds", errors="ignore").to_csv(folder / CURVE, index=False)
    if len(combinations) > 1:
        pd.DataFrame(found).to_csv(folder / SEARCH, index=False)
    _write(
        folder / CONFIG,
        {
            "run": run,
            "model": name,
            "kind": kind,
            "settings": chosen,
            "seed": own_seed,
            "classes": model.classes_.tolist(),
            "observations": {label: int((labels == label).sum()) for label in np.unique(labels)},
            "image_shape": list(learned.images.shape[1:]),
        },
    )
    indices = {side: {"index": index.tolist(), "azimuth": azimuth[index].tolist()} for side, index in sides.items()}
    _write(
        folder / SPLIT,
        {"settings": division, "scheme": run["split"], "seed": seed, "azimuths": len(azimuth), **indices},
    )
    if checkpoints is not None:
        shutil.rmtree(checkpoints, ignore_errors=True)
        for parent in list(Path(checkpoints).parents)[:2]:
            with contextlib.suppress(OSError):  # it holds others' still, or they removed it
                parent.rmdir()
    print(f"{run['name']}/{name}: fitted to {len(labels)} images of {', '.join(model.classes_)}")


def _read(stores, roles, azimuth, run):
    """The `Rows` at some azimuths of all stores."""
    parts, snrs = [], []
    # By SNR, then by target: the order of rows depends on nothing else.
    for store in sorted(map(Path, stores), key=lambda path: (path.stem, path.parent.name)):
        parts.append(images.read([store], azimuth, run["elevation"], run["upsample"]))
        # Pure noise is that of every SNR.
        snrs.append(np.full(len(parts[-1].images), store.stem if store.parent.name in roles else ANY_SNR))
    rows = images.join(parts)
    labels = np.array([name if roles.get(name) == "known" else OTHER for name in rows.target])
    places = np.stack([np.unique(rows.target, return_inverse=True)[1], rows.elevation, rows.azimuth], axis=1)
    views = np.unique(places.round(4), axis=0, return_inverse=True)[1]
    return Rows(rows.images, labels, np.concatenate(snrs), views)


def _write(path, content):
    path.write_text(json.dumps(content, indent=1) + "\n")
