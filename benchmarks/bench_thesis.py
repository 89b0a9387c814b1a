"""One solve at full size, and what the whole reference experiment would take: `make bench-thesis`.

Meshes the targets of config/thesis.yaml (if that is not done), solves the costliest at its highest frequency, in all
directions, and scales the time of each part to the other targets and bands: assembly and directions with the number of
pairs of unknowns, factorization with its cube, mirror planes counted in.
"""

import argparse
import json
import os
import resource
import subprocess
import time
from pathlib import Path

import pandas as pd

from core.sweep import sweeps
from mesh.io import read_ply
from scattering import needs
from scattering.solve import PARTS, solve
from setup.config import load
from setup.yaml_file import read_yaml

POWERS = {"assembly": (2, 1), "factorization": (3, 2), "directions": (2, 2)}  # of unknowns, and of 2^planes below


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--config", default="config/thesis.yaml")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks"))
    options = parser.parse_args()
    config = load(read_yaml(options.config))
    folder = Path("results", config["name"], "mesh")
    figures = [f"{folder}/{target}.json" for target in config["targets"]]
    command = ["snakemake", "--cores", str(options.threads), *figures, "--configfile", options.config]
    subprocess.run(command, check=True)
    asked = sweeps(config["radar"], config["aspect"], config["mesh"]["bands"])

    def plan(target, number, band):
        planes = len(config["targets"][target].get("symmetry", []))
        return needs.need(band, planes, asked[number], needs.method(config, target))

    rows = [
        {
            "target": target,
            "band": number,
            "planes": len(config["targets"][target].get("symmetry", [])),
            "unknowns": band["unknowns"],
            "frequencies": band["frequencies"]["count"],
            "planned_gb": plan(target, number, band)["megabytes"] / 1000,
        }
        for target, path in zip(config["targets"], figures, strict=True)
        for number, band in enumerate(json.loads(Path(path).read_text())["bands"])
    ]
    table = pd.DataFrame(rows)
    cost = {part: table.unknowns**n / 2.0 ** (g * table.planes) for part, (n, g) in POWERS.items()}
    largest = table.loc[cost["factorization"].idxmax()]
    sweep = asked[largest.band]
    frequency = sweep.frequency[-1]
    symmetry = config["targets"][largest.target].get("symmetry", [])
    print(
        f"{largest.target} at {frequency / 1e9:g} GHz: {largest.unknowns} unknowns, mirror planes {symmetry}, "
        f"{len(sweep.elevation) * len(sweep.azimuth)} directions, planned memory {largest.planned_gb:.1f} GB",
        flush=True,
    )
    start, said = time.perf_counter(), {"at": 0.0}

    def progress(_, part, done):
        if time.perf_counter() - said["at"] > 60:
            said["at"] = time.perf_counter()
            print(f"  {said['at'] - start:6.0f} s: {part} {100 * done:.0f} %", flush=True)

    solution = solve(
        *read_ply(folder / f"{largest.target}-{largest.band}.ply"),
        [frequency],
        sweep.elevation,
        sweep.azimuth,
        sweep.polarizations,
        symmetry,
        precision=config["scattering"]["precision"],
        threads=options.threads,
        progress=progress,
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    seconds = {part: float(solution.seconds[part][0]) for part in PARTS}
    print(", ".join(f"{part} {value:.0f} s" for part, value in seconds.items()), end="; ")
    print(f"peak memory {peak:.1f} GB, residual {solution.residual[0]:.1e}")
    for part in PARTS:
        table[f"{part}_h"] = seconds[part] * cost[part] / cost[part][largest.name] * table.frequencies / 3600
    table["hours"] = table[[f"{part}_h" for part in PARTS]].sum(axis=1)
    print(table.round(2).to_string(index=False))
    print(f"the whole experiment, {config['radar']['frequencies']} frequencies: {table.hours.sum():.1f} hours")
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "thesis.csv", index=False)
    row = {"target": largest.target, "ghz": frequency / 1e9, "unknowns": largest.unknowns, **seconds}
    row |= {"peak_gb": peak, "residual": solution.residual[0]}
    pd.DataFrame([row]).to_csv(options.out / "thesis-solve.csv", index=False)


if __name__ == "__main__":
    main()
