"""The matrices of `factorization`, factorized by JAX on a GPU: whole, by LU with partial pivoting.

They are filled on the host as in `factorization`, then moved to the device: (N, N) for each parity, 8 N^2 bytes
in single precision, must fit into it. XLA compiles for every shape, which takes as long as a small matrix's LU:
therefore matrices are enlarged by rows and columns of the identity, and right sides by zeros, to a few round sizes.
"""

import ctypes
from functools import partial

import jax
import jax.numpy as jnp
import jax.scipy.linalg
import numpy as np

from isarflow.core.errors import InputError
from isarflow.scattering.mom.factorization import SymmetricMatrix

SIZE_STEP = 1024  # sizes of matrices are multiples of it
COLUMNS_STEP = 256  # numbers of right sides are multiples of it


def give_back():
    """Return free memory, which glibc would keep, to the system for the next part of a solve."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim:
        trim(0)


def holds(unknowns, parities):
    """Whether JAX's device is a GPU whose memory holds a solve by whole matrices in single precision.

    That is all parities' factors and, while the last matrix is factorized, XLA's copies of it: with two parities of
    46,293 unknowns each, 76 GB were too few.
    """
    if jax.default_backend() == "cpu":
        return False
    return 8 * (unknowns / parities) ** 2 * (parities + 3) < jax.devices()[0].memory_stats()["bytes_limit"]


class OnDevice:
    """A filled SymmetricMatrix or GeneralMatrix, moved to JAX's device and factorized there."""

    def __init__(self, matrix):
        self.matrix, self.size, self.dtype = matrix, matrix.size, matrix.dtype

    def factorize(self, threads=1, progress=lambda done: None):
        """Factorize the whole matrix by LU on JAX's device. `threads` are not used."""
        try:
            # Also for single precision: what XLA compiles is the same for all settings of a process.
            with jax.enable_x64(True):
                self.factors = jax.block_until_ready(jax.scipy.linalg.lu_factor(self._move(), overwrite_a=True))
        except jax.errors.JaxRuntimeError as error:
            if "RESOURCE_EXHAUSTED" not in str(error):
                raise
            raise InputError(
                f"a matrix of {self.size} unknowns does not fit into the memory of {jax.devices()[0].device_kind}; "
                "set JAX_PLATFORMS=cpu in the environment to solve on the processor."
            ) from None
        progress(1.0)

    def between(self, left, right, groups, threads=1):
        """left^T A^-1 right for groups (slices) of their columns, (N, D) each: a list of (K, K) complex128."""
        x = self.solve(right)
        return [(left[:, group].T @ x[:, group]).astype(np.complex128) for group in groups]

    def solve(self, right, threads=1):
        """A^-1 right, (N, D)."""
        padded = np.zeros((len(self.factors[1]), _round_up(right.shape[1], COLUMNS_STEP)), self.dtype)
        padded[: self.size, : right.shape[1]] = right
        with jax.enable_x64(True):
            return np.array(jax.scipy.linalg.lu_solve(self.factors, padded))[: self.size, : right.shape[1]]

    def _move(self):
        """The enlarged matrix on the device, strip by strip; the host's strips are dropped."""
        symmetric, size, begin = isinstance(self.matrix, SymmetricMatrix), _round_up(self.size, SIZE_STEP), 0
        strips, whole = self.matrix.blocks if symmetric else self.matrix.columns, jnp.zeros((size, size), self.dtype)
        while strips:
            strip = strips.pop(0)
            strip = strip[0] + 1j * strip[1] if symmetric else strip.T
            rows = np.zeros((len(strip), size), self.dtype)
            rows[:, : strip.shape[1]] = strip
            whole = _write(whole, rows, begin)
            begin += len(rows)
        return _complete(whole, self.size, symmetric)


@partial(jax.jit, donate_argnums=0)
def _write(whole, rows, begin):
    return jax.lax.dynamic_update_slice(whole, rows, (begin, 0))


@partial(jax.jit, static_argnums=2)
def _complete(rows, size, symmetric):
    """The matrix from the rows of its lower triangle, or from the rows of its transpose; beyond `size` the identity."""
    row, col = (jax.lax.broadcasted_iota(jnp.int32, rows.shape, axis) for axis in (0, 1))
    whole = jnp.where(row < col, rows.T, rows) if symmetric else rows.T
    return jnp.where((row == col) & (row >= size), 1, whole)


def _round_up(count, step):
    return -(-count // step) * step
