"""Plan the memory and time of a solve before it starts.

The times are those of two cores of an AVX-512 processor (AMD EPYC), fitted to `make bench-compressed`: spheres of 2,000
to 120,000 unknowns with none to two mirror planes, and targets of the reference experiment. They are right within 1.3
times there, unless another solve runs at the same time; more cores divide them, and `machine` measures the factor of
another machine. The memory is right within 1.3 times everywhere.
"""

import ast
from functools import cache
from math import cos, log10, radians
from pathlib import Path

import numpy as np

from isarflow.core.sweep import C0
from isarflow.scattering.sampling import TOLERANCE, samples_of_ring

FLOPS = 1.87e11  # real operations a second in single precision, counted as (4/3) N^3
ASSEMBLY = 5.8e-9  # s for each pair of unknowns that a mirror plane does not spare
NEAR_PAIRS = 2.3e-5  # s for each unknown
EXCITATION = 3.3e-8  # s for each unknown and sampled direction
START = 0.7  # s per frequency: compiled code is loaded
BASE = 540  # MB of the process
COLUMNS = 768  # right sides that `solve` takes at a time: bounds their memory, and keeps two threads busy
CLEARLY = 0.7  # of the time of whole matrices, where they fit easily
LARGE = 4000  # MB: above it, compressed matrices are also used to save memory
# For compressed matrices: functions of a patch, random columns that a tile's sketch begins with (most have a smaller
# rank), numbers in samples for each unknown; the share of tiles that are filled whole, over the patches of a
# parity; a tile's rank, over that share.
PATCH_FUNCTIONS, SKETCH, SAMPLED = 480, 48, 3 * 384 * 460 / 480
WHOLE, RANK = (1.82, -0.51), (16, 1.95)
# Seconds of both cores: to compute a tile, to compress one from samples and whole; to factorize a tile without its
# products, to invert a diagonal block. Then real operations a second in products.
TILE_SECONDS, FAR, NEAR, OVERHEAD, INVERSE = 0.0021, 0.0026, 0.0060, 0.0036, 0.037
PRODUCTS = 1.83e11
# Numbers in memory for each of a tile's final factors: with the matrix's, and free memory that is not given back.
KEPT = 1.7
OPERATORS = Path(__file__).with_name("operators")


def planned(measures, planes, sweep, formulation, precision, tolerance):
    """Peak memory of `solve` in MB, and its time at all frequencies of a Sweep in s on the two cores described above.

    measures: `unknowns`, `triangles` and `box` (m) of the mesh; planes: the number of its mirror planes, with which a
    matrix of N unknowns falls into G = 2^planes parities of N / G; tolerance: None for whole matrices.
    """
    megabytes, seconds = at_one_frequency(measures, planes, sweep, formulation, precision, tolerance)
    return int(megabytes), len(sweep.frequency) * (START + sum(seconds.values()))


def at_one_frequency(measures, planes, sweep, formulation, precision, tolerance):
    """Megabytes, and seconds of each part of `solve` at the highest of a Sweep's frequencies; as `planned`.

    Memory: the matrices, right sides with the results of a substitution, and the near pairs.
    """
    unknowns, operator, single = measures["unknowns"], _constants(formulation), precision == "single"
    parities, both = 2**planes, 1 if operator["SYMMETRIC"] else 2
    waves = len(set("".join(sweep.polarizations)))
    # For a parity's right side; mirror images among separate transmitters and receivers are not counted.
    apart = sweep.receivers and len(sweep.each[0]) + len(sweep.receivers[0])
    columns = waves * (apart or _sampled(measures["box"], sweep, single) / parities)
    way = _whole if tolerance is None else _compressed
    kept, sampled, assembly, factorization, substitution = way(unknowns / parities, parities, columns, both, tolerance)
    # For a part of the right sides: themselves, and the results of a substitution for one parity. Projection and
    # excitation differ if the operator is not symmetric.
    right = unknowns * min(COLUMNS, columns) * (both + 2 / parities)
    numbers = (8 if single else 16) * (kept + max(right, sampled))
    megabytes = BASE + (numbers + operator["NEAR_BYTES"] * measures["triangles"]) / 1e6
    slower = 1 if single else 2
    return megabytes, {
        "assembly": operator["FILLING"] * assembly,
        "factorization": slower * factorization,
        "directions": slower * substitution + operator["FILLING"] * EXCITATION * unknowns * columns,
    }


def chosen(measures, planes, sweep, formulation, precision, tolerance):
    """The tolerance, or None where whole matrices are nearly as good, or the only choice (CFIE, double precision)."""
    if precision != "single" or not _constants(formulation)["SYMMETRIC"]:
        return None
    whole, compressed = (planned(measures, planes, sweep, formulation, precision, of) for of in (None, tolerance))
    faster, smaller = (
        compressed[1] < CLEARLY * whole[1],
        whole[0] > LARGE and compressed[0] < whole[0] and compressed[1] < whole[1],
    )
    return tolerance if faster or smaller else None


def _whole(size, parities, columns, both, _):
    """Numbers kept, those of samples, and seconds of assembly, factorization and substitution; of `size` unknowns.

    Factorization: (4/3) N^3 real operations for each parity, and 4 N^2 for each column to substitute (half of a
    triangular solve serves a monostatic amplitude). A matrix that is not symmetric keeps and works twice as much.
    """
    kept = parities * (size**2 * both / 2 + 1024 * size)
    assembly = parities * (ASSEMBLY * size**2 + NEAR_PAIRS * size)
    factorization = both * parities * 4 / 3 * size**3 / FLOPS
    return kept, 0, assembly, factorization, both * parities * 4 * size**2 * columns / FLOPS


def _compressed(size, parities, columns, _, tolerance):
    """As `_whole` for compressed matrices, in patches of about PATCH_FUNCTIONS (see `lowrank` and `sampled`).

    The nearer patches are, the higher a tile's rank, and the larger the share of tiles that are filled whole.
    """
    patches = max(size / PATCH_FUNCTIONS, 1)
    tiles, whole = patches**2 / 2, min(1, WHOLE[0] * patches ** WHOLE[1])
    rank = RANK[0] * (1 + RANK[1] * whole) * max(1 + 0.2 * log10(1e-5 / tolerance), 0.3)
    kept = KEPT * parities * size * (patches * rank + PATCH_FUNCTIONS)
    evaluated = TILE_SECONDS * (tiles * (1 / 7 + 1 / 72 + whole) + patches)
    compressed = tiles * (FAR * (1 - whole) + NEAR * whole)
    stacked = rank * patches / 3  # columns of the factors to the left of a tile, on average
    updates = 8 * PATCH_FUNCTIONS * stacked * (SKETCH + 3.1 * rank) / PRODUCTS
    return (
        kept,
        parities * size * SAMPLED,
        parities * (evaluated + compressed + NEAR_PAIRS * size),
        parities * (tiles * (OVERHEAD + updates) + patches * INVERSE),
        parities * tiles * 16 * PATCH_FUNCTIONS * rank * columns / PRODUCTS,
    )


@cache
def _constants(formulation):
    """The costs that an operator's file states. It is read, not imported: JAX takes longer than all planning."""
    body = ast.parse((OPERATORS / f"{formulation}.py").read_bytes()).body
    numbers = [node for node in body if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)]
    return {node.targets[0].id: node.value.value for node in numbers}


def _sampled(box, sweep, single):
    """Number of directions whose excitation is computed at the highest frequency, without mirror planes."""
    tolerance = TOLERANCE[np.dtype(np.complex64 if single else np.complex128)]
    x = 2 * np.pi * sweep.frequency[-1] / C0 * float(np.hypot(*box[:2]) / 2)
    counts = np.unique(sweep.each[0], return_counts=True)
    return sum(
        min(given, samples_of_ring(x * cos(radians(angle)), tolerance)) for angle, given in zip(*counts, strict=True)
    )
