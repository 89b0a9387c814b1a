"""OpenMax (Bendale and Boult 2016; thesis section 5.3.2): logits revised by an image's distance from its class."""

import numpy as np
from scipy.special import softmax


def fit_weibull(distances, tail):
    """Location, shape and scale of a Weibull distribution fitted to the `tail` largest distances, shape (3,).

    distances: (n,), not negative. As FitHigh of libMR, with which OpenMax was published: the location is fixed, 1 below
    the smallest of the tail, and the rest follows by maximum likelihood.
    """
    largest = np.sort(np.asarray(distances, float))[-tail:]
    location = largest[0] - 1
    if np.ptp(largest) < 1e-9 * max(largest[-1], 1):  # equal distances: likelihood grows with the shape, without end
        return np.array([location, 1e3, 1.0])
    from scipy.stats import weibull_min  # takes longer to import than a prediction, which does not need it

    shape, _, scale = weibull_min.fit(largest, floc=location)
    return np.array([location, shape, scale])


def fit(logits, labels, classes, tail):
    """Mean activation vectors (classes, classes) and Weibull tails (classes, 3) (thesis eqs. 5.7, 5.8).

    logits: activation vectors (n, classes) of training images with these labels (n,); of each class those classified
    correctly count, all of them if there is none. tails: as `fit_weibull` gives them.
    """
    means, tails = [], []
    for index, name in enumerate(classes):
        of_class = labels == name
        right = of_class & (logits.argmax(axis=1) == index)
        vectors = logits[right if right.any() else of_class]
        means.append(vectors.mean(axis=0))
        tails.append(fit_weibull(np.linalg.norm(vectors - means[-1], axis=1), tail))
    return np.stack(means), np.stack(tails)


def probabilities(logits, means, tails, alpha, shifted):
    """Probabilities (n, classes + 1) by thesis eqs. 5.9 to 5.12, the unknown's in the last column.

    Each of the `alpha` largest logits loses the share that its class's Weibull distribution gives to the distance from
    the class's mean, the i-th of them weighted with (alpha + 1 - i) / alpha; what they lose is the unknown's logit.
    As published, a negative logit is raised by that and makes the unknown's negative. `shifted` first takes the
    smallest logit from all, which changes no probability of softmax and leaves none negative.
    """
    alpha = min(alpha, logits.shape[1])
    distances = np.linalg.norm(logits[:, None] - means, axis=2)
    location, shape, scale = tails.T
    with np.errstate(over="ignore"):  # far beyond the tail all is lost
        lost = -np.expm1(-(np.maximum((distances - location) / scale, 0) ** shape))
    ranks = np.argsort(np.argsort(-logits, axis=1, kind="stable"), axis=1)
    lost = lost * np.maximum(alpha - ranks, 0) / alpha
    if shifted:
        logits = logits - logits.min(axis=1, keepdims=True)
    unknown = (logits * lost).sum(axis=1, keepdims=True)
    return softmax(np.concatenate([logits * (1 - lost), unknown], axis=1), axis=1)
