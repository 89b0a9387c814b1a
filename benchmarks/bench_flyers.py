"""A plastic drone and a bird of water beside their metal twins: `make bench-flyers`.

RCS and images of the first of each in config/flyers.yaml, of their kept fields and those of metal. Writes
bench-flyers.csv, a row for each polarization, and flyers.png.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from runner import options_of

from isarflow.core.store import open_store
from isarflow.learning.confidence import zncc

RUNS = {"as it is": Path("results/flyers-fields"), "all metal": Path("results/flyers-metal-fields")}
TARGETS = {"drone_plastic_01": "plastic drone", "bird_water_01": "bird of water"}
NEAR_PEAK = 30  # dB below the twin's largest RCS: what lies lower is left out
VIEW = {"elevation": 15, "azimuth": 30}  # degrees, of the images drawn
DEPTH = 30  # dB that they show


def db(values):
    return 20 * np.log10(np.maximum(np.abs(values), 1e-9))


def rows(target):
    """How far a target is from its twin, of each polarization: levels in dB, and how alike the images are."""
    fields, images = (
        [open_store(root / path).load() for root in RUNS.values()]
        for path in (f"scattering/{target}.zarr", f"imaging/{target}/clean.zarr")
    )
    for way in fields[0].polarization.values.tolist():
        own, twin = (db(store.field.sel(polarization=way).values) for store in fields)
        bright = twin > twin.max() - NEAR_PEAK
        magnitudes = [np.abs(store.image.sel(channel=way).values) for store in images]
        alike = zncc(*(each.reshape(-1, each.shape[-2] * each.shape[-1]) for each in magnitudes))
        yield {
            "target": target,
            "polarization": way,
            "median_rcs_dbsm": np.median(own) + 10 * np.log10(4 * np.pi),
            "median_rcs_metal_dbsm": np.median(twin) + 10 * np.log10(4 * np.pi),
            "mean_difference_db": np.abs(own - twin)[bright].mean(),
            "zncc_median": np.median(alike),
        }


def figure(path):
    shape, axes = plt.subplots(len(TARGETS), 3, squeeze=False, figsize=(13, 4.2 * len(TARGETS)), layout="constrained")
    for (target, label), row in zip(TARGETS.items(), axes, strict=True):
        for colour, (name, root), axis in zip(("C0", "C3"), RUNS.items(), row[1:], strict=True):
            field = open_store(root / f"scattering/{target}.zarr").field.sel(polarization="VV")
            middle = field.sel(elevation=0).isel(frequency=field.sizes["frequency"] // 2).load()
            row[0].plot(middle.azimuth, db(middle) + 10 * np.log10(4 * np.pi), colour, label=name)
            image = open_store(root / f"imaging/{target}/clean.zarr").image.sel(channel="VV")
            image = image.sel(VIEW, method="nearest").transpose("range", "crossrange").load()
            level = db(image) - db(image).max()
            drawn = axis.pcolormesh(image.crossrange, image.range, level, vmin=-DEPTH, vmax=0, cmap="viridis")
            axis.set(title=f"{label}, {name}", xlabel="cross-range (m)", ylabel="down-range (m)", aspect="equal")
            shape.colorbar(drawn, ax=axis, label="dB below the peak")
        row[0].set(
            title=f"{label}: VV at {float(middle.frequency) / 1e9:.2f} GHz, elevation 0°",
            xlabel="azimuth (degrees)",
            ylabel="RCS (dB m²)",
            xticks=range(0, 361, 90),
        )
        row[0].legend()
    shape.savefig(path, dpi=80)


def main():
    out = options_of(__doc__).out
    table = pd.DataFrame([row for target in TARGETS for row in rows(target)])
    table.to_csv(out / "bench-flyers.csv", index=False, float_format="%.3g")
    print(table.to_string(index=False, float_format=lambda value: f"{value:.2f}"))
    figure(out / "flyers.png")


if __name__ == "__main__":
    main()
