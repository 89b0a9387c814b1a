"""What a solve will need, known before it starts.

The times are those of two cores of an AVX-512 processor (AMD EPYC), measured on spheres and on the default experiment:
FLOPS operations a second in the factorization and the substitutions (single precision; half of that in double),
ASSEMBLY seconds for each pair of unknowns that a mirror plane does not spare, EXCITATION seconds for each unknown and
sampled direction. They hold within a factor of two there, and about twice that while another solve runs beside; more
cores divide them, a GPU takes a tenth or less.
"""

from math import cos, radians, sqrt

import numpy as np

from core.sweep import C0, azimuths, elevations, frequencies
from scattering.sampling import TOLERANCE, samples_of_ring

FLOPS = 1.6e11  # real operations a second in single precision, counted as (4/3) N^3
ASSEMBLY = 3e-8  # s
EXCITATION = 5e-8  # s
START = 0.5  # s a frequency: near pairs, kernels compiled
RUN = 512  # directions whose substitution a thread has under way


def planned_megabytes(unknowns, triangles, planes, radius, radar, aspect, scattering):
    """Peak memory of `solve` for a mesh with this many unknowns and mirror planes, in MB.

    radius: m, of the mesh about the vertical through its middle; radar, aspect, scattering: those parts of the config,
    with the target's own formulation.
    """
    size = 8 if scattering["precision"] == "single" else 16
    parities = 2**planes
    combined = scattering["formulation"] == "cfie"
    # The CFIE's matrix is not symmetric, nor is its right side what the far field is projected on.
    matrices = size * (unknowns**2 / parities * (1 if combined else 0.5) + 1024 * unknowns)
    waves = len(set("".join(radar["polarizations"]))) * (2 if combined else 1)
    sampled = _sampled(radius, radar, aspect, scattering) / parities
    # of each parity the right sides and what a substitution makes of them, which holds both parts and their sum
    right = size * unknowns * (sampled * (waves + 2 / parities) + 2 * 1.5 * min(RUN, sampled) / parities)
    # about 45 near pairs a triangle and image, with their moments and sparse matrices
    near = (80_000 if combined else 40_000) * triangles
    return int(800 + (matrices + right + near) / 1e6)


def planned_seconds(unknowns, planes, radius, count, radar, aspect, scattering):
    """Time of a band's solve at `count` frequencies, in seconds on the two cores described above.

    Factorization: (4/3) (N/G)^3 real operations for each of the G parities, and 4 (N/G)^2 for each parity and sampled
    direction to substitute (half of a triangular solve serves a monostatic amplitude). The CFIE factorizes and
    substitutes both triangles, fills all tiles with two kernels, and excites by E and by n x H.
    """
    combined = scattering["formulation"] == "cfie"
    parities = 2**planes
    size, sampled = unknowns / parities, _sampled(radius, radar, aspect, scattering) / parities
    waves = len(set("".join(radar["polarizations"])))
    factorization = parities * (4 / 3 * size**3 + 4 * size**2 * sampled * waves)
    rate = FLOPS if scattering["precision"] == "single" else FLOPS / 2
    filled = ASSEMBLY * unknowns**2 / parities + EXCITATION * unknowns * sampled * waves
    return count * (START + (2 if combined else 1) * factorization / rate + (3 if combined else 1) * filled)


def unknowns_that_fit(megabytes, planes, radius, radar, aspect, scattering):
    """The most unknowns of a closed surface whose solve fits into this memory (0 if none)."""
    low, high = 0, int(sqrt(megabytes * 1e6)) * 2**planes
    while low < high:
        middle = (low + high + 1) // 2
        if planned_megabytes(middle, middle / 1.5, planes, radius, radar, aspect, scattering) <= megabytes:
            low = middle
        else:
            high = middle - 1
    return low


def _sampled(radius, radar, aspect, scattering):
    """Directions whose excitation is computed at the highest frequency, without mirror planes."""
    tolerance = TOLERANCE[np.dtype(np.complex64 if scattering["precision"] == "single" else np.complex128)]
    x = 2 * np.pi * frequencies(radar)[-1] / C0 * radius
    given = len(azimuths(aspect))
    return sum(min(given, samples_of_ring(x * cos(radians(angle)), tolerance)) for angle in elevations(aspect))
