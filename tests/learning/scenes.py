"""Made-up targets, whose images are written, learned from and predicted."""

import hashlib
import json

import numpy as np
import pandas as pd
import xarray as xr

from isarflow.core import store
from isarflow.learning.data import images
from isarflow.learning.experiments import LEARNED, runs
from isarflow.learning.predict import Tested, predict
from isarflow.learning.train import Training, train

SPLIT = {"scheme": "random", "train": 0.7, "validation": 0.33, "folds": 4, "spacing": 0}
ELEVATION, AZIMUTHS, RANGE, CROSSRANGE = [-15.0, 0.0, 15.0], 24, 6, 5
ALL = {"elevation": "all", "snr_db": "clean"}
APERTURE = 3
FCNN = {"width": 24, "epochs": 12, "batch": 8, "learning_rate": 0.01, "openmax_tail": 5, "openmax_alpha": 1}
SETTINGS = {
    "lr": {"penalty": 0.1},
    "svm": {"C": 930.66, "scale": 2.75},
    "knn": {"k": 1},
    "matched_filter": {},
    "fcnn": FCNN,
}
ROLES = {"dart": "known", "disc": "known", "cube": "unknown", "wing": "other"}
ALL_TARGETS = ("dart", "disc", "cube", "wing")
PLANES = {"dart": [], "disc": [], "cube": ["xz"], "wing": ["xz", "yz"]}


def aspects():
    return np.arange(AZIMUTHS) * (360 / AZIMUTHS)


def scene(name):
    """A target's images (elevation, azimuth, range, crossrange): its own bright cell, sides that turn with azimuth."""
    cell = {"dart": (1, 1), "disc": (4, 3), "cube": (2, 4), "wing": (3, 0)}[name]
    images = np.zeros((len(ELEVATION), AZIMUTHS, RANGE, CROSSRANGE), np.complex64)
    images[..., *cell] = 1
    turn = np.exp(1j * np.deg2rad(aspects()))
    images[..., 0, 2] = 0.3 * turn
    images[..., 5, 2] = 0.2 * np.deg2rad(np.array(ELEVATION))[:, None] * turn.conj()
    return images


def run_of(selection=ALL, name="multi", seed=0, **more):
    """A run as the rules hand it to a training; of a split by sector that of the first fold."""
    experiment = {"train": selection, "models": list(SETTINGS), **more}
    learning = {"split": SPLIT, "experiments": {name: experiment}}
    sweep = {"seed": seed, "imaging": {"aperture": APERTURE}, "motion": {}}
    run, *_ = runs({"targets": {"cube": {"role": "unknown"}}, "learning": learning, **sweep}).values()
    return {key: run[key] for key in LEARNED}


def write(path, images, azimuth, channels=()):
    """A store as the imaging stage writes it; images with a dimension more have noise realizations in front.

    channels: the polarizations of several; then images are (..., channel, range, crossrange).
    """
    names = ["elevation", "azimuth", *(["channel"] if channels else []), "range", "crossrange"]
    names = ["realization"] * (images.ndim - len(names)) + names
    coordinates = {"elevation": ELEVATION, "azimuth": azimuth} | ({"channel": list(channels)} if channels else {})
    pixels = {"range": (RANGE, "away from the radar"), "crossrange": (CROSSRANGE, "horizontal")}
    for name, (count, comment) in pixels.items():
        coordinates[name] = name, np.arange(count) * 0.1, {"units": "m", "comment": comment}
    is_noisy = names[0] == "realization"
    if is_noisy:
        coordinates["realization"] = np.arange(len(images))
    attrs = {"range_wavenumber": 40.0, "polarization": ", ".join(channels) or "VV"}
    data = {"image": (names, images.astype(np.complex64))}
    if is_noisy:
        directions = (len(ELEVATION), len(azimuth))
        data["snr_mean"] = (
            ("elevation", "azimuth"),
            np.arange(np.prod(directions), dtype=np.float32).reshape(directions),
        )
        data["snr_peak_3db"] = (("elevation", "azimuth"), np.full(directions, 2.0, np.float32))
    store.write(xr.Dataset(data, coordinates, attrs), path)


def noisy(name, snr_db, realizations=2):
    """The target's images with white noise whose power is `snr_db` below the brightest cell's."""
    clean = scene(name)
    random = np.random.default_rng([7, *name.encode()])
    parts = random.standard_normal((2, realizations, *clean.shape)) * np.sqrt(10 ** (-snr_db / 10) / 2)
    return clean + parts[0] + 1j * parts[1]


def fitted(stores, folder, name="knn", selection=ALL, seed=0, experiment="multi", settings=None, **more):
    targets = {images.target_of(store) for store in stores}
    roles = {target: ROLES[target] for target in targets if target in ROLES} | more.pop("roles", {})
    run = run_of(selection, experiment, seed, **more)
    train(stores, Training(run, name, settings or SETTINGS[name], roles, PLANES, seed), folder)
    return folder


def sides_of(folder, target="dart"):
    """Indices and azimuths of each side of a target, as the model's folder says."""
    return json.loads((folder / "split.json").read_text())["targets"][target]


def tables_of(stores, folder, tmp_path, is_open=False, roles=ROLES, realizations=9):
    """The prediction tables of the stores' SNRs, by their labels."""
    labels = {store.rpartition("/")[2].removesuffix(".zarr") for store in stores}
    tested = Tested(roles, PLANES, is_open, realizations)
    predict(stores, tested, folder, [tmp_path / f"{label}.csv" for label in labels])
    return {label: pd.read_csv(tmp_path / f"{label}.csv") for label in labels}


def digest(folder):
    return {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.iterdir()
        if path.name != "seconds.csv"
    }
