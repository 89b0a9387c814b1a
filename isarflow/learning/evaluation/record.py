"""The record of a finished run, scores.json: the settings and the prediction tables that its scores are made of.

A run's folder may hold tables of an earlier config, too. Whoever judges a run anew takes the tables of its record.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from isarflow.core.errors import InputError
from isarflow.core.folders import RECORD, run_and_model
from isarflow.learning.classifier import config_of


class Record(NamedTuple):
    """The settings that a run's scores follow from, and the tables that were judged by them."""

    seed: int  # the config's, for the intervals
    kept: float  # the config's `learning.kept`
    definition: str  # the config's, of SNR
    runs: dict  # by name: what `experiments.LEARNED` names of each of the config's runs
    tables: list  # <run>/<model>/<label of the SNR>
    kinds: Mapping = {}  # of each target by name, where an experiment is by family
    classes: Mapping = {}  # likewise: its class, or 'other'


def write(path, settings, predictions):
    """Write a run's record. settings: the params of its scores; predictions: the paths of the tables judged by them."""
    tables = ["/".join((*run_and_model(table), Path(table).stem)) for table in predictions]
    values = settings["seed"], settings["learning.kept"], settings["noise.definition"], settings["runs"]
    Path(path).write_text(
        json.dumps(Record(*values, tables, settings["kinds"], settings["classes"])._asdict(), indent=1) + "\n"
    )


def read(results):
    """Return the Record of a finished run. results: the run's folder, results/<name>.

    Raises InputError for a folder without one.
    """
    path = Path(results, RECORD)
    if not Path(results).is_dir():
        raise InputError(f"{results} is no folder.")
    if not path.is_file():
        raise InputError(f"{path} is missing, which says how the run was scored; finish the run, with its own config.")
    try:
        return Record(**json.loads(path.read_text()))
    except (TypeError, ValueError) as error:
        why = f"it is not what a run of this version writes ({error})"
        raise InputError(f"{path}: {why}. Delete it and finish the run, with its own config.") from None


def paths(results, record, tables):
    """Return the paths of some tables of a run's Record.

    Raises InputError for a table that is missing, and for one whose model is of another config than the record.
    """
    table_paths, remedy = [Path(results, "learning/predictions", f"{table}.csv") for table in tables], "finish the run"
    for path in table_paths:
        run, model = run_and_model(path)
        if not path.is_file():
            raise InputError(f"{path} is missing, of which the run's scores were made; {remedy}, with its own config.")
        if config_of(folder := Path(results, "learning/models", run, model))["run"] != record.runs[run]:
            raise InputError(f"{folder} is of another config than {Path(results, RECORD)}; {remedy}, with one of them.")
    return table_paths
