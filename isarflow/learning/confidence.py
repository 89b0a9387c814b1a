"""Confidence scores: how much an image is like the known classes, to detect images out of distribution.

All are larger for an image more like the known classes; an image whose score is below a threshold is rejected. They
are made from logits, from a network's features, and from reconstructions.
"""

import numpy as np
from scipy.special import logsumexp, softmax

from isarflow.learning.classifier import OTHER
from isarflow.learning.data.features import squared_distances, unit

NEIGHBOUR = 5  # the distance to this nearest training image is the score
GAUSSIANS = ("means", "whitening", "background_mean", "background_whitening")  # names of the arrays of `fit_gaussians`


def of_logits(logits, classes):
    """Scores from logits (n, classes) of these classes: a mapping of name to (n,). A class OTHER counts as not known.

    softmax: the largest probability of a known class (Hendrycks and Gimpel 2017).
    max_logit: the largest logit of a known class (Hendrycks et al. 2022).
    energy: the logarithm of the sum of exp(logit), minus the free energy at temperature 1 (Liu et al. 2020).
    """
    known = classes != OTHER
    return {
        "softmax": softmax(logits, axis=1)[:, known].max(axis=1),
        "max_logit": logits[:, known].max(axis=1),
        "energy": logsumexp(logits[:, known], axis=1),
    }


def margin(scores, classes):
    """The largest of scores (..., classes) of a known class, (...), less that of OTHER where there is such a class."""
    known = classes != OTHER
    best = scores[..., known].max(axis=-1)
    return best if known.all() else best - scores[..., ~known][..., 0]


def neighbour_score(features, references):
    """Minus the distance of features (n, d), scaled to length 1, to the NEIGHBOUR-th nearest reference: (n,).

    references: (m, d), each of length 1; of fewer than NEIGHBOUR the farthest (Sun et al. 2022).
    """
    nearest = min(NEIGHBOUR, len(references)) - 1
    distances = squared_distances(unit(features), references, np.ones(len(references), references.dtype))
    return -np.sqrt(np.partition(distances, nearest, axis=1)[:, nearest])


def fit_gaussians(features, labels, classes):
    """A Gaussian for each class with a covariance in common, and one for all: a mapping of GAUSSIANS to arrays.

    features: (n, d); labels: (n,), each one of `classes`, which are sorted. The covariance within the classes is shrunk
    (Ledoit and Wolf 2004), as there may be fewer images than dimensions; that of all images, the background, is the
    same plus the scatter of the class means, so that the two differ only where the classes do.
    means: (classes, d); whitening: (d, d), with |(x - mean) whitening|^2 the squared Mahalanobis distance.
    """
    from sklearn.covariance import LedoitWolf  # predictions do without scikit-learn

    means = np.stack([features[labels == name].mean(axis=0) for name in classes])
    index = np.searchsorted(classes, labels)
    within = LedoitWolf(assume_centered=True).fit(features - means[index]).covariance_
    # For features that never vary one would divide by zero.
    within += (1e-6 * np.trace(within) / len(within) + 1e-12) * np.eye(len(within))
    middle = features.mean(axis=0)
    apart = (means - middle) * np.sqrt(np.bincount(index) / len(index))[:, None]
    return {
        "means": means,
        "whitening": _whitening(within),
        "background_mean": middle,
        "background_whitening": _whitening(within + apart.T @ apart),
    }


def _whitening(covariance):
    """W with W W^T the inverse of a covariance (d, d)."""
    return np.linalg.inv(np.linalg.cholesky(covariance)).T


def mahalanobis_scores(features, gaussians):
    """Scores from features (n, d) and the result of `fit_gaussians`: a mapping of name to (n,).

    mahalanobis: minus the squared distance to the nearest class (Lee et al. 2018).
    relative_mahalanobis: the same, less the distance to the Gaussian of all classes (Ren et al. 2021).
    """
    white = features @ gaussians["whitening"]
    means = gaussians["means"] @ gaussians["whitening"]
    nearest = squared_distances(white, means, np.einsum("ij,ij->i", means, means)).min(axis=1)
    background = ((features - gaussians["background_mean"]) @ gaussians["background_whitening"]) ** 2
    return {"mahalanobis": -nearest, "relative_mahalanobis": background.sum(axis=1) - nearest}


def zncc(images, others, noise=0.0):
    """Zero-mean normalised cross-correlation of images with others, both (n, pixels): (n,), 0 where one is constant.

    noise: the part of the images' variance over their pixels that comes from noise, (n,); it is subtracted.
    """
    images, others = (rows - rows.mean(axis=1, keepdims=True) for rows in (images, others))
    variance = (images**2).mean(axis=1)
    variance = np.maximum(variance - noise, 0.05 * variance)  # an estimate of the noise may take nearly all
    size = np.sqrt(variance * (others**2).mean(axis=1))
    return np.divide((images * others).mean(axis=1), size, out=np.zeros(len(images), size.dtype), where=size > 0)


def noise_variance(images):
    """The variance (n,) that noise gives the pixels of magnitude images (n, pixels), estimated from the images.

    The faintest quarter of an image's pixels is taken for noise alone. Magnitudes of noise of power P have a
    Rayleigh distribution, with first quartile sqrt(P log(4/3)) and variance (1 - pi/4) P.
    """
    power = np.quantile(images, 0.25, axis=1) ** 2 / np.log(4 / 3)
    return (1 - np.pi / 4) * power


def coherence(images, others):
    """|r^H x| / (|r| |x|) of complex images x and others r, both (n, pixels): (n,), 0 where one is zero."""
    return np.abs((unit(others).conj() * unit(images)).sum(axis=1))
