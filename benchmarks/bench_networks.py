"""Trainings on the device that JAX finds here, beside two cores of the processor: `make gpu`.

Drone and missile of the dataset in VV, 32 x 32 pixels, without noise. Each network is trained on each device from the
same seed: for one epoch, in which its program is compiled and kept; for one epoch again; and for EPOCHS, whose further
ones are timed. A row of results/benchmarks/networks.csv for each network and device: milliseconds to train on an image
and to judge one; and the loss of the last epoch and the accuracy at SNR dB on images that did not train, which show
whether a device's arithmetic is right.
"""

import os
import time

import numpy as np
import pandas as pd
from runner import in_process, options_of, show

CORES, EPOCHS, FEW, SNR = 2, 3, 640, 12  # of the processor; of a training; images of a large network; dB
FULL = {"width": 256, "capsules": 32, "decoder": 512}
NETWORKS = {  # model, its settings beside config/config.yaml's, images that train at most
    "capsule network, full size": ("capsule", FULL, FEW),
    "capsule network, small": ("capsule", {}, None),
    "matrix capsules, full size": ("matrix_capsule", FULL, FEW),
    "matrix capsules, small": ("matrix_capsule", {}, None),
    "convolutional network": ("cnn", {"batch": 64}, None),
}


def main():
    options = options_of(__doc__, networks={"nargs": "*", "default": list(NETWORKS)})
    rows = []
    for name in options.networks:
        for on_processor in (False, True):
            rows.append({"network": name} | in_process(measured, name, on_processor))
            show(rows[-1])
            pd.DataFrame(rows).to_csv(options.out / "networks.csv", index=False, float_format="%.4g")


def measured(name, on_processor):
    """A row of the table, in a process of its own, before JAX looks for devices."""
    if on_processor:
        os.environ["JAX_PLATFORMS"] = "cpu"
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])
    import jax
    from bench_training import KNOWN, images

    from isarflow.learning.classifier import build_classifier
    from isarflow.setup.config import load_config

    kind, settings, most = NETWORKS[name]
    settings = load_config()["learning"]["models"][kind] | settings
    sides = []
    for side, snr in ((0, "clean"), (1, SNR)):
        parts = [images(target, "random", side, snr, 0, "polar")[..., 0] for target in KNOWN]
        sides.append((np.concatenate(parts).astype(np.complex64), np.repeat(KNOWN, [len(part) for part in parts])))
    (learned, labels), (seen, truth) = sides
    chosen = np.random.default_rng(0).permutation(len(learned))[:most]
    learned, labels, took = learned[chosen], labels[chosen], []
    for epochs in (1, 1, EPOCHS):
        model = build_classifier(kind, settings | {"epochs": epochs} | patient(settings, epochs), 0)
        model.noise = noise(learned.shape[1:])
        start = time.perf_counter()
        model.fit(learned, labels)
        took.append(time.perf_counter() - start)
    model.evaluate(seen)  # compiles
    start = time.perf_counter()
    right = (model.evaluate(seen).labels == truth).mean()
    return {
        "device": jax.devices()[0].device_kind if not on_processor else f"{CORES} cores",
        "images": len(learned),
        "train_ms": 1000 * (took[2] - took[1]) / ((EPOCHS - 1) * len(learned)),
        "judge_ms": 1000 * (time.perf_counter() - start) / len(seen),
        "loss": float(model.curve_["loss"][-1]),
        "accuracy": float(right),
    }


def patient(settings, epochs):
    return {"patience": epochs} if "patience" in settings else {}


def noise(shape, count=256):
    """Images of white noise, (count, *shape)."""
    return np.random.default_rng(1).standard_normal((count, *shape, 2), np.float32).view(np.complex64)[..., 0]


if __name__ == "__main__":
    main()
