"""What a solve will need, known before it starts.

The times are those of two cores of an AVX-512 processor (AMD EPYC), measured on spheres and on the default experiment:
FLOPS operations a second in the factorization and the substitutions (single precision; half of that in double),
ASSEMBLY seconds for each pair of unknowns that a mirror plane does not spare, EXCITATION seconds for each unknown and
sampled direction. They hold within a factor of two there, and about twice that while another solve runs beside; more
cores divide them, a GPU takes a tenth or less.
"""

import ast
from functools import cache
from math import cos, radians
from pathlib import Path

import numpy as np

from core.sweep import C0
from scattering.sampling import TOLERANCE, samples_of_ring

FLOPS = 1.6e11  # real operations a second in single precision, counted as (4/3) N^3
ASSEMBLY = 3e-8  # s
EXCITATION = 5e-8  # s
START = 0.5  # s a frequency: near pairs, kernels compiled
RUN = 512  # directions whose substitution a thread has under way
OPERATORS = Path(__file__).with_name("operators")


def planned(measures, planes, sweep, formulation, precision):
    """Peak memory of `solve` in MB, and its time at all frequencies of a Sweep in s on the two cores described above.

    measures: `unknowns`, `triangles` and `box` (m) of the mesh; planes: the number of its mirror planes, with which a
    matrix of N unknowns falls into G = 2^planes parities of N / G.

    Memory: the matrices, of each parity the right sides with what a substitution makes of them, and the near pairs.
    Factorization: (4/3) (N/G)^3 real operations for each parity, and 4 (N/G)^2 for each parity and sampled direction to
    substitute (half of a triangular solve serves a monostatic amplitude). An operator whose matrix is not symmetric
    keeps and works twice as much, and its right side is not what the far field is projected on.
    """
    unknowns, operator, single = measures["unknowns"], _constants(formulation), precision == "single"
    parities, both = 2**planes, 1 if operator["SYMMETRIC"] else 2
    size, sampled = unknowns / parities, _sampled(measures["box"], sweep, single) / parities
    waves = len(set("".join(sweep.polarizations)))

    matrices = unknowns * (size * both / 2 + 1024)
    # A substitution holds both parts of its right sides and their sum.
    right = unknowns * (sampled * (waves * both + 2 / parities) + 2 * 1.5 * min(RUN, sampled) / parities)
    numbers = (8 if single else 16) * (matrices + right)
    megabytes = 800 + (numbers + operator["NEAR_BYTES"] * measures["triangles"]) / 1e6

    factorization = both * parities * (4 / 3 * size**3 + 4 * size**2 * sampled * waves)
    filled = operator["FILLING"] * (ASSEMBLY * unknowns * size + EXCITATION * unknowns * sampled * waves)
    seconds = START + factorization / (FLOPS if single else FLOPS / 2) + filled
    return int(megabytes), len(sweep.frequency) * seconds


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
