"""Compute range profiles: echo against range at one aspect, from all frequencies together."""

import numpy as np

from isarflow.core.sweep import C0

OVERSAMPLING = 8


def range_profiles(field, frequency):
    """Return range (ranges,) in m, one unambiguous length, negative towards the radar, and profiles (ranges, azimuth).

    field: (frequency, azimuth) in m; frequency: Hz. A Hamming window, then the sum over frequencies.
    """
    count = OVERSAMPLING * len(frequency)
    distance = (np.arange(count) - count // 2) * (C0 / (2 * (frequency[1] - frequency[0]))) / count
    # A scatterer at range r has phase exp(-2jkr), k = 2 pi f / c: the conjugate brings it back into phase.
    steering = np.exp(4j * np.pi / C0 * np.outer(distance, frequency - frequency.mean()))
    window = np.hamming(len(frequency))
    return distance, steering @ (window[:, None] / window.sum() * field)
