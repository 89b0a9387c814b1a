"""Tidy tables of scores, of confusion counts and of what was reached on validation images, from all predictions."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from tqdm import tqdm

from core.sweep import snr_of_label
from learning import thresholds
from learning.classifier import OTHER
from learning.experiments import REFERENCE, train_snr_db, training
from learning.images import among
from learning.metrics import confusion, interval, metrics_of, metrics_of_labels, resampled, separation, weights
from learning.predict import KNOWN

RUN = ["experiment", "model", "split", "training", "train_snr_db", "test_snr_db", "elevation", "score", "threshold"]
COLUMNS = [*RUN, "metric", "value", "low", "high", "n"]
CONFUSION = [*RUN, "target", "predicted", "count"]
VALIDATION = [*RUN, "metric", "value", "n"]


def score(predictions, runs, seed, scores, confusions, validation):
    """Write scores.csv, confusion.csv and validation.csv from prediction tables <run>/<model>/snr_<n>dB.csv.

    runs: what `experiments.runs` gives; seed: the config's, for the intervals.
    Column `training` says in words what SNRs a run trained at and tells an experiment's runs apart; `train_snr_db` is a
    number, empty for training without noise and at several SNRs.
    Column `elevation`: 'all' counts every test image; 'trained' only those at elevations the model was trained at (left
    out where that is all of them).
    Columns `score` and `threshold` are empty for the closed set, the known targets alone. An open run has rows besides
    for every confidence score, whose name is the `score`: without a threshold auroc, fpr95 and oscr; with `threshold`,
    the protocol that chose it, the metrics of the open set, where truth is the class or OTHER, and the threshold.
    f1_weighted_gain is how much more the weighted F1 is than that of REFERENCE on the same test images with a threshold
    of the same protocol, its interval from the same resamples; without an open run of REFERENCE there is none, and
    of several the first by name counts.
    validation.csv is for comparing methods: of the closed set accuracy and weighted F1 at the validation azimuths, and
    of each confidence score and protocol the weighted F1 that the threshold reaches on the images it was chosen with.
    n is the number of images that a value rests on.
    """
    rows, cells, reached, resamples = [], [], [], {}
    order = sorted(map(Path, predictions), key=lambda path: (path.parts[-3], path.parts[-2], snr_of_label(path.stem)))
    for path in tqdm(order, unit="table", desc="scores", leave=False):
        run, model = runs[path.parts[-3]], path.parts[-2]
        table = pd.read_csv(path, keep_default_na=False)  # a target may be called NA
        head = [run["experiment"], model, run["split"], training(run), train_snr_db(run), snr_of_label(path.stem)]
        for subset, part in _subsets(table, run["elevation"]):
            for judged in [_closed(part, seed), *(_opened(part, seed) if run["open"] else ())]:
                key = (*head, subset, judged.score, judged.threshold)
                rows += [[*key, name, *estimate, judged.images] for name, estimate in judged.metrics.items()]
                cells += [[*key, *names, count] for names, count in judged.counts.items()]
                reached += [[*key, *reached_here] for reached_here in judged.validation]
                if judged.threshold and subset == "all":  # runs trained at other elevations have other images there
                    resamples[key] = judged
    rows += _gains(resamples)
    pd.DataFrame(rows, columns=COLUMNS).to_csv(scores, index=False)
    pd.DataFrame(cells, columns=CONFUSION).to_csv(confusions, index=False)
    pd.DataFrame(reached, columns=VALIDATION).to_csv(validation, index=False)
    print(f"{len(order)} prediction tables, {len(rows)} scores")
    for name in sorted({run["experiment"] for run in runs.values() if run["lacks_unknown"]}):
        print(
            f"Warning: experiment '{name}' is open, but no target has role unknown: these are scores of a closed set."
        )


class Judged(NamedTuple):
    """A prediction table judged in one way.

    score, threshold: what stands in these columns. metrics: a mapping of name to (value, low, high) on so many test
    `images`. counts: a mapping of (target, predicted) to the number of test images. f1_weighted: that metric in each
    bootstrap resample. validation: (metric, value, number of images) at the validation azimuths.
    """

    score: str
    threshold: str
    images: int
    metrics: dict
    counts: dict
    f1_weighted: np.ndarray | None = None
    validation: tuple = ()


def _gains(opened):
    """Rows f1_weighted_gain. opened: a mapping of what stands in the columns RUN to what was `Judged` with it."""
    references = {}
    for key, judged in opened.items():
        _, model, split, trained, _, *rest, score, protocol = key
        if (model, trained, score) == REFERENCE:
            references.setdefault((split, *rest, protocol), judged)
    rows = []
    for key, judged in opened.items():
        _, _, split, _, _, *rest, _, protocol = key
        if reference := references.get((split, *rest, protocol)):
            gain = judged.metrics["f1_weighted"][0] - reference.metrics["f1_weighted"][0]
            low_high = interval(judged.f1_weighted - reference.f1_weighted)
            rows.append([*key, "f1_weighted_gain", gain, *low_high, judged.images])
    return rows


def _subsets(table, trained):
    """(name, rows) of each subset of elevations."""
    yield "all", table
    rows = trained == "all" or among(table["elevation"], trained)
    if not np.all(rows):
        yield "trained", table[rows]


def _closed(table, seed):
    """The known targets alone, as they were predicted."""
    known = table[table["role"] == "known"]
    test, held_out = (known[known["side"] == side] for side in ("test", "validation"))
    reached = metrics_of_labels(held_out["truth"], held_out["predicted"])
    validation = tuple((name, reached[name], len(held_out)) for name in ("accuracy", "f1_weighted"))
    return Judged("", "", len(test), *_judge(test, test["predicted"].to_numpy(), seed), validation)


def _opened(table, seed):
    """Known and unknown targets by each confidence score: without a threshold, and with that of each protocol."""
    test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
    known, right = (test["role"] == "known").to_numpy(), (test["truth"] == test["predicted"]).to_numpy()
    azimuths, groups = np.unique(test["azimuth"], return_inverse=True)
    draws = np.concatenate([np.ones((1, len(azimuths))), weights(len(azimuths), seed)])
    for column in (name for name in table if name.startswith(KNOWN)):
        name, values = column.removeprefix(KNOWN), test[column].to_numpy(float)
        separated = separation(values, known, right, groups, draws)
        yield Judged(name, "", len(test), {metric: (v[0], *interval(v[1:])) for metric, v in separated.items()}, {})
        for protocol in thresholds.ROLES:
            threshold = thresholds.choose(table, column, protocol)
            metrics, *others = _judge(test, thresholds.apply(values, test["predicted"], threshold), seed)
            metrics["threshold"] = (threshold, np.nan, np.nan)
            validation = ("f1_weighted", *thresholds.reached(table, column, protocol, threshold))
            yield Judged(name, protocol, len(test), metrics, *others, (validation,))


def _judge(test, predicted, seed):
    """The `metrics`, `counts` and `f1_weighted` of a `Judged`, of predicted labels for test rows of a table."""
    labels = np.array(sorted({*test["truth"], *predicted}, key=lambda label: (label == OTHER, label)))
    codes = [pd.Categorical(values, categories=labels).codes.astype(int) for values in (test["truth"], predicted)]
    azimuths, groups = np.unique(test["azimuth"], return_inverse=True)
    counts = confusion(groups, *codes, (len(azimuths), len(labels)))
    # In the closed set OTHER may be predicted, and is then wrong, but never true.
    judged = labels if OTHER in set(test["truth"]) else labels[labels != OTHER]
    draws = resampled(counts, labels, judged, seed)
    values = metrics_of(counts.sum(axis=0), labels, judged)
    targets, owners = np.unique(test["target"], return_inverse=True)
    by_target = confusion(owners, *codes, (len(targets), len(labels))).sum(axis=1)
    cells = {(targets[i], labels[j]): count for (i, j), count in np.ndenumerate(by_target)}
    return {name: (value, *interval(draws[name])) for name, value in values.items()}, cells, draws["f1_weighted"]
