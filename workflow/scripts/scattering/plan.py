"""What a solve will need, known before it starts. Light to import: the Snakefile asks."""

from common.radar import azimuths, elevations


def planned_megabytes(unknowns, triangles, planes, radar, aspect, precision):
    """Peak memory of `solve` for a mesh with this many unknowns and mirror planes, in MB."""
    size = 8 if precision == "single" else 16
    parities = 2**planes
    matrices = size * (unknowns**2 / (2 * parities) + 1024 * unknowns)
    waves = len(set("".join(radar["polarizations"])))
    directions = len(elevations(aspect)) * len(azimuths(aspect)) / parities
    right = size * unknowns * directions * (waves + 2 / parities)
    near = 40_000 * triangles  # about 45 near pairs a triangle and image, with their moments and sparse matrices
    return int(800 + (matrices + right + near) / 1e6)
