"""The threshold below which an image is rejected as none of the known classes.

It is chosen on validation images, for each SNR separately, as a radar knows the level of its noise. Three protocols:
`thesis` sees the unknown targets among them; `blind` only the known ones and those of role other; `kept` keeps a share
of the known ones, or of training views if the model can leave these out of its library in turn: they are many more.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from isarflow.learning.classifier import OTHER
from isarflow.learning.metrics import KEPT, metrics_of_labels
from isarflow.learning.split import LEFT_OUT

# Roles whose validation images judge a protocol; all but `kept` also choose by them.
ROLES = {"thesis": ("known", "unknown"), "blind": ("known", "other"), "kept": ("known", "other")}


class Seen(NamedTuple):
    """The validation rows of a prediction table that a protocol sees."""

    rows: pd.DataFrame
    weight: float  # number of images that each with truth OTHER counts for
    by_share: pd.DataFrame | None  # the rows of known targets of which the threshold keeps a share


def seen(table, protocol):
    """The rows that a protocol sees of a prediction table, which has columns side, role, truth and predicted."""
    rows = table[(table["side"] == "validation") & table["role"].isin(ROLES[protocol])]
    known = (rows["role"] == "known").sum()
    weight = known / (len(rows) - known) if protocol != "thesis" and 0 < known < len(rows) else 1.0
    by_share = rows[rows["role"] == "known"] if protocol == "kept" or known == len(rows) else None
    if protocol == "kept" and (left_out := table["side"] == LEFT_OUT).any():
        by_share = table[left_out]
    return Seen(rows, weight, by_share)


def choose(table, score, protocol, kept=KEPT):
    """Choose the threshold of a confidence score, a column of a prediction table, under a protocol."""
    return chosen(seen(table, protocol), score, kept)


def chosen(among, score, kept=KEPT):
    """The threshold of a confidence score, chosen on the rows that a protocol sees, `Seen`.

    It has the largest weighted F1 over the classes and OTHER; under the protocol `kept`, and if there are only known
    images, it keeps this share of them. Under the blind protocol the images of role other together count as much as the
    known ones, as the number of targets of that role says nothing of the number of unknown ones to come.
    """
    if among.by_share is not None:
        return float(np.quantile(among.by_share[score], 1 - kept))
    rows = among.rows
    return best(rows[score].to_numpy(float), rows["truth"], rows["predicted"], among.weight)


def reached(among, score, threshold):
    """The weighted F1 of a threshold on the rows, which `chosen` makes as large as it can, and their number."""
    rows = among.rows
    predicted = apply(rows[score], rows["predicted"], threshold)
    weights = np.where(rows["truth"] == OTHER, among.weight, 1.0)
    return metrics_of_labels(rows["truth"], predicted, weights)["f1_weighted"], len(rows)


def best(scores, truth, predicted, weight=1.0):
    """The threshold with the largest weighted F1, halfway between two scores; of several such the middle one.

    scores: (n,), below the threshold is OTHER; truth, predicted: labels (n,), where predicted OTHER stays so.
    weight: number of images that each image with truth OTHER counts for.
    """
    order = np.argsort(-scores, kind="stable")
    scores, truth, predicted = scores[order], np.asarray(truth)[order], np.asarray(predicted)[order]
    kept, counts = predicted != OTHER, np.where(truth == OTHER, weight, 1.0)
    # For thresholds that keep 0, 1, 2 ... images: the sum over the labels of F1 = 2 right / (predicted + true) times
    # the count of true images.
    total = np.zeros(len(scores) + 1)
    for name in np.unique(truth[truth != OTHER]):
        claimed = _running(counts * (predicted == name))
        right = _running((predicted == name) & (truth == name))
        count = (truth == name).sum()
        total += count * 2 * right / (claimed + count)
    if missed := counts[truth == OTHER].sum():
        rejected = counts.sum() - _running(counts * kept)
        right = missed - _running(counts * ((truth == OTHER) & kept))
        total += missed * 2 * right / (rejected + missed)
    # Between equal scores no threshold can pass.
    possible = np.concatenate([[True], scores[1:] < scores[:-1], [True]])
    total[~possible] = -1
    places = np.flatnonzero(total >= total.max() - 1e-9)
    place = places[len(places) // 2]
    if place == 0:
        return float(np.nextafter(scores[0], np.inf))
    return float((scores[place - 1] + scores[place]) / 2 if place < len(scores) else scores[-1])


def _running(values):
    """Sums of the first 0, 1, 2 ... of values (n,): (n + 1,)."""
    return np.concatenate([[0], np.cumsum(values)])


def apply(scores, predicted, threshold):
    """Labels (n,) with OTHER where the confidence score is below the threshold, or where OTHER was predicted."""
    return np.where(np.asarray(scores) >= threshold, predicted, OTHER)
