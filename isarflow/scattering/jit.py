"""Functions that Numba compiles, kept for the next job."""

import numba

from isarflow.core.compiled import folder

numba.config.CACHE_DIR = numba.config.CACHE_DIR or folder()


def kernel(function=None, **settings):
    """Compile a function by Numba, with these settings, so that several threads may run it; a decorator."""
    return numba.njit(function, nogil=True, cache=True, error_model="numpy", **settings)
