"""Recognition on images of each imager: `make bench-imaged`, after `make report`.

The default experiment's small fields in VV (14 frequencies, 13 elevations, 121 azimuths, apertures of 11). Every second
elevation is in the library, at every second azimuth, and random views between are tested: the share named rightly of
the closed set of five targets, by three quick models. A table goes to results/benchmarks/imaged.csv.
"""

import time
from pathlib import Path

import pandas as pd
import xarray as xr
from imaged import TARGETS, Imaged, recognised
from runner import options_of

SHARED = {"aperture": 11, "polarizations": ["VV"]}
IMAGERS = {
    "fourier, Hamming": {"imager": "fourier", "window": "hamming", "reformat": "polar", "upsample": "none"},
    "fourier, boxcar": {"imager": "fourier", "window": "boxcar", "reformat": "polar", "upsample": "none"},
    "sparse": {"imager": "sparse", "pixels": 1, "sparsity": 0.05, "iterations": 100},
    "sparse, 2 pixels a cell": {"imager": "sparse", "pixels": 2, "sparsity": 0.05, "iterations": 100},
    "esprit": {"imager": "esprit", "pixels": 1, "scatterers": 20},
    "centres": {"imager": "centres", "pixels": 1, "centres": 8},
}
MODELS = {
    "likelihood": ("likelihood", {"candidates": 8, "mismatch": 0.03}),
    "zncc": ("matched_filter", {"features": "magnitude"}),
    "knn": ("knn", {"k": 1, "features": "magnitude"}),
}
SNRS = [24, 12, 6, 0]  # dB, of the mean power in the aperture


def main():
    options = options_of(__doc__, fields={"type": Path, "default": Path("results/quick/scattering")})
    fields = {target: xr.open_zarr(options.fields / f"{target}.zarr").field.load() for target in TARGETS}
    tables = []
    for name, settings in IMAGERS.items():
        begun = time.process_time()
        made = Imaged(fields, settings | SHARED)
        tables.append(recognised(made, {"same": made}, MODELS, SNRS, step=2, drawn=10).assign(imager=name))
        print(f"{name}: {time.process_time() - begun:.0f} s of processor time", flush=True)
        print(tables[-1].drop(columns=["tested", "imager"]).round(3).to_string(index=False), flush=True)
    table = pd.concat(tables)
    table.to_csv(options.out / "imaged.csv", index=False, float_format="%.4g")
    print(table.pivot(index=["imager", "model"], columns="snr_db", values="accuracy").round(3))


if __name__ == "__main__":
    main()
