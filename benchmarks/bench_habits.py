"""The mesh stage on CAD files of many makers' habits: `make bench-habits`.

Fans, fine exports, capped halves, rivets, lofts with slivers, patches, odd shells (tests/mesh/habits_made.py). Prints a
line for each: seconds of processor time, unknowns, what its volume is off the solid's, or why it was refused. A table
goes to results/benchmarks/habits.csv.
"""

import os
import time
from pathlib import Path

import pandas as pd
from habits_made import HABITS
from runner import options_of, show

from isarflow.core.errors import InputError
from isarflow.mesh.build import build_meshes
from isarflow.mesh.io import write_ply

OUTPUT = Path("results/benchmarks")
MESH = {"edges_per_wavelength": 10, "bands": 1}
OFF = 0.01  # of the solid's volume: more is another solid


def meshed(name, path):
    """A row for the habit `name`, meshed from a file at `path`."""
    habit = HABITS[name]
    write_ply(path, *habit.make())
    radar = {"center_frequency": habit.frequency * 1e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
    row, start, fault = {"habit": name}, time.process_time(), None
    try:
        _, measures = build_meshes(path, {"unit": "m", "symmetry": list(habit.symmetry)}, MESH, radar)
    except InputError as error:
        fault = str(error)
    row["seconds"] = time.process_time() - start
    if fault:
        return row | {"refused": fault}
    (band,) = measures["bands"]
    volume = band["volume"]["after"]
    row |= {"unknowns": band["unknowns"], "of_uniform": band["unknowns"] / band["ideal_unknowns"]}
    row |= {"closed": band["watertight"], "pieces": band["components"], "missed": band["missed"]}
    if habit.volume:
        row["volume_off"] = volume / habit.volume - 1 if volume else -1.0
    return row | {"repairs": {key: count for key, count in measures["repairs"].items() if count}}


def main():
    options = options_of(__doc__, habits={"nargs": "+", "choices": HABITS, "default": list(HABITS)})
    rows, path = [], options.out / f"habit-{os.getpid()}.ply"
    for name in options.habits:
        rows.append(meshed(name, path))
        path.unlink()
        show(rows[-1])
        pd.DataFrame(rows).to_csv(options.out / "habits.csv", index=False)
    table = pd.DataFrame(rows).reindex(columns=["seconds", "volume_off", "missed", "refused"])
    print(
        f"{len(table)} files, {table.refused.notna().sum()} refused, {table.missed.notna().sum()} miss a goal, "
        f"{(table.volume_off.abs() > OFF).sum()} with another volume; {(table.seconds > 60).sum()} above a minute"
    )


if __name__ == "__main__":
    main()
