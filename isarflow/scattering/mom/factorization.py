"""Block factorizations: L D L^T of a complex-symmetric matrix of which only the lower triangle is stored, and L U.

A Galerkin EFIE matrix equals its transpose, so half of the storage and half of the work of an LU suffice. The CFIE
matrix does not. Pivoting stays within the diagonal blocks, which keeps the structure; the residual is as small as with
LU and partial pivoting, and every solve measures it. Golub, Van Loan, Matrix Computations, 4th ed., sec. 4.1 (L D L^T)
and 3.2.10 (blocks).

The symmetric matrix keeps real and imaginary part apart: three real products then replace a complex one (Higham, SIAM
J. Matrix Anal. Appl. 13, 1992: as stable in the norm), a quarter less work. Each block is finished in one go, by
products as long as the whole row to its left.

The work is cut into products of fixed size, each done by one thread in a fixed order on its piece of the result: the
last bit does not depend on how many threads there are. (A product that BLAS itself splits between threads does.)
"""

from itertools import pairwise, product
from math import ceil

import numpy as np

from isarflow.scattering.threads import Pool, blas_of_one_thread

BLOCK_ROWS = 256  # rows and columns of a block: few, because work on diagonal blocks is not halved
LARGE_UNKNOWNS = 8_000  # from this size of the matrix on, blocks are larger
LARGE_BLOCK_ROWS = 384  # rows and columns of these: products are faster, and diagonal blocks matter less
RUN_COLUMNS = 512  # rows or columns of a task


class Symmetric:
    """What matrices with factors L D L^T share, in whatever way they store them.

    rooted: whether W is part of L^-1, with D^-1 = W^T W; D is then 1.
    """

    rooted = False

    def between(self, left, right, groups, threads=1):
        """left^T A^-1 right for groups (slices) of their columns, (N, D) each: a list of (K, K) complex128.

        One substitution serves both if they are the same array.
        """
        y, divided = self._forward(right, threads)
        x = y if left is right else self._forward(left, threads)[0]

        def of_group(group):
            products = (x[rows, group].T @ divided[rows, group] for rows in runs(self.size))
            return sum(products, np.zeros(2 * (group.stop - group.start,), np.complex128))

        with Pool(threads) as pool:
            return list(pool.map(of_group, groups))

    def solve(self, right, threads=1):
        """A^-1 right, (N, D)."""
        _, x = self._forward(right, threads)
        with Pool(threads) as pool:
            parts = even_runs(x.shape[1], self._step())
            pool.wait([pool.submit(self._backward, x[:, part]) for part in parts])
        return x

    def _forward(self, right, threads):
        """L^-1 right and D^-1 L^-1 right, (N, D)."""
        y = np.empty(right.shape, self.dtype)
        divided = y if self.rooted else np.empty_like(y)

        def run(part):
            y[:, part] = right[:, part]
            self._forward_run(y[:, part], divided[:, part])

        with Pool(threads) as pool:
            list(pool.map(run, even_runs(right.shape[1], self._step())))
        return y, divided


class SymmetricMatrix(Symmetric):
    """An (N, N) complex-symmetric matrix, stored as block rows of its lower triangle, real and imaginary part apart.

    Filled by `put`, then `factorize`d in place; after that `between` and `solve` may be called.
    """

    def __init__(self, size, dtype, block=None):
        block = block or (BLOCK_ROWS if size < LARGE_UNKNOWNS else LARGE_BLOCK_ROWS)
        self.size, self.dtype = size, np.dtype(dtype)
        self.spans = list(pairwise([*range(0, size, block), size]))
        # Up to and with the diagonal block, which is stored whole.
        self.blocks = [np.zeros((2, b - a, b), self.dtype.type(0).real.dtype) for a, b in self.spans]

    def put(self, row, col, block):
        """Write a dense block whose upper left corner is (row, col); parts above the diagonal blocks are ignored."""
        for (a, b), stored in zip(self.spans, self.blocks, strict=True):
            top, bottom, right = max(row, a), min(row + block.shape[0], b), min(col + block.shape[1], b)
            if top >= bottom or col >= right:
                continue
            part = block[top - row : bottom - row, : right - col]
            stored[:, top - a : bottom - a, col:right] = part.real, part.imag
            left = max(col, a)
            if row > col and left < right:
                # In the diagonal block the upper half is the mirror of the lower.
                mirror = part[:, left - col :].T
                stored[:, left - a : right - a, top:bottom] = mirror.real, mirror.imag

    def factorize(self, threads=1, progress=lambda done: None):
        """Replace the matrix by its factors: L left of the diagonal blocks, D^-1 in them. N^3 real flops."""
        inverses = []
        with Pool(threads) as pool:
            for j, ((a, b), row) in enumerate(zip(self.spans, self.blocks, strict=True)):
                # Left of column a, row j and the rows below it hold L D; row j is now divided by D.
                lower = np.empty((3, b - a, a), row.dtype)  # real and imaginary part of L, and their sum
                finished = zip(self.spans, inverses, strict=False)
                pool.wait([pool.submit(_divide, lower, row, inverse, slice(*span)) for span, inverse in finished])
                diagonal, *below = [
                    pool.submit(_update, block_row, lower, slice(a, b)) for block_row in self.blocks[j:]
                ]
                pool.wait([diagonal])  # the block is inverted while the rows below are still updated
                # The inverse is made in double precision and of the symmetric part: the block's rounding would else
                # enter every later column, and grow from one to the next where parts of a target are tightly coupled
                # (close plates).
                block = row[0, :, a:].astype(np.float64) + 1j * row[1, :, a:]
                inverse = np.linalg.inv((block + block.T) / 2)
                pool.wait(below)
                row[:, :, :a] = lower[:2]
                row[:, :, a:] = inverse.real, inverse.imag
                inverses.append(np.stack([*row[:, :, a:], row[0, :, a:] + row[1, :, a:]]))  # as `_product` takes them
                progress(share_of_work(b / self.size))

    def _backward(self, x):
        """L^-T x in place."""
        for (a, b), row in reversed(list(zip(self.spans, self.blocks, strict=True))):
            # Real products with both parts side by side: L stays as it is stored.
            parts = np.concatenate([x[a:b].real, x[a:b].imag], 1)
            by_real, by_imag = row[0, :, :a].T @ parts, row[1, :, :a].T @ parts
            width = x.shape[1]
            x[:a] -= (by_real[:, :width] - by_imag[:, width:]) + 1j * (by_real[:, width:] + by_imag[:, :width])

    def _step(self):
        return RUN_COLUMNS

    def _forward_run(self, y, divided):
        """L^-1 y in place and D^-1 of it, for the columns of one task."""
        parts = np.empty((3, *y.shape), y.real.dtype)
        for (a, b), row in zip(self.spans, self.blocks, strict=True):
            if a:
                real, imag = _product(row[:, :, :a], parts[:, :a].transpose(0, 2, 1))
                y[a:b] -= real + 1j * imag
            parts[0, a:b], parts[1, a:b] = y[a:b].real, y[a:b].imag
            parts[2, a:b] = parts[0, a:b] + parts[1, a:b]
            real, imag = _product(row[:, :, a:], parts[:, a:b].transpose(0, 2, 1))
            divided[a:b] = real + 1j * imag


def share_of_work(done):
    """Share of a symmetric factorization's work after a share of its columns: column x costs about x (1 - x)."""
    return done * done * (3 - 2 * done)


def _product(a, b):
    """Real and imaginary part of A B^T by three real products; a: (2, M, K) parts, b: (3, N, K) parts and their sum."""
    real, imag = a[0] @ b[0].T, a[1] @ b[1].T
    cross_terms = (a[0] + a[1]) @ b[2].T
    cross_terms -= real
    cross_terms -= imag
    real -= imag
    return real, cross_terms


def _divide(lower, row, inverse, cols):
    """Compute columns of L, its parts and their sum, from the columns of L D."""
    lower[0, :, cols], lower[1, :, cols] = _product(row[:, :, cols], inverse)
    lower[2, :, cols] = lower[0, :, cols] + lower[1, :, cols]


def _update(row, lower, cols):
    """Subtract from a block the row to its left times L^T."""
    if lower.shape[2]:
        real, imag = _product(row[:, :, : cols.start], lower)
        row[0, :, cols] -= real
        row[1, :, cols] -= imag


class GeneralMatrix:
    """An (N, N) matrix, stored as block columns. Used like SymmetricMatrix, but filled with all blocks."""

    def __init__(self, size, dtype, block=BLOCK_ROWS):
        self.size, self.dtype = size, np.dtype(dtype)
        self.spans = list(pairwise([*range(0, size, block), size]))
        self.columns = [np.zeros((size, b - a), dtype) for a, b in self.spans]

    def put(self, row, col, block):
        """Write a dense block whose upper left corner is (row, col)."""
        for (a, b), column in zip(self.spans, self.columns, strict=True):
            left, right = max(col, a), min(col + block.shape[1], b)
            if left < right:
                column[row : row + block.shape[0], left - a : right - a] = block[:, left - col : right - col]

    def factorize(self, threads=1, progress=lambda done: None):
        """Replace the matrix by L below the diagonal blocks, U above and U^-1 in them. (8/3) N^3 real flops."""
        with Pool(threads) as pool:
            for k, ((a, b), column) in enumerate(zip(self.spans, self.columns, strict=True)):
                inverse = np.linalg.inv(column[a:b].astype(np.complex128)).astype(self.dtype)
                column[a:b] = inverse
                panel = column[b:].copy()
                pool.wait([pool.submit(_multiply, column[b:], panel, inverse.T, r) for r in runs(len(panel))])
                rest = product(self.columns[k + 1 :], self.spans[k + 1 :])
                tasks = [pool.submit(_subtract, later, column, later[a:b].T, slice(*rows)) for later, rows in rest]
                pool.wait(tasks)
                progress(1 - (1 - (k + 1) / len(self.columns)) ** 3)

    def between(self, left, right, groups, threads=1):
        """left^T A^-1 right for groups (slices) of their columns, (N, D) each: a list of (K, K) complex128."""
        y = self._forward(right, threads)
        x = np.array(left, self.dtype, order="C")
        result = [np.zeros(2 * (group.stop - group.start,), np.complex128) for group in groups]
        with Pool(threads) as pool:
            for (a, b), column in zip(self.spans, self.columns, strict=True):
                # x = U^-T left: the rows above this block column have their x already.
                parts = runs(x.shape[1])
                pool.wait([pool.submit(_subtract, x[a:b].T, x[:a].T, column[:a].T, r) for r in parts])
                value = np.empty_like(x[a:b])
                pool.wait([pool.submit(_multiply, value.T, x[a:b].T, column[a:b].T, r) for r in parts])
                x[a:b] = value
                for group, total in zip(groups, result, strict=True):
                    total += value[:, group].T @ y[a:b, group]
        return result

    def solve(self, right, threads=1):
        """A^-1 right, (N, D)."""
        x = self._forward(right, threads)
        with blas_of_one_thread:
            for (a, b), column in reversed(list(zip(self.spans, self.columns, strict=True))):
                x[a:b] = column[a:b] @ x[a:b]
                x[:a] -= column[:a] @ x[a:b]
        return x

    def _forward(self, right, threads):
        """L^-1 right, (N, D)."""
        y = np.array(right, self.dtype, order="C")
        with Pool(threads) as pool:
            for (a, b), column in zip(self.spans, self.columns, strict=True):
                rest, below, solved = y[b:], column[b:], y[a:b].T
                pool.wait([pool.submit(_subtract, rest, below, solved, r) for r in runs(len(rest))])
        return y


class Product:
    """A x in double precision, summed from the blocks of A that `put` takes, one thread at a time; A is not kept."""

    def __init__(self, x, symmetric):
        self.x, self.symmetric = x, symmetric
        self.result = np.zeros(x.shape, np.complex128)

    def put(self, row, col, block):
        """Take a dense block whose upper left corner is (row, col); for a symmetric matrix its mirror image too."""
        rows, cols = slice(row, row + block.shape[0]), slice(col, col + block.shape[1])
        self.result[rows] += block @ self.x[cols]
        if self.symmetric and row > col:
            self.result[cols] += block.T @ self.x[rows]


def runs(length, step=RUN_COLUMNS):
    """Slices of `length` items, `step` in each but the last."""
    return [slice(begin, min(begin + step, length)) for begin in range(0, length, step)]


def even_runs(length, most):
    """Equal slices of `length` items, about `most` in each, an even number, so that two threads finish together.

    Long ones, all but the last, have a multiple of 16 items, with which products are faster.
    """
    step = max(ceil(length / (2 * max(ceil(length / (2 * most)), 1))), 1)
    return runs(length, step if step < 64 else 16 * ceil(step / 16))


def _multiply(c, a, b, rows):
    """Set c = a @ b.T on some rows."""
    np.matmul(a[rows], b.T, out=c[rows])


def _subtract(c, a, b, rows):
    """Subtract a @ b.T from c on some rows."""
    c[rows] -= a[rows] @ b.T
