"""The fields of this folder beside others of the same targets: `make check-fields`.

At the lowest, the middle and the highest frequency every target is solved again in two ways:

    finer   on a mesh of fourteen edges a wavelength instead of ten
    cfie    on its own mesh by the combined field equation, if it is closed and the matrix fits into memory (up to about
            60,000 unknowns in 24 GB)

Rows are added to accuracy.csv after each solve; what it holds already is not solved again. Hours at full size, and
meshes take minutes. Its own mesh is the one that the store names: a checkout that makes other meshes is refused.
"""

import argparse
import json
import multiprocessing
import os
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from make import CONFIG

from isarflow.core.sweep import Sweep, sweeps
from isarflow.mesh.io import read_ply
from isarflow.scattering.costs import chosen_tolerance, planned
from isarflow.scattering.fields.field_files import digest
from isarflow.scattering.needs import memory_megabytes
from isarflow.scattering.solve import solve
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

HERE = Path(__file__).parent
FINER = 14  # edges a wavelength
SHOWN = 30  # dB below the peak over all directions, down to which levels are compared
REFERENCES = ["cfie", "finer"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--targets", nargs="+", help="all that are here, unless given")
    parser.add_argument("--frequencies", type=int, nargs="+", default=[0, 13, 26], help="their numbers")
    parser.add_argument("--references", nargs="+", choices=REFERENCES, default=REFERENCES)
    options = parser.parse_args()
    config, path = load_config(*map(read_yaml, CONFIG)), HERE / "accuracy.csv"
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    targets = options.targets or [name for name in config["targets"] if (HERE / f"{name}.zarr").exists()]
    for reference in options.references:
        for number in options.frequencies:
            for target in targets:
                store = xr.open_zarr(HERE / f"{target}.zarr")
                field = store.field.isel(frequency=[number]).load()
                ghz = round(float(field.frequency[0]) / 1e9, 4)
                if not any((row["target"], row["ghz"], row["reference"]) == (target, ghz, reference) for row in rows):
                    rows += compared(config, target, reference, field, store.attrs, options.threads)
                    pd.DataFrame(rows).to_csv(path, index=False, float_format="%.4g")


def compared(config, target, reference, field, attrs, threads):
    """A row for each polarization of how far a field is from the reference; none where that cannot be solved.

    attrs: the store's. Exits where the field's own mesh is asked for and this checkout makes another.
    """
    sweep = Sweep(*(field[name].values for name in ("frequency", "elevation", "azimuth", "polarization")))
    ghz = round(sweep.frequency[0] / 1e9, 4)
    mesh, figures = (finer_mesh if reference == "finer" else own_mesh)(config, target, sweep.frequency[0], threads)
    if reference == "cfie" and digest(mesh) not in attrs["mesh_sha256"]:
        raise SystemExit(f"{mesh} is not the mesh of the dataset's {target}: check it out as of {attrs['made_by']}.")
    if reference == "cfie" and not figures["watertight"]:
        return []
    symmetry = config["targets"][target].get("symmetry", [])
    settings = {"formulation": "cfie" if reference == "cfie" else "efie", "precision": "single"}
    given = figures, len(symmetry), sweep
    most = config["scattering"]["tolerance"]
    settings["tolerance"] = chosen_tolerance(*given, **settings, tolerance=most) if reference == "finer" else None
    megabytes, seconds = planned(*given, **settings)
    said = f"{target} at {ghz} GHz, {reference}: {figures['unknowns']} unknowns"
    if megabytes > 0.95 * memory_megabytes():
        print(f"{said}; left out, as it needs {megabytes / 1000:.0f} GB", flush=True)
        return []
    print(f"{said}, planned {seconds:.0f} s", flush=True)
    with multiprocessing.get_context("spawn").Pool(1) as pool:  # gives its memory back
        solution = pool.apply(solved, (mesh, sweep, symmetry, threads, settings))
    print(f"residual {solution.residual[0]:.1e}", flush=True)
    rows = []
    for name, mine, other in zip(sweep.polarizations, field.values[:, 0], solution.field[:, 0], strict=True):
        row = {"target": target, "ghz": ghz, "reference": reference, "unknowns": figures["unknowns"]}
        rows.append(row | {"polarization": str(name)} | apart(mine, other))
        print(*(f"{key} {v:.4g}" if isinstance(v, float) else v for key, v in rows[-1].items()), flush=True)
    return rows


def own_mesh(config, target, frequency, threads):
    """The path of the mesh of the band that a frequency (Hz) is in, and its figures."""
    figures = meshed(target, threads, Path("results", config["name"]), *CONFIG)
    bands = sweeps(config["radar"], config["aspect"], config["mesh"]["bands"])
    (number,) = (n for n, band in enumerate(bands) if np.isclose(band.frequency, frequency).any())
    return figures.with_name(f"{target}-{number}.ply"), json.loads(figures.read_text())["bands"][number]


def finer_mesh(_, target, frequency, threads):
    """The path of a target's finer mesh for one frequency (Hz), and its figures."""
    name = f"finer-{frequency / 1e9:.4f}"
    overlay = Path("results", f"{name}.yaml")
    overlay.parent.mkdir(exist_ok=True)
    radar = {"center_frequency": float(frequency), "bandwidth": 0, "frequencies": 1}
    mesh = {"edges_per_wavelength": FINER, "bands": 1}
    overlay.write_text(yaml.safe_dump({"name": name, "mesh": mesh, "radar": radar}))
    figures = meshed(target, threads, Path("results", name), *CONFIG, str(overlay))
    return figures.with_name(f"{target}-0.ply"), json.loads(figures.read_text())["bands"][0]


def meshed(target, threads, results, *configs):
    figures = results / "mesh" / f"{target}.json"
    command = ["snakemake", "--quiet", "all", "--cores", str(threads), str(figures), "--configfile", *configs]
    subprocess.run(command, check=True)
    return figures


def solved(mesh, sweep, symmetry, threads, settings):
    asked = sweep.frequency, sweep.elevation, sweep.azimuth, list(sweep.polarizations)
    return solve(*read_ply(mesh), *asked, symmetry, threads=threads, **settings)


def apart(field, reference):
    """How far a field (elevation, azimuth) is from a reference: relative to its peak, and of the level near it."""
    peak = np.abs(reference).max()
    error = np.abs(field - reference) / peak
    shown = np.abs(reference) > peak * 10 ** (-SHOWN / 20)
    level = np.abs(20 * np.log10(np.abs(field[shown]) / np.abs(reference[shown])))
    return {
        "error_rms_db": float(10 * np.log10(np.mean(error**2))),
        "error_largest_db": float(20 * np.log10(error.max())),
        "level_median_db": float(np.median(level)),
        "level_90_percent_db": float(np.quantile(level, 0.9)),
        "level_largest_db": float(level.max()),
        "directions": int(shown.sum()),
    }


if __name__ == "__main__":
    main()
