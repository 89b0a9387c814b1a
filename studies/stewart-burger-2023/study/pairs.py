"""Scores of runs with other models of the known targets: resources/results/models.csv.xz, of models.py beside it."""

from functools import cache
from types import SimpleNamespace

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
