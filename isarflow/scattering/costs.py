"""Plan the memory and time of a solve before it starts.

The times are measured on two cores of an AVX-512 processor (AMD EPYC), and fitted to `make bench-compressed`: spheres
of 2,000 to 120,000 unknowns with none to two mirror planes, and targets of the reference experiment; since then
compressed matrices take less, by the ratio of the parts' times on the aircraft (11,616 unknowns). They were right
within 1.3 times there, unless another solve runs at the same time; more cores divide them, and `machine` measures the
factor of another machine. The memory is right within 1.3 times everywhere.
"""

from math import cos, log10, radians

import numpy as np

from isarflow.core.sweep import C0
from isarflow.scattering.directions import TOLERANCE, samples_of_ring

FLOPS = 1.87e11  # real operations a second in single precision, counted as (4/3) N^3
ASSEMBLY_SECONDS = 5.8e-9  # for each pair of unknowns that a mirror plane does not spare
NEAR_PAIRS_SECONDS = 2.3e-5  # for each unknown
EXCITATION_SECONDS = 1.6e-8  # for each unknown and sampled direction
START_SECONDS = 0.7  # per frequency: compiled code is loaded
BASE_MEGABYTES = 540  # of the process
COLUMNS = 768  # right sides that `solve` takes at a time: bounds their memory, and keeps two threads busy
CLEARLY_SHARE = 0.7  # of the time of whole matrices, where they fit easily
LARGE_MEGABYTES = 4000  # above it, compressed matrices are also used to save memory
# Of each operator: matrices, 1 for a symmetric one and 2 for others; time for the matrix's entries and right sides, in
# units of the EFIE's; bytes of the near pairs for each triangle, about 45 pairs a triangle and image.
OPERATORS = {
    "efie": (1, 1, 13_000),
    "cfie": (2, 3, 26_000),
    "pmchwt": (1, 1.8, 26_000),
    "ibc": (1, 1.4, 26_000),
    "tds": (1, 1.4, 26_000),
}
# Of compressed matrices.
PATCH_FUNCTIONS = 480  # of a patch
SKETCH_COLUMNS = 48  # random columns that a tile's sketch begins with: most tiles have a smaller rank
SAMPLED_NUMBERS = 1104  # in samples for each unknown
# In memory for each number of a tile's final factors, with the matrix's factors, and free memory not given back.
FACTOR_NUMBERS = 1.7
# Of both cores, for compressed matrices.
TILE_SECONDS = 0.0017  # to fill and compress a tile from samples
WHOLE_TILE_SECONDS = 0.0032  # how much more it takes to fill a tile whole
FACTORIZED_TILE_SECONDS = 0.003  # to factorize a tile, without its products
INVERSE_SECONDS = 0.022  # to invert a diagonal block


def planned(measures, planes, sweep, formulation, precision, tolerance):
    """Peak memory of `solve` in MB, and its time at all frequencies of a Sweep in s on the two cores described above.

    measures: `unknowns`, of all currents (see `needs.currents`), `triangles` and `box` (m) of the mesh; planes: the
    number of mirror planes: a matrix of N unknowns falls into G = 2^planes parities of N / G; tolerance: None for whole
    matrices.
    """
    megabytes, seconds = at_one_frequency(measures, planes, sweep, formulation, precision, tolerance)
    return int(megabytes), len(sweep.frequency) * (START_SECONDS + sum(seconds.values()))


def at_one_frequency(measures, planes, sweep, formulation, precision, tolerance):
    """Megabytes, and seconds of each part of `solve` at the highest of a Sweep's frequencies; as `planned`.

    Memory: the matrices, right sides with the results of a substitution, and the near pairs.
    """
    unknowns, parities, single = measures["unknowns"], 2**planes, precision == "single"
    matrices, filling, near_bytes = OPERATORS[formulation]
    waves = len(set("".join(sweep.polarizations)))
    # For a parity's right side; mirror images among separate transmitters and receivers are not counted.
    apart = sweep.receivers and len(sweep.each[0]) + len(sweep.receivers[0])
    columns = waves * (apart or _sampled(measures["box"], sweep, single) / parities)
    way = _whole if tolerance is None else _compressed
    others = {"matrices": matrices, "is_sampled": formulation == "efie", "tolerance": tolerance}
    kept, sampled, *seconds = way(unknowns / parities, columns, **others)
    assembly, factorization, substitution = (parities * part for part in seconds)
    # Of a part of the right sides: the excitation; its skeletons, or the projection if the operator is not symmetric;
    # and the results of a substitution for one parity.
    right = unknowns * min(COLUMNS, columns) * (2 + 2 / parities)
    numbers = (8 if single else 16) * (parities * kept + max(right, parities * sampled))
    slower = 1 if single else 2
    return BASE_MEGABYTES + (numbers + near_bytes * measures["triangles"]) / 1e6, {
        "assembly": filling * assembly,
        "factorization": slower * factorization,
        "directions": slower * substitution + filling * EXCITATION_SECONDS * unknowns * columns,
    }


def chosen_tolerance(measures, planes, sweep, formulation, precision, tolerance):
    """The tolerance, or None where whole matrices are nearly as good, or alone there (CFIE, double precision)."""
    if precision != "single" or formulation == "cfie":
        return None
    whole, compressed = (planned(measures, planes, sweep, formulation, precision, tried) for tried in (None, tolerance))
    faster, smaller = compressed[1] < whole[1], compressed[0] < whole[0]
    clearly = compressed[1] < CLEARLY_SHARE * whole[1]
    return tolerance if clearly or (whole[0] > LARGE_MEGABYTES and smaller and faster) else None


def _whole(size, columns, *, matrices, **_):
    """Of a parity of `size` unknowns: numbers kept and of samples; seconds of assembly, factorization, substitution.

    Factorization: (4/3) N^3 real operations, and 4 N^2 for each column to substitute (half of a triangular solve serves
    a monostatic amplitude). A matrix that is not symmetric keeps and works twice as much.
    """
    assembly = ASSEMBLY_SECONDS * size**2 + NEAR_PAIRS_SECONDS * size
    factorization, substitution = 4 / 3 * size**3 / FLOPS, 4 * size**2 * columns / FLOPS
    return size**2 * matrices / 2 + 1024 * size, 0, assembly, matrices * factorization, matrices * substitution


def _compressed(size, columns, *, is_sampled, tolerance, **_):
    """As `_whole` for compressed matrices, in patches of about PATCH_FUNCTIONS (see `lowrank` and `cross`).

    The nearer patches are, the higher a tile's rank, and the larger the share of tiles that are filled whole; all are
    unless they are sampled.
    """
    patches = max(size / PATCH_FUNCTIONS, 1)
    tiles, whole = patches**2 / 2, min(1, 1.82 * patches**-0.51)
    rank = 16 * (1 + 1.95 * whole) * max(1 + 0.2 * log10(1e-5 / tolerance), 0.3)
    stacked = rank * patches / 3  # columns of the factors to the left of a tile, on average
    updates = 8 * PATCH_FUNCTIONS * stacked * (SKETCH_COLUMNS + 3.1 * rank) / FLOPS
    return (
        FACTOR_NUMBERS * size * (patches * rank + PATCH_FUNCTIONS),
        SAMPLED_NUMBERS * size,
        tiles * (TILE_SECONDS + WHOLE_TILE_SECONDS * (whole if is_sampled else 1)) + NEAR_PAIRS_SECONDS * size,
        tiles * (FACTORIZED_TILE_SECONDS + updates) + patches * INVERSE_SECONDS,
        tiles * 16 * PATCH_FUNCTIONS * rank * columns / FLOPS,
    )


def _sampled(box, sweep, single):
    """Number of directions whose excitation is computed at the highest frequency, without mirror planes."""
    tolerance = TOLERANCE[np.dtype(np.complex64 if single else np.complex128)]
    x = 2 * np.pi * sweep.frequency[-1] / C0 * float(np.hypot(*box[:2]) / 2)
    counts = np.unique(sweep.each[0], return_counts=True)
    return sum(
        min(given, samples_of_ring(x * cos(radians(angle)), tolerance)) for angle, given in zip(*counts, strict=True)
    )
