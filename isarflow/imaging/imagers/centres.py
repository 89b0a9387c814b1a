"""Scattering centres: as few points as the samples ask for, each where it fits best.

They are found one by one, the next where the rest correlates most (orthogonal matching pursuit: Pati, Rezaiifar and
Krishnaprasad, Asilomar 1993). After each, least squares moves all of them and sets their amplitudes. Their number is
that of the least Bayesian information criterion (Schwarz, Ann. Stat. 6, 1978).
"""

import functools

import numpy as np
from scipy.optimize import least_squares

from isarflow.imaging.scatterers import Scatterers, slopes, waves

SEARCHED = 2  # places in a cell at which the next centre is looked for
CLEAN = 1e-8  # of the samples' power: what is left below it counts as noise, as that of numbers of single precision
STEPS = 30  # evaluations of least squares, at most


class Imager(Scatterers):
    SETTINGS = {
        "pixels": {"type": "integer", "minimum": 1, "maximum": 64, "description": "pixels in a cell, 1 to 64"},
        "centres": {"type": "integer", "minimum": 1, "maximum": 1000, "description": "scattering centres at most"},
    }

    @functools.cached_property
    def searched(self):
        """Places where centres are looked for, (P, 2), and their waves, (F * A, P)."""
        places = self.places(SEARCHED)
        return places, waves(self.wavevectors, places).astype(np.complex64)

    def find(self, samples):
        for one in samples:
            yield fit(one, self.wavevectors, *self.searched, self.cell, self.settings["centres"])


def fit(samples, wavevectors, searched, atoms, cell, most):
    """Scattering centres of samples (S,) in m: places (M, D) in m, and amplitudes (M,), complex, in m.

    wavevectors: (S, D) in rad/m, see `waves`. searched: (P, D), places where centres are looked for, and atoms, (S, P),
    their waves. cell: (D,), the resolution in m. most: the largest M. Samples of exactly 0 are left out.
    """
    there = samples != 0
    samples, wavevectors, atoms = samples[there].astype(complex), wavevectors[there], atoms[there]
    places, amplitudes = np.empty((0, wavevectors.shape[1])), np.empty(0, complex)
    if not len(samples):
        return places, amplitudes
    values, floor = 2 * len(samples), CLEAN * (np.abs(samples) ** 2).sum()

    def criterion(rest, count):
        each = 2 + wavevectors.shape[1]  # numbers of a centre: its place and its complex amplitude
        return values * np.log((np.abs(rest) ** 2).sum() + floor) + each * count * np.log(values)

    rest, least = samples, criterion(samples, 0)
    while len(places) < min(most, values // 8):
        strongest = np.abs(rest.conj().astype(np.complex64) @ atoms).argmax()
        tried = refined(samples, wavevectors, np.vstack([places, searched[strongest]]), cell)
        left = samples - waves(wavevectors, tried[0]) @ tried[1]
        if criterion(left, len(tried[0])) >= least:
            break
        (places, amplitudes), rest, least = tried, left, criterion(left, len(tried[0]))
    return places, amplitudes


def refined(samples, wavevectors, places, cell):
    """Places (M, D) moved to where the squared error is least, and amplitudes (M,) there. Arguments as of `fit`."""
    count, directions = places.shape

    def parts(values):  # of complex numbers as real ones
        return np.concatenate([values.real, values.imag])

    def split(unknowns):
        moved, real, imaginary = np.split(unknowns, [count * directions, count * (directions + 1)])
        return moved.reshape(places.shape) * cell, real + 1j * imaginary

    def error(unknowns):
        moved, amplitudes = split(unknowns)
        return parts(waves(wavevectors, moved) @ amplitudes - samples)

    def slope(unknowns):
        return parts(slopes(wavevectors, *split(unknowns), cell))

    amplitudes = np.linalg.lstsq(waves(wavevectors, places), samples)[0]
    scale = np.abs(samples).max()
    samples, amplitudes = samples / scale, amplitudes / scale
    start = np.concatenate([(places / cell).ravel(), amplitudes.real, amplitudes.imag])
    moved, amplitudes = split(least_squares(error, start, slope, method="lm", max_nfev=STEPS).x)
    return moved, scale * amplitudes
