"""Figures of merit from confusion counts, with intervals from a bootstrap over viewing azimuths.

Confusion counts have shape (..., truth, predicted); all functions work on any number of leading dimensions.
"""

import functools

import numpy as np

RESAMPLES = 1000
LEVEL = 0.95
KEPT = 0.95  # share of the known images above the threshold of fpr95


def confusion(groups, truth, predicted, shape):
    """Counts (groups, labels, labels) from the number of each observation's group, truth and predicted label.

    shape: (groups, labels). The three arrays have shape (observations,).
    """
    count, labels = shape
    cells = (np.asarray(groups) * labels + truth) * labels + predicted
    return np.bincount(cells, minlength=count * labels**2).reshape(count, labels, labels)


def figures(counts, labels, judged):
    """All metrics of confusion counts (..., labels, labels): a mapping of name to values (...).

    accuracy, f1_weighted (by true counts), f1_macro (plain mean), precision_<label>, recall_<label>; the last three of
    the labels in `judged` only: one that is predicted but can never be true says nothing of its own.
    A ratio with nothing below the line is 0.
    """
    counts = np.asarray(counts, float)
    right = np.diagonal(counts, axis1=-2, axis2=-1)
    true, predicted = counts.sum(axis=-1), counts.sum(axis=-2)
    total = true.sum(axis=-1)
    f1 = _ratio(2 * right, true + predicted)
    precision, recall = _ratio(right, predicted), _ratio(right, true)
    result = {
        "accuracy": _ratio(right.sum(axis=-1), total),
        "f1_weighted": _ratio((f1 * true).sum(axis=-1), total),
        "f1_macro": f1[..., [label in judged for label in labels]].mean(axis=-1),
    }
    for index, label in enumerate(labels):
        if label not in judged:
            continue
        result[f"precision_{label}"] = precision[..., index]
        result[f"recall_{label}"] = recall[..., index]
    return result


def figures_of(truth, predicted, weight=1.0):
    """The `figures` of labels (n,), each image counting as many times as `weight`, (n,) or one number, says."""
    labels, codes = np.unique([*truth, *predicted], return_inverse=True)
    counts = np.zeros((len(labels), len(labels)))
    np.add.at(counts, tuple(codes.reshape(2, -1)), weight)
    return figures(counts, labels, labels)


@functools.cache
def weights(azimuths, seed):
    """How often each of so many azimuths is drawn in each bootstrap resample: (resamples, azimuths).

    Images of one azimuth are not independent, so whole azimuths are drawn with replacement. The draws follow from the
    seed and the number of azimuths alone, so models tested on the same azimuths are compared on the same draws.
    """
    random = np.random.default_rng([seed, *b"bootstrap"])
    return random.multinomial(azimuths, np.full(azimuths, 1 / azimuths), size=RESAMPLES)


def interval(values):
    """The 95 % percentile interval of resampled values (resamples,): (low, high).

    Where no image was ever wrong it has no width, and only says that the sample shows no error.
    """
    tail = (1 - LEVEL) / 2
    return tuple(np.quantile(values, [tail, 1 - tail]))


def resampled(counts, labels, judged, seed):
    """All `figures` of counts (azimuths, labels, labels) in each resample: a mapping of name to (resamples,)."""
    return figures(np.tensordot(weights(len(counts), seed), counts, axes=1), labels, judged)


def separation(scores, known, right, groups, draws):
    """How well a score tells known from unknown images without any threshold: a mapping of name to values (draws,).

    auroc: probability that a known image scores higher than an unknown one (ties count half).
    oscr: the same, for known images that are also classified rightly: the area under the curve of correct
    classification against false positive rate (Dhamija et al. 2018).
    fpr95: share of the unknown images above the threshold that keeps 95 % of the known ones.
    scores: (n,); known, right: (n,) booleans; groups: (n,) numbers of azimuths; draws: (draws, azimuths), how often
    each azimuth counts. Without images of both kinds all are NaN.
    """
    draws = np.asarray(draws, float)
    count = draws.shape[1]
    own, own_groups, own_right = scores[known], groups[known], right[known]
    rest = [np.sort(scores[~known & (groups == group)]) for group in range(count)]
    sizes = np.array([np.bincount(own_groups, minlength=count), [len(one) for one in rest]], float)
    known_total, rest_total = draws @ sizes[0], draws @ sizes[1]
    above = np.empty((2, count, count))  # pairs by azimuth of the known image, azimuth of the unknown one
    for group, one in enumerate(rest):
        below = (np.searchsorted(one, own, "left") + np.searchsorted(one, own, "right")) / 2
        above[0, :, group] = np.bincount(own_groups, below, count)
        above[1, :, group] = np.bincount(own_groups, below * own_right, count)
    auroc, oscr = (_ratio(np.einsum("da,ab,db->d", draws, pairs, draws), known_total * rest_total) for pairs in above)

    order = np.argsort(-own, kind="stable")
    if len(order):
        running = np.cumsum(draws[:, own_groups[order]], axis=1)
        thresholds = own[order][(running >= KEPT * known_total[:, None] - 1e-9).argmax(axis=1)]
        kept = np.stack([len(one) - np.searchsorted(one, thresholds, "left") for one in rest], axis=1)
        fpr95 = _ratio((draws * kept).sum(axis=1), rest_total)
    else:
        fpr95 = np.zeros(len(draws))
    none = (known_total == 0) | (rest_total == 0)
    return {
        name: np.where(none, np.nan, values) for name, values in (("auroc", auroc), ("fpr95", fpr95), ("oscr", oscr))
    }


def _ratio(above, below):
    return np.divide(above, below, out=np.zeros(np.broadcast(above, below).shape), where=below > 0)
