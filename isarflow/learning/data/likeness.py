"""How much images are like each other: the zero-mean normalised cross-correlation (ZNCC) of their magnitudes."""

import numpy as np
import pandas as pd

from isarflow.core import sweep
from isarflow.learning.data import features


def standardized(images):
    """Return magnitudes of images (n, ...) as rows (n, d) of mean 0 and length 1; a constant one stays zero."""
    return features.standardized(np.abs(images).reshape(len(images), -1))


def by_angle(image, farthest):
    """Return the ZNCC of pairs of images (elevation, azimuth, ...) by the angle between them.

    farthest: degrees. Columns along (azimuth or elevation), degrees, mean; low and high: the 10th and 90th of 100.
    """
    image = image.transpose("elevation", "azimuth", ...).load()
    azimuth, elevation = image.azimuth.values, image.elevation.values
    rows = standardized(image.stack(view=["elevation", "azimuth"]).transpose("view", ...).values)
    rows, found = rows.reshape(len(elevation), len(azimuth), -1), []
    step = azimuth[1] - azimuth[0]
    for lag in range(1, min(int(farthest / step + 1e-6), len(azimuth) - 1) + 1):
        there = np.roll(rows, -lag, axis=1) if sweep.closes_circle(azimuth) else rows[:, lag:]
        found.append(("azimuth", lag * step, np.einsum("eap,eap->ea", rows[:, : there.shape[1]], there)))
    apart = (elevation - elevation[:, None]).round(4)
    for degrees in np.unique(apart[(apart > 0) & (apart <= farthest)]):
        low, high = np.nonzero(apart == degrees)
        found.append(("elevation", degrees, np.einsum("eap,eap->ea", rows[low], rows[high])))
    table = [(along, degrees, x.mean(), *np.quantile(x, (0.1, 0.9))) for along, degrees, x in found]
    return pd.DataFrame(table, columns=["along", "degrees", "mean", "low", "high"])


def most_alike(rows, known):
    """Return where one of `rows` is most like one of `known`: its number, the rows' of both, and their ZNCC.

    rows: (n, d); known: a list of the same, as of `standardized`.
    """
    alike = np.stack([rows @ other.T for other in known])
    return *np.unravel_index(alike.argmax(), alike.shape), alike.max()
