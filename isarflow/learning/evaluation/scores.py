"""Tidy tables of scores, of confusion counts and of results on validation images, from all predictions."""

from pathlib import Path

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from tqdm import tqdm

from isarflow.core.folders import run_and_model
from isarflow.core.sweep import snr_of_label
from isarflow.learning.data.images import among
from isarflow.learning.data.split import LEFT_OUT
from isarflow.learning.evaluation import judge, metrics
from isarflow.learning.evaluation.looks import LOOKS, fused
from isarflow.learning.evaluation.metrics import KEPT_SHARE
from isarflow.learning.experiments import REFERENCE, is_by_family, split_of, train_snr_db, training
from isarflow.learning.tables import read_table

HEAD = ["experiment", "model", "split", "training", "train_snr_db"]
CASE = [*HEAD, "test_snr_db", "elevation", "score", "threshold"]
SCORED = [*CASE, "snr_definition", "fold", "metric"]
COLUMNS = [*SCORED, "value", "low", "high", "n"]
CONFUSION = [*CASE, "target", "predicted", "count"]
VALIDATION = [*CASE, "metric", "value", "n"]
OF_LOOKS = ("f1_weighted", "auroc", *judge.MIXES)  # metrics of several looks by family, of the open set
OF_CLOSED_LOOKS = ("accuracy", "f1_weighted")
NO_SHARES = ("threshold", "f1_weighted_gain")  # metrics that may lie outside 0 to 1


def score(
    predictions,
    runs,
    definition,
    seed,
    threads,
    scores,
    confusions,
    validation,
    kept_share=KEPT_SHARE,
    track=None,
    kinds=None,
):
    """Write scores.csv, confusion.csv and validation.csv from prediction tables <run>/<model>/snr_<n>dB.csv.

    runs: the result of `experiments.runs`; definition: the config's of SNR; seed: the config's, for the intervals;
    threads: number of models judged at a time; kept_share: the config's `learning.kept`. track: None, or names of the
    models whose scores add up over looks, and the azimuth's step in degrees and the aperture, as of `looks.fused`.
    docs/method.md describes the metrics and columns. Besides: `elevation` is never 'trained' if the model was trained
    at all elevations. The images of each fold are judged by its own models; the threshold of all folds is their mean.
    By the other definition than the config's only SNRs are listed at which all images have some. f1_weighted_gain is
    left out where REFERENCE was not trained at the same SNRs, without the same targets; of several the first by name
    counts.
    f1_weighted_<n>_looks has an interval by family alone, as else few tracks are independent. validation.csv has of
    each confidence score and protocol the weighted F1 that the threshold reaches on the images it was chosen with.
    """
    tables, opened, cases = ([], [], []), [], tables_of_cases(predictions, runs)
    work = (delayed(_judged)(head, *case, definition, seed, kept_share, track, kinds) for head, case in cases.items())
    judged = Parallel(n_jobs=threads, return_as="generator")(work)
    for *of_case, decisions in tqdm(judged, total=len(cases), unit="model", desc="scores", leave=False):
        for table, rows in zip(tables, of_case, strict=True):
            table += rows
        opened += decisions
    tables[0].extend(_gains(opened, definition, seed))
    written = zip((scores, confusions, validation), tables, (COLUMNS, CONFUSION, VALIDATION), strict=True)
    for path, rows, columns in written:
        pd.DataFrame(rows, columns=columns).to_csv(path, index=False)
    print(f"{len(predictions)} prediction tables, {len(tables[0])} scores")


def _judged(head, run, tables, definition, seed, kept_share, track, kinds):
    """Rows of the three tables for one model, and the open set's `Decision`s as `_gains` takes them."""
    rows, cells, reached, opened = [], [], [], []
    table_by_snr = {snr: pd.concat(map(read_table, paths), ignore_index=True) for snr, paths in sorted(tables.items())}
    for subset, parts in _subsets(table_by_snr, run["elevation"]):
        kinds = kinds if is_by_family(run) else None
        decided = {snr: judge.decide(part, kept_share, kinds) for snr, part in parts.items()}
        for snr, decisions in decided.items():
            for decision in decisions:
                key = (*head, snr, subset, decision.score, decision.threshold)
                rows += [[*key, definition, *row] for row in judge.rows(decision, seed)]
                cells += [[*key, *cell] for cell in judge.cells(decision)]
                reached += [[*key, *row] for row in decision.validation]
                if decision.threshold and subset == "all":  # runs that trained at other elevations have other images
                    opened.append((key, (*head[2:4], snr, decision.threshold, *run["without"]), decision))
        for snr, part in parts.items() if track and head[1] in track[0] else ():
            for kind, row in _looks(part, kept_share, kinds, seed, *track[1:]):
                rows.append([*head, snr, subset, *kind, definition, "", *row])
        for definition_of_row, snr, kind, row in judge.by_other_definitions(decided, definition, seed):
            rows.append([*head, snr, subset, *kind, definition_of_row, "", *row])
    return rows, cells, reached, opened


def _looks(table, kept_share, kinds, seed, step, aperture):
    """(score, threshold) and (metric, value, low, high, n) of the weighted F1 of several looks together.

    By family, where blocks are models and so have intervals, of OF_LOOKS and, of the closed set, OF_CLOSED_LOOKS.
    """
    table = table[table["side"] != LEFT_OUT]
    for count in LOOKS:
        together = fused(table, count, step, aperture)
        known = together[together["role"] == "known"]
        if known.groupby("fold")["side"].nunique().reindex(table["fold"].unique()).eq(2).all():  # chosen on some, too
            for decision in judge.decide(together, kept_share, kinds):
                if kinds is not None:
                    for fold, metric, *row in judge.rows(decision, seed):
                        if not fold and metric in (OF_LOOKS if decision.score else OF_CLOSED_LOOKS):
                            yield (decision.score, decision.threshold), (f"{metric}_{count}_looks", *row)
                elif decision.is_final:
                    f1 = metrics.metrics_of_labels(decision.test["truth"], decision.predicted)["f1_weighted"]
                    row = f"f1_weighted_{count}_looks", f1, "", "", len(decision.test)
                    yield (decision.score, decision.threshold), row


def tables_of_cases(predictions, runs):
    """Map the values of the columns HEAD to one of its runs and, by SNR in dB, its tables' paths in order of folds."""
    cases = {}
    for path in sorted(map(Path, predictions), key=run_and_model):
        name, model = run_and_model(path)
        run, snr = runs[name], train_snr_db(runs[name])
        head = (run["experiment"], model, split_of(run), training(run), "" if pd.isna(snr) else snr)
        _, tables = cases.setdefault(head, (run, {}))
        tables.setdefault(snr_of_label(path.stem), []).append(path)
    return cases


def _subsets(tables, trained):
    """(name, tables by SNR) of each subset of elevations."""
    yield "all", tables
    if trained != "all":
        parts = {snr: table[among(table["elevation"], trained)] for snr, table in tables.items()}
        if any(len(part) < len(tables[snr]) for snr, part in parts.items()):
            yield "trained", parts


def _gains(opened, definition, seed):
    """Rows f1_weighted_gain. opened: values of the columns CASE, what compared methods share, and the `Decision`."""
    rows, references = [], {}
    for key, shared, decision in opened:
        if (key[CASE.index("model")], decision.score) == (REFERENCE[0], REFERENCE[2]):
            references.setdefault(shared, decision)
    for key, shared, decision in opened:
        if shared in references and (gain := judge.gain(decision, references[shared], seed)):
            rows.append([*key, definition, "", "f1_weighted_gain", *gain])
    return rows


def over_seeds(scores, output):
    """Write the means over several seeds' tables scores.csv: one row for each of their rows.

    Columns: as in scores.csv, with value the mean, low and high its 95 % interval over seeds, n their number, and
    lowest and highest of them. A seed without such a row is left out of it.
    """
    tables = [pd.read_csv(path, keep_default_na=False) for path in scores]
    rows = pd.concat(tables, ignore_index=True)
    rows["value"] = pd.to_numeric(rows["value"])
    values = rows.groupby(SCORED, sort=False)["value"].agg(["mean", "std", "count", "min", "max"]).reset_index()
    error, is_share = values["std"] / np.sqrt(values["count"]), ~values["metric"].isin(NO_SHARES)
    low, high = metrics.around(values["mean"], error, values["count"] - 1, is_share)  # NaN for a single value
    means = values[SCORED].assign(value=values["mean"], low=low, high=high, n=values["count"])
    means.assign(lowest=values["min"], highest=values["max"]).to_csv(output, index=False)
    print(f"{len(means)} scores over {len(tables)} seeds")
