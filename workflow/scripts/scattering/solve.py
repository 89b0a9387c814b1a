"""Solve a mesh for its monostatic scattering amplitude over frequencies and directions."""

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from common.errors import InputError
from common.radar import C0
from scattering import magnetic, nearfield
from scattering.assembly import assemble
from scattering.basis import fundamental_domain, rwg
from scattering.factorization import GeneralMatrix, SymmetricMatrix
from scattering.farfield import excitation
from scattering.sampling import axis_of, directions, sample

DTYPES = {"single": np.complex64, "double": np.complex128}
MAX_RESIDUAL = 1e-3
PARTS = ("assembly", "factorization", "directions")
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
    threads=1,
    progress=lambda frequency, part, done: None,
    formulation="efie",
):
    """Backscatter amplitude of a perfectly conducting mesh, in metres (see `farfield` for signs and references).

    vertices: (V, 3) m; triangles: (T, 3); frequencies: (F,) Hz; elevation: (E,), azimuth: (A,) degrees;
    polarizations: receive and transmit, from VV, HH, HV, VH; symmetry: mirror planes of the mesh, e.g. ['xz'];
    precision: single or double; threads: for the linear algebra, without effect on the result;
    progress(number, part, fraction) is called as the work goes on. Returns a Solution.
    formulation: efie, or cfie for closed meshes with outward normals.
    Raises InputError if the mesh lacks the symmetry or, for cfie, is open or turned inwards, or if a frequency cannot
    be solved to a residual of 1e-3.
    """
    if formulation == "cfie":
        magnetic.check_closed(vertices, triangles)
    surface = fundamental_domain(vertices, triangles, symmetry)
    bases = [rwg(surface, parity) for parity in surface.parities]
    unknowns = sum(map(len, bases))
    if unknowns == 0:
        raise InputError("the mesh has no inner edge, so there is no current to solve for.")
    near = nearfield.find(surface)
    combined = formulation == "cfie"
    kind = GeneralMatrix if combined else SymmetricMatrix
    magnetic_near = magnetic.static_moments(surface, near.pairs) if combined else None

    axis = axis_of(surface)
    centred = replace(surface, vertices=surface.vertices - axis)
    path = 2 * directions(elevation, azimuth)[0] @ axis
    letters = sorted(set("".join(polarizations)))
    shape = (len(polarizations), len(frequencies), len(elevation), len(azimuth))
    field = np.empty(shape, np.complex128)
    residual = np.zeros(len(frequencies))
    seconds = {part: np.zeros(len(frequencies)) for part in PARTS}

    for n, frequency in enumerate(frequencies):
        k = 2 * np.pi * frequency / C0
        clock = _Clock(seconds, n)
        matrices = [kind(len(basis), DTYPES[precision]) for basis in bases]
        assemble(surface, bases, k, near, matrices, DTYPES[precision], partial(progress, n, "assembly"), magnetic_near)
        probes = [_Probe(matrix) for matrix in matrices]
        clock.lap("assembly")
        for p, matrix in enumerate(matrices):
            matrix.factorize(threads, partial(_one_of, progress, n, p, len(matrices)))
        clock.lap("factorization")
        samples = sample(centred, k, elevation, azimuth, DTYPES[precision])
        of_waves = partial(_excitations, centred, bases, k, samples, letters, DTYPES[precision])
        received = of_waves()
        excited = of_waves(magnetic.ALPHA) if combined else received
        for i, (receive, transmit) in enumerate(polarizations):
            amplitude = _amplitude(matrices, received[receive], excited[transmit], samples, receive, transmit, threads)
            field[i, n] = amplitude * np.exp(1j * k * path)
        right = excited[polarizations[0][1]]
        residual[n] = max(probe.residual(m, b, threads) for probe, m, b in zip(probes, matrices, right, strict=True))
        clock.lap("directions")
        # Written so that a NaN fails too.
        if not residual[n] <= MAX_RESIDUAL:
            raise InputError(
                f"at {frequency / 1e9:g} GHz the solution's residual is {residual[n]:.1e}, more than {MAX_RESIDUAL:g}. "
                "The mesh may overlap itself or hold slivers; 'scattering.precision: double' may help."
            )
        progress(n, "done", 1.0)

    return Solution(field, residual, seconds, unknowns)


def _excitations(surface, bases, k, samples, letters, dtype, alpha=1.0):
    """`excitation` by each polarization from all sampled directions."""
    return {x: excitation(surface, bases, k, samples.u, samples.polarizations[x], dtype, alpha) for x in letters}


def _amplitude(matrices, received, excited, samples, receive, transmit, threads):
    """f = -V_p^T z^-1 V_q over all parities, (E, A)."""
    total = 0
    for parity, (matrix, left, right) in enumerate(zip(matrices, received, excited, strict=True)):
        between = matrix.between(left, right, samples.rings, threads)
        total = total + np.stack(
            [
                np.einsum("ai,ij,aj->a", weights[receive][parity], ring, weights[transmit][parity], optimize=True)
                for weights, ring in zip(samples.weights, between, strict=True)
            ]
        )
    # F = sum over the group of chi(g) g h makes a parity's matrix |G| times the one that is stored.
    return -total / len(matrices)


def _one_of(progress, n, p, count, done):
    progress(n, "factorization", (p + done) / count)


class _Clock:
    """Writes the seconds between laps."""

    def __init__(self, seconds, n):
        self.seconds, self.n, self.start = seconds, n, time.perf_counter()

    def lap(self, part):
        now = time.perf_counter()
        self.seconds[part][self.n] = now - self.start
        self.start = now


class _Probe:
    """Some whole rows of a matrix, kept because the factorization overwrites it."""

    def __init__(self, matrix):
        self.numbers = np.unique(np.linspace(0, matrix.size - 1, min(PROBED_ROWS, matrix.size)).astype(int))
        self.rows = matrix.rows(self.numbers)

    def residual(self, matrix, right, threads):
        """|A x - b| / |b| over the kept rows, the largest over some columns of `right`."""
        right = right[:, :: -(-right.shape[1] // PROBED_DIRECTIONS)]
        difference = self.rows @ matrix.solve(right, threads) - right[self.numbers]
        scale = np.linalg.norm(right, axis=0) * np.sqrt(len(self.numbers) / max(matrix.size, 1))
        # A parity that a direction does not excite has nothing to compare with.
        excited = scale > 1e-6 * scale.max(initial=0)
        return float((np.linalg.norm(difference, axis=0)[excited] / scale[excited]).max(initial=0.0))
