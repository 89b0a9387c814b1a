"""Matrices of the solver as plain arrays, and their size."""

import numpy as np

from isarflow.scattering.mom.basis import rwg


def dense(matrix):
    """A matrix (N, N), symmetric or not, that is not factorized yet."""
    if hasattr(matrix, "columns"):
        return np.concatenate(matrix.columns, 1)
    result = np.empty((matrix.size, matrix.size), matrix.dtype)
    for (a, b), block in zip(matrix.spans, matrix.blocks, strict=True):
        result[a:b, :b] = block[0] + 1j * block[1]
        result[:a, a:b] = result[a:b, :a].T
    return result


def unknowns(surface):
    """Count the RWG functions of a Surface over all parities."""
    return sum(len(rwg(surface, parity)) for parity in surface.parities)
