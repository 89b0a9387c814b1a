"""Some test images, and what a model with a decoder makes of them."""

from pathlib import Path

import numpy as np
import xarray as xr

from core.store import open_store, write
from core.sweep import snr_of_label
from learning import images
from learning.experiments import CLEAN
from learning.train import azimuths_of, load, run_of

EXAMPLES = 5  # of each target


def reconstruct(stores, folder, output):
    """Write what the model in `folder` makes of EXAMPLES test images of each target to a zarr store.

    stores: imaging/<target>/<label>.zarr, without noise and at some SNRs. The examples lie evenly among the test
    azimuths and the elevations, the same for every target; of noisy images the first realization.
    Variables, magnitudes over (range, crossrange): truth (target, example), without noise; seen and made (snr, target,
    example), what the network sees and what it reconstructs; predicted (snr, target, example): the class.
    """
    model, run = load(folder), run_of(folder)
    targets = sorted({images.target_of(store) for store in stores})
    labels = sorted({Path(store).stem for store in stores} - {CLEAN}, key=snr_of_label)
    elevation, azimuth = _examples(stores[0], azimuths_of(folder, "test"))
    found = {}
    for store in map(Path, stores):
        rows = images.read([store], azimuth, elevation, run["upsample"])
        # All pairs of these angles, and all realizations: of each example the first.
        some = [
            np.flatnonzero(images.among(rows.elevation, [e]) & images.among(rows.azimuth, [a]))[0]
            for e, a in zip(elevation, azimuth, strict=True)
        ]
        found[store.parent.name, store.stem] = model.reconstruct(rows.images[some])
    pixels = ("range", "crossrange")

    def of_snrs(part):
        return np.stack([[found[target, label][part] for target in targets] for label in labels])

    dataset = xr.Dataset(
        {
            "truth": (("target", "example", *pixels), np.stack([found[target, CLEAN][0] for target in targets])),
            "seen": (("snr", "target", "example", *pixels), of_snrs(0)),
            "made": (("snr", "target", "example", *pixels), of_snrs(1)),
            "predicted": (("snr", "target", "example"), of_snrs(2).astype(str)),
        },
        coords={
            "snr": ("snr", [snr_of_label(label) for label in labels], {"units": "dB", "long_name": "SNR"}),
            "target": ("target", targets, {"units": "", "long_name": "target"}),
            "elevation": ("example", elevation, {"units": "degrees", "long_name": "elevation"}),
            "azimuth": ("example", azimuth, {"units": "degrees", "long_name": "azimuth"}),
        },
        attrs={"run": run["name"], "model": Path(folder).name},
    )
    write(dataset, output)
    print(f"{len(targets)} targets, {EXAMPLES} images of each without noise and at {', '.join(labels)}")


def _examples(store, azimuths):
    """Elevations and azimuths of EXAMPLES images, evenly among those of a store at these azimuths."""
    with open_store(store) as dataset:
        elevation, azimuth = np.meshgrid(dataset.elevation.values, np.sort(azimuths), indexing="ij")
    some = np.linspace(0, elevation.size - 1, EXAMPLES + 2).astype(int)[1:-1]
    return elevation.ravel()[some], azimuth.ravel()[some]
