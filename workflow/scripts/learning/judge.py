"""Judge prediction tables: the final label of each test image, and the metrics and intervals that follow."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from isarflow.learning import metrics, thresholds
from isarflow.learning.classifier import OTHER
from isarflow.learning.metrics import KEPT
from isarflow.learning.predict import KNOWN

SHORT = ("accuracy", "f1_weighted", "f1_macro")  # metrics by another definition of SNR
BY_FOLD = ("accuracy", "f1_weighted")  # metrics of each single fold


@dataclass(frozen=True)
class Decision:
    """The test images of one SNR with the labels of one way of judging.

    score, threshold: values of these columns. test: the table's rows; predicted: their labels (n,), rejected ones
    OTHER. fixed: metrics that do not depend on labels, as (name, value, low, high). validation: (metric, value,
    number of images) on the validation images. is_final: True if these labels are final, not those before a
    threshold. labels: all that occur; judged: those that can be true; blocks, folds: those that the images belong to
    (see `split.blocks`), as text.
    """

    score: str
    threshold: str
    test: pd.DataFrame
    predicted: np.ndarray
    fixed: tuple = ()
    validation: tuple = ()

    @property
    def is_final(self):
        return not self.score or bool(self.threshold)

    @cached_property
    def _labelled(self):
        """The labels that occur, and the numbers of each image's true and predicted label among them, (2, n)."""
        labels = np.concatenate([self.test["truth"].to_numpy(str), self.predicted.astype(str)])
        found, numbers = np.unique(labels, return_inverse=True)
        return found, numbers.reshape(2, -1)

    @cached_property
    def _placed(self):
        """The blocks that occur, and the number of each image's block among them, (n,)."""
        return np.unique(self.test["block"].to_numpy(str), return_inverse=True)

    @property
    def blocks(self):
        return self._placed[0]

    @cached_property
    def folds(self):
        return np.unique(self.test["fold"].to_numpy(str))

    def of_folds(self, folds):
        """The Decision of the images of these folds alone."""
        own = np.isin(self.test["fold"].to_numpy(str), folds)
        return replace(self, test=self.test[own], predicted=self.predicted[own])

    @cached_property
    def labels(self):
        return ordered(self._labelled[0])

    @cached_property
    def judged(self):
        # In the closed set OTHER may be predicted, and is then wrong; it is never true.
        found, (true, _) = self._labelled
        return self.labels if OTHER in found[np.unique(true)] else self.labels[self.labels != OTHER]

    def counts(self, labels, blocks, weight=None):
        """Confusion counts (blocks, labels, labels) of these labels and blocks, each image counting by its weight.

        Labels and blocks are those that occur, and maybe others.
        """
        found, numbers = self._labelled
        number = {label: number for number, label in enumerate(labels)}
        codes = np.array([number[label] for label in found])[numbers]
        place = np.searchsorted(blocks, self.blocks)[self._placed[1]]
        return metrics.confusion(place, *codes, (len(blocks), len(labels)), weight)


def decide(table, is_open, kept=KEPT):
    """The `Decision`s of a prediction table of all folds: the closed set's, and for an open run those of each score.

    kept: the share of known images that the protocol of this name keeps.
    """
    return [_closed(table), *(_opened(table, kept) if is_open else ())]


def _closed(table):
    """The known targets alone, as they were predicted."""
    known = table[table["role"] == "known"]
    test, held_out = (known[known["side"] == side] for side in ("test", "validation"))
    reached = metrics.metrics_of_labels(held_out["truth"], held_out["predicted"])
    validation = tuple((name, reached[name], len(held_out)) for name in BY_FOLD)
    return Decision("", "", test, test["predicted"].to_numpy(), (), validation)


def _opened(table, kept):
    """Known and unknown targets by each confidence score: without a threshold, and with that of each protocol."""
    scores = [name for name in table if name.startswith(KNOWN)]
    test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
    labels = test["predicted"].to_numpy(object)
    # Every fold has models of its own, and so thresholds.
    folds = {
        protocol: [
            ((test["fold"] == fold).to_numpy(), thresholds.seen(rows, protocol)) for fold, rows in table.groupby("fold")
        ]
        for protocol in thresholds.ROLES
    }
    for column in scores:
        name, values = column.removeprefix(KNOWN), test[column].to_numpy()
        yield Decision(name, "", test, test["predicted"].to_numpy())
        for protocol in thresholds.ROLES:
            predicted, chosen, reached = np.empty(len(test), object), [], []
            for own, among in folds[protocol]:
                threshold = thresholds.chosen(among, column, kept)
                predicted[own] = thresholds.apply(values[own], labels[own], threshold)
                chosen.append(threshold)
                reached.append(thresholds.reached(among, column, threshold))
            best, images = zip(*reached, strict=True)
            validation = ("f1_weighted", np.average(best, weights=images), sum(images))
            fixed = ("threshold", float(np.mean(chosen)), np.nan, np.nan)
            yield Decision(name, protocol, test, predicted.astype(str), (fixed,), (validation,))


def rows(decision, seed):
    """(fold, metric, value, low, high, images) of all metrics of a Decision: of all folds together, then of each."""
    images = len(decision.test)
    if not decision.is_final:
        for name, (value, low, high) in _separated(decision, seed).items():
            yield "", name, value, low, high, images
        return
    labels, blocks = decision.labels, decision.blocks
    counts = decision.counts(labels, blocks)
    draws = metrics.resampled(counts, labels, decision.judged, seed)
    for name, value in metrics.metrics_of(counts.sum(axis=0), labels, decision.judged).items():
        yield "", name, value, *metrics.interval(value, draws[name], _equal_blocks(counts)), images
    for row in decision.fixed:
        yield "", *row, images
    for fold in decision.folds if len(decision.folds) > 1 else ():
        own = decision.of_folds([fold])
        values = metrics.metrics_of(own.counts(labels, own.blocks).sum(axis=0), labels, labels)
        for name in BY_FOLD:
            yield fold, name, values[name], np.nan, np.nan, len(own.test)


def _separated(decision, seed):
    """Metrics of how a confidence score separates without a threshold: a mapping of metric to (value, low, high).

    Scores of two models cannot be compared, so several folds give the mean over folds. Either every fold
    has images in all blocks, or it is a block of its own, which counts as often as it is drawn.
    """
    sizes = np.unique(decision.test["block"], return_counts=True)[1]
    count = len(sizes)
    draws = np.concatenate([np.ones((1, count)), metrics.weights(count, seed)])
    parts = [part for _, part in decision.test.groupby("fold")]
    if all(part["block"].nunique() == count for part in parts):
        every = [_separation(decision, part, draws) for part in parts]
        found = {name: sum(of[name] for of in every) / len(parts) for name in every[0]}
    else:
        alone = [_separation(decision, part, np.ones((1, 1))) for part in parts]
        found = {name: draws @ np.concatenate([of[name] for of in alone]) / count for name in alone[0]}
    equal = metrics.equal_blocks(sizes)
    return {name: (of[0], *metrics.interval(of[0], of[1:], equal)) for name, of in found.items()}


def _separation(decision, test, draws):
    known, right = (test["role"] == "known").to_numpy(), (test["truth"] == test["predicted"]).to_numpy()
    groups = np.unique(test["block"], return_inverse=True)[1]
    return metrics.separation(test[KNOWN + decision.score].to_numpy(float), known, right, groups, draws)


def cells(decision):
    """(target, predicted, number of test images) of a Decision; none for a confidence score without a threshold."""
    if not decision.is_final:
        return
    targets, numbers = np.unique(decision.test["target"].to_numpy(str), return_inverse=True)
    for number, target in enumerate(targets):
        predicted = decision.predicted[numbers == number]
        for label in decision.labels:
            yield target, label, int((predicted == label).sum())


def by_other_definitions(decided, definition, seed):
    """Metrics SHORT at equal SNR by other definitions than the run's: (definition, snr, kind, row) of each.

    decided: the result of `decide`, by SNR; kind: the `score` and `threshold`; row: (metric, value, low, high, images).
    An image of the table at SNR s has by another definition the SNR s + d, with a d of its own. So it counts at the SNR
    m as the run's images would at m - d, which lies between two of the run's SNRs: with both, by linear weights.
    """
    snrs = np.array(sorted(decided))
    for position in range(len(decided[snrs[0]])):
        several = [decided[snr][position] for snr in snrs]
        if not several[0].is_final:
            continue
        for column in (name for name in several[0].test if name.startswith("snr_") and name != f"snr_{definition}"):
            shifts = [decision.test[column].to_numpy(float) - snr for snr, decision in zip(snrs, several, strict=True)]
            shifts = [np.nan_to_num(of) for of in shifts]
            for snr in snrs[(snrs - shifts[0].max() >= snrs[0]) & (snrs - shifts[0].min() <= snrs[-1])]:
                of_snr = [_hat(snr - of, snrs, number) for number, of in enumerate(shifts)]
                yield from (
                    (column.removeprefix("snr_"), snr, (several[0].score, several[0].threshold), row)
                    for row in _weighted(several, of_snr, seed)
                )


def _hat(values, grid, number):
    """Weight of a point of the grid in the linear interpolation at each of the values (n,)."""
    return np.interp(values, grid, np.arange(len(grid)) == number)


def _weighted(decisions, weights, seed):
    """(metric, value, low, high, images) of metrics SHORT, from Decisions whose images count by their weights."""
    labels, blocks = ordered({label for one in decisions for label in one.labels}), decisions[0].blocks
    judged = [label for label in labels if any(label in one.judged for one in decisions)]
    counts = sum(one.counts(labels, blocks, of) for one, of in zip(decisions, weights, strict=True) if of.any())
    values = metrics.metrics_of(counts.sum(axis=0), labels, judged)
    draws = metrics.resampled(counts, labels, judged, seed)
    for name in SHORT:
        low, high = metrics.interval(values[name], draws[name], _equal_blocks(counts))
        yield name, values[name], low, high, round(counts.sum())


def gain(decision, reference, seed):
    """Weighted F1 of a Decision minus that of a reference on the same folds: (value, low, high, images).

    None where they have no fold in common.
    """
    folds = np.intersect1d(decision.folds, reference.folds)
    if not len(folds):
        return None
    f1, equal = [], None
    for one in (decision.of_folds(folds), reference.of_folds(folds)):
        labels = one.labels
        counts = one.counts(labels, one.blocks)
        equal = _equal_blocks(counts)  # of the same test images
        drawn = metrics.resampled(counts, labels, labels, seed)["f1_weighted"]
        f1.append((metrics.metrics_of(counts.sum(axis=0), labels, labels)["f1_weighted"], drawn, counts.sum()))
    value, drawn = f1[0][0] - f1[1][0], f1[0][1] - f1[1][1]
    return value, *metrics.interval(value, drawn, equal, share=False), int(f1[0][2])


def ordered(labels):
    """Labels as an array in one order, OTHER last."""
    return np.array(sorted(labels, key=lambda label: (label == OTHER, label)))


def _equal_blocks(counts):
    return metrics.equal_blocks(counts.sum(axis=(1, 2)))
