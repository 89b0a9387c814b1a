"""Fit one model of one run and store it."""

import contextlib
import json
import os
import shutil
from collections import namedtuple
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from isarflow.learning import conformance
from isarflow.learning.classifier import ANY_SNR, CONFIG, OTHER, SPLIT, build_classifier, choices
from isarflow.learning.data import images
from isarflow.learning.data.moves import moves_of
from isarflow.learning.data.split import Division
from isarflow.learning.experiments import CLEAN

COPIES = 4  # of each training image without noise, for a model that does not search the place of a target that moves
CURVE, SECONDS, SEARCH = "curve.csv", "seconds.csv", "search.csv"


@dataclass(frozen=True)
class Training:
    """The inputs of a fitted model other than the images."""

    run: dict  # one of `experiments.runs`
    model: str  # its name in the config
    settings: dict  # its own, a list for choices
    roles: dict  # of the targets, by name; those not known, and pure noise, which has no role, are labelled OTHER
    planes: dict  # of the targets, by name: their mirror planes
    seed: int  # the config's
    classes: dict = field(default_factory=dict)  # of known targets, by name; one that is not there is its own class


Examples = namedtuple("Examples", "images labels snrs views")  # arguments of `Classifier.fit`, n observations each


def train(stores, training, folder, checkpoints=None):
    """Fit a model to the training views of the stores and write it to `folder`.

    stores: imaging/<target>/<label>.zarr, each target's at every SNR of the run, and that of pure noise where the model
    learns a class OTHER. training: a `Training`; of the combinations of its choices the one that is most accurate on
    the validation images is kept, the first of equals.
    checkpoints: a folder in which a long training keeps its state, to go on if killed; it is removed in the end.
    Writes model.npz (the learned arrays), config.json, split.json (the `Division`, and each target's sides) and, for a
    model that has one, curve.csv and the seconds until each epoch, seconds.csv; for one with choices search.csv.
    Raises InputError for a model that is not what `classifier.py` asks for.
    """
    run, name, folder = training.run, training.model, Path(folder)
    kind = training.settings.get("kind", name)
    # Every model has its own random numbers, independent of the rest of the config.
    seed = int(np.random.SeedSequence([training.seed, *f"{run['name']}/{name}".encode()]).generate_state(1)[0])
    divided = images.divide(stores, training.planes, run)
    learns_noise = build_classifier(kind, choices(training.settings)[0], seed).learns_noise
    learned, noise, aspects = _read(stores, training, divided, "train", learns_noise)
    held_out, *_ = _read(stores, training, divided, "validation", learns_noise)

    who = conformance.describe(name, run["name"], kind)
    model, best, search, moves = None, -1.0, [], moves_of(run)
    every_choice, shown, shown_aspects = choices(training.settings), (learned, held_out), aspects
    if moves and not build_classifier(kind, every_choice[0], seed).searches:
        seen = training.seed, run["name"], name
        shown = _moved(moves, learned, COPIES, *seen), _moved(moves, held_out, 1, *seen)
        shown_aspects = aspects[_shown(learned.snrs, COPIES)]
    for settings in every_choice:
        candidate = build_classifier(kind, settings, seed)
        candidate.checkpoints, candidate.noise = checkpoints, noise
        candidate.aspects, candidate.moves, candidate.beside = shown_aspects, moves, folder.parent
        _fit(candidate, *shown, run["random_snr"], who)
        accuracy = _accuracy(candidate, shown[1]) if len(every_choice) > 1 else 0.0
        search.append({**settings, "validation_accuracy": accuracy})
        if accuracy > best:
            model, best = candidate, accuracy

    folder.mkdir(parents=True, exist_ok=True)
    model.save(folder)
    fresh = build_classifier(kind, model.settings, seed)
    fresh.moves = moves
    conformance.refuse(who, conformance.of_restored(model, fresh, folder, held_out.images))
    if model.curve_ is not None:
        curve = pd.DataFrame(model.curve_)
        if "seconds" in curve:  # in a file of its own, as they differ every time
            curve[["epoch", "seconds"]].to_csv(folder / SECONDS, index=False)
        curve.drop(columns="seconds", errors="ignore").to_csv(folder / CURVE, index=False)
    if len(search) > 1:
        pd.DataFrame(search).to_csv(folder / SEARCH, index=False)
    labels, counts = np.unique(learned.labels, return_counts=True)
    observations = dict(zip(labels.tolist(), counts.tolist(), strict=True))
    config = {"run": run, "model": name, "kind": kind, "settings": model.settings, "seed": seed}
    config |= {"classes": model.classes_.tolist(), "observations": observations}
    config["image_shape"] = list(learned.images.shape[1:])
    views = {target: {side: _listed(of, side) for side in of.sides} for target, of in divided.items()}
    split = {"division": asdict(Division(**run["division"])), "targets": views}
    for path, content in ((CONFIG, config), (SPLIT, split)):
        (folder / path).write_text(json.dumps(content, indent=1) + "\n")
    if checkpoints is not None:
        shutil.rmtree(checkpoints, ignore_errors=True)
        with contextlib.suppress(OSError):  # other jobs still use the folders around it, or removed them
            os.removedirs(Path(checkpoints).parent)
    print(f"{run['name']}/{name}: fitted to {len(learned.labels)} images of {', '.join(model.classes_)}")


def _fit(model, learned, held_out, keeps_snrs, who):
    """Fit a model and check it."""
    conformance.refuse(who, conformance.of_face(model))
    try:
        model.fit(learned.images, learned.labels, held_out, learned.snrs if keeps_snrs else None, learned.views)
    except Exception as error:
        error.add_note(f"That was the fit of {who}, with the settings {dict(model.settings)}.")
        raise
    conformance.refuse(who, conformance.of_fitted(model, learned.labels, held_out.images))


def _accuracy(model, held_out):
    """The accuracy of a model on the validation images of its classes (OTHER may be none)."""
    of_class = np.isin(held_out.labels, model.classes_)
    return float(np.mean(model.predict(held_out.images[of_class]) == held_out.labels[of_class]))


def _moved(moves, examples, copies, *names):
    """Examples in the order of `_shown`, those without noise moved anew each time; noisy ones are moved already."""
    is_clean = examples.snrs == CLEAN
    moved = [moves.drawn(examples.images[is_clean], *names, copy) for copy in range(copies)]
    images = np.concatenate([examples.images[~is_clean], *moved])
    return Examples(images, *(of[_shown(examples.snrs, copies)] for of in examples[1:]))


def _shown(snrs, copies):
    """The numbers of examples of these SNRs, those without noise several times, after all others."""
    return np.concatenate([np.flatnonzero(snrs != CLEAN), *[np.flatnonzero(snrs == CLEAN)] * copies])


def _listed(divided, side):
    """The entry of split.json for a side of a target's `images.Divided`: angles in degrees, and azimuths' numbers."""
    elevation, azimuth = (of.tolist() for of in divided.angles(side))
    return {"index": divided.sides[side].azimuth.tolist(), "elevation": elevation, "azimuth": azimuth}


def _read(stores, training, divided, side, learns_noise):
    """The `Examples` of a side of each target, by SNR, then by target; images of pure noise; the aspects of the former.

    Images of noise, where they are read, are among the examples of a model with a class OTHER, too, unless it
    `learns_noise` by itself.
    """
    run = training.run
    pixels, origin = images.read_side(stores, divided, run, side, elevation=run["elevation"])
    role = origin["target"].map(training.roles)
    labels = np.where(role == "known", origin["target"].replace(training.classes), OTHER).astype(str)
    # Pure noise, which has no role, is the same at every SNR.
    snrs = np.where(role.isna(), ANY_SNR, origin["label"]).astype(str)
    views = origin.round(4).groupby(["target", "elevation", "azimuth"]).ngroup().to_numpy()
    is_noise = role.isna().to_numpy()
    kept = np.flatnonzero(~is_noise | (training.settings.get("other", False) and not learns_noise))
    examples = Examples(*(of[kept] for of in (pixels, labels, snrs, views)))
    return examples, pixels[is_noise], images.aspects(origin, training.planes)[kept]
