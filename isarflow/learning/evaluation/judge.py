"""Judge prediction tables: the final label of each test image, and the metrics and intervals that follow."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from isarflow.core.errors import InputError
from isarflow.learning.classifier import OTHER
from isarflow.learning.evaluation import metrics, thresholds
from isarflow.learning.evaluation.metrics import KEPT_SHARE
from isarflow.learning.tables import KNOWN

SHORT = ("accuracy", "f1_weighted", "f1_macro")  # metrics by another definition of SNR
BY_FOLD = ("accuracy", "f1_weighted")  # metrics of each single fold
# By family an open set also has the F1 at two mixes of true labels, as of `metrics.at_mix`.
MIXES = {"f1_balanced": None, "f1_mix": metrics.UNKNOWN_MIX}


@dataclass(frozen=True)
class Decision:
    """The test images of one SNR with the labels of one way of judging."""

    score: str  # value of this column
    threshold: str
    test: pd.DataFrame  # the table's rows
    predicted: np.ndarray  # their labels (n,), rejected ones OTHER
    fixed: tuple = ()  # metrics that do not depend on labels: (name, value, low, high)
    validation: tuple = ()  # of the validation images: (metric, value, number of images)
    kinds: Mapping | None = None  # by family, where a block is a whole model: the kind of each target

    @property
    def is_final(self):
        """False for the labels of an open set before a threshold."""
        return not self.score or bool(self.threshold)

    @cached_property
    def _labelled(self):
        """The labels that occur, and the numbers of each image's true and predicted label among them, (2, n)."""
        labels = np.concatenate([self.test["truth"].to_numpy(object), self.predicted.astype(object)])
        names, numbers = metrics.numbered(labels)
        return names, numbers.reshape(2, -1)

    @cached_property
    def _blocks(self):
        """The blocks that occur (see `split.blocks`), and the number of each image's block among them, (n,)."""
        return metrics.numbered(self.test["block"])

    def strata(self, blocks=None):
        """Within which each of these or of all blocks is drawn: the kind of its target by family, else none.

        All kinds of a single model are one stratum, as alone they would not vary.
        """
        if self.kinds is None:
            return ()
        firsts = self.test.drop_duplicates("block")
        kinds = dict(zip(firsts["block"].astype(str), firsts["target"].map(self.kinds), strict=True))
        drawn = [kinds[str(block)] for block in (self._blocks[0] if blocks is None else blocks)]
        return tuple(kind if drawn.count(kind) > 1 else "" for kind in drawn)

    @cached_property
    def folds(self):
        """The folds that the images belong to, as text."""
        return metrics.numbered(self.test["fold"])[0]

    def of_folds(self, folds):
        """The Decision of the images of these folds alone."""
        if np.isin(self.folds, folds).all():
            return self
        chosen = np.isin(self.test["fold"].to_numpy(str), folds)
        return replace(self, test=self.test[chosen], predicted=self.predicted[chosen])

    @cached_property
    def labels(self):
        """All labels that occur."""
        return ordered(self._labelled[0])

    @cached_property
    def judged(self):
        """The labels that can be true: in the closed set OTHER may be predicted, and is then wrong."""
        return self.labels if (self.test["truth"] == OTHER).any() else self.labels[self.labels != OTHER]

    def counts(self, labels, weight=None):
        """Confusion counts (blocks, labels, labels) of these and maybe other labels, by the images' weights (n,)."""
        (names, numbers), (blocks, place) = self._labelled, self._blocks
        codes = pd.Index(labels).get_indexer(names)[numbers]
        return metrics.confusion(place, *codes, (len(blocks), len(labels)), weight)


def ordered(labels):
    """Labels as an array in one order, OTHER last."""
    return np.array(sorted(labels, key=lambda label: (label == OTHER, label)))


def decide(table, kept_share=KEPT_SHARE, kinds=None):
    """The `Decision`s of a prediction table of all folds: of the closed set, and of each confidence score in it.

    kept_share: of known images, above the threshold of the protocol `kept`. kinds: the kind of each target for a split
    by family, else None.
    Raises InputError for a fold of an open set that has no validation image of a known target.
    """
    known = table[table["role"] == "known"]
    test, held_out = (known[known["side"] == side] for side in ("test", "validation"))
    reached = metrics.metrics_of_labels(held_out["truth"], held_out["predicted"])
    validation = tuple((name, reached[name], len(held_out)) for name in BY_FOLD)
    closed = Decision("", "", test, test["predicted"].to_numpy(), (), validation, kinds)
    return [closed, *_opened(table, kept_share, kinds)]


def _opened(table, kept_share, kinds):
    """Known and unknown targets by each confidence score: without a threshold, and with each protocol's."""
    test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
    labels = test["predicted"].to_numpy(object)
    columns = [name for name in table if name.startswith(KNOWN)]
    folds = _folds(table, test) if columns else ()
    for column in columns:
        name, values = column.removeprefix(KNOWN), test[column].to_numpy()
        yield Decision(name, "", test, test["predicted"].to_numpy(), kinds=kinds)
        for protocol in thresholds.ROLES if kinds is None else thresholds.BY_FAMILY:
            predicted, choices = np.empty(len(test), object), []
            for of_fold, rows in folds:
                choices.append(thresholds.threshold_and_f1(rows, column, protocol, kept_share))
                predicted[of_fold] = thresholds.apply(values[of_fold], labels[of_fold], choices[-1][0])
            chosen, best, images = zip(*choices, strict=True)
            validation = ("f1_weighted", np.average(best, weights=images), sum(images))
            fixed = ("threshold", float(np.mean(chosen)), np.nan, np.nan)
            yield Decision(name, protocol, test, predicted.astype(str), (fixed,), (validation,), kinds)


def _folds(table, test):
    """(which of the test rows, the rows that thresholds are chosen by) of each fold, as each has models of its own."""
    held_out, parts = table[table["side"] != "test"], []
    for fold in np.unique(test["fold"]):
        rows = held_out[held_out["fold"] == fold]
        if not ((rows["role"] == "known") & (rows["side"] == "validation")).any():
            missing = f"fold {fold} has no validation image of a known target"
            raise InputError(f"{missing}: no threshold can be chosen for its test images of the open set.")
        parts.append(((test["fold"] == fold).to_numpy(), rows))
    return parts


def rows(decision, seed):
    """(fold, metric, value, low, high, images) of all metrics of a Decision: of all folds together, then of each."""
    images = len(decision.test)
    if not decision.is_final:
        yield from (("", *row, images) for row in _separated(decision, seed))
        return
    labels = decision.labels
    counts = decision.counts(labels)
    together = metrics.with_intervals(counts, labels, decision.judged, seed, strata=decision.strata())
    yield from (("", *row, images) for row in (*together, *decision.fixed))
    for name, value, low, high in () if decision.kinds is None else _at_mixes(decision, seed):
        yield "", name, value, low, high, images
    for fold in decision.folds if len(decision.folds) > 1 else ():
        part = decision.of_folds([fold])
        values = metrics.metrics_of(part.counts(labels).sum(axis=0), labels, labels)
        for name in BY_FOLD:
            yield fold, name, values[name], np.nan, np.nan, len(part.test)


def _at_mixes(decision, seed):
    """(metric, value, low, high) of MIXES: F1 where every true label weighs as the mix says."""
    labels, counts, strata = decision.labels, decision.counts(decision.labels), decision.strata()
    drawn = np.tensordot(metrics.draw_counts(len(counts), seed, strata), counts, axes=1)
    blocks = metrics.equal_blocks(counts.sum(axis=(1, 2)))
    for name, share in MIXES.items():
        value, draws = (
            metrics.metrics_of(metrics.at_mix(of, labels, share), labels, labels)["f1_weighted"]
            for of in (counts.sum(axis=0), drawn)
        )
        yield name, value, *metrics.interval(value, draws, blocks, strata=strata)


def _separated(decision, seed):
    """(metric, value, low, high) of how a confidence score separates without a threshold.

    Scores of two models cannot be compared, so several folds give the mean over folds. Either a fold has images
    in several blocks, or it is a block of its own, which counts as often as it is drawn.
    """
    blocks, sizes = np.unique(decision.test["block"], return_counts=True)
    count, equal, strata = len(sizes), metrics.equal_blocks(sizes), decision.strata(blocks)
    draws = np.concatenate([np.ones((1, count)), metrics.draw_counts(count, seed, strata)])
    parts = [part for _, part in decision.test.groupby("fold")]
    if count == 1 or not all(part["block"].nunique() == 1 for part in parts):
        means = [_separation(decision, part, draws[:, np.isin(blocks, part["block"])]) for part in parts]
        results = {name: sum(values[name] for values in means) / len(parts) for name in means[0]}
    else:
        alone = [_separation(decision, part, np.ones((1, 1))) for part in parts]
        results = {name: draws @ np.concatenate([values[name] for values in alone]) / count for name in alone[0]}
    for name, values in results.items():
        yield name, values[0], *metrics.interval(values[0], values[1:], equal, strata=strata)


def _separation(decision, test, draws):
    known, right = (test["role"] == "known").to_numpy(), (test["truth"] == test["predicted"]).to_numpy()
    groups = np.unique(test["block"], return_inverse=True)[1]
    return metrics.separation(test[KNOWN + decision.score].to_numpy(float), known, right, groups, draws)


def cells(decision):
    """(target, predicted, number of test images) of a Decision; none for a confidence score without a threshold."""
    if not decision.is_final:
        return
    targets, numbers = metrics.numbered(decision.test["target"])
    for number, target in enumerate(targets):
        predicted = decision.predicted[numbers == number]
        yield from ((target, label, np.sum(predicted == label)) for label in decision.labels)


def by_other_definitions(decided, definition, seed):
    """Metrics SHORT at equal SNR by other definitions than the run's: (definition, snr, kind, row) of each.

    decided: the result of `decide`, by SNR; kind: the `score` and `threshold`; row: (metric, value, low, high, images).
    By another definition the SNR of an image of the table at s is s + d; d differs from image to image. At the SNR m
    the image stands for one of the run at m - d, which lies between two of the run's SNRs: it counts with both, by
    linear weights.
    """
    snrs = np.array(sorted(decided))
    for decisions in zip(*(decided[snr] for snr in snrs), strict=True):
        if not decisions[0].is_final:
            continue
        kind = decisions[0].score, decisions[0].threshold
        for column in (name for name in decisions[0].test if name.startswith("snr_") and name != f"snr_{definition}"):
            of_snrs = zip(snrs, decisions, strict=True)
            shifts = [np.nan_to_num(decision.test[column].to_numpy(float) - snr) for snr, decision in of_snrs]
            for snr in snrs[(snrs - shifts[0].max() >= snrs[0]) & (snrs - shifts[0].min() <= snrs[-1])]:
                of_snrs = zip(snrs, shifts, strict=True)
                weights = [np.interp(snr - shift, snrs, snrs == run_snr) for run_snr, shift in of_snrs]
                for row in _weighted(decisions, weights, seed):
                    yield column.removeprefix("snr_"), snr, kind, row


def _weighted(decisions, weights, seed):
    """(metric, value, low, high, images) of metrics SHORT, from Decisions whose images count by their weights."""
    labels = ordered({label for decision in decisions for label in decision.labels})
    judged = [label for label in labels if any(label in decision.judged for decision in decisions)]
    weighted = zip(decisions, weights, strict=True)
    counts = sum(decision.counts(labels, of_images) for decision, of_images in weighted if of_images.any())
    for row in metrics.with_intervals(counts, labels, judged, seed, SHORT, decisions[0].strata()):
        yield *row, round(counts.sum())


def gain(decision, reference, seed):
    """Weighted F1 of a Decision minus the reference's on the same folds: (value, low, high, images).

    None where they have no fold in common.
    """
    folds = np.intersect1d(decision.folds, reference.folds)
    if not len(folds):
        return None
    pair = decision.of_folds(folds), reference.of_folds(folds)
    labels = [decision.labels for decision in pair]
    counts = [decision.counts(classes) for decision, classes in zip(pair, labels, strict=True)]
    ((*_, value, low, high),) = metrics.differences(counts, labels, seed, ["f1_weighted"], pair[1].strata())
    return value, low, high, len(pair[0].test)
