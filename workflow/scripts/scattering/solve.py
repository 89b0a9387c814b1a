"""Solve a mesh for its monostatic scattering amplitude over frequencies and directions."""

import time
from dataclasses import dataclass

import numpy as np

from common.errors import InputError
from common.radar import C0
from scattering import nearfield
from scattering.assembly import assemble
from scattering.basis import fundamental_domain, rwg
from scattering.factorization import SymmetricMatrix
from scattering.farfield import directions, distinct_directions, excitation

DTYPES = {"single": np.complex64, "double": np.complex128}
MAX_RESIDUAL = 1e-3
PROBED_ROWS, PROBED_DIRECTIONS = 128, 4  # where the residual is measured


@dataclass
class Solution:
    """field: (P, F, E, A) complex, m; residual: (F,); seconds: {part: (F,)}; unknowns: int"""

    field: np.ndarray
    residual: np.ndarray
    seconds: dict
    unknowns: int


def solve(
    vertices,
    triangles,
    frequencies,
    elevation,
    azimuth,
    polarizations=("VV",),
    symmetry=(),
    precision="single",
    progress=lambda frequency, part, done: None,
):
    """Backscatter amplitude of a perfectly conducting mesh, in metres (see `farfield` for signs and references).

    vertices: (V, 3) m; triangles: (T, 3); frequencies: (F,) Hz; elevation: (E,), azimuth: (A,) degrees;
    polarizations: receive and transmit, from VV, HH, HV, VH; symmetry: mirror planes of the mesh, e.g. ['xz'];
    precision: single or double. Returns a Solution.
    Raises InputError if the mesh lacks the symmetry or a frequency cannot be solved to a residual of 1e-3.
    """
    surface = fundamental_domain(vertices, triangles, symmetry)
    bases = [rwg(surface, parity) for parity in surface.parities]
    unknowns = sum(map(len, bases))
    if unknowns == 0:
        raise InputError("the mesh has no inner edge, so there is no current to solve for.")
    near = nearfield.find(surface)

    u, v, h = (x.reshape(-1, 3) for x in directions(elevation, azimuth))
    distinct, place, sign = distinct_directions(u, surface.axes)
    vectors = {"V": v[distinct], "H": h[distinct]}
    field = np.empty((len(polarizations), len(frequencies), len(u)), np.complex128)
    residual = np.zeros(len(frequencies))
    seconds = {part: np.zeros(len(frequencies)) for part in ("assembly", "factorization", "directions")}

    for n, frequency in enumerate(frequencies):
        k = 2 * np.pi * frequency / C0
        clock = _Clock(seconds, n)
        matrices = [SymmetricMatrix(len(basis), DTYPES[precision]) for basis in bases]
        assemble(
            surface, bases, k, near, matrices, DTYPES[precision], lambda done, n=n: progress(n, "assembly", done)
        )
        probes = [_probe(matrix) for matrix in matrices]
        clock.lap("assembly")

        share = np.array([len(basis) for basis in bases]) ** 3.0
        share = np.append(0, np.cumsum(share) / share.sum())
        for p, matrix in enumerate(matrices):
            if matrix.size:
                matrix.factorize(
                    lambda done, n=n, p=p: progress(n, "factorization", share[p] + done * (share[p + 1] - share[p]))
                )
        clock.lap("factorization")

        amplitude = np.zeros((len(polarizations), len(distinct)), np.complex128)
        waves = {q: excitation(surface, bases, k, u[distinct], vectors[q], DTYPES[precision])
                 for q in sorted(set("".join(polarizations)))}
        for p, matrix in enumerate(matrices):
            if matrix.size == 0:
                continue
            # F = sum over the group of chi(g) g h makes the matrix |G| times the one that is stored.
            for i, (receive, transmit) in enumerate(polarizations):
                amplitude[i] -= matrix.quadratic(waves[receive][p], waves[transmit][p]) / len(matrices)
            right = waves[polarizations[0][1]][p][:, :: max(1, len(distinct) // PROBED_DIRECTIONS)]
            residual[n] = max(residual[n], _residual(matrix, probes[p], right))
        clock.lap("directions")
        if not residual[n] <= MAX_RESIDUAL:
            raise InputError(
                f"at {frequency / 1e9:g} GHz the solution's residual is {residual[n]:.1e}, more than {MAX_RESIDUAL:g}. "
                "The mesh may overlap itself or hold slivers; 'scattering.precision: double' may help."
            )
        for i, (receive, transmit) in enumerate(polarizations):
            field[i, n] = amplitude[i][place] * (sign if receive != transmit else 1)
        progress(n, "done", 1.0)

    shape = (len(polarizations), len(frequencies), len(elevation), len(azimuth))
    return Solution(field.reshape(shape), residual, seconds, unknowns)


class _Clock:
    def __init__(self, seconds, n):
        self.seconds, self.n, self.start = seconds, n, time.perf_counter()

    def lap(self, part):
        now = time.perf_counter()
        self.seconds[part][self.n] = now - self.start
        self.start = now


def _probe(matrix):
    """Some whole rows, kept before the factorization overwrites the matrix."""
    numbers = np.unique(np.linspace(0, matrix.size - 1, min(PROBED_ROWS, matrix.size)).astype(int))
    return numbers, matrix.rows(numbers) if matrix.size else None


def _residual(matrix, probe, right):
    """|A x - b| / |b| over the probed rows, the largest of the columns of `right`."""
    numbers, rows = probe
    difference = rows @ matrix.solve(right) - right[numbers]
    scale = np.linalg.norm(right, axis=0) * np.sqrt(len(numbers) / matrix.size)
    # A parity that a direction does not excite at all has nothing to compare with.
    excited = scale > 1e-6 * scale.max()
    return float((np.linalg.norm(difference, axis=0)[excited] / scale[excited]).max(initial=0.0))
