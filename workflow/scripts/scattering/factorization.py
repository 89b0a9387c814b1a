"""Block factorizations: L D L^T of a complex-symmetric matrix of which only the lower triangle is stored, and L U.

A Galerkin EFIE matrix equals its transpose, so half of the storage and half of the work of an LU suffice. The CFIE's
does not. Pivoting stays within the diagonal blocks, which keeps the structure; the residual is as small as that of LU
with full pivoting, and every solve measures it. Golub, Van Loan, Matrix Computations, 4th ed., sec. 4.1 (L D L^T) and
3.2.10 (blocks).

The work is cut into products of fixed size, each done by one thread in a fixed order on its piece of the result: the
last bit does not depend on how many threads there are. (A product that BLAS itself splits between threads does.)
"""

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise, product

import numpy as np
import threadpoolctl
from scipy import sparse

BLOCK = 256  # columns of a block: few, because work on diagonal blocks is not halved; enough for products at full speed
RUN = 512  # rows of a task


class SymmetricMatrix:
    """An (N, N) complex-symmetric matrix, stored as block columns of its lower triangle.

    Filled by `put` and `add`, then `factorize`d in place; after that `between` and `solve` may be called.
    """

    def __init__(self, size, dtype, block=BLOCK):
        self.size, self.dtype = size, np.dtype(dtype)
        edges = [*range(0, size, block), size]
        self.spans = list(pairwise(edges))
        # columns[j]: rows from spans[j][0] on, row-major, so that any run of rows is one piece of memory
        self.columns = [np.zeros((size - a, b - a), dtype) for a, b in self.spans]

    def put(self, row, col, block):
        """Write a dense block whose upper left corner is (row, col); what lies above the diagonal blocks is ignored."""
        for (a, b), column in zip(self.spans, self.columns, strict=True):
            left, right = max(col, a), min(col + block.shape[1], b)
            top, bottom = max(row, a), row + block.shape[0]
            if left >= right or top >= bottom:
                continue
            part = block[top - row :, left - col : right - col]
            column[top - a : bottom - a, left - a : right - a] = part
            if row > col and top < b:
                # The diagonal block is stored whole: its upper half is the mirror of its lower.
                inside = min(bottom, b) - top
                column[left - a : right - a, top - a : top - a + inside] = part[:inside].T

    def add(self, rows, cols, values):
        """Add values to entries, given with both triangles; no entry may occur twice."""
        for (a, b), column in zip(self.spans, self.columns, strict=True):
            mine = (cols >= a) & (cols < b) & (rows >= a)
            column[rows[mine] - a, cols[mine] - a] += values[mine].astype(self.dtype)

    def rows(self, numbers):
        """Whole rows of the matrix (not of its factors), (len(numbers), N)."""
        result = np.empty((len(numbers), self.size), self.dtype)
        for place, number in enumerate(numbers):
            for (a, b), column in zip(self.spans, self.columns, strict=True):
                if number >= a:
                    result[place, a:b] = column[number - a]
                if a <= number < b:
                    result[place, b:] = column[b - a :, number - a]
        return result

    def factorize(self, threads=1, progress=lambda done: None):
        """Replace the matrix by its factors: L below the diagonal blocks, D^-1 in them. (4/3) N^3 real flops."""
        with _Pool(threads) as pool:
            # The last task to write each run of rows of each block column: the next one there waits for it.
            written = [{} for _ in self.columns]
            for k, column in enumerate(self.columns):
                pool.wait(written[k].values())
                width = column.shape[1]
                # Inverted in double precision: the block's rounding would otherwise enter every later column.
                inverse = np.linalg.inv(column[:width].astype(np.complex128)).astype(self.dtype)
                column[:width] = inverse
                panel = column[width:].copy()
                pool.wait([pool.submit(_multiply, column[width:], panel, inverse.T, r) for r in _runs(len(panel))])
                begin = 0
                for j in range(k + 1, len(self.columns)):
                    other = self.columns[j]
                    for r in _runs(len(other)):
                        written[j][r.start] = pool.submit(
                            _subtract,
                            other,
                            column[width + begin :],
                            panel[begin : begin + other.shape[1]],
                            r,
                            written[j].get(r.start),
                        )
                    begin += other.shape[1]
                progress(1 - (1 - (k + 1) / len(self.columns)) ** 3)

    def between(self, left, right, groups, threads=1):
        """left^T A^-1 right for groups (slices) of their columns, (N, D) each: a list of (K, K) complex128.

        One substitution serves both if they are the same array.
        """
        y = _forward(right, self.spans, self._below(), threads)
        x = y if left is right else _forward(left, self.spans, self._below(), threads)
        result = [np.zeros(2 * (group.stop - group.start,), np.complex128) for group in groups]
        with _Pool(threads) as pool:
            for (a, b), column in zip(self.spans, self.columns, strict=True):
                middle = np.empty_like(y[a:b])
                pool.wait([pool.submit(_multiply, middle.T, y[a:b].T, column[: b - a], r) for r in _runs(y.shape[1])])
                for group, total in zip(groups, result, strict=True):
                    total += x[a:b, group].T @ middle[:, group]
        return result

    def solve(self, right, threads=1):
        """A^-1 right, (N, D)."""
        x = _forward(right, self.spans, self._below(), threads)
        with _Pool(threads):
            for (a, b), column in reversed(list(zip(self.spans, self.columns, strict=True))):
                x[a:b] = column[: b - a] @ x[a:b] - column[b - a :].T @ x[b:]
        return x

    def _below(self):
        """L below each diagonal block."""
        return [column[b - a :] for (a, b), column in zip(self.spans, self.columns, strict=True)]


class GeneralMatrix:
    """An (N, N) matrix, stored as block columns. Used as SymmetricMatrix, filled with all blocks and entries."""

    def __init__(self, size, dtype, block=BLOCK):
        self.size, self.dtype = size, np.dtype(dtype)
        self.spans = list(pairwise([*range(0, size, block), size]))
        self.columns = [np.zeros((size, b - a), dtype) for a, b in self.spans]

    def put(self, row, col, block):
        """Write a dense block whose upper left corner is (row, col)."""
        for (a, b), column in zip(self.spans, self.columns, strict=True):
            left, right = max(col, a), min(col + block.shape[1], b)
            if left < right:
                column[row : row + block.shape[0], left - a : right - a] = block[:, left - col : right - col]

    def add(self, rows, cols, values):
        """Add values to entries; no entry may occur twice."""
        for (a, b), column in zip(self.spans, self.columns, strict=True):
            mine = (cols >= a) & (cols < b)
            column[rows[mine], cols[mine] - a] += values[mine].astype(self.dtype)

    def rows(self, numbers):
        """Whole rows of the matrix (not of its factors), (len(numbers), N)."""
        return np.concatenate([column[numbers] for column in self.columns], 1)

    def factorize(self, threads=1, progress=lambda done: None):
        """Replace the matrix by L below the diagonal blocks, U above and U^-1 in them. (8/3) N^3 real flops."""
        with _Pool(threads) as pool:
            # The last task to write each block: the next one there waits for it.
            written = {}
            for k, ((a, b), column) in enumerate(zip(self.spans, self.columns, strict=True)):
                pool.wait([task for block, task in written.items() if k in block])
                inverse = np.linalg.inv(column[a:b].astype(np.complex128)).astype(self.dtype)
                column[a:b] = inverse
                panel = column[b:].copy()
                pool.wait([pool.submit(_multiply, column[b:], panel, inverse.T, r) for r in _runs(len(panel))])
                rest = range(k + 1, len(self.columns))
                for i, j in product(rest, rest):
                    other, rows = self.columns[j], slice(*self.spans[i])
                    after = written.get((i, j))
                    written[i, j] = pool.submit(_subtract, other, column, other[a:b].T, rows, after)
                progress(1 - (1 - (k + 1) / len(self.columns)) ** 3)

    def between(self, left, right, groups, threads=1):
        """left^T A^-1 right for groups (slices) of their columns, (N, D) each: a list of (K, K) complex128."""
        y = _forward(right, self.spans, self._below(), threads)
        x = np.array(left, self.dtype, order="C")
        result = [np.zeros(2 * (group.stop - group.start,), np.complex128) for group in groups]
        with _Pool(threads) as pool:
            for (a, b), column in zip(self.spans, self.columns, strict=True):
                # x = U^-T left: what is above this block column has its x already.
                runs = _runs(x.shape[1])
                pool.wait([pool.submit(_subtract, x[a:b].T, x[:a].T, column[:a].T, r, None) for r in runs])
                value = np.empty_like(x[a:b])
                pool.wait([pool.submit(_multiply, value.T, x[a:b].T, column[a:b].T, r) for r in runs])
                x[a:b] = value
                for group, total in zip(groups, result, strict=True):
                    total += value[:, group].T @ y[a:b, group]
        return result

    def solve(self, right, threads=1):
        """A^-1 right, (N, D)."""
        x = _forward(right, self.spans, self._below(), threads)
        with _Pool(threads):
            for (a, b), column in reversed(list(zip(self.spans, self.columns, strict=True))):
                x[a:b] = column[a:b] @ x[a:b]
                x[:a] -= column[:a] @ x[a:b]
        return x

    def _below(self):
        """L below each diagonal block."""
        return [column[b:] for (_, b), column in zip(self.spans, self.columns, strict=True)]


class Product:
    """A x, collected in double precision from what `put` and `add` give of A; of A nothing is kept."""

    def __init__(self, x, symmetric):
        self.x, self.symmetric = x, symmetric
        self.result = np.zeros(x.shape, np.complex128)

    def put(self, row, col, block):
        """Take a dense block whose upper left corner is (row, col); for a symmetric matrix its mirror image too."""
        rows, cols = slice(row, row + block.shape[0]), slice(col, col + block.shape[1])
        self.result[rows] += block @ self.x[cols]
        if self.symmetric and row > col:
            self.result[cols] += block.T @ self.x[rows]

    def add(self, rows, cols, values):
        """Take entries, given with both triangles."""
        self.result += sparse.csr_array((values, (rows, cols)), 2 * (len(self.x),)) @ self.x


class _Pool(ThreadPoolExecutor):
    """Threads that each call a BLAS of one thread."""

    def __init__(self, threads):
        super().__init__(threads)

    def __enter__(self):
        self.limit = threadpoolctl.threadpool_limits(1, "blas")
        return super().__enter__()

    def __exit__(self, *error):
        super().__exit__(*error)
        self.limit.restore_original_limits()

    @staticmethod
    def wait(futures):
        for future in futures:
            future.result()


def _forward(right, spans, below, threads):
    """L^-1 right, (N, D), for a unit lower triangle of which `below` holds what is under each diagonal block."""
    y = np.array(right, below[0].dtype if below else None, order="C")
    with _Pool(threads) as pool:
        for (a, b), part in zip(spans, below, strict=True):
            rest, solved = y[b:], y[a:b].T
            pool.wait([pool.submit(_subtract, rest, part, solved, r, None) for r in _runs(len(rest))])
    return y


def _runs(length):
    return [slice(begin, min(begin + RUN, length)) for begin in range(0, length, RUN)]


def _multiply(c, a, b, rows):
    """c = a @ b.T on some rows."""
    np.matmul(a[rows], b.T, out=c[rows])


def _subtract(c, a, b, rows, after):
    """c -= a @ b.T on some rows, after what else writes them."""
    product = a[rows] @ b.T
    if after is not None:
        after.result()
    c[rows] -= product
