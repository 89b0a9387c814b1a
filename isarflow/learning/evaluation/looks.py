"""Add the scores of several looks at a target along a track: rows of a prediction table."""

import numpy as np
import pandas as pd

from isarflow.learning.predict import KNOWN, SCORE

LOOKS = (2, 3, 5)  # how many are added
TRACK = ["target", "elevation", "realization", "side", "fold"]  # columns in which all looks of a track are equal


def fused(table, count, step, aperture):
    """All rows of a prediction table at which a track begins, with the scores of `count` looks added up.

    The looks of a track have azimuths an aperture apart, so that no two share a sample or noise. step: degrees between
    azimuths; aperture: number of azimuths of an image. The columns score_<class> and known_<score> have the sums, which
    is right for logarithms of likelihoods and of their ratios; `predicted` follows from the former. Other columns are
    taken from the first look. No row is left if a circle has no room for so many looks.
    """
    number, circle = ((table["azimuth"] - table["azimuth"].min()) / step).round().astype(int), 360 / step
    places = table[TRACK].round(4).assign(number=number)
    index, rows = pd.MultiIndex.from_frame(places), []
    for look in range(count):
        along = number + look * aperture
        # If the sweep is not a closed circle, it has no azimuth there.
        places["number"] = along % round(circle) if abs(circle - round(circle)) < 1e-6 else along
        rows.append(index.get_indexer(pd.MultiIndex.from_frame(places)))
    begins = (np.array(rows) >= 0).all(axis=0) & (count * aperture <= circle + 1e-6)
    names = [name for name in table if name.startswith((SCORE, KNOWN))]
    values, result = table[names].to_numpy(float), table[begins].reset_index(drop=True)
    result[names] = sum((values[row[begins]] for row in rows), np.zeros((len(result), len(names))))
    classes = [name for name in names if name.startswith(SCORE)]
    if len(result):
        result["predicted"] = result[classes].idxmax(axis=1).str.removeprefix(SCORE)
    return result
