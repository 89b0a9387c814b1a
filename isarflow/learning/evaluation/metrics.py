"""Metrics from confusion counts, with intervals from a bootstrap over blocks of azimuths, or over models within kinds.

Confusion counts have shape (..., truth, predicted); all functions work on any number of leading dimensions.
"""

import functools

import numpy as np
import pandas as pd
from scipy.special import expit, logit, stdtrit

from isarflow.learning.classifier import OTHER

RESAMPLES = 1000
CONFIDENCE_LEVEL = 0.95
# Images share samples with their neighbours in the next block, too: over arcs of one aperture the variance of a sum is
# two thirds of what it is in the long run, where correlation falls linearly to nothing over that length.
NEIGHBOUR_VARIANCE = 3 / 2
UNKNOWN_MIX = 0.8  # share of unknown images where ten targets are tested of which two are known
KEPT_SHARE = 0.95  # share of the known images above the threshold of fpr95


def numbered(values):
    """Number values (n,): the distinct ones as sorted text, and each value's number among them, (n,).

    As np.unique of their text, but only the distinct values are compared, which are few.
    """
    codes, distinct = pd.factorize(np.asarray(values))
    names, places = np.unique(distinct.astype(str), return_inverse=True)
    return names, places[codes]


def confusion(groups, truth, predicted, shape, weight=None):
    """Count (groups, labels, labels) from the numbers of each observation's group, truth and predicted label.

    shape: (groups, labels). The arrays, and weight, how often each counts, are (observations,).
    """
    count, labels = shape
    cells = (np.asarray(groups) * labels + truth) * labels + predicted
    return np.bincount(cells, weight, minlength=count * labels**2).reshape(count, labels, labels)


def metrics_of(counts, labels, judged):
    """All metrics of confusion counts (..., labels, labels): a mapping of name to values (...).

    f1_weighted is weighted by true counts, f1_macro is a plain mean. The latter, precision_<label> and recall_<label>
    are of the labels in `judged` only: a label that is predicted but can never be true has no meaningful value.
    A ratio with denominator 0 is 0, except the precision of a label that is never predicted, which is NaN.
    """
    counts = np.asarray(counts, float)
    right = np.diagonal(counts, axis1=-2, axis2=-1)
    true, predicted = counts.sum(axis=-1), counts.sum(axis=-2)
    total = true.sum(axis=-1)
    f1 = _ratio(2 * right, true + predicted)
    precision, recall = np.where(predicted > 0, _ratio(right, predicted), np.nan), _ratio(right, true)
    result = {
        "accuracy": _ratio(right.sum(axis=-1), total),
        "f1_weighted": _ratio((f1 * true).sum(axis=-1), total),
        "f1_macro": f1[..., [label in judged for label in labels]].mean(axis=-1),
    }
    for index, label in enumerate(labels):
        if label in judged:
            result |= {f"precision_{label}": precision[..., index], f"recall_{label}": recall[..., index]}
    return {name: value[()] for name, value in result.items()}  # numbers, where counts have no leading dimension


def at_mix(counts, labels, other_share=None):
    """Counts (..., labels, labels) of images that are weighed by their true label: a share of label OTHER.

    The known labels share the rest alike. None: every label weighs the same.
    """
    counts = np.asarray(counts, float)
    is_other = np.asarray(labels) == OTHER
    share = 1 / len(labels) if other_share is None else other_share
    wanted = np.where(is_other, share, (1 - share) / max((~is_other).sum(), 1))
    return counts * _ratio(wanted, counts.sum(axis=-1))[..., None]


def metrics_of_labels(truth, predicted, weight=None):
    """The metrics of labels (n,), each image counting `weight` times, (n,); None: once."""
    labels, codes = numbered(np.concatenate([np.asarray(truth, object), np.asarray(predicted, object)]))
    counts = confusion(0, *codes.reshape(2, -1), (1, len(labels)), weight)[0]
    return metrics_of(counts, labels, labels)


@functools.cache
def draw_counts(blocks, seed, strata=()):
    """Number of times that each block is drawn in each bootstrap resample: (resamples, blocks) (Kuensch 1989).

    It follows from the seed, the number of blocks and maybe the stratum of each, within which blocks are drawn:
    models tested on the same blocks have the same draws.
    """
    random, drawn = np.random.default_rng([seed, *b"bootstrap"]), np.empty((RESAMPLES, blocks), int)
    stratum_of = np.unique(strata, return_inverse=True)[1] if strata else np.zeros(blocks, int)
    for stratum in range(stratum_of.max(initial=-1) + 1):
        inside = stratum_of == stratum
        size = inside.sum()
        drawn[:, inside] = random.multinomial(size, np.full(size, 1 / size), size=RESAMPLES)
    return drawn


def equal_blocks(sizes):
    """Number of blocks of equal size that say as much as blocks of these sizes (blocks,) (Kish 1965)."""
    return sizes.sum() ** 2 / (sizes**2).sum()


def interval(value, draws, blocks, is_share=True, strata=()):
    """The 95 % interval of a value from its values in resamples, draws (resamples,), of `blocks` blocks: (low, high).

    blocks: as `equal_blocks` counts them. The standard error is the standard deviation of the draws, with two
    corrections of its variance: n / (n - strata), as blocks are drawn about their own mean or their stratum's, and
    NEIGHBOUR_VARIANCE for blocks of azimuths, whose neighbours are alike; blocks in strata are models, which have none.
    is_share: see `around`.
    NaN for a single block, which shows no spread, and for a value that is NaN; resamples that are NaN are left out.
    """
    freedom = blocks - max(len(set(strata)), 1)
    if freedom <= 0 or np.isnan(value):
        return np.nan, np.nan
    variance_factor = blocks / freedom * (1 if strata else NEIGHBOUR_VARIANCE)
    return around(value, np.nanstd(draws) * np.sqrt(variance_factor), freedom, is_share)


def around(value, error, freedom, is_share):
    """The 95 % interval by Student's t of values with these standard errors and degrees of freedom: (low, high).

    Of a share, between 0 and 1, on the scale of log(value / (1 - value)) by the delta method, so that it stays within 0
    and 1; else symmetric. Arguments are numbers or arrays.
    """
    value, half = np.asarray(value), np.asarray(stdtrit(freedom, (1 + CONFIDENCE_LEVEL) / 2) * error)
    sides, slope = np.stack([-half, half]), value * (1 - value)
    with np.errstate(divide="ignore", invalid="ignore"):
        of_share = np.where(slope > 0, expit(logit(value) + sides / slope), value + 0 * sides)
    return tuple(np.where(is_share, of_share, value + sides))


def resampled(counts, labels, judged, seed, strata=()):
    """The metrics of counts (blocks, labels, labels) in each resample: a mapping of name to (resamples,)."""
    return metrics_of(np.tensordot(draw_counts(len(counts), seed, strata), counts, axes=1), labels, judged)


def with_intervals(counts, labels, judged, seed, names=None, strata=()):
    """(name, value, low, high) of all metrics, or of some names, of counts (blocks, labels, labels)."""
    values, draws = metrics_of(counts.sum(axis=0), labels, judged), resampled(counts, labels, judged, seed, strata)
    blocks = equal_blocks(counts.sum(axis=(1, 2)))
    for name in names or values:
        yield name, values[name], *interval(values[name], draws[name], blocks, strata=strata)


def differences(counts, labels, seed, names, strata=()):
    """(name, value, reference's, difference, low, high) of metrics of two methods on the same images, drawn alike.

    counts: (blocks, labels, labels) of the method and of the reference; labels: of each.
    """
    methods = list(zip(counts, labels, strict=True))
    values = [metrics_of(table.sum(axis=0), classes, classes) for table, classes in methods]
    draws = [resampled(table, classes, classes, seed, strata) for table, classes in methods]
    blocks = equal_blocks(counts[1].sum(axis=(1, 2)))
    for name in names:
        value, reference = (metric[name] for metric in values)
        ends = interval(value - reference, draws[0][name] - draws[1][name], blocks, False, strata)
        yield name, value, reference, value - reference, *ends


def separation(scores, known, right, groups, draws):
    """Measure how well a score separates known from unknown images without a threshold: mapping of name to (draws,).

    auroc: probability that a known image scores higher than an unknown one (ties count half). oscr: the same for known
    images that are also classified correctly (Dhamija et al. 2018). fpr95: share of the unknown images above the
    threshold that keeps 95 % of the known ones.
    groups: (n,) numbers of blocks; draws: (draws, blocks), how often each block counts. All are NaN unless there are
    images of both kinds.
    """
    draws = np.asarray(draws, float)
    count = draws.shape[1]
    known_scores, known_groups = scores[known], groups[known]
    unknown = [np.sort(scores[~known & (groups == group)]) for group in range(count)]
    known_total = draws @ np.bincount(known_groups, minlength=count).astype(float)
    unknown_total = draws @ np.array([len(part) for part in unknown], float)
    # Pairs in which the known image scores higher, by its block and the unknown image's block; then the pairs among
    # them in which it is also classified correctly.
    pairs = np.empty((2, count, count))
    for group, part in enumerate(unknown):
        below = (np.searchsorted(part, known_scores, "left") + np.searchsorted(part, known_scores, "right")) / 2
        pairs[0, :, group] = np.bincount(known_groups, below, count)
        pairs[1, :, group] = np.bincount(known_groups, below * right[known], count)
    auroc, oscr = (_ratio(np.einsum("da,ab,db->d", draws, part, draws), known_total * unknown_total) for part in pairs)

    order, fpr95 = np.argsort(-known_scores, kind="stable"), np.zeros(len(draws))
    if len(order):
        running = np.cumsum(draws[:, known_groups[order]], axis=1)
        thresholds = known_scores[order][(running >= KEPT_SHARE * known_total[:, None] - 1e-9).argmax(axis=1)]
        accepted = np.stack([len(part) - np.searchsorted(part, thresholds, "left") for part in unknown], axis=1)
        fpr95 = _ratio((draws * accepted).sum(axis=1), unknown_total)
    none = (known_total == 0) | (unknown_total == 0)
    return {name: np.where(none, np.nan, v) for name, v in {"auroc": auroc, "fpr95": fpr95, "oscr": oscr}.items()}


def _ratio(above, below):
    return np.divide(above, below, out=np.zeros(np.broadcast(above, below).shape), where=below > 0)
