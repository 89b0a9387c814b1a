"""Some test images, and their reconstructions by a model with a decoder."""

from pathlib import Path

import numpy as np
import xarray as xr

from isarflow.core.store import write
from isarflow.core.sweep import snr_of_label
from isarflow.learning.classifier import config_of, load_classifier
from isarflow.learning.data import images
from isarflow.learning.experiments import CLEAN

EXAMPLES = 5  # of each target


def reconstruct(stores, planes, folder, output):
    """Write reconstructions by the model in `folder` of EXAMPLES test images of each target to a zarr store.

    stores: imaging/<target>/<label>.zarr, without noise and at some SNRs; planes: each target's mirror planes. The
    examples are spread evenly over a target's test views; of noisy images the first realization.
    Variables, magnitudes of the first polarization over (range, crossrange): truth (target, example), without noise;
    seen and made (snr, target, example), the network's input and its reconstruction; predicted (snr, target,
    example): the class.
    """
    model, run = load_classifier(folder), config_of(folder)["run"]
    targets = sorted({images.target_of(store) for store in stores})
    labels = sorted({Path(store).stem for store in stores} - {CLEAN}, key=snr_of_label)
    divided = images.divide(stores, planes, run)
    shown, decoded = {}, {}  # by target, origins of its examples; by target and label, what is made
    for store in map(Path, stores):
        target = images.target_of(store)
        pixels, origin = images.read_side([store], {target: divided[target]}, run, "test", realizations=1)
        rows = np.linspace(0, len(pixels) - 1, EXAMPLES + 2).astype(int)[1:-1]
        shown[target], decoded[target, store.stem] = origin.iloc[rows], model.reconstruct(pixels[rows])
    noisy = [[decoded[target, label] for target in targets] for label in labels]
    seen, reconstructed, predicted = (np.array([[part[i] for part in row] for row in noisy]) for i in range(3))
    places, axes = ("snr", "target", "example"), ("range", "crossrange")
    data = {
        "truth": (("target", "example", *axes), np.array([decoded[target, CLEAN][0] for target in targets])),
        "seen": ((*places, *axes), seen),
        "made": ((*places, *axes), reconstructed),
        "predicted": (places, predicted.astype(str)),
    }
    azimuth = [shown[target]["azimuth"] for target in targets]
    elevation = shown[targets[0]]["elevation"].astype(float)
    coords = {
        "snr": ("snr", [snr_of_label(label) for label in labels], {"units": "dB", "long_name": "SNR"}),
        "target": ("target", targets, {"units": "", "long_name": "target"}),
        "elevation": ("example", elevation, {"units": "degrees", "long_name": "elevation"}),
        "azimuth": (("target", "example"), azimuth, {"units": "degrees", "long_name": "azimuth"}),
    }
    write(xr.Dataset(data, coords, {"run": run["name"], "model": Path(folder).name}), output)
    print(f"{len(targets)} targets, {EXAMPLES} images of each without noise and at {', '.join(labels)}")
