"""Block low-rank L D L^T of a complex-symmetric matrix: tiles off the diagonal are products U V^T of low rank.

Functions are numbered patch by patch (see `basis`), so that a tile holds the coupling of two patches: of the
aircraft's tiles of 512 x 512, a tenth of a wavelength an edge, half have a rank below 10 at a relative 1e-4 (block
low-rank: Amestoy et al., SIAM J. Sci. Comput. 37, 2015). The factorization goes column by column. A tile of L D is
a tile of the matrix minus products of finished tiles. The sum is never formed: a randomized range finder only
multiplies it by a few dozen random columns (Halko, Martinsson, Tropp, SIAM Rev. 53, 2011).

As in `factorization` every product is done by one thread: the last bit does not depend on how many there are.
"""

from itertools import pairwise, starmap

import numpy as np
from scipy.linalg import ldl
from scipy.linalg.lapack import zpstrf, ztrtri

from isarflow.scattering.costs import SKETCH_COLUMNS
from isarflow.scattering.mom.device import give_back
from isarflow.scattering.mom.factorization import Symmetric, runs, share_of_work
from isarflow.scattering.mom.tiles import TILE_TRIANGLES
from isarflow.scattering.threads import Pool

FREED_COLUMNS = 8  # columns after which free memory is given back
SPANNED_LIMITS = 2.0  # error limits of a tile: the most of a random column, a sum of all singular values' remainders
SPARE_COLUMNS = 8  # random columns by which a run must exceed the rank that it finds; else another run follows
FEW_COLUMNS = 24, 32  # columns of a shorter first run
RAISED_COLUMNS = 7 + SPARE_COLUMNS  # columns more than the rank of the matrix's tile, which updates raise
STRIPE_ROWS = 64  # rows of a triangular block that are multiplied at once: fewer spare zeros, more make faster products
PROJECTION_NUMBERS = 1 << 25  # numbers that a thread may keep in a substitution
UPPER = np.triu(np.ones((SKETCH_COLUMNS, SKETCH_COLUMNS)))  # to multiply with: np.triu takes as long as a small inverse
# A row for each function of a tile, electric and magnetic: on all of TILE_TRIANGLES at most.
RANDOM = np.random.default_rng(0).standard_normal((6 * TILE_TRIANGLES, 1024)).astype(np.complex64)


def compress(times, project, width, error_limit, first_columns=SKETCH_COLUMNS):
    """Compress a tile X, given as two products, to U (M, r) and V (N, r), U V^T within `error_limit` (2-norm, about).

    times(run) is X R with R a run (slice) of the columns of RANDOM's first N = width rows; project(Q) is Q^H X.
    first_columns: columns of the first run.
    """
    basis, ends = None, [0, *sorted({min(first_columns, width), *range(SKETCH_COLUMNS, width, SKETCH_COLUMNS), width})]
    for run in starmap(slice, pairwise(ends)):
        sketch = times(run)
        if basis is not None:
            sketch = _beside(basis, sketch)
        # The pivoted Cholesky factor of the Gram matrix chooses columns of X R one by one, the one farthest from the
        # span of those before, until all remainders are small; the factor's inverse makes them orthonormal.
        sketch = sketch.astype(np.complex128)
        gram = sketch.conj().T @ sketch
        if not np.isfinite(gram.trace()):  # which would count as nothing
            return sketch[:, :1].astype(np.complex64), np.full((width, 1), np.nan, np.complex64)
        factor, pivots, rank, _ = zpstrf(gram, tol=(SPANNED_LIMITS * error_limit) ** 2)
        inverse = ztrtri(factor[:rank, :rank])[0] * UPPER[:rank, :rank] if rank else UPPER[:0, :0]
        added = (sketch[:, pivots[:rank] - 1] @ inverse).astype(np.complex64)
        # Once more: a small column of norm 1 also has the enlarged rounding errors along the basis.
        basis = added if basis is None else np.concatenate([basis, _beside(basis, added)], 1)
        if rank <= run.stop - run.start - SPARE_COLUMNS:
            break
    # Of Q^H X the left singular vectors stay whose singular value is above the limit.
    projected = project(basis)
    squares, vectors = np.linalg.eigh(projected.astype(np.complex128) @ projected.conj().T)
    vectors = vectors[:, squares > error_limit**2].astype(np.complex64)
    return basis @ vectors, (vectors.conj().T @ projected).T


def _beside(basis, columns):
    """What of the columns is not in the span of an orthonormal basis."""
    return columns - basis @ (basis.conj().T @ columns)


def _first_run(rank):
    """Columns of the first run for a tile of this rank. Updates raise the rank, most often by two to seven."""
    return next((columns for columns in FEW_COLUMNS if columns >= rank + RAISED_COLUMNS), SKETCH_COLUMNS)


class Inverse:
    """The inverse of a complex-symmetric (n, n) block as W^T W.

    With pivoting by Bunch and Kaufman a block is P^T L D L^T P, D of 1 x 1 and 2 x 2 blocks: W is C L^-1 P, where
    D^-1 = C^T C. Of a 2 x 2 block C begins with the sum or the difference of its rows: its diagonal may be zero.
    """

    def __init__(self, block):
        lower, middle, self.order = ldl(block, hermitian=False, overwrite_a=True, check_finite=False)
        inverse = ztrtri(lower[self.order], lower=1)[0] if len(lower) else lower  # L^-1
        main, off = np.diagonal(middle), np.diagonal(middle, -1)
        first = np.flatnonzero(off)
        second, a, b, d = first + 1, main[first], off[first], main[first + 1]
        sign = np.where(abs(a + d + 2 * b) < abs(a + d - 2 * b), -1, 1)
        # Of the rows' sum or difference, and of the other, each times the root of a half.
        p, q = (a + d) / 2 + sign * b, (a - d) / 2
        above, below = inverse[first], sign[:, None] * inverse[second]
        with np.errstate(all="ignore"):  # a singular block gives a solution that is not finite, which `solve` refuses
            inverse /= np.sqrt(main)[:, None]
            inverse[first] = (above + below) / np.sqrt(2 * p)[:, None]
            rotated = above - below - (q / p)[:, None] * (above + below)
            inverse[second] = rotated / np.sqrt(2 * (a * d - b**2) / p)[:, None]
        self.root = inverse.astype(np.complex64)

    def reduced(self, x):
        """W x, (n, D)."""
        x = x[self.order]
        out = np.empty_like(x)
        for rows in runs(len(x), STRIPE_ROWS):
            # A 2 x 2 block may begin with the last of the rows.
            np.matmul(self.root[rows, : rows.stop + 1], x[: rows.stop + 1], out=out[rows])
        return out

    def expanded(self, x):
        """W^T x, (n, D)."""
        out = np.empty_like(x)
        out[self.order] = self.root.T @ x
        return out


class Stack:
    """Matrices of one width below each other, to which more are added: as one array, whole or a part at a time."""

    def __init__(self, width):
        self.room, self.ends = np.empty((0, width), np.complex64), [0]

    def add(self, part):
        begin, end = self.ends[-1], self.ends[-1] + len(part)
        if end > len(self.room):
            # Twice as much: parts not written yet take no memory.
            room = np.empty((2 * end, self.room.shape[1]), self.room.dtype)
            room[:begin] = self.room[:begin]
            self.room = room
        self.room[begin:end] = part
        self.ends.append(end)

    @property
    def whole(self):
        return self.room[: self.ends[-1]]

    @property
    def parts(self):
        return [slice(*pair) for pair in pairwise(self.ends)]


def _stacked(ranks):
    """Where tiles (i, k), ranks[i, k] rows of each, lie when stacked row i by row: slices of i, numbers of k."""
    of_rows = np.repeat(np.tile(np.arange(len(ranks)), len(ranks)), ranks.T.reshape(-1))
    numbers = np.argsort(np.argsort(of_rows, kind="stable"))  # stacked column by column, each row's new place
    rows, columns = (np.cumsum(ranks.sum(axis)).tolist() for axis in (1, 0))
    return [slice(*pair) for pair in pairwise([0, *rows])], np.split(numbers, columns[:-1])


class LowRankMatrix(Symmetric):
    """An (N, N) complex-symmetric matrix of single precision in blocks, compressed to a tolerance (absolute, 2-norm).

    spans: the slices of its blocks. Filled by `cross.fill`, then used like SymmetricMatrix.
    """

    dtype, rooted = np.dtype(np.complex64), True

    def __init__(self, spans):
        self.spans, self.size = spans, spans[-1].stop
        self.error_limit = None  # largest error of a tile, 2-norm
        self.diagonal = [None] * len(spans)  # the matrix's blocks, then an Inverse of each of D's
        self.tiles = {}  # of the matrix, (i, j) with i > j: U (n_i, r), V (n_j, r); or the tile itself and None
        # For L D, for each row i: transposed U_ij, (r, n_i), for j < i.
        self.left = [Stack(span.stop - span.start) for span in spans]
        self.right = [None] * len(spans)  # for each column j: W V_ij, (n_j, r), for i > j, beside each other
        self.ranks = np.zeros(2 * (len(spans),), int)  # of L D's tiles (i, j)
        # Where U^T or V^T of all tiles lie when stacked row i by row: the tiles of a row, and of a column.
        self.rows, self.places = [], []

    def times(self, x, threads=1):
        """A x, (N, D), before the factors replace A."""
        out = np.empty_like(x)

        def row(i):
            out[self.spans[i]] = self.diagonal[i] @ x[self.spans[i]]
            for j, span in enumerate(self.spans):
                if j != i:
                    u, v = self.tiles[max(i, j), min(i, j)]
                    if v is None:
                        product = (u if j < i else u.T) @ x[span]
                    else:
                        product = u @ (v.T @ x[span]) if j < i else v @ (u.T @ x[span])
                    out[self.spans[i]] += product

        with Pool(threads) as pool:
            pool.wait([pool.submit(row, i) for i in range(len(self.spans))])
        return out

    def factorize(self, threads=1, progress=lambda done: None):
        """Replace the matrix by its factors."""
        count = len(self.spans)
        with Pool(threads) as pool:
            for j in range(count):
                column = _Column(self, j, pool)
                below = [pool.submit(column.tile, i) for i in range(j + 1, count)]
                column.invert()
                factors = [future.result() for future in below]
                for i, (u, v) in enumerate(factors, j + 1):
                    self.left[i].add(u.T)
                    self.ranks[i, j] = v.shape[1]
                # The last column has no tiles, and tiles of others may be empty.
                nothing = np.zeros((column.width, 0), self.dtype)
                self.right[j] = self.diagonal[j].reduced(np.concatenate([nothing, *(v for _, v in factors)], 1))
                del column, below, factors  # the next column makes couplings of its own
                if j % FREED_COLUMNS == FREED_COLUMNS - 1:
                    give_back()  # frees the matrix's tiles, which the factors replace
                progress(share_of_work((j + 1) / count))
        self.rows, self.places = _stacked(self.ranks)

    def _backward(self, x):
        """L^-T x in place."""
        projections = np.empty((self.ranks.sum(), x.shape[1]), x.dtype)  # U^T x of all tiles
        for j, span in reversed(list(enumerate(self.spans))):
            x[span] -= self.right[j] @ projections[self.places[j]]
            x[span] = self.diagonal[j].expanded(x[span])
            projections[self.rows[j]] = self.left[j].whole @ x[span]

    def _step(self):
        # A run has V^T y of all tiles at hand.
        return int(np.clip(PROJECTION_NUMBERS // max(self.ranks.sum(), 1), 32, 256))

    def _forward_run(self, y, _):
        """W L^-1 y in place, for the columns of one task."""
        projections = np.empty((self.ranks.sum(), y.shape[1]), y.dtype)  # V^T y of all tiles
        for j, span in enumerate(self.spans):
            y[span] -= self.left[j].whole.T @ projections[self.rows[j]]
            y[span] = self.diagonal[j].reduced(y[span])
            projections[self.places[j]] = self.right[j].T @ y[span]


class _Column:
    """A column j while its tiles are made: the products of finished columns k < j that are subtracted.

    The product that a tile (i, j) lacks is the sum over k of U_ik C_ijk U_jk^T, where C_ijk = V_ik^T D_k^-1 V_jk is the
    coupling of the two tiles of column k.
    """

    def __init__(self, matrix, j, pool):
        self.matrix, self.j = matrix, j
        self.stack_j, self.parts = (
            matrix.left[j].whole,
            matrix.left[j].parts,
        )  # U_jk^T of all k below each other, (K, n_j)
        self.width = matrix.spans[j].stop - matrix.spans[j].start
        self.first_run = slice(0, min(SKETCH_COLUMNS, self.width))
        self.sketches = {}  # U_jk^T R of all k, by the first of R's columns
        self.sketch(self.first_run)  # before there are threads
        # For each k the column of right[k] where W V_jk begins; those of the rows below follow.
        self.begins = matrix.ranks[:j, :j].sum(0).tolist()
        # For each row i > j: the rows of its C_ijk among the `couplings` of each k.
        ranks = matrix.ranks[j + 1 :, :j]
        ends = np.cumsum(ranks, 0)
        pairs = zip((ends - ranks).tolist(), ends.tolist(), strict=True)
        self.coupling_rows = [list(map(slice, *pair)) for pair in pairs]
        self.diagonal_couplings, self.couplings, self.sketched_couplings = (
            zip(*pool.map(self.couple, range(j)), strict=True) if j else 3 * ((),)
        )

    def sketch(self, run):
        """U_jk^T R of all k, (K, run)."""
        if run.start not in self.sketches:
            self.sketches[run.start] = self.stack_j @ RANDOM[: self.width, run]
        return self.sketches[run.start]

    def couple(self, k):
        """Make C_ijk for i = j, and for all i > j below each other, (., r_jk); and these times the sketch U_jk^T R."""
        part = self.parts[k]
        # right[k] has W V_ik, and D_k^-1 = W^T W.
        right, rank = self.matrix.right[k][:, self.begins[k] :], part.stop - part.start
        coupling = right.T @ right[:, :rank]
        return coupling[:rank], coupling[rank:], coupling[rank:] @ self.sketch(self.first_run)[part]

    def invert(self):
        """Invert the diagonal block. In double precision, as its rounding would enter every later column."""
        block = self.matrix.diagonal[self.j].astype(np.complex128)
        if self.j:
            couplings = zip(self.diagonal_couplings, self.parts, strict=True)
            inner = np.concatenate([coupling @ self.stack_j[part] for coupling, part in couplings])
            for rows in runs(self.width, STRIPE_ROWS):
                # Only the lower triangle is read.
                block[rows, : rows.stop] -= self.stack_j[:, rows].T @ inner[:, : rows.stop]
        self.matrix.diagonal[self.j] = Inverse(block)

    def tile(self, i):
        """Return U and V of the tile (i, j) of L D: the matrix's tile less the sum over k of U_ik C_ijk U_jk^T."""
        matrix, j = self.matrix, self.j
        u, v = matrix.tiles.pop((i, j))
        if not j:
            return u, v
        stack_i, parts_i = matrix.left[i].whole, matrix.left[i].parts  # U_ik^T of all k below each other, (K_i, n_i)
        rows = self.coupling_rows[i - j - 1]

        def times(run):  # the tile times some columns of RANDOM
            random = RANDOM[: self.width, run]
            if run.stop <= self.first_run.stop:
                inner = [sketched[of_row, run] for sketched, of_row in zip(self.sketched_couplings, rows, strict=True)]
            else:
                sketch, of_columns = self.sketch(run), zip(self.couplings, rows, self.parts, strict=True)
                inner = [coupling[of_row] @ sketch[part] for coupling, of_row, part in of_columns]
            product = u @ random if v is None else u @ (v.T @ random)
            return product - stack_i.T @ np.concatenate(inner)

        def project(basis):  # the adjoint of a basis times the tile
            adjoint = basis.conj().T
            projected = adjoint @ stack_i.T
            inner = np.empty((len(adjoint), len(self.stack_j)), matrix.dtype)
            for coupling, of_row, part_i, part_j in zip(self.couplings, rows, parts_i, self.parts, strict=True):
                np.matmul(projected[:, part_i], coupling[of_row], out=inner[:, part_j])
            product = adjoint @ u if v is None else (adjoint @ u) @ v.T
            return product - inner @ self.stack_j

        first_columns = SKETCH_COLUMNS if v is None else _first_run(u.shape[1])
        return compress(times, project, self.width, matrix.error_limit, first_columns)
