"""The mesh stage on random vehicles: `make bench-mesh`.

Aircraft with NACA wings, quadrotors and missiles, of closed solids that overlap, with trailing edges of 0.1 to 1.3 mm
(tests/mesh/vehicles_made.py), meshed at 1 and 2 GHz in turn. Prints a line for each and what was refused or missed in
all; a table goes to results/benchmarks/mesh.csv.
"""

import os
import time
from pathlib import Path

import pandas as pd
from runner import options_of, show
from vehicles_made import drawn

from isarflow.core.errors import InputError
from isarflow.mesh.build import build_meshes
from isarflow.mesh.io import write_ply

OUTPUT = Path("results/benchmarks")
MESH = {"edges_per_wavelength": 10, "bands": 1}


def meshed(number, path):
    """The `number`th vehicle's row: seconds of processor time, unknowns, or why it was refused."""
    write_ply(path, *drawn(number))
    gigahertz = 1 + number % 2
    radar = {"center_frequency": gigahertz * 1e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
    start, row = time.process_time(), {"vehicle": number, "kind": ("aircraft", "quadrotor", "missile")[number % 3]}
    try:
        _, measures = build_meshes(path, {"unit": "m"}, MESH, radar)
    except InputError as error:
        return row | {"gigahertz": gigahertz, "seconds": time.process_time() - start, "refused": str(error)}
    (band,) = measures["bands"]
    found = {"unknowns": band["unknowns"], "of_uniform": band["unknowns"] / band["ideal_unknowns"]}
    row |= {"gigahertz": gigahertz, "seconds": time.process_time() - start} | found
    return row | {"area": band["area"]["after"] / band["area"]["before"] - 1, "missed": band["missed"], "refused": None}


def main():
    options = options_of(__doc__, first={"type": int, "default": 0}, count={"type": int, "default": 200})
    rows, path = [], options.out / f"vehicle-{os.getpid()}.ply"
    for number in range(options.first, options.first + options.count):
        rows.append(meshed(number, path))
        path.unlink()
        show(rows[-1])
        pd.DataFrame(rows).to_csv(options.out / "mesh.csv", index=False)
    table = pd.DataFrame(rows).reindex(columns=["seconds", "of_uniform", "missed", "refused"])
    over = table.of_uniform
    print(
        f"{len(table)} vehicles, {table.refused.notna().sum()} refused, {table.missed.notna().sum()} miss a goal; "
        f"slowest {table.seconds.max():.0f} s; unknowns over those of a uniform mesh: median {over.median():.2f}, "
        f"largest {over.max():.2f}, {(over > 1.4).sum()} above 1.4"
    )


if __name__ == "__main__":
    main()
