"""The threshold below which an image is rejected as none of the known classes.

It is chosen on validation images, for each SNR separately, as a radar knows the level of its noise. Three protocols:
`thesis` sees the unknown targets among them; `blind` only known targets and targets of role other; `kept` keeps a share
of the known ones, or of training views if the model can leave these out of its library in turn: they are many more.
By family there is `mix`, which is `blind` where four of five images are of none of the known classes.
"""

import numpy as np

from isarflow.learning.classifier import OTHER
from isarflow.learning.data.split import LEFT_OUT
from isarflow.learning.evaluation.metrics import KEPT_SHARE, UNKNOWN_MIX, metrics_of_labels

# Roles whose validation images judge a protocol; all but `kept` also choose by them.
ROLES = {"thesis": ("known", "unknown"), "blind": ("known", "other"), "kept": ("known", "other")}
BY_FAMILY = {
    "blind": ROLES["blind"],
    "kept": ROLES["kept"],
    "mix": ROLES["blind"],
}  # the protocols of a split by family


def choose(table, score, protocol, kept_share=KEPT_SHARE):
    """The threshold of a confidence score, a column of a prediction table, under a protocol: `threshold_and_f1`."""
    return threshold_and_f1(table, score, protocol, kept_share)[0]


def threshold_and_f1(table, score, protocol, kept_share=KEPT_SHARE):
    """The threshold of a score under a protocol, the weighted F1 that it reaches on validation rows, and their number.

    table: of predictions, with columns side, role, truth, predicted and the score's. The threshold has the largest
    weighted F1 over the classes and OTHER; under the protocol `kept`, and if there are only known images, it keeps this
    share of them. Under `blind` and `kept` the images of role other together count as much as the known ones in this
    F1, under `mix` four times as much, as the number of targets of that role says nothing of the number of unknown ones
    to come. Under `thesis` every image counts once.
    """
    judging = ((table["side"] == "validation") & table["role"].isin((ROLES | BY_FAMILY)[protocol])).to_numpy()
    truth, predicted, role, scores = (table[name].to_numpy()[judging] for name in ("truth", "predicted", "role", score))
    is_known, left_out = role == "known", (table["side"] == LEFT_OUT).to_numpy()
    known, count = is_known.sum(), len(scores)
    weight = known / (count - known) if protocol != "thesis" and 0 < known < count else 1.0
    weight *= UNKNOWN_MIX / (1 - UNKNOWN_MIX) if protocol == "mix" else 1
    if protocol == "kept" or known == count:
        shared = table[score].to_numpy()[left_out] if protocol == "kept" and left_out.any() else scores[is_known]
        threshold = float(np.quantile(shared, 1 - kept_share))
    else:
        threshold = best(scores.astype(float), truth, predicted, weight)
    labels = apply(scores, predicted, threshold)
    weights = np.where(truth == OTHER, weight, 1.0)
    return threshold, metrics_of_labels(truth, labels, weights)["f1_weighted"], count


def best(scores, truth, predicted, weight=1.0):
    """Return the threshold with the largest weighted F1, halfway between two scores; of several such the middle one.

    scores: (n,), below the threshold is OTHER; truth, predicted: labels (n,), where predicted OTHER stays so.
    weight: number of images that each image with truth OTHER counts for.
    """
    order = np.argsort(-scores, kind="stable")
    scores, truth, predicted = scores[order], np.asarray(truth)[order], np.asarray(predicted)[order]
    labelled, weights = predicted != OTHER, np.where(truth == OTHER, weight, 1.0)
    # For thresholds that keep 0, 1, 2 ... images: the sum over the labels of F1 = 2 right / (claimed + count), times
    # count: right are the images rightly given a label, claimed those given it, count those whose label it is.
    total = np.zeros(len(scores) + 1)
    for name in sorted({*truth} - {OTHER}):
        claimed = _running(weights * (predicted == name))
        right = _running((predicted == name) & (truth == name))
        count = (truth == name).sum()
        total += count * 2 * right / (claimed + count)
    if count := weights[truth == OTHER].sum():
        claimed = weights.sum() - _running(weights * labelled)
        right = count - _running(weights * ((truth == OTHER) & labelled))
        total += count * 2 * right / (claimed + count)
    # No threshold separates equal scores.
    possible = np.concatenate([[True], scores[1:] < scores[:-1], [True]])
    total[~possible] = -1
    best_kept = np.flatnonzero(total >= total.max() - 1e-9)
    kept = best_kept[len(best_kept) // 2]  # how many images the threshold keeps
    if kept == 0:
        return float(np.nextafter(scores[0], np.inf))
    return float((scores[kept - 1] + scores[kept]) / 2 if kept < len(scores) else scores[-1])


def _running(values):
    """Sums of the first 0, 1, 2 ... of values (n,): (n + 1,)."""
    return np.concatenate([[0], np.cumsum(values)])


def apply(scores, predicted, threshold):
    """Labels (n,) with OTHER where the confidence score is below the threshold, or where OTHER was predicted."""
    return np.where(np.asarray(scores) >= threshold, predicted, OTHER)
