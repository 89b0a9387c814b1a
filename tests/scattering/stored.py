"""Matrices of the solver as plain arrays."""

import numpy as np


def dense(matrix):
    """A matrix (N, N), symmetric or not, that is not factorized yet."""
    if hasattr(matrix, "columns"):
        return np.concatenate(matrix.columns, 1)
    result = np.empty((matrix.size, matrix.size), matrix.dtype)
    for (a, b), block in zip(matrix.spans, matrix.blocks, strict=True):
        result[a:b, :b] = block[0] + 1j * block[1]
        result[:a, a:b] = result[a:b, :a].T
    return result
