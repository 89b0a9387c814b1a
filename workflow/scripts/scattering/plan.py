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

from core.sweep import C0, azimuths, elevations, frequencies
from scattering.sampling import TOLERANCE, samples_of_ring

FLOPS = 1.6e11  # real operations a second in single precision, counted as (4/3) N^3
ASSEMBLY = 3e-8  # s
EXCITATION = 5e-8  # s
START = 0.5  # s a frequency: near pairs, kernels compiled
RUN = 512  # directions whose substitution a thread has under way
OPERATORS = Path(__file__).with_name("operators")


def planned_megabytes(unknowns, triangles, planes, radius, radar, aspect, scattering):
    """Peak memory of `solve` for a mesh with this many unknowns and mirror planes, in MB.

    radius: m, of the mesh about the vertical through its middle; radar, aspect, scattering: those parts of the config,
    with the target's own formulation.
    """
    size = 8 if scattering["precision"] == "single" else 16
    parities = 2**planes
    operator = _constants(scattering["formulation"])
    # Without symmetry all of the matrix is kept, and its right side is not what the far field is projected on.
    both = 1 if operator["SYMMETRIC"] else 2
    matrices = size * (unknowns**2 / parities * both / 2 + 1024 * unknowns)
    waves = len(set("".join(radar["polarizations"]))) * both
    sampled = _sampled(radius, radar, aspect, scattering) / parities
    # of each parity the right sides and what a substitution makes of them, which holds both parts and their sum
    right = size * unknowns * (sampled * (waves + 2 / parities) + 2 * 1.5 * min(RUN, sampled) / parities)
    return int(800 + (matrices + right + operator["NEAR_BYTES"] * triangles) / 1e6)


def planned_seconds(unknowns, planes, radius, count, radar, aspect, scattering):
    """Time of a band's solve at `count` frequencies, in seconds on the two cores described above.

    Factorization: (4/3) (N/G)^3 real operations for each of the G parities, and 4 (N/G)^2 for each parity and sampled
    direction to substitute (half of a triangular solve serves a monostatic amplitude); twice that if the operator's
    matrix is not symmetric.
    """
    operator = _constants(scattering["formulation"])
    parities = 2**planes
    size, sampled = unknowns / parities, _sampled(radius, radar, aspect, scattering) / parities
    waves = len(set("".join(radar["polarizations"])))
    factorization = parities * (4 / 3 * size**3 + 4 * size**2 * sampled * waves)
    rate = FLOPS if scattering["precision"] == "single" else FLOPS / 2
    filled = ASSEMBLY * unknowns**2 / parities + EXCITATION * unknowns * sampled * waves
    return count * (START + (1 if operator["SYMMETRIC"] else 2) * factorization / rate + operator["FILLING"] * filled)


@cache
def _constants(formulation):
    """What an operator's file states of its cost. It is read, not imported: JAX takes longer than all planning."""
    body = ast.parse((OPERATORS / f"{formulation}.py").read_bytes()).body
    numbers = [node for node in body if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)]
    return {node.targets[0].id: node.value.value for node in numbers}


def _sampled(radius, radar, aspect, scattering):
    """Directions whose excitation is computed at the highest frequency, without mirror planes."""
    tolerance = TOLERANCE[np.dtype(np.complex64 if scattering["precision"] == "single" else np.complex128)]
    x = 2 * np.pi * frequencies(radar)[-1] / C0 * radius
    given = len(azimuths(aspect))
    return sum(min(given, samples_of_ring(x * cos(radians(angle)), tolerance)) for angle in elevations(aspect))
