"""A finished run's leaderboard, and anybody's predictions scored as the run's own models were.

    python -m isarflow.learning.evaluation.leaderboard results/<name> <experiment> mine.csv

A table of predictions has a row for each image that the experiment validates or tests (see `images`), with columns KEY,
`predicted`, a class or 'other', and, to be scored in the open set, `confidence`, larger for images of known classes.
Images, folds, seed and settings follow from the run's record, whatever else its folder holds. docs/benchmark.md goes
through it.
"""

import argparse
import json
import sys
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.folders import SCORES, run_and_model
from isarflow.core.store import open_store
from isarflow.core.sweep import snr_label, snr_of_label
from isarflow.learning.classifier import OTHER, SPLIT, config_of
from isarflow.learning.data.images import ORIGIN, among
from isarflow.learning.data.split import LEFT_OUT
from isarflow.learning.evaluation import judge, record
from isarflow.learning.experiments import CLEAN, is_by_family
from isarflow.learning.tables import KNOWN, read_table

KEY = ["test_snr_db", "fold", "target", "elevation", "azimuth", "realization"]
OURS = ["truth", "role", "side", "block"]  # what the protocol adds to an image
SCORE = "confidence"
COLUMNS = ["test_snr_db", "score", "threshold", "fold", "metric", "value", "low", "high", "n"]
NUMBERS = [name for name in (*KEY, SCORE) if name != "target"]
METHOD = ["experiment", "split", "training", "test_snr_db", "model"]
VALUES = ["value", "low", "high"]
# Columns of a leaderboard: threshold and metric of learning/scores.csv. All but the first are of the open set.
BOARD = {
    "accuracy": ("", "accuracy"),
    "f1_weighted_blind": ("blind", "f1_weighted"),
    "f1_weighted_kept": ("kept", "f1_weighted"),
    "auroc": ("", "auroc"),
    "fpr95": ("", "fpr95"),
    "oscr": ("", "oscr"),
    "f1_mix": ("mix", "f1_mix"),
    "f1_balanced": ("blind", "f1_balanced"),
}
RANK = "f1_weighted_blind"
LEADERBOARD = "learning/leaderboard.csv"


def images(results: str | Path, experiment: str, snrs: Iterable[float] | None = None) -> pd.DataFrame:
    """Return the images that an experiment of a finished run validates and tests: columns KEY and OURS.

    results: the run's folder, results/<name>; snrs: in dB, all by default. Thresholds are chosen on the images whose
    `side` is validation, by the blind protocol on those whose `role` is known or other; `role` unknown is never trained
    on. Raises InputError for a folder without predictions of such an experiment at these SNRs.
    """
    paths = _tables(results, experiment)
    known = {snr_of_label(path.stem) for path in paths}
    wanted = known if snrs is None else {*snrs}
    if strange := sorted(wanted - known):
        unknown, possible = (", ".join(f"{snr:g}" for snr in snrs_in_db) for snrs_in_db in (strange, sorted(known)))
        raise InputError(f"{results} has no predictions at {unknown} dB, but at {possible} dB.")
    tables = []
    for path in paths:
        snr = snr_of_label(path.stem)
        if snr in wanted:
            table = read_table(path).assign(test_snr_db=snr)
            tables.append(table.loc[table["side"] != LEFT_OUT, [*KEY, *OURS]])
    return pd.concat(tables, ignore_index=True).drop_duplicates(KEY, ignore_index=True)


def _tables(results: str | Path, experiment: str) -> list[Path]:
    """The prediction tables of one model of each of an experiment's runs, sorted paths."""
    finished, models = record.read(results), dict[str, str]()
    for run, model, _ in (table.split("/") for table in finished.tables):
        if finished.runs[run]["experiment"] == experiment:
            models.setdefault(run, model)
    if not models:
        experiments = sorted({run["experiment"] for run in finished.runs.values()})
        lacking = f"has no predictions of an experiment '{experiment}', but of {', '.join(experiments) or 'none'}"
        raise InputError(f"{results} {lacking}.")
    wanted = {*models.items()}
    return record.paths(results, finished, sorted(table for table in finished.tables if run_and_model(table) in wanted))


def training(results: str | Path, experiment: str) -> pd.DataFrame:
    """Return the views that an experiment trains on: columns fold, target, elevation, azimuth and truth, the class.

    By family those of role other are among them, with the class 'other'. Raises InputError as `images` does.
    """
    finished, held_out, parts = record.read(results), images(results, experiment), []
    held_out = held_out.query("role == 'known' and side == 'validation'")
    classes = dict(zip(held_out["target"], held_out["truth"], strict=True))
    classes = finished.classes if _by_family(finished, experiment) else classes
    models = {Path(results, "learning/models", *run_and_model(path)) for path in _tables(results, experiment)}
    for model in sorted(models):
        split, trained = json.loads((model / SPLIT).read_text()), config_of(model)["run"]["elevation"]
        for target in sorted({*classes} & {*split["targets"]}):
            side = split["targets"][target]["train"]
            elevation = [angle for angle in side["elevation"] if trained == "all" or among([angle], trained)]
            views = pd.MultiIndex.from_product([elevation, side["azimuth"]], names=["elevation", "azimuth"])
            constants = {"fold": split["division"]["fold"], "target": target, "truth": classes[target]}
            parts.append(views.to_frame(index=False).assign(**constants))
    views = pd.concat(parts, ignore_index=True)[["fold", "target", "elevation", "azimuth", "truth"]]
    return views.drop_duplicates(ignore_index=True)  # runs that train at several SNRs train at the same views


def pixels(results: str | Path, table: pd.DataFrame, experiment: str | None = None) -> np.ndarray:
    """Return the images of rows of `images`, or of `training`, without noise: (n, [channel,] range, crossrange).

    They are complex, divided by their peak over all channels, and in the order of the rows. experiment: that of the
    rows, which a run with targets that move asks for, as the noisy images of its experiments differ. Raises InputError
    without it, and for one that the run does not have.
    """
    folder = _folder_of_noisy(results, experiment) if "test_snr_db" in table else "imaging"
    table = table.reset_index(drop=True)
    label = table["test_snr_db"].map(snr_label) if "test_snr_db" in table else pd.Series(CLEAN, table.index)
    image_of_row: dict[Any, np.ndarray] = {}
    for (target, name), rows in table.groupby([table["target"], label]):
        with open_store(Path(results, folder, target, f"{name}.zarr")) as dataset:
            where = {axis: xr.DataArray(rows[axis].to_numpy(), dims="view") for axis in ORIGIN if axis in dataset.dims}
            image = dataset["image"].load().sel(where, method="nearest").transpose("view", ...)
        image_of_row |= dict(zip(rows.index, image.values, strict=True))
    return np.stack([image_of_row[row] for row in table.index])


def _by_family(finished: record.Record, experiment: str) -> bool:
    return any(is_by_family(run) for run in finished.runs.values() if run["experiment"] == experiment)


def _folder_of_noisy(results: str | Path, experiment: str | None) -> str:
    """The folder of an experiment's images with noise; None for the only one of a run."""
    runs = record.read(results).runs.values()
    folders = {run["experiment"]: run.get("motion", {}).get("folder", "imaging") for run in runs}
    if experiment is None and len({*folders.values()}) == 1:
        return next(iter(folders.values()))
    every = ", ".join(sorted(folders))
    if experiment is None:
        raise InputError(f"{results}: its experiments differ in how targets move; name that of the images: {every}.")
    if experiment not in folders:
        raise InputError(f"{results} has no experiment '{experiment}', but {every}.")
    return folders[experiment]


def score(results: str | Path, experiment: str, predictions: pd.DataFrame | str | Path) -> pd.DataFrame:
    """Score a table of predictions as a finished run's own models were scored.

    Parameters:
        results: the run's folder, results/<name>
        experiment: of the run's config
        predictions: a DataFrame, or the path of a CSV file, with the columns of `benchmark.images` that name an image,
            `predicted`, and for the open set `confidence`; at each SNR that it has, a row for each of these images

    Returns:
        Rows of learning/scores.csv by SNR: COLUMNS. threshold is empty in the closed set; in the open set blind,
        thesis, kept or mix, and empty for AUROC, FPR and OSCR.

    Raises:
        InputError: for a folder without a finished run, an experiment that it does not have, and predictions that lack
            an image or a column, have a class that the experiment does not have, or a number that is not finite.

    Warns of rows that match no image, which are left out.

    Whoever takes every image for a dart, one of two targets with as many images each, is right in half of them:

    >>> asked = images("results/example", "multi", snrs=[0])
    >>> scores = score("results/example", "multi", asked.assign(predicted="dart"))
    >>> scores[scores["metric"] == "accuracy"]["value"].tolist()
    [0.5]
    """
    where = "the table" if isinstance(predictions, pd.DataFrame) else predictions
    finished, given = record.read(results), _checked(predictions, where)
    asked = images(results, experiment, sorted(given["test_snr_db"].unique()))
    classes = {*asked["truth"], OTHER}
    if strange := sorted({*given["predicted"].astype(str)} - classes):
        raise InputError(f"{where} has a class '{strange[0]}'; classes are {', '.join(sorted(classes))}.")
    given, asked = (table.assign(**_angles(table)) for table in (given, asked))
    if given.duplicated(KEY).any():
        raise InputError(f"{where} has an image twice: {_named(given[given.duplicated(KEY)])}.")
    table = asked.merge(given[[*KEY, "predicted", *({SCORE} & {*given})]], how="left", on=KEY)
    matched = given[KEY].merge(asked[KEY], how="left", on=KEY, indicator="sides")["sides"].eq("both").to_numpy()
    strays = f"{(~matched).sum():,} of its {len(given):,} rows match no image of '{experiment}'"
    strays = "" if matched.all() else f"{strays}; the first is {_named(given[~matched])}."
    if (lost := table["predicted"].isna()).any():
        lacking = f"{where} lacks {lost.sum():,} of {len(table):,} images; the first is {_named(table[lost])}."
        raise InputError(f"{lacking} {strays}".rstrip())
    if strays:
        warnings.warn(f"{where}: {strays} These rows are left out.", stacklevel=2)
    if SCORE in table and (table["role"] == "unknown").any():
        table = table.rename(columns={SCORE: KNOWN + SCORE}).astype({KNOWN + SCORE: float})
    rows, kinds = [], finished.kinds if _by_family(finished, experiment) else None
    for snr, part in table.groupby("test_snr_db"):
        for decision in judge.decide(part, finished.kept, kinds):
            rows += [(snr, decision.score, decision.threshold, *row) for row in judge.rows(decision, finished.seed)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _checked(predictions: pd.DataFrame | str | Path, where: str | Path) -> pd.DataFrame:
    """A table of predictions, a DataFrame or the path of a CSV file, whose columns of numbers hold finite numbers."""
    try:
        if isinstance(predictions, pd.DataFrame):
            table = predictions.reset_index(drop=True)
        else:
            table = pd.read_csv(predictions, keep_default_na=False)
    except (OSError, ValueError) as error:
        raise InputError(f"{where} cannot be read as a CSV file: {error}") from None
    needed = [*KEY, "predicted"]
    if lacking := [name for name in needed if name not in table]:
        raise InputError(f"{where} has no column {', '.join(lacking)}; it needs {', '.join(needed)}.")
    if table.empty:
        raise InputError(f"{where} has no row.")
    numbers = table[[name for name in NUMBERS if name in table]].apply(pd.to_numeric, errors="coerce")
    for name, wrong in (~np.isfinite(numbers)).items():
        if wrong.any():
            row = wrong.idxmax()
            raise InputError(f"{where}, image {row + 1}: {name} is '{table[name][row]}', which is no finite number.")
    return table.assign(**numbers)


def _angles(table: pd.DataFrame) -> dict[str, pd.Series]:
    """Elevation and azimuth of a table as they are compared: with few digits, and 0 to 360 degrees for -180 to 180."""
    angles = table[["elevation", "azimuth"]].astype(float).round(3)
    return {"elevation": angles["elevation"], "azimuth": angles["azimuth"] % 360}


def _named(table: pd.DataFrame) -> str:
    return ", ".join(f"{name} {value}" for name, value in table[KEY].iloc[0].items())


def leaderboard(scores: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each experiment, SNR, model and confidence score, the largest weighted F1 first.

    scores: rows of learning/scores.csv, of all elevations and by one definition of SNR. Columns: METHOD, score, n, the
    number of tested images, and the columns of BOARD, each with its 95 % interval, <name>_low and <name>_high.
    """
    scores = scores[scores["fold"].astype(str) == ""]
    board = _of_metric(scores[scores["score"] == ""], "accuracy").drop(columns=["score", "n"])
    opened = {name: _of_metric(scores[scores["score"] != ""], name) for name in list(BOARD)[1:]}
    for name, rows in opened.items():
        if name not in judge.MIXES or len(rows):  # which only experiments by family have
            board = board.merge(rows, how="left")
    board = board.sort_values(["experiment", "test_snr_db", RANK], ascending=[True, False, False], ignore_index=True)
    return board[[*METHOD, "score", "n", *(end for name in BOARD if name in board for end in _ends(name))]]


def _of_metric(scores: pd.DataFrame, name: str) -> pd.DataFrame:
    """The rows of a column of BOARD, its values and ends of intervals named so."""
    threshold, metric = BOARD[name]
    rows = scores[(scores["threshold"] == threshold) & (scores["metric"] == metric)]
    return rows[[*METHOD, "score", "n", *VALUES]].rename(columns=dict(zip(VALUES, _ends(name), strict=True)))


def _ends(name: str) -> tuple[str, str, str]:
    return name, f"{name}_low", f"{name}_high"


def write_leaderboard(scores: str | Path, definition: str, output: str | Path) -> None:
    """Write the `leaderboard` of a run. scores: its learning/scores.csv; definition: the config's of SNR."""
    leaderboard(_scores(scores, definition)).to_csv(output, index=False, float_format="%.4g")


def _scores(path: str | Path, definition: str) -> pd.DataFrame:
    """The rows of a run's learning/scores.csv that `leaderboard` takes."""
    # Only columns of numbers have empty cells; other ones have empty text.
    table = pd.read_csv(path, keep_default_na=False, na_values=dict.fromkeys(VALUES, ""))
    return table[(table["elevation"] == "all") & (table["snr_definition"] == definition)]


def in_words(board: pd.DataFrame) -> pd.DataFrame:
    """A leaderboard with text for each metric and its interval, as '0.93 (0.90-0.95)'; '' where there is none."""
    words = board[[*METHOD, "score"]].fillna("")
    for name in (column for column in BOARD if column in board):
        parts = [board[column].map("{:.2f}".format) for column in _ends(name)]
        text = parts[0] + " (" + parts[1] + "\N{EN DASH}" + parts[2] + ")"
        words[name] = text.where(board[name].notna(), "")
    return words


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("results", help="a finished run's folder, results/<name>")
    parser.add_argument("experiment", help="of its config")
    parser.add_argument("predictions", type=Path, help="a CSV file of a row for each image")
    options = parser.parse_args(arguments)
    try:
        with warnings.catch_warnings(record=True, action="always") as messages:
            table = score(options.results, options.experiment, options.predictions)
    except InputError as error:
        raise SystemExit(str(error)) from None
    for warning in messages:
        print(warning.message, file=sys.stderr)
    run_scores = _scores(Path(options.results, SCORES), record.read(options.results).definition)
    asked = (run_scores["experiment"] == options.experiment) & run_scores["test_snr_db"].isin(table["test_snr_db"])
    method = {"experiment": options.experiment, "split": "", "training": "", "model": options.predictions.stem}
    board = leaderboard(pd.concat([run_scores[asked], table.assign(**method)]))
    print(in_words(board).drop(columns=METHOD[:3]).to_string(index=False))


if __name__ == "__main__":
    main()
