"""What depends on the models of the known targets: every drone of the dataset with every missile: `make models`.

Runs config/models.yaml for each pair, as results/models_<drone>_<missile>, and writes beside this file models.csv.xz:
the scores of all pairs at the thesis's conditions, after columns drone and missile. With --capsule one pair's capsule
network is trained as well (an hour of one core). The runs take 25 GB; they may be deleted afterwards.
"""

import argparse
import itertools
import subprocess
from pathlib import Path

import pandas as pd

from isarflow.core.folders import ROOT
from isarflow.report.results import read_learned
from isarflow.report.thesis import DEFINITION
from isarflow.report.vocabulary import select

DRONES, MISSILES = ("drone", "drone_hexa", "drone_guarded"), ("missile", "missile_plain", "missile_cruciform")
CAPSULE = "capsule_listing"  # the experiment of the capsule network
CONFIGS = "config/thesis.yaml", "config/thesis-fields.yaml", "config/models.yaml"
CASE = {"snr_definition": DEFINITION, "fold": "", "threshold": ["", "thesis"], "metric": ["accuracy", "f1_weighted"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cores", type=int, default=2)
    pairs, tables = list(itertools.product(DRONES, MISSILES)), []
    parser.add_argument("--capsule", default="drone_hexa-missile_plain", choices=["none", *map("-".join, pairs)])
    options = parser.parse_args()
    for pair in pairs:
        name = f"models_{'_'.join(pair)}"
        config = [f"name={name}", f"targets={{drone: {target(pair[0])}, missile: {target(pair[1])}}}"]
        if options.capsule != "-".join(pair):
            config.append(f"learning={{experiments: {{{CAPSULE}: null}}}}")
        scores = Path("results", name, "learning", "scores.csv")
        how = "--cores", str(options.cores), str(scores), "--configfile", *CONFIGS, "--config", *config
        subprocess.run(["snakemake", *how], cwd=ROOT, check=True)
        of_pair = select(read_learned(ROOT / scores), **CASE)
        of_pair.insert(0, "drone", pair[0])
        of_pair.insert(1, "missile", pair[1])
        tables.append(of_pair.drop(columns=["snr_definition", "fold"]))
    pd.concat(tables).to_csv(Path(__file__).with_name("models.csv.xz"), index=False, float_format="%.6g")


def target(name):
    return f"{{field: resources/fields/{name}.zarr, symmetry: [xz]}}"


if __name__ == "__main__":
    main()
