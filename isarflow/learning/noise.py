"""The noise of images: its covariance over the pixels, and its share of an image's energy."""

import numpy as np
from scipy.linalg import eigh

from isarflow.core.errors import InputError
from isarflow.learning.data.features import by_channel, unit

LOADING = 0.01  # of the mean noise power of a pixel: the uncertainty of its covariance, estimated from few images
FAINT = 0.25  # of an image's pixels, the faintest, are taken for noise alone
SHARES = (1e-4, 0.99)  # of noise in an image's energy, at least and at most


def covariance(noise, shape, who):
    """The covariance Q (N, N) of noise over the pixels of all channels, of trace 1, from images of noise alone.

    noise: (m, [channel,] range, crossrange); shape: (channels, range, crossrange) of the images that `who` learns from.
    All channels have the same noise. It is white if all images of noise are empty, as those of an imager that finds
    points are. Raises InputError where there are no images of noise, or of another shape or not finite.
    """
    size = np.prod(shape[1:])
    noise = np.zeros(0) if noise is None else np.asarray(noise)
    asked = f"images of noise alone, (m, {', '.join(map(str, shape))})"
    if noise.ndim < 3 or len(noise) == 0 or by_channel(noise).shape[1:] != tuple(shape):
        there = "none" if noise.size == 0 else f"an array {noise.shape}"
        raise InputError(f"the {who} learns from {asked}; its attribute 'noise' is {there} when it is fitted.")
    if not np.isfinite(noise).all():
        raise InputError(f"the {who} learns from {asked}; some of its 'noise' is not finite.")
    rows = unit(noise.reshape(-1, size))
    rows = rows[rows.any(axis=1)]
    one = rows.T @ rows.conj() / len(rows) if len(rows) else np.eye(size) / size
    return np.kron(np.eye(shape[0]), one) / shape[0]


def powers(covariance):
    """The noise's power in each pixel, (N,), float32: the diagonal of its covariance."""
    return np.maximum(np.diag(covariance).real, 1e-12).astype(np.float32)


def loaded(covariance):
    """The covariance (N, N) of trace 1 with LOADING of its mean power more on the diagonal."""
    return covariance + LOADING / len(covariance) * np.eye(len(covariance))


def whitened(rows, covariance, weakest=-np.inf):
    """Powers (d,) and a basis B (N, d) with B^H Q B = 1 and B^H R B = diag(powers), all above `weakest`.

    R is the covariance of rows (m, N), images of unit length; Q that of the noise.
    """
    spread = rows.T @ rows.conj() / len(rows)
    return eigh(spread.astype(complex), covariance.astype(complex), subset_by_value=(weakest, np.inf))


def share(magnitudes, powers):
    """The share of noise in the energy of images, (n,), float32, from the faint pixels of their magnitudes (n, N).

    Images have unit length; powers: (N,), Q's diagonal. For noise alone |x_p|^2 / Q_pp has an exponential distribution,
    with -log(1 - FAINT) as its quantile FAINT.
    """
    found = np.quantile(magnitudes**2 / powers, FAINT, axis=1) / -np.log(1 - FAINT)
    return np.clip(found, *SHARES).astype(np.float32)
