"""Sparse recovery: the fewest scatterers on a fine grid that explain the samples, by the L1 norm.

Of each image x the smallest |A x - y|^2 / 2 + t sum |x| is sought, A the waves of all pixels, by FISTA (Beck and
Teboulle, SIAM J. Imaging Sci. 2, 2009), which starts anew where it overshoots (O'Donoghue and Candes, Found. Comput.
Math. 15, 2015). All images are found at once.
"""

import functools

import numpy as np

from isarflow.imaging.scatterers import Scatterers, waves

FAINTEST = 1e-3  # of the strongest pixel: what is weaker is not drawn


class Imager(Scatterers):
    """The L1 norm makes amplitudes too small: those of an image are scaled to fit its samples."""

    SETTINGS = {
        "pixels": {"type": "integer", "minimum": 1, "maximum": 8, "description": "pixels in a cell, 1 to 8"},
        "sparsity": {
            "type": "number",
            "exclusiveMinimum": 0,
            "exclusiveMaximum": 1,
            "description": "weight of the L1 norm, of that which leaves nothing: between 0 and 1; 0.1 is usual",
        },
        "iterations": {"type": "integer", "minimum": 1, "maximum": 100000, "description": "of FISTA; 100 is usual"},
    }

    @functools.cached_property
    def matrix(self):
        """The waves of all pixels, (pixels, F * A)."""
        return waves(self.wavevectors, self.places()).T.astype(np.complex64)

    def find(self, samples):
        samples = samples.astype(np.complex64)
        there = samples != 0
        image = fista(self.matrix, samples, there, self.settings["sparsity"], self.settings["iterations"])
        fitted = (image @ self.matrix) * there
        power = (np.abs(fitted) ** 2).sum(axis=1)
        scale = (fitted.conj() * samples).sum(axis=1) / np.where(power > 0, power, 1)
        places = self.places()
        for one, factor in zip(image, scale, strict=True):
            shown = np.abs(one) > FAINTEST * np.abs(one).max()
            yield places[shown], factor * one[shown]


def fista(matrix, samples, there, sparsity, iterations):
    """The images (images, P) of least |image @ matrix - samples|^2 / 2 + t |image|_1.

    matrix: (P, S); samples (images, S), of which only those count that are `there`, (images, S). t is `sparsity` times
    the least t of which an image is empty.
    """
    back = matrix.conj().T.copy()
    step = 1 / np.linalg.norm(back @ matrix, 2)  # of the largest that converges
    threshold = (sparsity * step * np.abs(samples @ back).max(axis=1, keepdims=True)).astype(np.float32)
    image = ahead = np.zeros((len(samples), len(matrix)), np.complex64)
    momentum = np.ones((len(samples), 1), np.float32)
    for _ in range(iterations):
        moved = ahead - step * (((ahead @ matrix - samples) * there) @ back)
        size = np.abs(moved)
        found = moved * (np.maximum(size - threshold, 0) / np.maximum(size, 1e-30))
        overshot = ((ahead - found).conj() * (found - image)).real.sum(axis=1, keepdims=True) > 0
        momentum[overshot] = 1
        grown = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
        ahead = found + (momentum - 1) / grown * (found - image)
        image, momentum = found, grown
    return image
