"""Measure how much slower this machine is than the one of `costs`'s times, in a tenth of a second.

Two rates bound a solve: of matrix products, and of passes over arrays. Both are measured on one core; the
core's time counts, not the clock's, so other programs make little difference.
"""

import time
import timeit
from functools import cache

import numpy as np

from isarflow.scattering.threads import blas_of_one_thread

MATRIX_ROWS = 512  # of the matrices of a product
PASS_NUMBERS = 250_000  # complex ones that a pass is over
REPEATS = 5  # of which the fastest counts: another program may run at the same time
REFERENCE_SECONDS = 0.0105, 0.0052  # of a product and of a pass on the reference machine


@cache
def slowness():
    """Time of work here over that on the reference machine."""
    return float(np.mean(np.divide(benchmark(), REFERENCE_SECONDS)))


def benchmark():
    """Seconds of a core for a product of two complex matrices in single precision, and for exp(j x) in double."""
    rng = np.random.default_rng(0)
    matrix = (rng.standard_normal((MATRIX_ROWS, MATRIX_ROWS)) + 1j).astype(np.complex64)
    phases = 1j * rng.standard_normal(PASS_NUMBERS)
    works = (lambda: matrix @ matrix), (lambda: np.exp(phases))
    with blas_of_one_thread:
        return tuple(min(timeit.repeat(work, timer=time.thread_time, repeat=REPEATS, number=1)) for work in works)
