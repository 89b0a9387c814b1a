"""The threshold below which an image is rejected as none of the known classes.

It is chosen on validation images, for each SNR by itself, as a radar knows the level of its noise. Two protocols:
`thesis` sees images of the unknown targets among them (at azimuths that are not tested); `blind` sees none, only the
known targets and those of role other.
"""

import numpy as np

from learning.classifier import OTHER
from learning.metrics import KEPT, metrics_of_labels

ROLES = {"thesis": ("known", "unknown"), "blind": ("known", "other")}


def choose(table, score, protocol):
    """The threshold of a confidence score under a protocol, chosen on the validation rows of a prediction table.

    table: columns side, role, truth, predicted and the column `score`. Rows of other roles are not looked at.
    The threshold with the largest weighted F1 over the classes and OTHER; where there is nothing but known images, the
    one that keeps 95 % of them. Under the blind protocol the images of role other together count as much as the known
    ones: how many targets of that role a config happens to have says nothing of how many unknown ones will come.
    """
    rows, weight = _validation(table, protocol)
    if (rows["role"] == "known").all():
        return float(np.quantile(rows[score], 1 - KEPT))
    return best(rows[score].to_numpy(float), rows["truth"].to_numpy(), rows["predicted"].to_numpy(), weight)


def reached(table, score, protocol, threshold):
    """What `choose` makes as large as it can: the weighted F1 of a threshold on the validation rows of a table.

    Gives it and the number of these rows.
    """
    rows, weight = _validation(table, protocol)
    predicted = apply(rows[score], rows["predicted"], threshold)
    weights = np.where(rows["truth"] == OTHER, weight, 1.0)
    return metrics_of_labels(rows["truth"], predicted, weights)["f1_weighted"], len(rows)


def _validation(table, protocol):
    """The validation rows that a protocol sees, and for how many each of those with truth OTHER counts."""
    rows = table[(table["side"] == "validation") & table["role"].isin(ROLES[protocol])]
    known = (rows["role"] == "known").sum()
    weight = known / (len(rows) - known) if protocol == "blind" and 0 < known < len(rows) else 1.0
    return rows, weight


def best(scores, truth, predicted, weight=1.0):
    """The threshold with the largest weighted F1, halfway between two scores; of several such the middle one.

    scores: (n,), below the threshold is OTHER; truth, predicted: labels (n,), where predicted OTHER stays so.
    weight: how many images each image with truth OTHER counts for.
    """
    order = np.argsort(-scores, kind="stable")
    scores, truth, predicted = scores[order], np.asarray(truth)[order], np.asarray(predicted)[order]
    kept, counts = predicted != OTHER, np.where(truth == OTHER, weight, 1.0)
    # For thresholds that keep 0, 1, 2 ... images: the sum over the labels of F1 = 2 right / (predicted + true) times
    # the count of true images.
    total = np.zeros(len(scores) + 1)
    for name in np.unique(truth[truth != OTHER]):
        claimed = _running(counts * ((predicted == name) & kept))
        right = _running((predicted == name) & (truth == name))
        count = (truth == name).sum()
        total += count * 2 * right / (claimed + count)
    missed = counts[truth == OTHER].sum()
    if missed:
        rejected = counts.sum() - _running(counts * kept)
        right = missed - _running(counts * ((truth == OTHER) & kept))
        total += missed * 2 * right / (rejected + missed)
    # Between equal scores no threshold can pass.
    possible = np.concatenate([[True], scores[1:] < scores[:-1], [True]])
    total[~possible] = -1
    places = np.flatnonzero(total >= total.max() - 1e-9)
    place = places[len(places) // 2]
    edges = np.concatenate([[np.nextafter(scores[0], np.inf)], scores, [scores[-1]]])
    if place in (0, len(scores)):
        return float(edges[place])
    return float((edges[place] + edges[place + 1]) / 2)


def _running(values):
    """Sums of the first 0, 1, 2 ... of values (n,): (n + 1,)."""
    return np.concatenate([[0], np.cumsum(values)])


def apply(scores, predicted, threshold):
    """Labels (n,) with OTHER where the confidence score is below the threshold, or where OTHER was predicted."""
    return np.where(np.asarray(scores) >= threshold, predicted, OTHER)
