"""How much slower this machine is than the one that `plan` states its times for: a benchmark of a second, kept.

Two rates bound a solve: that of matrix products, and that of passes over arrays. Both are measured on two cores once
for each kind of processor, and kept in the user's cache folder; delete the file there to measure again.
"""

import json
import os
import platform
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import threadpoolctl

THREADS = 2
SIZE = 1024  # of the matrices of a product
NUMBERS = 250_000  # complex ones that a thread's pass is over
REPEATS = 12  # of which the fastest counts: another program may run beside
REFERENCE = 0.0463, 0.0123  # s that a product and a pass take there
CPUINFO = Path("/proc/cpuinfo")


class Slowness(NamedTuple):
    """How many times as long as on the reference machine."""

    products: float
    passes: float


@cache
def slowness():
    """The Slowness of this machine: as kept, else measured and kept."""
    path = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "isarflow", "machines.json")
    key = f"{processor()}, {os.cpu_count()} cores, NumPy {np.__version__}"
    try:
        kept = dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        kept = {}
    if key not in kept:
        kept[key] = [seconds / there for seconds, there in zip(benchmark(), REFERENCE, strict=True)]
        with suppress(OSError):  # it is measured again next time
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(kept, indent=1))
    return Slowness(*kept[key])


def benchmark():
    """Seconds of a product of two complex matrices in single precision, and of exp(j x) in double, on THREADS cores."""
    rng = np.random.default_rng(0)
    matrix = (rng.standard_normal((SIZE, SIZE)) + 1j).astype(np.complex64)
    phases = [1j * rng.standard_normal(NUMBERS) for _ in range(THREADS)]
    with threadpoolctl.threadpool_limits(THREADS), ThreadPoolExecutor(THREADS) as pool:
        product = _fastest(lambda: matrix @ matrix)
        return product, _fastest(lambda: list(pool.map(np.exp, phases)))


def _fastest(work):
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def processor():
    """What this machine's processor is called."""
    lines = CPUINFO.read_text().splitlines() if CPUINFO.exists() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())
