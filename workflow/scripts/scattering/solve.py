"""Solve a mesh for its monostatic scattering amplitude over frequencies and directions."""

import time
from dataclasses import replace
from functools import partial

import jax
import numpy as np

from core.errors import InputError
from core.sweep import C0
from scattering.assembly import Entries, assemble
from scattering.basis import fundamental_domain, rwg
from scattering.device import GeneralOnDevice, SymmetricOnDevice
from scattering.factorization import GeneralMatrix, Product, SymmetricMatrix
from scattering.farfield import electric, excitation
from scattering.lowrank import LowRankMatrix
from scattering.operators import cfie, efie
from scattering.sampled import fill
from scattering.sampling import directions, middle_of, sample
from scattering.solver import Solution

OPERATORS = {"efie": efie, "cfie": cfie}
DTYPES = {"single": np.complex64, "double": np.complex128}
MAX_RESIDUAL = 1e-3  # above it (or PROMISE) the solution is refined once, and refused if that does not help
# Of a tolerance, what a tile may leave out, and how much larger the residual may be before the solution is refined.
SHARE, PROMISE = 0.4, 10
KINDS = {  # whole matrices: on JAX's device or not, symmetric or not
    (False, False): GeneralMatrix,
    (False, True): SymmetricMatrix,
    (True, False): GeneralOnDevice,
    (True, True): SymmetricOnDevice,
}
PARTS = ("assembly", "factorization", "directions")
PROBED_ROWS, PROBED_DIRECTIONS = 128, 4  # where the residual is measured


def solve(
    vertices,
    triangles,
    frequencies,
    elevation,
    azimuth,
    polarizations=("VV",),
    symmetry=(),
    *,
    precision="single",
    threads=1,
    progress=lambda frequency, part, done: None,
    formulation="efie",
    tolerance=None,
):
    """Backscatter amplitude of a perfectly conducting mesh, in metres (see `farfield` for signs and references).

    vertices: (V, 3) m; triangles: (T, 3); frequencies: (F,) Hz; elevation: (E,), azimuth: (A,) degrees;
    polarizations: receive and transmit, from VV, HH, HV, VH; symmetry: mirror planes of the mesh, e.g. ['xz'];
    precision: single or double; threads: for the linear algebra, without effect on the result;
    progress(number, part, fraction) is called as the work goes on. Returns a Solution.
    formulation: efie, or cfie for closed meshes with outward normals;
    tolerance: None for whole matrices, or for compressed ones what they may leave out, relative to the diagonal's norm
    (efie and single precision; see `sampled` and `lowrank`).
    Raises InputError if the mesh lacks the symmetry or, for cfie, is open or turned inwards, or if a frequency cannot
    be solved to a residual of 1e-3.
    """
    if tolerance is not None and (formulation, precision) != ("efie", "single"):
        raise ValueError("compressed matrices are those of the EFIE, in single precision")
    operator, dtype = OPERATORS[formulation], DTYPES[precision]
    operator.check_mesh(vertices, triangles)
    surface = fundamental_domain(vertices, triangles, symmetry)
    bases = [rwg(surface, parity) for parity in surface.parities]
    unknowns = sum(map(len, bases))
    if unknowns == 0:
        raise InputError("the mesh has no inner edge, so there is no current to solve for.")
    # About its middle a target needs the fewest directions, and coordinates of single precision have the most digits.
    middle = middle_of(surface)
    surface = replace(surface, vertices=surface.vertices - middle)
    path = 2 * directions(elevation, azimuth)[0] @ middle
    near = operator.near_terms(surface)

    ways = sorted(set("".join(polarizations)))
    shape = (len(polarizations), len(frequencies), len(elevation), len(azimuth))
    field = np.empty(shape, np.complex128)
    residual = np.zeros(len(frequencies))
    seconds = {part: np.zeros(len(frequencies)) for part in PARTS}

    for n, frequency in enumerate(frequencies):
        k = 2 * np.pi * frequency / C0
        clock = _Clock(seconds, n)
        system = _System(partial(Entries, operator, surface, bases, k, near), dtype, tolerance, threads)
        system.assemble(partial(progress, n, "assembly"))
        clock.lap("assembly")
        system.factorize(partial(progress, n, "factorization"))
        clock.lap("factorization")
        progress(n, "directions", 0.0)
        samples = sample(surface, k, elevation, azimuth, dtype)
        of_waves = partial(_excitations, surface, bases, k, samples, ways, dtype)
        received = of_waves(electric)
        excited = received if operator.SYMMETRIC else of_waves(operator.excited)
        between, residual[n] = system.between(received, excited, polarizations, samples.rings)
        for i, (receive, transmit) in enumerate(polarizations):
            amplitude = _amplitude(between[receive + transmit], samples, receive, transmit)
            field[i, n] = amplitude * np.exp(1j * k * path)
        clock.lap("directions")
        # Written so that a NaN fails too.
        if not residual[n] <= MAX_RESIDUAL:
            raise InputError(
                f"at {frequency / 1e9:g} GHz the solution's residual is {residual[n]:.1e}, more than {MAX_RESIDUAL:g}. "
                "The mesh may overlap itself, hold slivers, or be far smaller than the wavelength; "
                "'scattering.precision: double' may help."
            )
        progress(n, "done", 1.0)

    return Solution(field, residual, seconds, unknowns)


def _excitations(surface, bases, k, samples, ways, dtype, wave):
    """`excitation` by each polarization from all sampled directions."""
    return {way: excitation(surface, bases, k, samples.u, samples.polarizations[way], dtype, wave) for way in ways}


def _amplitude(between, samples, receive, transmit):
    """f = -V_p^T z^-1 V_q, (E, A), from that between the samples of each ring, for each parity."""
    total = sum(
        np.stack(
            [
                np.einsum("ai,ij,aj->a", weights[receive][parity], ring, weights[transmit][parity], optimize=True)
                for weights, ring in zip(samples.weights, rings, strict=True)
            ]
        )
        for parity, rings in enumerate(between)
    )
    # F = sum over the group of chi(g) g h makes a parity's matrix |G| times the one that is stored.
    return -total / len(between)


class _System:
    """The matrices of all parities at one frequency; entries: `Entries` of a dtype."""

    def __init__(self, entries, dtype, tolerance, threads):
        self.entries, self.dtype, self.tolerance, self.threads = entries, dtype, tolerance, threads

    def assemble(self, progress):
        entries = self.entries(self.dtype)
        sizes = [len(basis) for basis in entries.bases]
        if self.tolerance is None:
            kind = KINDS[jax.default_backend() != "cpu", entries.operator.SYMMETRIC]
            self.matrices = [kind(size, self.dtype) for size in sizes]
            assemble(entries, self.matrices, progress)
            self.promise = MAX_RESIDUAL
        else:
            self.matrices = [LowRankMatrix([block.spans[p] for block in entries.blocks]) for p in range(len(sizes))]
            fill(entries, self.matrices, SHARE * self.tolerance, self.threads, progress)
            self.promise = min(MAX_RESIDUAL, PROMISE * self.tolerance)
        # Kept, because the factorization overwrites the matrices.
        self.probed = [np.unique(np.linspace(0, n - 1, min(PROBED_ROWS // len(sizes), n)).astype(int)) for n in sizes]
        self.rows = entries.rows(self.probed)

    def factorize(self, progress):
        for p, matrix in enumerate(self.matrices):
            matrix.factorize(self.threads, lambda done, p=p: progress((p + done) / len(self.matrices)))

    def between(self, received, excited, polarizations, rings):
        """V_p^T z^-1 V_q between the samples of each ring, for each polarization and parity; and the residual.

        received, excited: for V and H a list over parities of (N, K)
        """
        transmitted = sorted({transmit for _, transmit in polarizations})
        # A handful of columns will do, because these are substituted once more.
        some = slice(None, None, -(-excited[transmitted[0]][0].shape[1] // PROBED_DIRECTIONS))
        few = [
            np.concatenate([waves[:, some] for waves in parity], axis=1)
            for parity in zip(*(excited[way] for way in transmitted), strict=True)
        ]
        residual = self._residual(few, self._solve(few))
        if residual <= self.promise or np.isnan(residual):
            return {
                receive + transmit: [
                    matrix.between(left, right, rings, self.threads)
                    for matrix, left, right in zip(self.matrices, received[receive], excited[transmit], strict=True)
                ]
                for receive, transmit in polarizations
            }, residual
        currents = {way: self._refined(excited[way]) for way in transmitted}
        return {
            receive + transmit: [
                [left[:, ring].T @ right[:, ring] for ring in rings]
                for left, right in zip(received[receive], currents[transmit], strict=True)
            ]
            for receive, transmit in polarizations
        }, max(self._residual(excited[way], currents[way]) for way in transmitted)

    def _solve(self, right):
        return [matrix.solve(b, self.threads) for matrix, b in zip(self.matrices, right, strict=True)]

    def _refined(self, right):
        """Currents after one step of iterative refinement with a matrix of double precision (Golub, Van Loan, 3.5.3).

        The matrix is assembled anew, tile by tile, because its factors have taken its place.
        """
        currents, entries = self._solve(right), self.entries(np.complex128)
        products = [Product(x, entries.operator.SYMMETRIC) for x in currents]
        assemble(entries, products)
        corrections = self._solve([b - p.result for b, p in zip(right, products, strict=True)])
        return [x.astype(np.complex128) + dx for x, dx in zip(currents, corrections, strict=True)]

    def _residual(self, right, currents):
        """|A x - b| / |b| over the probed rows, the largest over parities and columns of b and x, (N, D)."""
        return max(map(_residual, self.rows, self.probed, right, currents))


def _residual(rows, numbers, right, solution):
    difference = rows @ solution - right[numbers]
    scale = np.linalg.norm(right, axis=0) * np.sqrt(len(numbers) / max(len(right), 1))
    # A parity that a direction does not excite has nothing to compare with.
    excited = scale > 1e-6 * scale.max(initial=0)
    return float((np.linalg.norm(difference, axis=0)[excited] / scale[excited]).max(initial=0.0))


class _Clock:
    """Writes the seconds between laps."""

    def __init__(self, seconds, n):
        self.seconds, self.n, self.start = seconds, n, time.perf_counter()

    def lap(self, part):
        now = time.perf_counter()
        self.seconds[part][self.n] = now - self.start
        self.start = now
