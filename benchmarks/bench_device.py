"""Bands of the dataset solved on the device that JAX finds here, beside the fields that are kept: `make bench-device`.

    bench_device.py aircraft-6 drone-0        named bands, whose meshes are in results/fields/mesh

A row of results/benchmarks/device.csv for each: seconds of each part, those of the dataset's own solve, on two cores,
and the error of the field, relative to its peak. Stores, logs and processor times are left where Snakemake would leave
them: so `resources/fields/make.py keep` takes what a machine with a GPU has solved, which needs no Snakemake for it.
"""

import contextlib
import time
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from runner import options_of, show

from isarflow.core.compiled import keep_compiled
from isarflow.core.store import SUMS
from isarflow.core.sweep import sweeps
from isarflow.scattering import needs
from isarflow.scattering.band import solve_band
from isarflow.scattering.solve import PARTS
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

RESULTS, FIELDS, TABLE = Path("results/fields"), Path("resources/fields"), Path("results/benchmarks/device.csv")


def main():
    options = options_of(__doc__, bands={"positional": True, "nargs": "+", "metavar": "TARGET-BAND"})
    config = load_config(*map(read_yaml, ("config/thesis.yaml", "config/fields.yaml")))
    of_bands = sweeps(config["radar"], config["aspect"], config["mesh"]["bands"], config["scattering"])
    for name in options.bands:
        if (RESULTS / "scattering" / "bands" / f"{name}.zarr" / SUMS).exists():
            print(f"{name} is there")
            continue
        target, band = name.rsplit("-", 1)
        row = {"device": keep_compiled(), "target": target, "band": int(band)}
        row |= solved(config, target, name, of_bands[int(band)], options.threads) | kept(target, name)
        pd.DataFrame([row]).to_csv(TABLE, mode="a", header=not TABLE.exists(), index=False, float_format="%.4g")
        show(row)


def solved(config, target, name, sweep, threads):
    """Solve a band as its job does, and say what that took."""
    store, log, job = (
        RESULTS / kind / "bands" / f"{name}.{end}"
        for kind, end in (("scattering", "zarr"), ("logs/scattering", "log"), ("benchmarks/scattering", "tsv"))
    )
    for path in (store, log, job):
        path.parent.mkdir(parents=True, exist_ok=True)
    how = needs.method(config, target), config["targets"][target].get("symmetry", []), threads, target
    start, processor = time.perf_counter(), time.process_time()
    with log.open("w") as file, contextlib.redirect_stdout(file):
        solve_band(RESULTS / "mesh" / f"{name}.ply", store, sweep, *how)
    wall, processor = time.perf_counter() - start, time.process_time() - processor
    job.write_text(f"s\tcpu_time\n{wall:.2f}\t{processor:.2f}\n")
    return {"frequencies": len(sweep.frequency), "seconds": wall, "processor_s": processor}


def kept(target, name):
    """What the dataset's own solve of a band took, and the error of the band that is just solved beside its field."""
    if not (FIELDS / f"{target}.zarr").exists():
        return {"kept_s": np.nan, "error_db": np.nan}
    band = xr.open_zarr(RESULTS / "scattering" / "bands" / f"{name}.zarr").field
    truth = xr.open_zarr(FIELDS / f"{target}.zarr").field.sel(frequency=band.frequency)
    solves = pd.read_csv(FIELDS / "solves.csv")
    solves = solves[(solves.target == target) & (solves.band == int(name.rsplit("-", 1)[1]))]
    error = float(abs(band - truth).max() / abs(truth).max())
    took = solves[[f"{part}_s" for part in PARTS]].to_numpy().sum()
    return {"kept_s": float(took), "error_db": 20 * np.log10(error)}


if __name__ == "__main__":
    main()
