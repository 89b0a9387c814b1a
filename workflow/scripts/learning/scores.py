"""Tidy tables of scores, of confusion counts and of what was reached on validation images, from all predictions."""

from pathlib import Path

import numpy as np
import pandas as pd
from tqdm import tqdm

from core.sweep import snr_of_label
from learning import thresholds
from learning.classifier import OTHER
from learning.experiments import REFERENCE, train_snr_db, training
from learning.images import among
from learning.metrics import confusion, figures, figures_of, interval, resampled, separation, weights
from learning.predict import KNOWN

RUN = ["experiment", "model", "split", "training", "train_snr_db", "test_snr_db", "elevation", "score", "threshold"]
COLUMNS = [*RUN, "metric", "value", "low", "high", "n"]
CONFUSION = [*RUN, "target", "predicted", "count"]
VALIDATION = [*RUN, "metric", "value", "n"]
CLOSED = ["", ""]  # score and threshold of a closed set


def score(predictions, runs, seed, scores, confusions, validation):
    """Write scores.csv, confusion.csv and validation.csv from prediction tables <run>/<model>/snr_<n>dB.csv.

    runs: what `experiments.runs` gives; seed: the config's, for the intervals.
    Column `training` says in words what SNRs a run trained at and tells an experiment's runs apart; `train_snr_db` is a
    number, empty for training without noise and at several SNRs.
    Column `elevation`: 'all' counts every test image; 'trained' only those at elevations the model was trained at (left
    out where that is all of them).
    Columns `score` and `threshold` are empty for the closed set, the known targets alone. An open run has rows besides
    for every known score: with its name as `score` and no threshold auroc, fpr95 and oscr; with the protocol that chose
    the threshold as `threshold` the figures of the open set, where truth is the class or OTHER, and the threshold.
    f1_weighted_gain is how much more the weighted F1 is than that of REFERENCE on the same test images with a threshold
    of the same protocol, its interval from the same resamples; without an open run of REFERENCE there is none, and
    of several the first by name counts.
    validation.csv is for comparing methods: of the closed set accuracy and weighted F1 at the validation azimuths, and
    of each known score and protocol the weighted F1 that the threshold reaches on the images it was chosen with.
    n is the number of images that a figure rests on.
    """
    rows, cells, reached, drawn = [], [], [], {}
    order = sorted(map(Path, predictions), key=lambda path: (path.parts[-3], path.parts[-2], snr_of_label(path.stem)))
    for path in tqdm(order, unit="table", desc="scores", leave=False):
        run, model = runs[path.parts[-3]], path.parts[-2]
        table = pd.read_csv(path, keep_default_na=False)  # a target may be called NA
        head = [run["experiment"], model, run["split"], training(run), train_snr_db(run), snr_of_label(path.stem)]
        for subset, part in _subsets(table, run["elevation"]):
            reached += [[*head, subset, *line] for line in _validated(part, run["open"])]
            found = [_closed(part, seed)]
            if run["open"]:
                found += _opened(part, seed)
            for kind, metrics, counts, draws in found:
                rows += [[*head, subset, *kind, name, *values] for name, values in metrics.items()]
                cells += [[*head, subset, *kind, *names, count] for names, count in counts.items()]
                if kind[1] and subset == "all":  # runs trained at other elevations have other images there
                    drawn[*head, subset, *kind] = metrics["f1_weighted"], draws
    rows += _gains(drawn)
    pd.DataFrame(rows, columns=COLUMNS).to_csv(scores, index=False)
    pd.DataFrame(cells, columns=CONFUSION).to_csv(confusions, index=False)
    pd.DataFrame(reached, columns=VALIDATION).to_csv(validation, index=False)
    print(f"{len(order)} prediction tables, {len(rows)} scores")
    for name in sorted({run["experiment"] for run in runs.values() if run["lacks_unknown"]}):
        print(
            f"Warning: experiment '{name}' is open, but no target has role unknown: these are scores of a closed set."
        )


def _gains(drawn):
    """Rows f1_weighted_gain, of the figures and draws of weighted F1 by what stands in the columns RUN."""
    known = {}
    for key, figure in drawn.items():
        _, model, split, trained, _, *rest, score, protocol = key
        if (model, trained, score) == REFERENCE:
            known.setdefault((split, *rest, protocol), figure)
    rows = []
    for key, ((value, *_, count), draws) in drawn.items():
        _, _, split, _, _, *rest, _, protocol = key
        (reference, *_), reference_draws = known.get((split, *rest, protocol), ((None,), None))
        if reference is not None:
            rows.append([*key, "f1_weighted_gain", value - reference, *interval(draws - reference_draws), count])
    return rows


def _subsets(table, trained):
    """(name, rows) of each subset of elevations."""
    yield "all", table
    rows = trained == "all" or among(table["elevation"], trained)
    if not np.all(rows):
        yield "trained", table[rows]


def _validated(table, is_open):
    """The rows of validation.csv for a table, from the column `score` on."""
    rows = table[(table["side"] == "validation") & (table["role"] == "known")]
    closed = figures_of(rows["truth"], rows["predicted"])
    found = [[*CLOSED, metric, closed[metric], len(rows)] for metric in ("accuracy", "f1_weighted")]
    for column in _known_scores(table) if is_open else ():
        for protocol in thresholds.ROLES:
            threshold = thresholds.choose(table, column, protocol)
            f1, count = thresholds.reached(table, column, protocol, threshold)
            found.append([column.removeprefix(KNOWN), protocol, "f1_weighted", f1, count])
    return found


def _known_scores(table):
    return [name for name in table if name.startswith(KNOWN)]


def _closed(table, seed):
    test = table[(table["side"] == "test") & (table["role"] == "known")]
    return CLOSED, *_judged(test, test["predicted"].to_numpy(), seed)


def _opened(table, seed):
    """What an open run's table gives for each known score, in the form of `_closed`."""
    test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
    known, right = (test["role"] == "known").to_numpy(), (test["truth"] == test["predicted"]).to_numpy()
    azimuths, groups = np.unique(test["azimuth"], return_inverse=True)
    draws = np.concatenate([np.ones((1, len(azimuths))), weights(len(azimuths), seed)])
    found = []
    for column in _known_scores(table):
        name, values = column.removeprefix(KNOWN), test[column].to_numpy(float)
        metrics = {
            metric: (drawn[0], *interval(drawn[1:]), len(test))
            for metric, drawn in separation(values, known, right, groups, draws).items()
        }
        found.append(([name, ""], metrics, {}, None))
        for protocol in thresholds.ROLES:
            threshold = thresholds.choose(table, column, protocol)
            predicted = thresholds.apply(values, test["predicted"], threshold)
            metrics, *others = _judged(test, predicted, seed)
            metrics["threshold"] = (threshold, np.nan, np.nan, len(test))
            found.append(([name, protocol], metrics, *others))
    return found


def _judged(test, predicted, seed):
    """Of predictions for rows of a table: figures, each (value, low, high, n), counts by (target, predicted), and the
    weighted F1 in each resample.
    """
    labels = np.array(
        sorted({*test["truth"].unique(), *pd.unique(predicted)}, key=lambda label: (label == OTHER, label))
    )
    codes = [pd.Categorical(values, categories=labels).codes.astype(int) for values in (test["truth"], predicted)]
    azimuths, groups = np.unique(test["azimuth"], return_inverse=True)
    counts = confusion(groups, *codes, (len(azimuths), len(labels)))
    total = counts.sum(axis=0)
    targets, owners = np.unique(test["target"], return_inverse=True)
    by_target = confusion(owners, *codes, (len(targets), len(labels))).sum(axis=1)
    # In the closed set OTHER may be predicted, and is then wrong, but never true.
    judged = labels if OTHER in set(test["truth"]) else labels[labels != OTHER]
    draws = resampled(counts, labels, judged, seed)
    metrics = {
        name: (value, *interval(draws[name]), total.sum()) for name, value in figures(total, labels, judged).items()
    }
    cells = {(targets[i], labels[j]): count for (i, j), count in np.ndenumerate(by_target)}
    return metrics, cells, draws["f1_weighted"]
