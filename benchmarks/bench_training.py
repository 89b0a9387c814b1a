"""How good the capsule network becomes with steps of training (make bench-training): F1 at validation azimuths.

On the images of a run at full size (RESULTS=results/thesis), split at random: the network of config/thesis.yaml learns
the known targets' and is scored after some epochs: weighted F1 of the closed set and, with the threshold that is best
on the same images, of the open set. Each score is written as soon as it is there, and a killed training goes on.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd

from isarflow.learning import images, thresholds
from isarflow.learning.classifier import OTHER, build
from isarflow.learning.experiments import CLEAN, label
from isarflow.learning.metrics import metrics_of_labels
from isarflow.learning.split import divisions
from isarflow.setup.config import load
from isarflow.setup.yaml_file import read_yaml

CONFIG = load(*map(read_yaml, ("config/thesis.yaml", "config/thesis-fields.yaml")))
ROLES = {name: target["role"] for name, target in CONFIG["targets"].items()}
KNOWN, UNKNOWN = (tuple(name for name, own in ROLES.items() if own == role) for role in ("known", "unknown"))
PLANES = {name: tuple(target["symmetry"]) for name, target in CONFIG["targets"].items()}
EPOCHS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96)  # after which it is scored, and after the last
CLOSED, OPENED = (-6, 0), {6: "zncc", 15: "mse", 24: "mse"}  # dB
SCORED = 400  # images of each target at an SNR


def read(folder, side, snr, targets, realizations):
    """Images (n, 32, 32) of a side of these targets at an SNR, and the targets' names (n,)."""
    (division,) = divisions("random", CONFIG["learning"]["split"], CONFIG["seed"], CONFIG["imaging"]["aperture"])
    stores = [Path(folder) / "imaging" / target / f"{label(snr)}.zarr" for target in targets]
    divided = images.divide(stores, PLANES, division)
    pixels, origin = images.read_side(stores, divided, side, pixels=32, realizations=realizations)
    return pixels, origin["target"].to_numpy(str)


def scores(network, held_out):
    """The weighted F1 of a fitted network on images and targets by SNR, closed and open."""
    found = {}
    for snr, (pixels, targets) in held_out.items():
        outcome, known = network.evaluate(pixels), np.isin(targets, KNOWN)
        truth = np.where(known, targets, OTHER)
        found[f"closed_{snr}dB"] = metrics_of_labels(truth[known], outcome.labels[known])["f1_weighted"]
        if score := OPENED.get(snr):
            threshold = thresholds.best(outcome.known[score], truth, outcome.labels)
            predicted = thresholds.apply(outcome.known[score], outcome.labels, threshold)
            found[f"{score}_{snr}dB"] = metrics_of_labels(truth, predicted)["f1_weighted"]
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", help="folder with imaging/, as results/thesis")
    parser.add_argument("output", type=Path, help="CSV file of a row for each score")
    parser.add_argument("--snr", default=CLEAN, help="dB of the training images, all realizations, or clean")
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--steps", type=int, default=25_350, help="as many as 150 epochs of 169 batches")
    parser.add_argument("--end", type=float, default=0.05, help="of the learning rate, at the last step")
    parser.add_argument("--seed", type=int, default=0, help="of the weights to begin with and the order of the images")
    arguments = parser.parse_args()
    snr = CLEAN if arguments.snr == CLEAN else float(arguments.snr)
    learned = read(arguments.results, "train", snr, KNOWN, None)
    random = np.random.default_rng(0)
    held_out = {}
    for each in (*CLOSED, *OPENED):
        pixels, targets = read(arguments.results, "validation", each, KNOWN + UNKNOWN, 1)
        rows = np.concatenate(
            [random.permutation(np.flatnonzero(targets == target))[:SCORED] for target in KNOWN + UNKNOWN]
        )
        held_out[each] = pixels[rows], targets[rows]
    known = np.isin(held_out[24][1], KNOWN)

    epochs = max(1, round(arguments.steps * arguments.batch / len(learned[0])))
    settings = CONFIG["learning"]["models"]["capsule"] | {"epochs": epochs, "patience": epochs}
    settings |= {"batch": arguments.batch, "decay": arguments.end ** (1 / epochs)}
    network, scored = (build("capsule", settings, arguments.seed) for _ in range(2))
    network.checkpoints = arguments.output.with_suffix(".state")
    about = {key: getattr(arguments, key) for key in ("snr", "batch", "seed")} | {"epochs": epochs}
    begun = time.perf_counter()

    def watch(epoch, weights):
        if epoch not in EPOCHS and epoch != epochs:
            return
        scored.classes_ = network.classes_
        scored._keep(weights)
        scored.mixture_logits_ = scored.mixture_means_ = scored.mixture_whitening_ = np.zeros(0)
        scored._mixture_score = lambda vectors, y: np.zeros(len(vectors))
        row = about | {"epoch": epoch, "steps": epoch * -(-len(learned[0]) // arguments.batch)}
        row |= {name: round(float(value), 4) for name, value in scores(scored, held_out).items()}
        rows = pd.read_csv(arguments.output, dtype={"snr": str}) if arguments.output.exists() else pd.DataFrame()
        # A training that goes on makes the epochs after its last checkpoint once more.
        rows = pd.concat([rows, pd.DataFrame([row])]).drop_duplicates([*about, "epoch"], keep="last")
        arguments.output.parent.mkdir(parents=True, exist_ok=True)
        rows.to_csv(arguments.output, index=False)
        print(f"{time.perf_counter() - begun:.0f} s: {row}", flush=True)

    network.watch = watch
    network.fit(*learned, (held_out[24][0][known], held_out[24][1][known]), None, np.arange(len(learned[0])))


if __name__ == "__main__":
    main()
