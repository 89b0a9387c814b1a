"""Add the scores of several looks at a target along a track: rows of a prediction table."""

import numpy as np
import pandas as pd

from isarflow.learning.classifier import best_known
from isarflow.learning.tables import KNOWN, SCORE

LOOKS = (2, 3, 5)  # how many are added
TRACK = ["target", "elevation", "realization", "side", "fold"]  # columns in which all looks of a track are equal


def fused(table, count, step, aperture):
    """All rows of a prediction table at which a track begins, with the scores of `count` looks added up.

    The looks of a track have azimuths an aperture apart, so that no two share a sample or noise. step: degrees between
    azimuths; aperture: number of azimuths of an image. The columns score_<class> and known_<score> have the sums, which
    is right for logarithms of likelihoods and of their ratios; `predicted` is the known class of the largest sum. Other
    columns are taken from the first look. No row is left if a circle has no room for so many looks.
    """
    azimuth, circle = ((table["azimuth"] - table["azimuth"].min()) / step).round().astype(int), 360 / step
    keys = table[TRACK].round(4).assign(azimuth=azimuth)  # azimuths are numbered by steps
    index, rows_of_looks = pd.MultiIndex.from_frame(keys), []
    for look in range(count):
        along = azimuth + look * aperture
        # Where azimuths close a circle a track goes on past its end; else there is no such row (-1).
        keys["azimuth"] = along % round(circle) if abs(circle - round(circle)) < 1e-6 else along
        rows_of_looks.append(index.get_indexer(pd.MultiIndex.from_frame(keys)))
    begins = (np.array(rows_of_looks) >= 0).all(axis=0) & (count * aperture <= circle + 1e-6)
    names = [name for name in table if name.startswith((SCORE, KNOWN))]
    values, result = table[names].to_numpy(float), table[begins].reset_index(drop=True)
    result[names] = sum((values[row[begins]] for row in rows_of_looks), np.zeros((len(result), len(names))))
    classes = np.array([name.removeprefix(SCORE) for name in names if name.startswith(SCORE)])
    result["predicted"] = best_known(result[[SCORE + name for name in classes]].to_numpy(), classes)
    return result
