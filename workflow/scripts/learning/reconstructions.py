"""Some test images, and what a model with a decoder makes of them."""

from pathlib import Path

import numpy as np
import xarray as xr

from common.radar import snr_of_label
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
    azimuths = azimuths_of(folder, "test")
    targets = sorted({images.target_of(store) for store in stores})
    labels = sorted({Path(store).stem for store in stores} - {CLEAN}, key=snr_of_label)
    found = {}
    for store in map(Path, stores):
        rows = images.read([store], azimuths, pixels=run["upsample"])
        # By elevation, then azimuth: coprime steps through both.
        first = np.flatnonzero(rows.realization == rows.realization.min())
        some = first[np.linspace(0, len(first) - 1, EXAMPLES + 2).astype(int)[1:-1]]
        seen, made = model.reconstruct(rows.images[some])
        found[store.parent.name, store.stem] = seen, made, model.predict(rows.images[some]), rows, some
    rows, some = found[targets[0], CLEAN][3:]
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
            "elevation": ("example", rows.elevation[some], {"units": "degrees", "long_name": "elevation"}),
            "azimuth": ("example", rows.azimuth[some], {"units": "degrees", "long_name": "azimuth"}),
        },
        attrs={"run": run["name"], "model": Path(folder).name},
    )
    dataset.to_zarr(output, zarr_format=2)
    print(f"{len(targets)} targets, {EXAMPLES} images of each without noise and at {', '.join(labels)}")
