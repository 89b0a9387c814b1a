"""Solve a mesh for its scattering amplitude over frequencies and directions."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import jax
import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, Sweep
from isarflow.core.words import check_word, check_words
from isarflow.mesh import topology
from isarflow.scattering import checks, needs
from isarflow.scattering.amplitudes import Bistatic, Monostatic
from isarflow.scattering.costs import COLUMNS, planned
from isarflow.scattering.directions import middle_of, skeletons
from isarflow.scattering.mom import dielectric, opaque
from isarflow.scattering.mom.assembly import Entries, assemble
from isarflow.scattering.mom.basis import AXES, fundamental_domain, rwg
from isarflow.scattering.mom.cross import fill
from isarflow.scattering.mom.device import OnDevice, give_back
from isarflow.scattering.mom.factorization import GeneralMatrix, Product, SymmetricMatrix
from isarflow.scattering.mom.farfield import Excitation
from isarflow.scattering.mom.lowrank import LowRankMatrix
from isarflow.scattering.mom.operators import cfie, efie
from isarflow.scattering.mom.sheet import balanced
from isarflow.scattering.solver import Solution
from isarflow.scattering.threads import Pool, blas_of_one_thread

OPERATORS = {"efie": efie, "cfie": cfie, "pmchwt": dielectric, "ibc": opaque, "tds": opaque}
FORMULATIONS = "efie", "cfie"  # a body's equation follows from its permittivity or surface impedance
DTYPES = {"single": np.complex64, "double": np.complex128}
# Above it (or RESIDUAL_FACTOR) the solution is refined, and refused if the residual stays too large.
MAX_RESIDUAL = 1e-3
TILE_SHARE = 0.4  # of the tolerance: the largest error of a tile
RESIDUAL_FACTOR = 10  # times the tolerance: the largest residual, above which a finer matrix refines the solution
FINER_MARGIN = 5  # the finer matrix's residual should be so much smaller than the largest: few directions are probed
MANY_UNKNOWNS = 6e4  # above it, errors of tiles add up to more than the largest residual unless each error is smaller
PARTS = ("assembly", "factorization", "directions")
PROBED_ROWS = 128  # of the matrix, in which the residual is measured


def solve(
    vertices: np.ndarray,
    triangles: np.ndarray,
    frequencies: Sequence[float] | np.ndarray,
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
    impedance: complex | Sequence[complex] | np.ndarray = 0.0,
    permittivity: complex | Sequence[complex] | np.ndarray | None = None,
    surface_impedance: complex | Sequence[complex] | np.ndarray = 0.0,
    normal_impedance: complex | Sequence[complex] | np.ndarray = 0.0,
) -> Solution:
    """Solve a mesh for its scattering amplitude f: of metal, thin sheets and opaque bodies, or of a solid body.

    The radar cross-section is 4 pi abs(f)^2; see `farfield` for signs and references.

    Parameters:
        vertices: (V, 3) m
        triangles: (T, 3) numbers of vertices, with edges of about a tenth of a wavelength
        frequencies: (F,) Hz
        elevation: (E,) degrees above the horizon
        azimuth: (A,) degrees
        polarizations: receive and transmit, from VV, HH, HV and VH
        symmetry: mirror planes of the mesh, from xz, yz and xy
        precision: single or double
        threads: for the linear algebra, without effect on the result
        progress: called as progress(number of the frequency, part, fraction) as the work goes on
        formulation: efie, or cfie for closed meshes
        tolerance: None for whole matrices, or for compressed ones their largest error, relative to the diagonal's norm
            (single precision, not cfie; see `cross` and `lowrank`)
        paired: True for directions one by one, elevation and azimuth (D,) each
        receivers: elevation and azimuth, (R,) each, of separate receivers; () for backscatter
        impedance: of a thin sheet, ohm a square, one, (F,), or (F, T) for each triangle (efie alone; see `materials`);
            0 is a perfect conductor
        permittivity: of a solid dielectric body that the mesh bounds, relative, one or (F,), of a negative imaginary
            part where there are losses; edges of a tenth of the wavelength in it (see `dielectric`); None for none
        surface_impedance: of closed opaque bodies and coated metal, E_tan = Z n x H, ohm; as `impedance` (see `opaque`)
        normal_impedance: across a thin dielectric sheet, eps_r times its `impedance`, as this; 0 leaves the current
            across it out. Neighbouring triangles have their normals on one side (see `normal`)

    Returns:
        A `Solution`, whose field is complex, in m: (P, F, E, A), or (P, F, D) of directions one by one, with receivers
        (..., R).

    Raises:
        InputError: for arguments that are none of these, as a mesh with NaN, without the symmetry, with edges of a
            wavelength (see `checks`) or, for cfie and bodies, open or turned inwards; for a solve that this machine
            has no memory for; and if a frequency cannot be solved to a residual of 1e-3.

    Warns of edges longer than a third of a wavelength, and of dielectric sheets whose triangles are turned otherwise.

    The backscatter of a sphere of 0.2 m at 600 MHz is -6.76 dBsm by the Mie series:

    >>> from isarflow.scattering.sphere import icosphere
    >>> field = solve(*icosphere(radius=0.2, edge=0.05), [0.6e9], [0.0], [0.0]).field
    >>> bool(abs(10 * np.log10(4 * np.pi * abs(field.item()) ** 2) + 6.76) < 0.1)
    True
    """
    check_word("formulation", formulation, FORMULATIONS)
    check_word("precision", precision, DTYPES)
    # The check makes arrays of lists.
    sweep = Sweep(frequencies, elevation, azimuth, polarizations, paired, receivers)  # type: ignore[arg-type]
    sweep = checks.checked_sweep(sweep)
    check_words("symmetry", symmetry, AXES)
    vertices, triangles = checks.checked_mesh(vertices, triangles)
    shape, index = (len(sweep.frequency), len(triangles)), 1.0
    materials, solid = checks.checked_impedance("impedance", impedance, shape, formulation), permittivity is not None
    surfaces = checks.checked_impedance("surface_impedance", surface_impedance, shape, formulation)
    kinds: tuple[type, type] = (Entries, Excitation)
    across = checks.checked_impedance("normal_impedance", normal_impedance, shape, formulation)
    has_both = has_loops = None  # triangles that have magnetic currents, too, of any kind or of loops alone
    if surfaces.any() or across.any():
        has_both = checks.opaque(vertices, triangles, materials, surfaces, permittivity)
        if across.any():
            has_loops = checks.dielectric_sheets(triangles, materials, across, has_both)
        formulation = "ibc" if surfaces.any() else "tds"
        kinds, materials = (opaque.Entries, dielectric.Excitation), np.stack([materials, surfaces, across], axis=1)
    elif solid:
        materials = checks.checked_permittivity(permittivity, shape[0], impedance, formulation)
        formulation, kinds = "pmchwt", (dielectric.Entries, dielectric.Excitation)
        index, has_both = max(1.0, abs(materials).max() ** 0.5), np.ones(len(triangles), bool)
    checks.check_tolerance(tolerance, formulation, precision)
    operator, dtype = OPERATORS[formulation], DTYPES[precision]
    if formulation in topology.CLOSED and formulation != "ibc":
        topology.check_closed(vertices, triangles, formulation)
    surface = fundamental_domain(vertices, triangles, symmetry, None if solid else materials.reshape(-1, shape[1]))
    materials = materials if solid else materials[..., surface.numbers]
    bases = [rwg(surface, parity) for parity in surface.parities]
    if has_both is not None:
        loops = None if has_loops is None else has_loops[surface.numbers]
        bases = dielectric.bases(surface, has_both[surface.numbers], loops)
    if tolerance is not None and not solid:
        bases = balanced(
            bases, materials[0] if materials.ndim == 3 else [materials[0], 0 * materials[0], 0 * materials[0]]
        )
    unknowns = sum(map(len, bases))
    if unknowns == 0:
        touching = "Triangles that touch share vertices."
        raise InputError(f"the mesh has no inner edge, so there is no current to solve for. {touching}")
    checks.check_edges(vertices, triangles, sweep.frequency.max(), index)
    rising = replace(sweep, frequency=np.sort(sweep.frequency))
    measures = {"unknowns": unknowns, "triangles": len(triangles), "box": np.ptp(vertices, axis=0)}
    megabytes, _ = planned(measures, len(surface.axes), rising, formulation, precision, tolerance)
    needs.check_memory(megabytes, unknowns, rising.frequency[-1])
    # About its middle a target needs the fewest directions, and single precision has the most digits of coordinates.
    middle = middle_of(surface)
    surface = replace(surface, vertices=surface.vertices - middle)
    with blas_of_one_thread:  # also between pools: the bits are the same whatever else the process does
        near, excitation = operator.near_terms(surface), kinds[1](surface, bases, dtype)
        directions = (Bistatic if sweep.receivers else Monostatic)(surface, middle, sweep, operator)
        field = np.empty((len(polarizations), shape[0], *directions.shape), np.complex128)
        residual, seconds = np.zeros(shape[0]), np.zeros((len(PARTS), shape[0]))
        for n, frequency in enumerate(sweep.frequency):
            k = 2 * np.pi * frequency / C0
            times = [time.perf_counter()]
            system = _System(
                partial(kinds[0], operator, surface, bases, k, near, threads=threads, material=materials[n]),
                dtype,
                tolerance,
                threads,
            )
            for part, work in zip(PARTS, (system.assemble, system.factorize), strict=False):
                work(partial(progress, n, part))
                times.append(time.perf_counter())
                give_back()
            of_waves, say = partial(excitation, k, threads=threads), partial(progress, n, PARTS[-1])
            field[:, n] = directions.amplitudes(system, k, of_waves, say)
            residual[n] = system.residual
            seconds[:, n] = np.diff([*times, time.perf_counter()])
            _check_residual(residual[n], frequency)
            checks.finite(field[:, n], "the field", k)
            progress(n, "done", 1.0)
    field = field.reshape(*field.shape[:2], *sweep.shape, *field.shape[3:])
    return Solution(field, residual, dict(zip(PARTS, seconds, strict=True)), unknowns)


def _check_residual(residual, frequency):
    if not residual <= MAX_RESIDUAL:  # written so that a NaN fails, too
        raise InputError(
            f"at {frequency / 1e9:g} GHz the solution's residual is {residual:.1e}, more than {MAX_RESIDUAL:g}. "
            "The mesh may overlap itself, hold slivers, or be far smaller than the wavelength; "
            "'scattering.precision: double' may help."
        )


class _System:
    """The matrices of all parities at one frequency; entries: `Entries` of a dtype."""

    def __init__(self, entries, dtype, tolerance, threads):
        self.entries, self.dtype, self.tolerance, self.threads = entries, dtype, tolerance, threads
        self.promise = min(MAX_RESIDUAL, RESIDUAL_FACTOR * (tolerance or 1))
        self.columns = COLUMNS  # right sides at a time

    def assemble(self, progress):
        entries = self.entries(self.dtype)
        sizes = [len(basis) for basis in entries.bases]
        if self.tolerance is None:
            kind = SymmetricMatrix if entries.operator.SYMMETRIC else GeneralMatrix
            self.matrices = [kind(size, self.dtype) for size in sizes]
            assemble(entries, self.matrices, self.threads, progress)
            if jax.default_backend() != "cpu":
                self.matrices = [OnDevice(matrix) for matrix in self.matrices]
        else:
            self.matrices = self._compressed(entries, self.tolerance, progress)
        # Kept, because the factorization overwrites the matrices.
        self.probed = [np.unique(np.linspace(0, n - 1, min(PROBED_ROWS // len(sizes), n)).astype(int)) for n in sizes]
        self.rows = entries.rows(self.probed)

    def _compressed(self, entries, tolerance, progress=lambda done: None):
        matrices = [LowRankMatrix([block.spans[p] for block in entries.blocks]) for p in range(len(entries.bases))]
        share = TILE_SHARE * min(1, MANY_UNKNOWNS / sum(matrix.size for matrix in matrices))
        fill(entries, matrices, share * tolerance, self.threads, progress)
        return matrices

    def factorize(self, progress):
        finished = [0.0] * len(self.matrices)
        # Compressed matrices beside each other: one's threads wait for the last tile of every column.
        beside = 1 if self.tolerance is None else min(self.threads, len(self.matrices))

        def factorize(p):
            def say(done):
                finished[p] = done
                progress(sum(finished) / len(finished))

            self.matrices[p].factorize(self.threads // beside, say)

        with Pool(beside) as pool:
            list(pool.map(factorize, range(len(self.matrices))))

    def probe(self, excited):
        """Measure `residual`, |A x - b| / |b|, of some right sides: if it is too large, all solutions are refined."""
        self.residual = self._residual(excited, self._solve(excited))
        self.refines = self.promise < self.residual < np.inf
        if self.refines and self.tolerance is None:
            self.columns = 1 << 30  # all: the whole matrix is assembled for each step
        elif self.refines:
            finer = self.tolerance * self.promise / (FINER_MARGIN * self.residual)
            finer = max(finer, float(np.finfo(self.dtype).eps))
            print(f"residual {self.residual:.1e}: the solution is refined by a matrix compressed to {finer:.1e}")
            self.finer = self._compressed(self.entries(self.dtype), finer)
        if self.refines:
            self.residual = 0.0  # from now on the largest of a refined solution

    def between(self, received, excited, groups):
        """V_p^T z^-1 V_q for each parity between the columns of each group: of received and excited, (N, K).

        If both are the same list, in single precision, only the columns of `skeletons` are solved for.
        """
        if excited is not received or self.dtype != np.complex64:
            return self._between(received, excited, [groups] * len(received))
        with Pool(self.threads) as pool:
            skeleton_columns, skeleton_groups, weights = zip(
                *skeletons(received, groups, pool, self.tolerance), strict=True
            )
        sides = zip(self._between(skeleton_columns, skeleton_columns, skeleton_groups), weights, strict=True)
        with blas_of_one_thread:
            return [[w.T @ amplitudes @ w for amplitudes, w in zip(*of_parity, strict=True)] for of_parity in sides]

    def _between(self, received, excited, groups):
        """As `between`, groups for each parity."""
        if self.refines:
            sides = zip(received, self.currents(excited), groups, strict=True)
            return [
                [left[:, group].T @ right[:, group] for group in parity_groups] for left, right, parity_groups in sides
            ]
        sides = zip(self.matrices, received, excited, groups, strict=True)
        return [
            matrix.between(left, right, parity_groups, self.threads) for matrix, left, right, parity_groups in sides
        ]

    def currents(self, excited):
        """Currents (N, D) of each parity, after up to two steps of refinement if one does not keep the promise."""
        currents = self._solve(excited)
        if self.refines:
            for _ in range(2):
                currents = self._refined(excited, currents)
                residual = self._residual(excited, currents)
                if residual <= self.promise:
                    break
            self.residual = float(np.maximum(self.residual, residual))  # NaN stays
        return currents

    def _solve(self, right):
        return [matrix.solve(b, self.threads) for matrix, b in zip(self.matrices, right, strict=True)]

    def _refined(self, right, currents):
        """Currents after one step of iterative refinement by a better matrix (Golub, Van Loan, 3.5.3).

        A compressed one is compressed less; a whole one is of double precision, assembled again, tile by tile.
        """
        if self.tolerance is not None:
            products = [matrix.times(x, self.threads) for matrix, x in zip(self.finer, currents, strict=True)]
            corrections = self._solve([b - product for b, product in zip(right, products, strict=True)])
            return [x + dx for x, dx in zip(currents, corrections, strict=True)]
        entries = self.entries(np.complex128)
        self.rows = entries.rows(self.probed)
        products = [Product(x, entries.operator.SYMMETRIC) for x in currents]
        assemble(entries, products)
        corrections = self._solve([b - p.result for b, p in zip(right, products, strict=True)])
        return [x.astype(np.complex128) + dx for x, dx in zip(currents, corrections, strict=True)]

    def _residual(self, right, currents):
        """|A x - b| / |b| over the probed rows, the largest over parities and columns of b and x, (N, D)."""
        # Not Python's max, which loses a NaN.
        return float(np.max([*map(_residual, self.rows, self.probed, right, currents)]))


def _residual(rows, numbers, right, solution):
    difference = rows @ solution - right[numbers]
    scale = np.linalg.norm(right, axis=0) * np.sqrt(len(numbers) / max(len(right), 1))
    # A parity that a direction does not excite has no right side to compare with.
    excited = ~(scale <= 1e-6 * scale.max(initial=0))  # written so that a NaN counts
    return float((np.linalg.norm(difference, axis=0)[excited] / scale[excited]).max(initial=0.0))
