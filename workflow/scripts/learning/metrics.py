"""Figures of merit from confusion counts, with intervals from a bootstrap over viewing azimuths.

Confusion counts have shape (..., truth, predicted); all functions work on any number of leading dimensions.
"""

import numpy as np

RESAMPLES = 1000
LEVEL = 0.95


def confusion(groups, truth, predicted, shape):
    """Counts (groups, labels, labels) from the number of each observation's group, truth and predicted label.

    shape: (groups, labels). The three arrays have shape (observations,).
    """
    count, labels = shape
    cells = (np.asarray(groups) * labels + truth) * labels + predicted
    return np.bincount(cells, minlength=count * labels**2).reshape(count, labels, labels)


def figures(counts, labels):
    """All metrics of confusion counts (..., labels, labels): a mapping of name to values (...).

    accuracy, f1_weighted (by true counts), f1_macro (plain mean), precision_<label>, recall_<label>.
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
        "f1_macro": f1.mean(axis=-1),
    }
    for index, label in enumerate(labels):
        result[f"precision_{label}"] = precision[..., index]
        result[f"recall_{label}"] = recall[..., index]
    return result


def intervals(counts, labels, seed):
    """95 % bootstrap intervals of all metrics: a mapping of name to (low, high).

    counts: (azimuths, labels, labels). Images of one azimuth are not independent, so whole azimuths are drawn with
    replacement: multinomial weights over azimuths, resampled counts by one product. The weights follow from the seed
    and the number of azimuths alone, so models tested on the same azimuths are compared on the same draws.
    Percentiles; where no image was ever wrong the interval has no width and only says that the sample shows no error.
    """
    azimuths = len(counts)
    random = np.random.default_rng([seed, *b"bootstrap"])
    weights = random.multinomial(azimuths, np.full(azimuths, 1 / azimuths), size=RESAMPLES)
    resampled = figures(np.tensordot(weights, counts, axes=1), labels)
    tail = (1 - LEVEL) / 2
    return {name: tuple(np.quantile(values, [tail, 1 - tail])) for name, values in resampled.items()}


def _ratio(above, below):
    return np.divide(above, below, out=np.zeros(np.broadcast(above, below).shape), where=below > 0)
