"""Score anybody's predictions by a run's protocol: its images, sides, folds, thresholds, metrics and intervals.

    python -m isarflow.learning.benchmark results/<name> <experiment> mine.csv

A table of predictions has a row for each image that the experiment validates or tests (see `images`), with columns KEY,
`predicted`, a class or 'other', and, to be scored in the open set, `confidence`, larger for images of known classes.
"""

import argparse
from pathlib import Path

import pandas as pd

from isarflow.core.errors import InputError
from isarflow.core.sweep import snr_label, snr_of_label
from isarflow.learning import judge
from isarflow.learning.metrics import KEPT
from isarflow.learning.model_folder import config_of
from isarflow.learning.predict import KNOWN
from isarflow.learning.scores import read_table
from isarflow.learning.split import LEFT_OUT

KEY = ["test_snr_db", "fold", "target", "elevation", "azimuth", "realization"]
OURS = ["truth", "role", "side", "block"]  # what the protocol adds to an image
SCORE = "confidence"
COLUMNS = ["test_snr_db", "threshold", "fold", "metric", "value", "low", "high", "n"]


def images(results, experiment, snrs=None):
    """Return the images that an experiment of a finished run validates and tests: columns KEY and OURS.

    results: the run's folder, results/<name>; snrs: in dB, all by default. Thresholds are chosen on the images whose
    `side` is validation, by the blind protocol on those whose `role` is known or other; `role` unknown is never trained
    on. Raises InputError for a folder without predictions of such an experiment.
    """
    folds, learning = {}, Path(results, "learning")
    for path in sorted(learning.glob("models/*/*/config.json")):
        run = config_of(path.parent)["run"]
        if run["experiment"] == experiment:
            folds.setdefault(run["name"], learning / "predictions" / run["name"] / path.parent.name)
    tables = []
    for folder in folds.values():
        paths = folder.glob("*.csv") if snrs is None else [folder / f"{snr_label(snr)}.csv" for snr in snrs]
        for path in sorted(path for path in paths if path.exists()):
            table = read_table(path).assign(test_snr_db=snr_of_label(path.stem))
            tables.append(table.loc[table["side"] != LEFT_OUT, [*KEY, *OURS]])
    if not tables:
        raise InputError(f"{results}: no predictions of an experiment '{experiment}'; make its report first.")
    return pd.concat(tables, ignore_index=True).drop_duplicates(KEY, ignore_index=True)


def score(results, experiment, predictions, seed=0, kept=KEPT):
    """Return the scores of a table of predictions, by SNR: rows of COLUMNS, as in learning/scores.csv.

    predictions: a DataFrame, or the path of a CSV file. At each SNR that it has it must have all images of the
    experiment. threshold is empty in the closed set; in the open set blind, thesis or kept, and empty for AUROC, FPR
    and OSCR. seed, kept: the config's `seed` and `learning.kept`. Raises InputError for what cannot be scored.
    """
    where = "the table" if isinstance(predictions, pd.DataFrame) else predictions
    mine = predictions if isinstance(predictions, pd.DataFrame) else pd.read_csv(predictions, keep_default_na=False)
    lacking = [name for name in (*KEY, "predicted") if name not in mine]
    if lacking:
        raise InputError(f"{where} has no column {', '.join(lacking)}; it needs {', '.join((*KEY, 'predicted'))}.")
    every = images(results, experiment, sorted(mine["test_snr_db"].unique()))
    # Angles may have been written with fewer digits.
    mine, every = (table.assign(**table[["elevation", "azimuth"]].astype(float).round(3)) for table in (mine, every))
    if mine.duplicated(KEY).any():
        raise InputError(f"{where} has an image twice: {_named(mine[mine.duplicated(KEY)])}.")
    table = every.merge(mine[[*KEY, "predicted", *({SCORE} & {*mine})]], how="left", on=KEY)
    if (missing := table["predicted"].isna()).any():
        raise InputError(
            f"{where} lacks {missing.sum():,} of {len(table):,} images; the first is {_named(table[missing])}."
        )
    if SCORE in table:
        table = table.rename(columns={SCORE: KNOWN + SCORE}).astype({KNOWN + SCORE: float})
    rows = []
    for snr, part in table.groupby("test_snr_db"):
        is_open = SCORE in mine and (part["role"] == "unknown").any()
        for decision in judge.decide(part, is_open, kept):
            rows += [(snr, decision.threshold, *row) for row in judge.rows(decision, seed)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _named(table):
    return ", ".join(f"{name} {value}" for name, value in table[KEY].iloc[0].items())


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", help="a finished run's folder, results/<name>")
    parser.add_argument("experiment", help="of its config")
    parser.add_argument("predictions", type=Path, help="a CSV file of a row for each image")
    options = parser.parse_args(arguments)
    try:
        table = score(options.results, options.experiment, options.predictions)
    except InputError as error:
        raise SystemExit(str(error)) from None
    shown = table[(table["fold"] == "") & table["metric"].isin(["accuracy", "f1_weighted", "auroc"])]
    print(shown.drop(columns="fold").to_string(index=False, float_format="%.3f"))


if __name__ == "__main__":
    main()
