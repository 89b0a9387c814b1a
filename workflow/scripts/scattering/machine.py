"""Measure how much slower this machine is than the one of `plan`'s times: a benchmark of a second, kept.

Two rates bound a solve: that of matrix products, and that of passes over arrays. Both are measured on one core, once
for each kind of processor, and kept in the user's cache folder; delete the file there to measure again. The
core's time counts, not the clock's, so other programs make little difference.
"""

import json
import os
import platform
import time
import timeit
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np
import threadpoolctl

SIZE = 1024  # of the matrices of a product
NUMBERS = 250_000  # complex ones that a pass is over
REPEATS = 12  # of which the fastest counts: another program may run at the same time
REFERENCE = 0.0840, 0.0052  # s of a product and of a pass on the reference machine
CPUINFO = Path("/proc/cpuinfo")


@cache
def slowness():
    """Time of work here over that on the reference machine: as kept, else measured and kept."""
    path = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "isarflow", "machine.json")
    key = f"{processor()}, {os.cpu_count()} cores, NumPy {np.__version__}"
    try:
        kept = dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        kept = {}
    if not isinstance(kept.get(key), float):
        kept[key] = float(np.mean(np.divide(benchmark(), REFERENCE)))
        with suppress(OSError):  # it is measured again next time
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(kept, indent=1))
    return kept[key]


def benchmark():
    """Seconds of a core for a product of two complex matrices in single precision, and for exp(j x) in double."""
    rng = np.random.default_rng(0)
    matrix = (rng.standard_normal((SIZE, SIZE)) + 1j).astype(np.complex64)
    phases = 1j * rng.standard_normal(NUMBERS)
    works = (lambda: matrix @ matrix), (lambda: np.exp(phases))
    with threadpoolctl.threadpool_limits(1):
        return tuple(min(timeit.repeat(work, timer=time.thread_time, repeat=REPEATS, number=1)) for work in works)


def processor():
    """Name of this machine's processor."""
    lines = CPUINFO.read_text().splitlines() if CPUINFO.exists() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())
