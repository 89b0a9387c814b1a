"""Predictions of one fitted model at every SNR."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from tqdm import tqdm

from core.errors import InputError
from learning import images
from learning.classifier import OTHER, Outcome
from learning.conformance import check_outcome, describe
from learning.model_folder import config_of, division_of, load
from learning.split import blocks, split

BATCH = 1024  # images at a time: bounds the memory, and as a constant keeps results the same bit for bit
SCORE, KNOWN = "score_", "known_"
SIDES = {"known": ("validation", "test"), "unknown": ("validation", "test"), "other": ("validation",)}


class Tested(NamedTuple):
    """What a model is tested on. roles, planes: of the targets by name, the latter their mirror planes.

    is_open: whether tables have confidence scores, too. realizations: of each view's noise, at most.
    """

    roles: dict
    planes: dict
    is_open: bool
    realizations: int


def predict(stores, tested, folder, outputs):
    """Classify images at azimuths that the model in `folder` was not trained at; write a table for each SNR.

    stores: imaging/<target>/<label>.zarr of all SNRs; tested: a `Tested`; outputs: paths <label>.csv. Targets of role
    other are classified at the validation azimuths only, with which thresholds are chosen.
    """
    model, divided = load(folder), divide(stores, tested.planes, division_of(folder))
    for output in tqdm(sorted(map(Path, outputs)), unit="SNR", desc="predicting", leave=False):
        at_snr = [store for store in stores if Path(store).stem == output.stem]
        table = predict_at(model, at_snr, tested, divided, folder)
        output.parent.mkdir(parents=True, exist_ok=True)
        # Nine digits keep a single-precision number exactly.
        table.to_csv(output, index=False, float_format="%.9g")
        known = table[(table["role"] == "known") & (table["side"] == "test")]
        right = np.mean(known["truth"] == known["predicted"])
        print(f"{output.stem}: {len(table)} images; of {len(known)} test images of known targets {right:.4f} are right")


class Divided(NamedTuple):
    """How a target's azimuths (n,) in degrees are divided: what `split` and `blocks` give."""

    azimuth: np.ndarray
    sides: dict
    blocks: np.ndarray


def divide(stores, planes, division):
    """The `Divided` of each target, by its name. planes: of each one."""
    one_of_each = {images.target_of(store): store for store in stores}  # a target's stores have the same azimuths
    azimuth = {target: images.azimuths(store) for target, store in one_of_each.items()}
    return {
        target: Divided(angles, *(part(angles, planes[target], division) for part in (split, blocks)))
        for target, angles in azimuth.items()
    }


def predict_at(model, stores, tested, divided, folder):
    """The predictions at one SNR, a DataFrame. divided: what `divide` gives.

    Columns: target, elevation, azimuth (degrees), realization, truth, predicted, role, side, fold, block
    (see `split.blocks`), snr_<definition> (the image's own SNR in dB by each definition), score_<class>..., and if it
    is open known_<confidence score>... . truth is OTHER for a target that is not known.
    Rows: validation and test azimuths, all elevations and realizations, sorted by the first four columns.
    Raises InputError for a model that gives no proper Outcome, and for an open run's without a confidence score.
    """
    config, is_open = config_of(folder), tested.is_open
    run, who = config["run"], describe(config["model"], config["run"]["name"], config["kind"])
    tables, parts = [], []
    for store in sorted(stores, key=images.target_of):
        role = tested.roles[images.target_of(store)]
        # The last bits of a score depend on what else is in its batch. A closed run's test images are batches of their
        # own, an open run's stand among the validation images.
        parts += [(store, role, sides) for sides in ([SIDES[role]] if is_open else [[side] for side in SIDES[role]])]
    for store, role, sides in parts:
        target = images.target_of(store)
        azimuth, found, block = divided[target]
        index = np.sort(np.concatenate([found[side] for side in sides]))
        asked = {"pixels": run["upsample"], "realizations": tested.realizations, "channels": run["channels"]}
        pixels, origin = images.read([store], {target: azimuth[index]}, **asked)
        place = np.searchsorted(azimuth, origin["azimuth"])
        outcome = classify(model, pixels)
        check_outcome(outcome, len(pixels), model.classes_, who, f" of {store}")
        if is_open and not outcome.known:
            raise InputError(
                f"{who}: its evaluate gives no known score, and without one nothing can be rejected. Give it one, or "
                f"take the model out of open experiments ('{run['experiment']}')."
            )
        columns = {
            "truth": origin["target"] if role == "known" else OTHER,
            "predicted": outcome.labels,
            "role": role,
            "side": np.where(np.isin(place, found["validation"]), "validation", "test"),
            "fold": run["division"]["fold"],
            "block": block[place],
        }
        columns |= {name: origin.pop(name) for name in list(origin) if name.startswith("snr_")}
        columns |= {SCORE + name: column for name, column in zip(model.classes_, outcome.scores.T, strict=True)}
        columns |= {KNOWN + name: column for name, column in outcome.known.items()} if is_open else {}
        tables.append(origin.drop(columns="label").assign(**columns))
    return pd.concat(tables).sort_values(["target", "elevation", "azimuth", "realization"], ignore_index=True)


def classify(model, images):
    """The Outcome of images, in batches."""
    parts = [model.evaluate(images[start : start + BATCH]) for start in range(0, len(images), BATCH)]
    return Outcome(
        np.concatenate([part.labels for part in parts]),
        np.concatenate([part.scores for part in parts]),
        {name: np.concatenate([part.known[name] for part in parts]) for name in parts[0].known},
    )
