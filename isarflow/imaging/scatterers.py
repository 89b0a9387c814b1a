"""Imagers that look for scatterers, finer than a resolution cell, and draw each of them as a spot."""

import functools
from collections.abc import Iterable

import numpy as np

from isarflow.core.sweep import C0
from isarflow.imaging.formation import Formation, resolution

SPOT = 1.5  # pixels, the full width of a spot at half its height: a scatterer between two pixels shows in both


class Scatterers(Formation):
    """An imager that gives a list of scatterers for each image; it defines `find`.

    Its setting `pixels` is their number in a resolution cell, along each axis. The phase of a spot is that of its
    scatterer's amplitude everywhere: there is no carrier. A sample that is exactly 0 is one that is missing.
    """

    def find(self, samples: np.ndarray) -> Iterable[tuple[np.ndarray, np.ndarray]]:
        """The scatterers of each image: places (M, 2), range and crossrange in m, and amplitudes (M,), complex, in m.

        samples: (images, F * A). An image without any, as of a zero field, gives none.
        """
        raise NotImplementedError

    @functools.cached_property
    def cell(self) -> np.ndarray:
        """The resolution in range and crossrange in m."""
        step, turn = self.frequency[1] - self.frequency[0], self.angle[1] - self.angle[0]
        return np.array(resolution(self.frequency, step, len(self.angle), turn))

    @functools.cached_property
    def wavevectors(self) -> np.ndarray:
        """(F * A, 2) in rad/m: a scatterer of amplitude f at p = (range, crossrange) has samples f exp(1j q . p)."""
        k = 2 * np.pi * self.frequency / C0
        q = -np.multiply.outer(k, np.cos(self.angle)), np.multiply.outer(k, np.sin(self.angle))
        return 2 * np.stack(q, axis=-1).reshape(-1, 2)

    def axes(self, pixels: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """The unambiguous extent, with so many pixels in a cell; by default those of the settings."""
        pixels = pixels or self.settings["pixels"]
        counts = pixels * len(self.frequency), pixels * len(self.angle)
        return tuple((np.arange(n) - n // 2) * cell / pixels for n, cell in zip(counts, self.cell, strict=True))

    def places(self, pixels: int | None = None) -> np.ndarray:
        """The pixels' centres one by one, (D * C, 2), as `axes`."""
        return np.stack(np.meshgrid(*self.axes(pixels), indexing="ij"), axis=-1).reshape(-1, 2)

    def at(self, down, cross):
        shape = len(down), len(cross)
        width = SPOT * self.cell / self.settings["pixels"]

        def images(samples):
            image = np.zeros((len(samples), *shape), np.complex64)
            for one, (places, amplitudes) in zip(image, self.find(samples.reshape(len(samples), -1)), strict=True):
                over_range, over_cross = (
                    np.exp2(-((2 * np.subtract.outer(axis, of) / size) ** 2))
                    for axis, of, size in zip((down, cross), places.T, width, strict=True)
                )
                one[:] = (over_range * amplitudes) @ over_cross.T
            return image

        return images

    def carrier(self) -> float:
        return 0.0


def waves(wavevectors: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The samples (S, M) of scatterers of amplitude 1 at places (M, D), m. wavevectors: (S, D) in rad/m."""
    return np.exp(1j * wavevectors @ places.T)


def slopes(wavevectors: np.ndarray, places: np.ndarray, amplitudes: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Derivatives (S, M * (D + 2)) of the samples of scatterers, arguments as of `waves`, of amplitudes (M,) in m.

    By the places in cells (D,), m, scatterer by scatterer, then by the real and by the imaginary parts of amplitudes.
    """
    shapes = waves(wavevectors, places)
    by_place = (1j * wavevectors * cell)[:, None, :] * (shapes * amplitudes)[:, :, None]
    return np.hstack([by_place.reshape(len(shapes), -1), shapes, 1j * shapes])
