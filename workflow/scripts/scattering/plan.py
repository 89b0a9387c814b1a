"""What a solve will need, known before it starts.

The times are those of two cores of an AVX-512 processor (AMD EPYC), measured on spheres and on the default experiment:
FLOPS operations a second in the factorization and the substitutions (single precision; half of that in double),
ASSEMBLY seconds for each pair of unknowns that a mirror plane does not spare, EXCITATION seconds for each unknown and
sampled direction. They hold within a factor of two there, and about twice that while another solve runs beside; more
cores divide them, a GPU takes a tenth or less.
"""

import ast
from functools import cache
from math import cos, log10, radians
from pathlib import Path

import numpy as np

from core.sweep import C0
from scattering.sampling import TOLERANCE, samples_of_ring

FLOPS = 1.6e11  # real operations a second in single precision, counted as (4/3) N^3
ASSEMBLY = 3e-8  # s
EXCITATION = 5e-8  # s
START = 0.5  # s a frequency: near pairs, kernels compiled
CLEARLY = 0.3  # of the time of whole matrices: the plan of compressed ones errs by a factor of two, too
LARGE = 4000  # MB: from here on compressed matrices serve to save memory, too
# Of compressed matrices: functions of a patch, columns of most sketches, numbers that samples hold for each unknown.
PATCH_FUNCTIONS, SKETCH, SAMPLED = 495, 48, 3 * 384 * 640 / 495
PRODUCTS = 1.2e11  # real operations a second in products with few columns
RUN = 512  # directions whose substitution a thread has under way
OPERATORS = Path(__file__).with_name("operators")


def planned(measures, planes, sweep, formulation, precision, tolerance):
    """Peak memory of `solve` in MB, and its time at all frequencies of a Sweep in s on the two cores described above.

    measures: `unknowns`, `triangles` and `box` (m) of the mesh; planes: the number of its mirror planes, with which a
    matrix of N unknowns falls into G = 2^planes parities of N / G; tolerance: None for whole matrices.

    Memory: the matrices, of each parity the right sides with what a substitution makes of them, and the near pairs.
    """
    unknowns, operator, single = measures["unknowns"], _constants(formulation), precision == "single"
    parities, both = 2**planes, 1 if operator["SYMMETRIC"] else 2
    sampled = _sampled(measures["box"], sweep, single) / parities
    waves = len(set("".join(sweep.polarizations)))
    columns = sampled * waves  # of a parity's right side
    if tolerance is None:
        matrices, assembly, factorization, substitution = _whole(unknowns / parities, parities, columns, both)
    else:
        matrices, assembly, factorization, substitution = _compressed(unknowns / parities, parities, columns, tolerance)
    # A substitution holds both parts of its right sides and their sum. What projects is not what excites, if the
    # operator is not symmetric.
    right = unknowns * (sampled * (waves * both + 2 / parities) + 2 * 1.5 * min(RUN, sampled) / parities)
    numbers = (8 if single else 16) * (matrices + right)
    megabytes = 800 + (numbers + operator["NEAR_BYTES"] * measures["triangles"]) / 1e6
    filled = operator["FILLING"] * (assembly + EXCITATION * unknowns * columns)
    seconds = START + (factorization + substitution) * (1 if single else 2) + filled
    return int(megabytes), len(sweep.frequency) * seconds


def chosen(measures, planes, sweep, formulation, precision, tolerance):
    """The tolerance, or None where whole matrices are nearly as good, or all there is (CFIE, double precision)."""
    if precision != "single" or not _constants(formulation)["SYMMETRIC"]:
        return None
    whole, compressed = (planned(measures, planes, sweep, formulation, precision, of) for of in (None, tolerance))
    faster, smaller = (
        compressed[1] < CLEARLY * whole[1],
        whole[0] > LARGE and compressed[0] < whole[0] and compressed[1] < whole[1],
    )
    return tolerance if faster or smaller else None


def _whole(size, parities, columns, both):
    """Numbers kept, and seconds of assembly, factorization and substitution, of dense matrices of `size` unknowns.

    Factorization: (4/3) N^3 real operations for each parity, and 4 N^2 for each column to substitute (half of a
    triangular solve serves a monostatic amplitude). A matrix that is not symmetric keeps and works twice as much.
    """
    kept = parities * (size**2 * both / 2 + 1024 * size)
    times = ASSEMBLY * parities * size**2, both * parities * 4 / 3 * size**3 / FLOPS
    return kept, *times, both * parities * 4 * size**2 * columns / FLOPS


def _compressed(size, parities, columns, tolerance):
    """The same of compressed matrices, in patches of about PATCH_FUNCTIONS (see `lowrank` and `sampled`).

    The nearer patches are, the higher a tile's rank, and the larger the share of tiles that are filled whole. Ranks,
    shares and the times of a tile (s) are those of the aircraft with 5,700 and 11,700 unknowns a parity: rough.
    """
    patches = max(size / PATCH_FUNCTIONS, 1)
    tiles, near = patches**2 / 2, min(1, 0.05 + 5 / patches)
    rank = (14 + 110 * near) * max(1 + 0.2 * log10(1e-5 / tolerance), 0.3)
    kept = parities * size * (1.25 * size * rank / PATCH_FUNCTIONS + 2 * PATCH_FUNCTIONS + SAMPLED)
    # What a dense tile takes, times the shares that samples, checks and near tiles are; then its compression.
    filled = tiles * (ASSEMBLY * parities * 2 * PATCH_FUNCTIONS**2 * (0.3 + near) + parities * (0.004 + 0.013 * near))
    stacked = rank * patches / 3  # columns of the factors to the left of a tile, on average
    updates = parities * tiles * (0.008 + 8 * PATCH_FUNCTIONS * stacked * (3 * SKETCH + rank) / PRODUCTS)
    return kept, filled, updates, parities * tiles * 16 * PATCH_FUNCTIONS * rank * columns / PRODUCTS


@cache
def _constants(formulation):
    """What an operator's file states of its cost. It is read, not imported: JAX takes longer than all planning."""
    body = ast.parse((OPERATORS / f"{formulation}.py").read_bytes()).body
    numbers = [node for node in body if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)]
    return {node.targets[0].id: node.value.value for node in numbers}


def _sampled(box, sweep, single):
    """Directions whose excitation is computed at the highest frequency, without mirror planes."""
    tolerance = TOLERANCE[np.dtype(np.complex64 if single else np.complex128)]
    x = 2 * np.pi * sweep.frequency[-1] / C0 * float(np.hypot(*box[:2]) / 2)
    given = len(sweep.azimuth)
    return sum(min(given, samples_of_ring(x * cos(radians(angle)), tolerance)) for angle in sweep.elevation)
