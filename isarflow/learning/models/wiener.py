"""Wiener filter in front of another model: an image is shrunk to the library by its own share of noise."""

import numpy as np

from isarflow.learning import noise
from isarflow.learning.data.features import unit_rows
from isarflow.learning.denoised import Denoised

BLOCK = 64  # images at a time, always: the last bits of a product depend on how many rows it has


class Model(Denoised):
    """The linear estimate of least mean squared error of the image without noise (Wiener 1949), all channels in one.

    An image of unit energy holds a share n of noise, of covariance n Q, and a view of the library, of covariance
    (1 - n) R, R being that of the training images. Its estimate is (1 - n) R ((1 - n) R + n Q)^-1 times the image. In
    the basis B with B^H Q B = 1 and B^H R B = diag(p) the gain is diagonal: (1 - n) p / ((1 - n) p + n).
    basis_: (N, N), conjugate, of rows to coordinates; back_: (N, N), of coordinates to rows; powers_: (N,), p; noise_:
    (N,), the diagonal of Q.
    """

    LABELS = {"wiener": ("ZNCC, Wiener", "the ZNCC of images shrunk to the library", 27)}
    SETTINGS = {"of": {"$ref": "#/$defs/model", "description": "the model of the same experiment that sees the images"}}
    covariances = True

    def learn(self, images):
        covariance = noise.covariance(self.noise, images.shape[1:], "Wiener filter")
        self.noise_, loaded = noise.powers(covariance), noise.loaded(covariance)
        powers, basis = noise.whitened(unit_rows(images), loaded)
        self.powers_ = np.maximum(powers, 0).astype(np.float32)
        # Rows are transposed columns. The inverse of B^H is Q B.
        self.basis_, self.back_ = basis.conj().astype(np.complex64), (loaded @ basis).T.astype(np.complex64)

    def denoised(self, images):
        rows = unit_rows(images)
        made = np.empty_like(rows)
        for start in range(0, len(rows), BLOCK):
            block = np.resize(rows[start : start + BLOCK], (BLOCK, rows.shape[1]))
            share = noise.share(np.abs(block), self.noise_)[:, None]
            clean = (1 - share) * self.powers_
            made[start : start + BLOCK] = (block @ self.basis_ * (clean / (clean + share)) @ self.back_)[
                : len(rows) - start
            ]
        return made.reshape(images.shape)
