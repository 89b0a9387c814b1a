"""Fit one model of one run and store it."""

import itertools
import json
from pathlib import Path

import numpy as np
import pandas as pd

from common.errors import InputError
from learning import images
from learning.classifier import OTHER, build, choices
from learning.split import split
from learning.training import ANY_SNR

CONFIG, SPLIT, CURVE, SEARCH = "config.json", "split.json", "curve.csv", "search.csv"


def load(folder):
    """A fitted model from the folder that `train` wrote."""
    config = json.loads((Path(folder) / CONFIG).read_text())
    return build(config["kind"], config["settings"], config["seed"]).load(Path(folder))


def run_of(folder):
    """The run, as `experiments.runs` gives it, that the model in this folder belongs to."""
    return json.loads((Path(folder) / CONFIG).read_text())["run"]


def azimuths_of(folder, *sides):
    """The azimuths in degrees of some sides ('test', 'validation', 'train') of the model's split, ascending."""
    division = json.loads((Path(folder) / SPLIT).read_text())
    return sorted(itertools.chain(*(division[side]["azimuth"] for side in sides)))


def train(stores, roles, run, name, settings, division, aperture, seed, folder):
    """Fit model `name` to the training azimuths of the stores and write it to `folder`.

    stores: imaging/<target>/<label>.zarr, each target's at every SNR of the run, and that of pure noise where the model
    learns a class OTHER. roles: of the targets. run: one of `experiments.runs`; settings: the model's, where each list
    is a choice: the combination that is most accurate on the validation azimuths is kept, the first of equals.
    division: `learning.split`; aperture: azimuth samples of an image; seed: the config's.
    Writes model.npz (what was learned), config.json, split.json (indices and azimuths in degrees of each side) and,
    for a model that has one, curve.csv; for one with choices search.csv.
    Raises InputError for a class without any image.
    """
    kind, combinations = settings.get("kind", name), choices(settings)
    azimuth = images.azimuths(sorted(stores)[0])
    sides = split(azimuth, division, seed, aperture, run["split"])
    learned, labels, snrs = _read(stores, roles, azimuth[sides["train"]], run)
    held_out, held_labels, _ = _read(stores, roles, azimuth[sides["validation"]], run)
    for role_name in sorted({name for name, role in roles.items() if role == "known"}):
        if not (labels == role_name).any():
            raise InputError(f"class '{role_name}' has no training image; its azimuths or elevations are empty.")
    # Every model has its own random numbers, whatever else the config holds.
    own_seed = int(np.random.SeedSequence([seed, *f"{run['name']}/{name}".encode()]).generate_state(1)[0])

    model, chosen, most, found = None, None, -1.0, []
    for choice in combinations:
        candidate = build(kind, choice, own_seed)
        candidate.fit(learned, labels, (held_out, held_labels), snrs if run["random_snr"] else None)
        right = float(np.mean(candidate.predict(held_out) == held_labels))
        found.append({**choice, "validation_accuracy": right})
        if right > most:
            model, chosen, most = candidate, choice, right

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    model.save(folder)
    if model.curve_ is not None:
        pd.DataFrame(model.curve_).to_csv(folder / CURVE, index=False)
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
            "observations": {label: int((labels == label).sum()) for label in model.classes_},
            "image_shape": list(learned.shape[1:]),
        },
    )
    indices = {side: {"index": index.tolist(), "azimuth": azimuth[index].tolist()} for side, index in sides.items()}
    _write(
        folder / SPLIT,
        {"settings": division, "scheme": run["split"], "seed": seed, "azimuths": len(azimuth), **indices},
    )
    print(f"{run['name']}/{name}: fitted to {len(labels)} images of {', '.join(model.classes_)}")


def _read(stores, roles, azimuth, run):
    """Images at some azimuths of all stores, their labels and the names of their SNRs."""
    parts, snrs = [], []
    # By SNR, then by target: the order of rows depends on nothing else.
    for store in sorted(map(Path, stores), key=lambda path: (path.stem, path.parent.name)):
        parts.append(images.read([store], azimuth, run["elevation"], run["upsample"]))
        # Pure noise is that of every SNR.
        snrs.append(np.full(len(parts[-1].images), store.stem if store.parent.name in roles else ANY_SNR))
    rows = images.join(parts)
    labels = np.array([name if roles.get(name) == "known" else OTHER for name in rows.target])
    return rows.images, labels, np.concatenate(snrs)


def _write(path, content):
    path.write_text(json.dumps(content, indent=1) + "\n")
