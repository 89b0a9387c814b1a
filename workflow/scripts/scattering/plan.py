"""What a solve will need, known before it starts. Light to import: the Snakefile asks.

The times are those of two cores of an AVX-512 processor (AMD EPYC), measured on the default experiment: 100 Gflop/s
in the factorization and the substitutions (single precision; half of that in double), ASSEMBLY seconds for each pair
of unknowns that a mirror plane does not spare, EXCITATION seconds for each unknown and direction. They hold within a
factor of two there; more cores divide them, a GPU takes a tenth or less.
"""

from math import sqrt

from common.radar import azimuths, elevations

FLOPS = 1e11  # real operations a second in single precision
ASSEMBLY = 8e-8  # s
EXCITATION = 5e-7  # s
START = 1.0  # s a frequency: near pairs, kernels compiled


def planned_megabytes(unknowns, triangles, planes, radar, aspect, scattering):
    """Peak memory of `solve` for a mesh with this many unknowns and mirror planes, in MB.

    radar, aspect, scattering: those parts of the config, with the target's own formulation.
    """
    size = 8 if scattering["precision"] == "single" else 16
    parities = 2**planes
    combined = scattering["formulation"] == "cfie"
    # The CFIE's matrix is not symmetric, nor is its right side what the far field is projected on.
    matrices = size * (unknowns**2 / parities * (1 if combined else 0.5) + 1024 * unknowns)
    waves = len(set("".join(radar["polarizations"]))) * (2 if combined else 1)
    directions = _directions(aspect) / parities
    right = size * unknowns * directions * (waves + 2 / parities)
    # about 45 near pairs a triangle and image, with their moments and sparse matrices
    near = (80_000 if combined else 40_000) * triangles
    return int(800 + (matrices + right + near) / 1e6)


def planned_seconds(unknowns, planes, frequencies, radar, aspect, scattering):
    """Time of a band's solve at this many frequencies, in seconds on the two cores described above.

    Factorization: (4/3) (N/G)^3 real operations for each of the G parities, and 4 (N/G)^2 for each parity and
    direction to substitute (half of a triangular solve serves a monostatic amplitude). The CFIE factorizes and
    substitutes both triangles, fills all tiles with two kernels, and excites by E and by n x H.
    """
    combined = scattering["formulation"] == "cfie"
    parities = 2**planes
    size, directions = unknowns / parities, _directions(aspect) / parities
    waves = len(set("".join(radar["polarizations"])))
    factorization = parities * (4 / 3 * size**3 + 4 * size**2 * directions * waves)
    rate = FLOPS if scattering["precision"] == "single" else FLOPS / 2
    filled = ASSEMBLY * unknowns**2 / parities + EXCITATION * unknowns * directions * waves
    return frequencies * (START + (2 if combined else 1) * factorization / rate + (3 if combined else 1) * filled)


def unknowns_that_fit(megabytes, planes, radar, aspect, scattering):
    """The most unknowns of a closed surface whose solve fits into this memory (0 if none)."""
    low, high = 0, int(sqrt(megabytes * 1e6)) * 2**planes
    while low < high:
        middle = (low + high + 1) // 2
        if planned_megabytes(middle, middle / 1.5, planes, radar, aspect, scattering) <= megabytes:
            low = middle
        else:
            high = middle - 1
    return low


def _directions(aspect):
    return len(elevations(aspect)) * len(azimuths(aspect))
