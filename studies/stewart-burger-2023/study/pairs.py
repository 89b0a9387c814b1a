"""Committed scores of other runs: with other models of the known targets (models.csv.xz, `make models`), and of the
capsule network while it learns, by several readings (capsule_training.csv, `make bench-training`).
"""

from functools import cache
from types import SimpleNamespace

import pandas as pd

from isarflow.core.folders import ROOT
from isarflow.report.results import read_learned
from isarflow.report.vocabulary import select

FULL_SIZE = ROOT / "resources" / "results"
SCORES = read_learned(FULL_SIZE / "models.csv.xz")
EVERY = SCORES[["drone", "missile"]].drop_duplicates().to_dict("records")  # the known targets of each run
TRAININGS = pd.read_csv(FULL_SIZE / "capsule_training.csv")


@cache
def results(drone, missile):
    """Return what `statements.read` takes from `Results`, of the run with these known targets."""
    table = select(SCORES, drone=drone, missile=missile)
    models = table.groupby(["experiment", "split"])["model"].unique()
    runs = {name: {"experiment": name, "split": split, "models": own} for (name, split), own in models.items()}
    settings = {"noise": {"snr_db": sorted(set(table["test_snr_db"]))}}
    return SimpleNamespace(mean_scores=table, runs=runs, curves={}, settings=settings)
