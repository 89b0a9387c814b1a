"""Meshing beside solving: `make bench-meshing`.

The default config's targets over 1.6 to 2.8 GHz, an aircraft of overlapping solids with trailing edges of 0.25 mm, and
the same of half a million triangles, from the CAD file to the field by Snakemake. Prints the processor time of both
stages for each, from Snakemake's own benchmark files; a table goes to results/benchmarks/meshing.csv.
"""

import json
import subprocess
from pathlib import Path

import pandas as pd
import yaml
from runner import options_of
from vehicles_made import uav

from isarflow.mesh.io import write_ply
from isarflow.setup.yaml_file import read_yaml

OUTPUT = Path("results/benchmarks")
SWEEP = {
    "radar": {"center_frequency": 2.2e9, "bandwidth": 1.2e9, "frequencies": 14},
    "aspect": {"azimuth": {"count": 121}},
}
MADE = {"uav": 1, "uav_fine": 8}  # how often an edge of the source is cut


def main():
    options = options_of(__doc__)
    targets = list(read_yaml("config/config.yaml")["targets"])
    added = {}
    for name, fine in MADE.items():
        path = options.out / f"{name}.ply"
        write_ply(path, *uav(fine=fine))
        added[name] = {"mesh": str(path), "unit": "m", "role": "unknown"}
    overlay = options.out / "meshing.yaml"
    overlay.write_text(yaml.safe_dump({"name": "bench-meshing", "targets": added, **SWEEP}))
    results = Path("results/bench-meshing")
    stores = [f"{results}/scattering/{name}.zarr" for name in (*targets, *added)]
    config = ["--configfile", "config/config.yaml", str(overlay)]
    subprocess.run(["snakemake", "--cores", str(options.threads), "--forceall", *stores, *config], check=True)
    rows = [row(results, name) for name in (*targets, *added)]
    table = pd.DataFrame(rows)
    print(table.to_string(index=False, float_format="%.2f"))
    table.to_csv(options.out / "meshing.csv", index=False, float_format="%.4g")


def row(results, name):
    """Processor seconds of a target's two stages, and the unknowns of its finest mesh."""
    measures = json.loads((results / "mesh" / f"{name}.json").read_text())
    spent = {"meshing": [results / "benchmarks" / "mesh" / f"{name}.tsv"]}
    spent["solving"] = sorted((results / "benchmarks" / "scattering" / "bands").glob(f"{name}-*.tsv"))
    times = {stage: sum(pd.read_csv(path, sep="\t").cpu_time.sum() for path in paths) for stage, paths in spent.items()}
    unknowns = max(band["unknowns"] for band in measures["bands"])
    return {"target": name, "unknowns": unknowns, **times, "ratio": times["meshing"] / times["solving"]}


if __name__ == "__main__":
    main()
