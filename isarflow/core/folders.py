"""Folders of the repository, and of the results of a run."""

from pathlib import Path

SCORES = "learning/scores.csv"
RECORD = "learning/scores.json"  # the settings and prediction tables that the scores are made of
PACKAGE = Path(__file__).resolve().parents[1]
# The repository that the package is in; none of an installed one.
ROOT = PACKAGE.parent if (PACKAGE.parent / "config/schema.yaml").exists() else Path()


def run_and_model(path):
    """The names of the run and the model that made a file <run>/<model>/<file>."""
    return Path(path).parts[-3:-1]


def of_fields(results, config):
    """The folder with the meshes and fields of a run.

    results: the run's own folder, which has them unless the config takes them `from` another run.
    """
    return Path(results).parent / config["from"] if "from" in config else Path(results)
