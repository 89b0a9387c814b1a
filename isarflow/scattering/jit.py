"""Functions that Numba compiles, kept for the next job."""

from functools import partial

import numba

from isarflow.core.compiled import folder


def kernel(function=None, **settings):
    """Compile a function by Numba, with these settings, so that several threads may run it; a decorator."""
    if function is None:
        return partial(kernel, **settings)
    before = numba.config.CACHE_DIR  # which Numba reads when a function is decorated
    numba.config.CACHE_DIR = before or folder()
    try:
        return numba.njit(function, nogil=True, cache=True, error_model="numpy", **settings)
    finally:
        numba.config.CACHE_DIR = before
