"""Predictions of one fitted model at every SNR."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from tqdm import tqdm

from isarflow.core.errors import InputError
from isarflow.learning.classifier import OTHER, Outcome, config_of, load_classifier
from isarflow.learning.conformance import describe, of_outcome, refuse
from isarflow.learning.data import images
from isarflow.learning.data.split import LEFT_OUT
from isarflow.learning.experiments import is_by_family
from isarflow.learning.tables import FOUND, KNOWN, SCORE, read_table, write_table

BATCH = 1024  # images at a time: bounds the memory; as it is constant, results stay the same bit for bit
TOGETHER = 2 * BATCH  # images of several targets that are classified at once: models fill up their last batch
SIDES = {"known": ("validation", "test"), "unknown": ("validation", "test"), "other": ("validation",)}


class Tested(NamedTuple):
    """Test data of a model."""

    roles: dict  # of the targets, by name
    planes: dict  # of the targets, by name: their mirror planes
    is_open: bool  # True if tables have confidence scores, too
    realizations: int  # of each view's noise, at most
    classes: Mapping = {}  # of known targets, by name; one that is not there is its own class


def predict(stores, tested, folder, outputs):
    """Classify images of views that the model in `folder` was not trained at; write a table for each SNR.

    stores: imaging/<target>/<label>.zarr of all SNRs; tested: a `Tested`; outputs: paths <label>.csv. Targets of role
    other are classified at the validation views only. In an open run at random the training views of the known ones
    are, too, if the model can leave their own aspects out of its library.
    """
    model, config = load_classifier(folder), config_of(folder)
    divided = images.divide(stores, tested.planes, config["run"])
    for output in tqdm(sorted(map(Path, outputs)), unit="SNR", desc="predicting", leave=False):
        at_snr = [store for store in stores if Path(store).stem == output.stem]
        _keep(predict_at(model, at_snr, tested, divided, config), output)


def add_up(tables, folder, outputs):
    """Write a table for each SNR of the model in `folder` that adds others' scores.

    tables: paths of the predictions of these, in their order, at all SNRs; outputs: paths <label>.csv.
    """
    model = load_classifier(folder)
    for output in sorted(map(Path, outputs)):
        parts = [read_table(path) for path in tables if Path(path).stem == output.stem]
        # A member may have judged training views, too, without their own aspects.
        parts = [part[part["side"] != LEFT_OUT].reset_index(drop=True) for part in parts]
        outcome = model.added([_outcome_of(part, model.classes_) for part in parts])
        own = [name for name in parts[0] if not name.startswith((SCORE, KNOWN, FOUND))]
        _keep(parts[0][own].assign(predicted=outcome.labels, **_columns(outcome, model.classes_)), output)


def _outcome_of(table, classes):
    """The Outcome that a table has of images."""
    known = {name.removeprefix(KNOWN): table[name].to_numpy() for name in table if name.startswith(KNOWN)}
    return Outcome(table["predicted"].to_numpy(), table[[SCORE + name for name in classes]].to_numpy(), known)


def _columns(outcome, classes):
    """The columns of a table that have an Outcome's scores."""
    columns = {SCORE + name: column for name, column in zip(classes, outcome.scores.T, strict=True)}
    columns |= {KNOWN + name: column for name, column in outcome.known.items()}
    return columns | {FOUND + name: column for name, column in outcome.found.items()}


def _keep(table, output):
    """Write a table, and print how many of its images are right."""
    output.parent.mkdir(parents=True, exist_ok=True)
    write_table(table, output)
    known = table[(table["role"] == "known") & (table["side"] == "test")]
    right = np.mean(known["truth"] == known["predicted"])
    print(f"{output.stem}: {len(table)} images; of {len(known)} test images of known targets {right:.4f} are right")


def predict_at(model, stores, tested, divided, config):
    """The predictions at one SNR, a DataFrame. divided: the result of `images.divide`; config: of the model's folder.

    Columns: target, elevation, azimuth (degrees), realization, by which rows are sorted, truth, predicted, role, side,
    fold, block (see `split.blocks`), snr_<definition> in dB, score_<class>..., and if it is open
    known_<confidence score>..., and if it searches found_range, found_crossrange (m) and found_drift (wavelengths)
    (docs/method.md).
    Raises InputError for a model that gives no proper Outcome, and in an open run for one without a confidence score.
    """
    stores, waiting, tables = sorted(stores, key=images.target_of), [], []
    for store in stores:
        waiting += _views(store, model, tested, divided[images.target_of(store)], config["run"])
        if sum(len(views.pixels) for views in waiting) >= TOGETHER or store == stores[-1]:
            for left_out in (False, True):
                if together := [views for views in waiting if views.left_out == left_out]:
                    tables.append(_judged(model, together, tested, config))
            waiting = []
    return pd.concat(tables).sort_values(["target", "elevation", "azimuth", "realization"], ignore_index=True)


class _Views(NamedTuple):
    """Images of a store that are judged at once."""

    store: str
    left_out: bool  # whether they are training views, without whose own aspects they are judged
    pixels: np.ndarray
    table: pd.DataFrame  # a row for each: the columns of its prediction, `predicted` empty


def _views(store, model, tested, of, run):
    """The _Views of a store that are tested. of: the target's `images.Divided`."""
    target, found = images.target_of(store), []
    role = tested.roles[target]
    # Only at random does a view left out relate to the rest of the library as a test view does to all of it.
    leaves_out = tested.is_open and model.leaves_out and run["split"] == "random" and run["elevation"] == "all"
    sides, trained = SIDES[role], role == "known" and target not in run["without"]
    if is_by_family(run):
        # A model has one side; one of role other is in the test as unknown as those that never train.
        sides = (run["division"]["settings"]["sides"][target],)
        role = "unknown" if role == "other" and sides == ("test",) else role
    if role == "known" and run["without"]:
        # Of known targets those that did not train are tested, and those that did validate.
        sides = ("validation",) if trained else ("test",)
    parts = [sides, ("train",)] if leaves_out and trained else [sides]
    every = [side for part in parts for side in part]
    pixels, origins = images.read_side([store], {target: of}, run, *every, realizations=tested.realizations)
    for part in parts:
        left_out, rows = part == ("train",), of.on(origins, *part)
        if left_out:
            rows &= (origins["realization"] == 0).to_numpy()  # they are many already
        origin = origins[rows].drop(columns="label").reset_index(drop=True)
        held_out, snrs = of.on(origin, "validation"), [name for name in origin if name.startswith("snr_")]
        columns = {
            "truth": tested.classes.get(target, target) if role == "known" else OTHER,
            "predicted": "",
            "role": role,
            "side": LEFT_OUT if left_out else np.where(held_out, "validation", "test"),
            "fold": run["division"]["fold"],
            "block": of.blocks[np.searchsorted(of.azimuth, origin["azimuth"])],
        }
        table = origin.drop(columns=snrs).assign(**columns, **origin[snrs])
        found.append(_Views(store, left_out, pixels[rows], table))
    return found


def _judged(model, together, tested, config):
    """The predictions of some _Views, all of which are left out, or none."""
    stores, (left_out, *_), pixels, tables = zip(*together, strict=True)
    pixels, table, run = np.concatenate(pixels), pd.concat(tables, ignore_index=True), config["run"]
    received = table.pop(images.RECEIVED) if images.RECEIVED in table else None
    outcome = classify(model, pixels, images.aspects(table, tested.planes) if left_out else None, received)
    who, where = describe(config["model"], run["name"], config["kind"]), f" of {stores[0]}"
    where += f" and {len(stores) - 1} more" if len(stores) > 1 else ""
    refuse(who, of_outcome(outcome, len(pixels), model.classes_, where))
    if tested.is_open and not outcome.known:
        advice = f"Give it one, or take the model out of open experiments ('{run['experiment']}')."
        raise InputError(f"{who}: its evaluate gives no known score, so nothing can be rejected. {advice}")
    shown = outcome if tested.is_open else outcome._replace(known={})
    return table.assign(predicted=outcome.labels, **_columns(shown, model.classes_))


def classify(model, images, without=None, received=None):
    """The Outcome of images, in batches.

    without: None, or the aspects (n,) that they are judged without. received: None, or the pulses of each, (n,), as
    text of 0 and 1, for a model that searches.
    """
    given = {} if without is None else {"without": without}
    if received is not None and model.is_searched:
        given["received"] = np.array([list(pulses) for pulses in received]) == "1"
    batches = [slice(start, start + BATCH) for start in range(0, len(images), BATCH)]
    parts = [model.evaluate(images[of], **{name: values[of] for name, values in given.items()}) for of in batches]
    return Outcome(
        np.concatenate([part.labels for part in parts]),
        np.concatenate([part.scores for part in parts]),
        *({name: np.concatenate([part[at][name] for part in parts]) for name in parts[0][at]} for at in (2, 3)),
    )
