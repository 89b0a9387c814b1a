"""The matrices of `factorization`, factorized by JAX on a GPU: whole, by LU with partial pivoting.

They are filled on the host as in `factorization`, then moved to the device's memory in one go: (N, N) for each parity,
N^2 8 bytes in single precision, must fit into it.
"""

import ctypes
from functools import partial

import jax
import jax.numpy as jnp
import jax.scipy.linalg
import numpy as np

from isarflow.core.errors import InputError
from isarflow.scattering.factorization import GeneralMatrix, SymmetricMatrix


def give_back():
    """Return free memory, which glibc would keep, to the system for the next part of a solve."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim:
        trim(0)


class _OnDevice:
    def factorize(self, threads=1, progress=lambda done: None):
        """Factorize the whole matrix by LU on JAX's device. `threads` are not used."""
        try:
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
        return np.array(jax.scipy.linalg.lu_solve(self.factors, jnp.asarray(right, self.dtype)))


class SymmetricOnDevice(_OnDevice, SymmetricMatrix):
    """A SymmetricMatrix that is factorized on JAX's device."""

    def _move(self):
        whole = jnp.zeros((self.size, self.size), self.dtype)
        for (a, _), block in zip(self.spans, self.blocks, strict=True):
            row = jnp.asarray(block[0] + 1j * block[1], self.dtype)
            whole = _write(_write(whole, row, a, 0), row[:, :a].T, 0, a)
        self.blocks.clear()
        return whole


class GeneralOnDevice(_OnDevice, GeneralMatrix):
    """A GeneralMatrix that is factorized on JAX's device."""

    def _move(self):
        whole = jnp.zeros((self.size, self.size), self.dtype)
        for (a, _), column in zip(self.spans, self.columns, strict=True):
            whole = _write(whole, jnp.asarray(column), 0, a)
        self.columns.clear()
        return whole


@partial(jax.jit, donate_argnums=0)
def _write(whole, part, row, col):
    return jax.lax.dynamic_update_slice(whole, part, (row, col))
