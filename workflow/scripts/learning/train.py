"""Fit one model of one experiment and store it."""

import importlib
import json
from pathlib import Path

import numpy as np
import pandas as pd

from common.errors import InputError
from learning import images
from learning.split import split

CONFIG, SPLIT, CURVE = "config.json", "split.json", "curve.csv"


def build(name, settings, seed):
    """An unfitted model: class `Model` of models/<name>.py."""
    return importlib.import_module(f"learning.models.{name}").Model(settings, seed)


def load(folder):
    """A fitted model from the folder that `train` wrote."""
    config = json.loads((Path(folder) / CONFIG).read_text())
    return build(config["model"], config["settings"], config["seed"]).load(Path(folder))


def unseen_azimuths(folder):
    """The azimuths in degrees that the model in this folder has never seen, shape (azimuths,)."""
    return json.loads((Path(folder) / SPLIT).read_text())["test"]["azimuth"]


def fit(model, observations, classes):
    """Fit the model to observations of these classes. Raises InputError for a class without any."""
    for name in classes:
        if not (observations.target == name).any():
            raise InputError(f"class '{name}' has no training image; its azimuths or elevations are empty.")
    return model.fit(observations.images, observations.target)


def train(stores, experiment, name, selection, settings, division, seed, folder):
    """Fit model `name` to the training azimuths of the stores and write it to `folder`.

    stores: one per class, imaging/<target>/<label>.zarr. selection: the experiment's `train` section (elevation,
    snr_db); settings: the model's; division: `learning.split`; seed: the config's.
    Writes model.npz (what was learned), config.json, split.json (indices and azimuths in degrees of both sides)
    and, for a model that has one, curve.csv.
    """
    stores = sorted(stores, key=images.target_of)
    classes = [images.target_of(store) for store in stores]
    azimuth = images.azimuths(stores[0])
    sides = dict(zip(("train", "test"), split(azimuth, division, seed), strict=True))
    observations = images.read(stores, azimuth[sides["train"]], selection["elevation"])
    # Every model has its own random numbers, whatever else the config holds.
    own_seed = int(np.random.SeedSequence([seed, *f"{experiment}/{name}".encode()]).generate_state(1)[0])
    model = fit(build(name, settings, own_seed), observations, classes)

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    model.save(folder)
    if model.curve_ is not None:
        pd.DataFrame(model.curve_).to_csv(folder / CURVE, index=False)
    _write(
        folder / CONFIG,
        {
            "experiment": experiment,
            "model": name,
            "settings": settings,
            "seed": own_seed,
            "train": selection,
            "classes": classes,
            "observations": {target: int((observations.target == target).sum()) for target in classes},
            "image_shape": list(observations.images.shape[1:]),
        },
    )
    indices = {side: {"index": index.tolist(), "azimuth": azimuth[index].tolist()} for side, index in sides.items()}
    _write(folder / SPLIT, {"settings": division, "seed": seed, "azimuths": len(azimuth), **indices})
    print(f"{experiment}/{name}: fitted to {len(observations.images)} images of {', '.join(classes)}")


def _write(path, content):
    path.write_text(json.dumps(content, indent=1) + "\n")
