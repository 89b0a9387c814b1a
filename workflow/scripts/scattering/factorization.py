"""Block L D L^T of a complex-symmetric matrix of which only the lower triangle is stored.

A Galerkin EFIE matrix equals its transpose, so half of the storage and half of the work of an LU suffice. Pivoting
stays within the diagonal blocks, which keeps the structure; the residual is as small as LU's with full pivoting, and
every solve measures it. Golub, Van Loan, Matrix Computations, 4th ed., sec. 4.1 (L D L^T) and 3.2.10 (block form).
"""

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.linalg.blas import get_blas_funcs

BLOCK = 1024  # columns of a block: large enough for matrix products at full speed


class SymmetricMatrix:
    """An (N, N) complex-symmetric matrix, stored as block columns of its lower triangle.

    Filled by `put` and `add`, then `factorize`d in place; after that `quadratic` and `solve` may be called.
    """

    def __init__(self, size, dtype, block=BLOCK):
        self.size, self.dtype = size, np.dtype(dtype)
        self.edges = np.append(np.arange(0, size, block), size)
        # columns[j]: rows from edges[j] on, row-major, so that any run of rows is one piece of memory
        self.columns = [np.zeros((size - a, b - a), dtype) for a, b in self._spans()]
        self._gemm = get_blas_funcs("gemm", dtype=self.dtype)

    def put(self, row, col, block):
        """Write a dense block whose upper left corner is (row, col); what lies above the diagonal blocks is ignored."""
        for j, (a, b) in enumerate(self._spans()):
            left, right = max(col, a), min(col + block.shape[1], b)
            top = max(row, a)
            if left < right and top < row + block.shape[0]:
                part = block[top - row :, left - col : right - col]
                self.columns[j][top - a : top - a + len(part), left - a : right - a] = part
                # A diagonal block is stored whole.
                mirrored = slice(max(top, left), min(row + block.shape[0], b))
                if mirrored.start < mirrored.stop and row > col:
                    part = block[mirrored.start - row : mirrored.stop - row, left - col : right - col]
                    self.columns[j][left - a : right - a, mirrored.start - a : mirrored.stop - a] = part.T

    def add(self, rows, cols, values):
        """Add values to entries, given with both triangles; no entry may occur twice."""
        for j, (a, b) in enumerate(self._spans()):
            mine = (cols >= a) & (cols < b) & (rows >= a)
            self.columns[j][rows[mine] - a, cols[mine] - a] += values[mine].astype(self.dtype)

    def rows(self, numbers):
        """Whole rows of the matrix (not of its factors), (len(numbers), N)."""
        result = np.empty((len(numbers), self.size), self.dtype)
        for place, number in enumerate(numbers):
            for j, (a, b) in enumerate(self._spans()):
                if number >= a:
                    result[place, a:b] = self.columns[j][number - a]
                if a <= number < b:
                    result[place, b:] = self.columns[j][b - a :, number - a]
        return result

    def factorize(self, progress=lambda done: None):
        """Replace the matrix by its factors: below the diagonal blocks L, in them L U of D. (4/3) N^3 flops."""
        self.pivots = []
        for k, column in enumerate(self.columns):
            width = column.shape[1]
            diagonal = lu_factor(column[:width], check_finite=False)
            self.pivots.append(diagonal)
            panel = column[width:].copy()
            column[width:] = lu_solve(diagonal, panel.T, trans=1, check_finite=False).T
            begin = 0
            for other in self.columns[k + 1 :]:
                self._subtract_product(other, column[width + begin :], panel[begin : begin + other.shape[1]])
                begin += other.shape[1]
            progress(1 - (1 - (k + 1) / len(self.columns)) ** 3)

    def quadratic(self, left, right):
        """left^T A^-1 right, column by column: (N, D) and (N, D) give (D,). One substitution if they are the same."""
        y = self._forward(right)
        x = y if left is right else self._forward(left)
        total = np.zeros(right.shape[1], np.complex128)
        for (a, b), diagonal in zip(self._spans(), self.pivots, strict=True):
            total += np.einsum("nd,nd->d", x[a:b], lu_solve(diagonal, y[a:b], check_finite=False))
        return total

    def solve(self, right):
        """A^-1 right, (N, D)."""
        x = self._forward(right)
        spans = list(self._spans())
        for j in reversed(range(len(spans))):
            a, b = spans[j]
            x[a:b] = lu_solve(self.pivots[j], x[a:b], check_finite=False) - self.columns[j][b - a :].T @ x[b:]
        return x

    def _forward(self, right):
        y = np.array(right, self.dtype, order="C")
        for (_, b), column in zip(self._spans(), self.columns, strict=True):
            a = b - column.shape[1]
            if b < self.size:
                self._subtract_product(y[b:], column[b - a :], y[a:b].T)
        return y

    def _subtract_product(self, c, a, b):
        """c -= a @ b.T in place, with c and a row-major, in one BLAS call without temporaries."""
        b = b if b.flags.c_contiguous or b.flags.f_contiguous else np.ascontiguousarray(b)
        if b.flags.c_contiguous:
            self._gemm(-1, b.T, a.T, 1, c.T, trans_a=1, overwrite_c=1)
        else:
            self._gemm(-1, b, a.T, 1, c.T, overwrite_c=1)

    def _spans(self):
        return zip(self.edges[:-1], self.edges[1:], strict=True)
