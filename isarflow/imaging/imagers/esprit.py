"""A subspace method: two-dimensional ESPRIT, which reads places from how the signal's subspace turns along each axis.

The samples are interpolated onto a uniform grid (kx, ky). Its windows of half its sides, and their mirror images
(spatial smoothing, forward and backward), span a subspace, which scatterers turn by one phase for each step of an axis.
The phases of both axes belong together as they have the same eigenvectors (Rouquette and Najim, IEEE Trans. Signal
Process. 49, 2001). Amplitudes are the least squares fit to the samples. There is no search, hence its speed.
"""

import functools

import numpy as np

from isarflow.imaging.imagers.fourier import wavenumber_grid
from isarflow.imaging.scatterers import Scatterers, waves

EXTENT = 0.8  # of the unambiguous extent: within it the interpolation is good to 2 %
RIDGE = 1e-4  # of the samples' power, added as noise, without which the interpolation would amplify it
DRAWS = 16  # of noise alone, of which the strongest eigenvalue is what a signal has to exceed
MIXED = 0.7  # of the turn along cross-range, added to that along range: alike phases in one of them are told apart
WORST = 1e-3  # least squares leaves out what is weaker, relative: amplitudes of places as one would grow


class Imager(Scatterers):
    SETTINGS = {
        "pixels": {"type": "integer", "minimum": 1, "maximum": 64, "description": "pixels in a cell, 1 to 64"},
        "scatterers": {"type": "integer", "minimum": 1, "maximum": 1000, "description": "scatterers at most"},
    }

    def __init__(self, frequency, angle, settings):
        super().__init__(frequency, angle, settings)
        kx, ky = wavenumber_grid(frequency, angle, "polar")
        self.steps = 2 * np.array([kx[0] - kx[1], ky[1] - ky[0]])  # of the phase, in rad/m of range and of crossrange
        self.uniform = 2 * np.stack(np.meshgrid(-kx, ky, indexing="ij"), axis=-1).reshape(-1, 2)
        self.window = len(kx) // 2 + 1, len(ky) // 2 + 1

    @functools.cached_property
    def interpolation(self):
        """From the samples to the uniform grid: the best linear estimate if scatterers lie anywhere within EXTENT."""
        box = EXTENT * self.cell * [len(self.frequency), len(self.angle)]

        def alike(here, there):  # the covariance of samples at wavevectors
            apart = (here[:, None] - there) * box / (2 * np.pi)
            return np.sinc(apart).prod(axis=-1)

        own = alike(self.wavevectors, self.wavevectors) + RIDGE * np.eye(len(self.wavevectors))
        return np.linalg.solve(own, alike(self.wavevectors, self.uniform)).astype(np.complex64)

    @functools.cached_property
    def strongest_noise(self):
        """The largest eigenvalue that noise alone has, in medians of its eigenvalues."""
        parts = np.random.default_rng(0).standard_normal((DRAWS, len(self.wavevectors), 2))
        values, _ = self.spectrum(parts @ [1, 1j])
        return float((values[:, -1] / np.median(values, axis=1)).max())

    def spectrum(self, samples):
        """Eigenvalues (images, N), ascending, and eigenvectors (images, N, N) of the windows' covariance."""
        grid = (samples @ self.interpolation).reshape(-1, len(self.frequency), len(self.angle))
        cut = np.lib.stride_tricks.sliding_window_view(grid, self.window, axis=(1, 2))
        cut = cut.reshape(len(grid), -1, self.window[0] * self.window[1])
        covariance = np.swapaxes(cut, 1, 2) @ cut.conj()
        return np.linalg.eigh(covariance + covariance[:, ::-1, ::-1].conj())

    def find(self, samples):
        most = min(self.settings["scatterers"], (self.window[0] - 1) * (self.window[1] - 1) // 2)
        for one, values, vectors in zip(samples, *self.spectrum(samples), strict=True):
            count = min(int((values > self.strongest_noise * np.median(values)).sum()), most) if one.any() else 0
            places = self.places_of(vectors[:, ::-1][:, :count]) if count else np.empty((0, 2))
            amplitudes = np.linalg.lstsq(waves(self.wavevectors, places), one, WORST)[0] if count else np.empty(0)
            yield places, amplitudes

    def places_of(self, subspace):
        """The places (M, 2) in m of M scatterers, whose windows span a subspace (N, M)."""
        count = subspace.shape[1]
        by_axis = subspace.reshape(*self.window, count)
        pairs = (by_axis[:-1], by_axis[1:]), (by_axis[:, :-1], by_axis[:, 1:])
        turns = [np.linalg.lstsq(*(part.reshape(-1, count) for part in pair))[0] for pair in pairs]
        _, shared = np.linalg.eig(turns[0] + MIXED * turns[1])
        phases = [np.angle(np.diagonal(np.linalg.solve(shared, turn @ shared))) for turn in turns]
        return np.stack(phases, axis=-1) / self.steps
