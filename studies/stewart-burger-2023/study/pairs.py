"""Committed scores of other runs: with other models of the known targets (models.csv.xz, `make models`), and of the
capsule network while it learns, by several readings (capsule_training.csv, `make bench-training`).
"""

from functools import cache
from types import SimpleNamespace

import pandas as pd

from isarflow.report.results import FULL_SIZE, read_learned
from isarflow.report.vocabulary import select


@cache
def _scores():
    return read_learned(FULL_SIZE / "models.csv.xz")


def every():
    """Return the drone and the missile of each run, as tuples."""
    return list(_scores()[["drone", "missile"]].drop_duplicates().itertuples(index=False, name=None))


@cache
def results(drone, missile):
    """Return what `statements.read` takes from `Results`, of the run with these known targets."""
    table = select(_scores(), drone=drone, missile=missile)
    models = table.groupby(["experiment", "split"])["model"].unique()
    runs = {name: {"experiment": name, "split": split, "models": own} for (name, split), own in models.items()}
    settings = {"noise": {"snr_db": sorted(set(table["test_snr_db"]))}}
    return SimpleNamespace(mean_scores=table, runs=runs, curves={}, settings=settings)


@cache
def _trainings():
    return pd.read_csv(FULL_SIZE / "capsule_training.csv")


def trained(reading, epoch, column, snr_db):
    """Return what a capsule network has by a reading after some epochs, as of `value_at`, without interval."""
    return {"ours": select(_trainings(), reading=reading, epoch=epoch, snr_db=snr_db)[column].iloc[0]}
