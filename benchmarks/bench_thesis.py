"""Solves at full size, and what the whole reference experiment would take: `make bench-thesis`.

Meshes the targets of config/thesis.yaml (if that is not done), solves the costliest target at the two highest
frequencies of its lowest, middle and highest band, and the costliest of other mirror planes in its highest, in all
directions. A band's first frequency takes longer, as it also compiles: a band takes its time, and that of the second
for each other one. What each part took beside the plan scales the plan of all other targets and bands. --whole solves
the costliest with whole matrices besides (an hour, 22 GB). A solve that the table holds already is not repeated.
"""

import json
import resource
import subprocess
import time
from pathlib import Path

import numpy as np
import pandas as pd
from runner import in_process, options_of, show

from isarflow.core.sweep import Sweep, sweeps
from isarflow.mesh.io import read_ply
from isarflow.scattering import needs
from isarflow.scattering.costs import at_one_frequency, chosen_tolerance
from isarflow.scattering.solve import PARTS, solve
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml


def main():
    asked = {"nargs": "+", "help": "of the config, unless given"}
    whole = {"action": "store_true", "help": "with whole matrices, too"}
    options = options_of(__doc__, config={"default": "config/thesis.yaml"}, polarizations=asked, whole=whole)
    config = load_config(read_yaml(options.config))
    if options.polarizations:
        config["radar"]["polarizations"] = options.polarizations
    folder = Path("results", config["name"], "mesh")
    figures = [f"{folder}/{target}.json" for target in config["targets"]]
    command = ["snakemake", "--cores", str(options.threads), *figures, "--configfile", options.config]
    subprocess.run(command, check=True)
    table = pd.DataFrame(plans(config, folder))
    table["seconds"] = table[[f"planned_{part}" for part in PARTS]].sum(axis=1)

    def costliest(rows):
        return rows.loc[rows.seconds.idxmax()]

    largest = costliest(table)
    bands = sorted({0, largest.band // 2, largest.band})
    measured = [row for _, row in table[table.target == largest.target].iterrows() if row.band in bands]
    measured += [costliest(rows) for planes, rows in table.groupby("planes") if planes != largest.planes]
    letters = "-".join(config["radar"]["polarizations"])
    path = options.out / f"thesis-bands-{letters}.csv"
    solves = pd.read_csv(path).to_dict("records") if path.exists() else []
    for row, tolerance in [(row, row.tolerance) for row in measured] + ([(largest, 0.0)] if options.whole else []):
        if (row.target, row.band, tolerance) in {
            (known["target"], known["band"], known["tolerance"]) for known in solves
        }:
            continue
        mesh, symmetry = folder / f"{row.target}-{row.band}.ply", config["targets"][row.target].get("symmetry", [])
        took = in_process(measure, config, mesh, row.band, symmetry, tolerance or None, options.threads)
        solves.append(
            {"target": row.target, "band": row.band, "unknowns": row.unknowns, "planned_gb": row.planned_gb} | took
        )
        show(solves[-1])
        pd.DataFrame(solves).to_csv(path, index=False)
    solved = pd.DataFrame(solves).merge(table, on=["target", "band", "tolerance"], suffixes=("", "_of_plan"))
    for part in PARTS:
        ratio = solved[part].sum() / solved[f"planned_{part}"].sum()
        print(f"{part}: {ratio:.2f} of the plan")
        table[f"{part}_h"] = table[f"planned_{part}"] * ratio * table.frequencies / 3600
    table["hours"] = table[[f"{part}_h" for part in PARTS]].sum(axis=1)
    shown = ["target", "band", "planes", "unknowns", "frequencies", "planned_gb", "tolerance"]
    shown += [*(f"{part}_h" for part in PARTS), "hours"]
    print(table[shown].round(3).to_string(index=False))
    print(
        f"{', '.join(config['radar']['polarizations'])}, all {config['radar']['frequencies']} frequencies: "
        f"{table.hours.sum():.2f} hours"
    )
    table[shown].to_csv(options.out / f"thesis-{letters}.csv", index=False)


def plans(config, folder):
    """A row for each target and band: its size, and what is planned at its highest frequency."""
    asked = sweeps(config["radar"], config["aspect"], config["mesh"]["bands"])
    for target, own in config["targets"].items():
        planes, method = len(own.get("symmetry", [])), needs.method(config, target)
        settings = {key: method[key] for key in ("formulation", "precision")}
        for number, band in enumerate(json.loads((folder / f"{target}.json").read_text())["bands"]):
            tolerance = chosen_tolerance(band, planes, asked[number], **settings, tolerance=method["tolerance"])
            megabytes, seconds = at_one_frequency(band, planes, asked[number], **settings, tolerance=tolerance)
            row = {"target": target, "band": number, "planes": planes, "unknowns": band["unknowns"]}
            row |= {"frequencies": band["frequencies"]["count"], "tolerance": tolerance or 0.0}
            yield row | {"planned_gb": megabytes / 1000} | {f"planned_{part}": seconds[part] for part in PARTS}


def measure(config, mesh, band, symmetry, tolerance, threads):
    """Seconds per frequency of a band's solve, from its two highest frequencies; and its memory."""
    sweep = sweeps(config["radar"], config["aspect"], config["mesh"]["bands"])[band]
    others = len(sweep.frequency) - 1
    sweep = Sweep(sweep.frequency[-2:], sweep.elevation, sweep.azimuth, sweep.polarizations)
    start, said = time.perf_counter(), {"at": 0.0}

    def progress(_, part, done):
        if time.perf_counter() - said["at"] > 60:
            said["at"] = time.perf_counter()
            print(f"  {said['at'] - start:6.0f} s: {part} {100 * done:.0f} %", flush=True)

    asked = sweep.frequency, sweep.elevation, sweep.azimuth, sweep.polarizations
    solution = solve(*read_ply(mesh), *asked, symmetry, threads=threads, progress=progress, tolerance=tolerance)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    row = {"ghz": sweep.frequency[-1] / 1e9, "tolerance": tolerance or 0.0}
    weights = [1, others] if others else [1]
    row |= {part: float(np.average(solution.seconds[part], weights=weights)) for part in PARTS}
    return row | {"peak_gb": peak, "residual": float(max(solution.residual))}


if __name__ == "__main__":
    main()
