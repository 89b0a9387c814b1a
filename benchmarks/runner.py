"""What the benchmarks share: their options, the line printed of a row, and measuring in a process of its own."""

import argparse
import multiprocessing
import os
import re
from pathlib import Path

import threadpoolctl

OUTPUT = Path("results/benchmarks")


def options_of(description, blas_threads=None, **more):
    """Read a benchmark's options from the command line, and make its folder of results.

    All have `threads` and `out`; more: others by name, as of `add_argument`, a `positional` one without dashes.
    blas_threads: to which BLAS and OpenMP are limited; None for `threads`.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=OUTPUT)
    for name, settings in more.items():
        positional = settings.pop("positional", False)
        parser.add_argument(name if positional else f"--{name}", **settings)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    threadpoolctl.threadpool_limits(blas_threads or options.threads)
    return options


def in_process(function, *arguments):
    """The result of a function from a process of its own, for its peak of memory."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(function, arguments)


def peak_mb():
    """The largest memory that this process has had, in MB."""
    return int(re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text()).group(1)) * 1024 / 1e6


def show(row):
    """Print a row of a table."""
    cells = (f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items())
    print(", ".join(cells), flush=True)
