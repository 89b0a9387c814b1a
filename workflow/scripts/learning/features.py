"""What models compute from complex images."""

import numpy as np


def real_imaginary(images, dtype=np.float32):
    """Real parts, then imaginary parts: images (n, range, crossrange) to features (n, 2 range crossrange)."""
    flat = images.reshape(len(images), -1)
    return np.concatenate([flat.real, flat.imag], axis=1).astype(dtype, copy=False)


def squared_distances(x, references, squared_norms):
    """Squared Euclidean distances between x (n, features) and references (m, features), shape (n, m).

    One matrix product, |x|^2 - 2 x.r + |r|^2; `squared_norms` are the references' |r|^2, shape (m,).
    """
    distances = x @ references.T
    distances *= -2
    distances += squared_norms
    distances += np.einsum("ij,ij->i", x, x)[:, None]
    # Rounding can take the distance between equal points below zero.
    return np.maximum(distances, 0, out=distances)
