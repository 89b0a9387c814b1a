"""Solve a mesh for its monostatic scattering amplitude over frequencies and directions."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import jax
import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, Sweep, unit_vectors
from isarflow.scattering.assembly import Entries, assemble
from isarflow.scattering.basis import fundamental_domain, rwg
from isarflow.scattering.device import GeneralOnDevice, SymmetricOnDevice, give_back
from isarflow.scattering.factorization import GeneralMatrix, Product, SymmetricMatrix
from isarflow.scattering.farfield import Excitation
from isarflow.scattering.lowrank import LowRankMatrix
from isarflow.scattering.operators import cfie, efie
from isarflow.scattering.plan import COLUMNS
from isarflow.scattering.sampled import fill
from isarflow.scattering.sampling import middle_of, rings, sample
from isarflow.scattering.solver import Solution

OPERATORS = {"efie": efie, "cfie": cfie}
DTYPES = {"single": np.complex64, "double": np.complex128}
MAX_RESIDUAL = 1e-3  # above it (or PROMISE) the solution is refined once, and refused if the residual stays too large
# Of a tolerance: the largest error of a tile; and the largest residual before the solution is refined.
SHARE, PROMISE = 0.4, 10
MANY = 1e5  # unknowns, above which errors of tiles add up to more than the promise unless each error is smaller
KINDS = {  # whole matrices: on JAX's device or not, symmetric or not
    (False, False): GeneralMatrix,
    (False, True): SymmetricMatrix,
    (True, False): GeneralOnDevice,
    (True, True): SymmetricOnDevice,
}
PARTS = ("assembly", "factorization", "directions")
PROBED_ROWS, PROBED_DIRECTIONS = 128, 4  # where the residual is measured


def solve(
    vertices: np.ndarray,
    triangles: np.ndarray,
    frequencies: np.ndarray,
    elevation: Sequence[float] | np.ndarray,
    azimuth: Sequence[float] | np.ndarray,
    polarizations: Sequence[str] = ("VV",),
    symmetry: Sequence[str] = (),
    *,
    precision: str = "single",
    threads: int = 1,
    progress: Callable[..., None] = lambda frequency, part, done: None,
    formulation: str = "efie",
    tolerance: float | None = None,
    paired: bool = False,
    receivers: tuple = (),
) -> Solution:
    """Backscatter amplitude of a perfectly conducting mesh, in metres (see `farfield` for signs and references).

    vertices: (V, 3) m; triangles: (T, 3); frequencies: (F,) Hz; elevation: (E,), azimuth: (A,) degrees;
    polarizations: receive and transmit, from VV, HH, HV, VH; symmetry: mirror planes of the mesh, e.g. ['xz'];
    precision: single or double; threads: for the linear algebra, without effect on the result;
    progress(number, part, fraction) is called as the work goes on. Returns a Solution.
    formulation: efie, or cfie for closed meshes with outward normals;
    tolerance: None for whole matrices, or for compressed ones their largest error, relative to the diagonal's norm
    (efie and single precision; see `sampled` and `lowrank`);
    paired: elevation and azimuth, (D,) each, are directions one by one, and the field is (P, F, D);
    receivers: elevation and azimuth (R,) of separate receivers, the field's last dimension, (..., R).
    Raises InputError if the mesh lacks the symmetry or, for cfie, is open or turned inwards, or if a frequency cannot
    be solved to a residual of 1e-3.
    """
    if tolerance is not None and (formulation, precision) != ("efie", "single"):
        raise ValueError("compressed matrices are those of the EFIE, in single precision")
    operator, dtype = OPERATORS[formulation], DTYPES[precision]
    sweep = Sweep(frequencies, np.asarray(elevation), np.asarray(azimuth), polarizations, paired)
    operator.check_mesh(vertices, triangles)
    surface = fundamental_domain(vertices, triangles, symmetry)
    bases = [rwg(surface, parity) for parity in surface.parities]
    unknowns = sum(map(len, bases))
    if unknowns == 0:
        raise InputError("the mesh has no inner edge, so there is no current to solve for.")
    # About its middle a target needs the fewest directions, and single precision has the most digits of coordinates.
    middle = middle_of(surface)
    surface = replace(surface, vertices=surface.vertices - middle)
    path = 2 * unit_vectors(*sweep.each)[0] @ middle
    elevations, azimuths = sweep.each
    # The mirror image of a direction in the plane xy has the same field, except for the sign of V.
    mirrored = ("xy" in symmetry) & (elevations < 0)
    of_rings = rings(np.where(mirrored, -elevations, elevations), azimuths)
    near = operator.near_terms(surface)
    excitation = Excitation(surface, bases, dtype)

    ways = sorted(set("".join(polarizations)))
    shape = (len(polarizations), len(frequencies), len(path))
    field = np.empty(shape + ((len(receivers[0]),) if receivers else ()), np.complex128)
    residual = np.zeros(len(frequencies))
    seconds = {part: np.zeros(len(frequencies)) for part in PARTS}

    for n, frequency in enumerate(frequencies):
        k = 2 * np.pi * frequency / C0
        clock = _Clock(seconds, n)
        system = _System(partial(Entries, operator, surface, bases, k, near), dtype, tolerance, threads)
        system.assemble(partial(progress, n, "assembly"))
        clock.lap("assembly")
        give_back()
        system.factorize(partial(progress, n, "factorization"))
        clock.lap("factorization")
        give_back()
        samples = sample(surface, k, [ring[0] for ring in of_rings], [ring[1] for ring in of_rings], dtype)
        of_waves = partial(excitation, k, threads=threads)
        # A few directions show whether the solution is good enough without refinement.
        some = slice(None, None, -(-len(samples.u) // PROBED_DIRECTIONS))
        few = (
            np.concatenate([samples.u[some]] * len(ways)),
            np.concatenate([samples.polarizations[w][some] for w in ways]),
        )
        residual[n] = system.residual(of_waves(*few, alpha=operator.ALPHA))
        refined = residual[n] > system.promise
        if receivers:
            waves = unit_vectors(*sweep.each), unit_vectors(*receivers)
            say = partial(progress, n, "directions")
            field[:, n], worst = _bistatic(system, of_waves, operator, *waves, polarizations, refined, say)
            residual[n] = max(worst) if refined else residual[n]
            field[:, n] *= np.exp(1j * k * ((waves[0][0] @ middle)[:, None] + waves[1][0] @ middle))
        # The refinement assembles the matrix once more, and therefore takes all directions at once.
        parts = () if receivers else samples.parts(ways, np.inf if refined else COLUMNS)
        for numbers, u, polarization, groups in parts:
            progress(n, "directions", numbers[0] / len(samples.rings))
            received = of_waves(u, polarization)
            excited = received if operator.SYMMETRIC else of_waves(u, polarization, alpha=operator.ALPHA)
            if refined:
                between, residual[n] = system.refined(received, excited, groups)
            else:
                between = system.between(received, excited, groups)
            for place, ring in enumerate(numbers):
                of_ring = [of_parity[place] for of_parity in between]
                *_, azimuths, there = of_rings[ring]
                field[:, n, there] = _amplitudes(of_ring, samples.weights[ring], polarizations, ways)[:, azimuths]
        for row, ways_of in () if receivers else zip(field[:, n], polarizations, strict=True):
            row *= np.where(mirrored & (ways_of[0] != ways_of[1]), -1, 1) * np.exp(1j * k * path)
        clock.lap("directions")
        # Written so that a NaN fails, too.
        if not residual[n] <= MAX_RESIDUAL:
            raise InputError(
                f"at {frequency / 1e9:g} GHz the solution's residual is {residual[n]:.1e}, more than {MAX_RESIDUAL:g}. "
                "The mesh may overlap itself, hold slivers, or be far smaller than the wavelength; "
                "'scattering.precision: double' may help."
            )
        progress(n, "done", 1.0)

    shape = *field.shape[:2], *sweep.shape, *field.shape[3:]
    return Solution(field.reshape(shape), residual, seconds, unknowns)


def _amplitudes(between, weights, polarizations, ways):
    """f = -V_p^T z^-1 V_q, (P, A), on a ring, from its values between samples by all `ways`, (K, K) per parity."""
    result = []
    for receive, transmit in polarizations:
        total = 0
        for parity, ring in enumerate(between):
            count = len(ring) // len(ways)
            left, right = (slice(w * count, (w + 1) * count) for w in map(ways.index, (receive, transmit)))
            of_left, of_right = weights[receive][parity], weights[transmit][parity]
            total += np.einsum("ai,ij,aj->a", of_left, ring[left, right], of_right, optimize=True)
        # F = sum over the group of chi(g) g h makes a parity's matrix |G| times the one that is stored.
        result.append(-total / len(between))
    return np.stack(result)


def _bistatic(system, of_waves, operator, transmitters, receivers, polarizations, refined, progress):
    """f = -V_p(u_r)^T z^-1 V_q(u_t), (P, D, R), phase about the middle, and the residuals if `refined`.

    transmitters, receivers: u, V and H, (D, 3) and (R, 3) each.
    """
    letters = dict(zip("VH", (1, 2), strict=True))
    field = np.zeros((len(polarizations), len(transmitters[0]), len(receivers[0])), np.complex128)
    parts, residuals = [], []
    for waves in (transmitters, receivers):
        count = len(waves[0])
        parts.append([slice(begin, min(begin + COLUMNS, count)) for begin in range(0, count, COLUMNS)])
    transmitted = sorted({way[1] for way in polarizations})
    for number, (letter, sent) in enumerate((letter, sent) for letter in transmitted for sent in parts[0]):
        progress(number / (len(transmitted) * len(parts[0])))
        waves = transmitters[0][sent], transmitters[letters[letter]][sent]
        currents, residual = system.currents(of_waves(*waves, alpha=operator.ALPHA), refined)
        residuals.append(residual)
        for row, way in enumerate(polarizations):
            for there in parts[1] if way[1] == letter else ():
                received = of_waves(receivers[0][there], receivers[letters[way[0]]][there])
                total = sum(x.T @ y for x, y in zip(currents, received, strict=True))
                # As in `_amplitudes`.
                field[row, sent, there] = -total / len(currents)
    return field, residuals


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
            assemble(entries, self.matrices, self.threads, progress)
            self.promise = MAX_RESIDUAL
        else:
            self.matrices = [LowRankMatrix([block.spans[p] for block in entries.blocks]) for p in range(len(sizes))]
            share = SHARE * min(1, MANY / sum(sizes))
            fill(entries, self.matrices, share * self.tolerance, self.threads, progress)
            self.promise = min(MAX_RESIDUAL, PROMISE * self.tolerance)
        # Kept, because the factorization overwrites the matrices.
        self.probed = [np.unique(np.linspace(0, n - 1, min(PROBED_ROWS // len(sizes), n)).astype(int)) for n in sizes]
        self.rows = entries.rows(self.probed)

    def factorize(self, progress):
        for p, matrix in enumerate(self.matrices):
            matrix.factorize(self.threads, lambda done, p=p: progress((p + done) / len(self.matrices)))

    def between(self, received, excited, groups):
        """V_p^T z^-1 V_q for each parity between the columns of each group: of received and excited, (N, K)."""
        return [
            matrix.between(left, right, groups, self.threads)
            for matrix, left, right in zip(self.matrices, received, excited, strict=True)
        ]

    def refined(self, received, excited, groups):
        """As `between`, after a step of refinement, or two if one does not keep the promise; and the residual."""
        currents, residual = self.currents(excited, refined=True)
        return [
            [left[:, group].T @ right[:, group] for group in groups]
            for left, right in zip(received, currents, strict=True)
        ], residual

    def currents(self, excited, refined):
        """Currents (N, D) of each parity, and their residual, 0 if they are not refined."""
        currents, residual = self._solve(excited), 0.0
        for _ in range(2 if refined else 0):
            currents = self._refined(excited, currents)
            residual = self._residual(excited, currents)
            if residual <= self.promise:
                break
        return currents, residual

    def residual(self, excited):
        """|A x - b| / |b| of the present solution."""
        return self._residual(excited, self._solve(excited))

    def _solve(self, right):
        return [matrix.solve(b, self.threads) for matrix, b in zip(self.matrices, right, strict=True)]

    def _refined(self, right, currents):
        """Currents after one step of iterative refinement with a matrix of double precision (Golub, Van Loan, 3.5.3).

        The matrix is assembled again, tile by tile, because its factors have replaced it.
        """
        entries = self.entries(np.complex128)
        self.rows = entries.rows(self.probed)
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
    # A parity that a direction does not excite has no right side to compare with.
    excited = scale > 1e-6 * scale.max(initial=0)
    return float((np.linalg.norm(difference, axis=0)[excited] / scale[excited]).max(initial=0.0))


class _Clock:
    """A clock that writes the seconds between laps."""

    def __init__(self, seconds, n):
        self.seconds, self.n, self.start = seconds, n, time.perf_counter()

    def lap(self, part):
        now = time.perf_counter()
        self.seconds[part][self.n] = now - self.start
        self.start = now
