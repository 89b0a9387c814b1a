"""An operator's matrix between RWG functions, tile by tile.

Galerkin's method with exp(+j omega t) on an integral equation of `operators`; on the EFIE, divided by j k eta / (4 pi):

    z_mn = int int [ f_m . f_n' - div f_m div f_n' / k^2 ] exp(-j k R) / R dS dS'          (m^3)

(Harrington, Field Computation by Moment Methods, ch. 3; Rao, Wilton, Glisson 1982, eq. 17). Every tile is first
integrated between half functions with three points a triangle; for near triangles this is replaced by the operator's
own, finer integrals; then half functions are gathered into RWG functions (see `tiles`). For mirror planes the
sources are also taken at their images; the sums with the characters of the group give one matrix per parity (see
`basis`).
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from isarflow.scattering.checks import finite
from isarflow.scattering.mom.basis import by_half
from isarflow.scattering.mom.green import TINY_METRES
from isarflow.scattering.mom.quadrature import RULES
from isarflow.scattering.mom.sheet import add_sheet
from isarflow.scattering.mom.tiles import TILE_TRIANGLES, tile
from isarflow.scattering.threads import Pool


@dataclass(frozen=True)
class Block:
    """The functions that begin on the triangles of a patch, or others on no more than TILE_TRIANGLES triangles.

    spans, halves and signs have an item for each parity.
    """

    triangles: np.ndarray  # (U,) those that the functions touch, in any parity
    spans: list  # the functions, a slice of all; or of the chosen ones
    halves: list  # (n, K) half functions, TILE_TRIANGLES i + place in `triangles`
    signs: list  # (n, K)
    numbers: list = ()  # of the functions, an array or a slice of all


def blocks_of(bases, patches):
    """A Block for each of a Surface's `patches`; one whose functions touch too many triangles is cut in two."""
    first = [basis.halves.min(1) // basis.per_triangle for basis in bases]
    blocks, runs = [], list(pairwise(patches))[::-1]
    while runs:
        begin, end = runs.pop()
        spans = [slice(*np.searchsorted(f, [begin, end]).tolist()) for f in first]
        block = replace(block_of(bases, spans), spans=spans)
        if len(block.triangles) <= TILE_TRIANGLES:
            blocks.append(block)
        else:
            middle = (begin + end) // 2
            runs += [(middle, end), (begin, middle)]
    return blocks


def block_of(bases, numbers):
    """The Block of chosen functions, `numbers` or a slice of each parity, on no more than TILE_TRIANGLES triangles."""
    chosen = [basis.halves[chosen_numbers] for basis, chosen_numbers in zip(bases, numbers, strict=True)]
    split = [np.divmod(halves, basis.per_triangle) for halves, basis in zip(chosen, bases, strict=True)]
    used = np.unique(np.concatenate([triangles.reshape(-1) for triangles, _ in split]))
    halves = [half * TILE_TRIANGLES + np.searchsorted(used, triangles) for triangles, half in split]
    signs = [basis.signs[chosen_numbers] for basis, chosen_numbers in zip(bases, numbers, strict=True)]
    return Block(used, [slice(0, len(chosen_halves)) for chosen_halves in chosen], halves, signs, numbers)


class Entries:
    """Entries of every parity's matrix, in m^3, without the factor |G| of the group's order.

    operator: a module of `operators`; surface: Surface; bases: a Basis for each of surface.parities; wavenumber: rad/m;
    near: the operator's `near_terms` of the surface; dtype: complex64 or complex128; threads: for `corrections`;
    material: the impedance of a sheet, ohm a square, one or (T,) of the surface's triangles (see `sheet`)
    """

    def __init__(self, operator, surface, bases, wavenumber, near, dtype, threads=1, material=0.0):
        self.operator, self.surface, self.bases, self.near, self.dtype = operator, surface, bases, near, dtype
        self.material = material
        self.real = np.float32 if dtype == np.complex64 else np.float64
        self.wavenumber, alpha = wavenumber, operator.ALPHA
        scales = wavenumber / (2 * np.pi), 4 / wavenumber**2, TINY_METRES**2, 1 / 2, 1, wavenumber, alpha
        self.constants = np.array([*scales, (1 - alpha) / wavenumber, 1 / 6], self.real)
        self.characters = surface.parities.astype(self.real)
        self.blocks = [self._placed(block) for block in blocks_of(bases, surface.patches)]
        # Now, before there are threads that would each compute them.
        self.corrections = self._corrections(threads)

    def _corrections(self, threads):
        """Corrections of the three points a triangle between near pairs, in the form of `tiles.tile`."""
        count, image_pairs = len(self.surface.vertices), self.near.pairs
        values = [np.concatenate(kind).reshape(-1, 9) for kind in self._near(threads)]
        fields = np.concatenate([g * count + pairs[:, 0] for g, pairs in enumerate(image_pairs)])
        begins = np.searchsorted(fields, count * np.arange(len(image_pairs))[:, None] + np.arange(count + 1))
        sources = np.concatenate([pairs[:, 1] for pairs in image_pairs])
        values = np.concatenate([part for kind in values for part in (kind.real, kind.imag)], 1, dtype=self.real)
        return begins, sources, values

    def _near(self, threads):
        """Corrections between half functions, lists over reflections of (P, 3, 3), in a list."""
        values = self.operator.corrections(self.near, self.surface, self.wavenumber, self.real, threads)
        add_sheet(values, self.near.pairs, self.surface, self.wavenumber, self.material)
        return [values]

    def _placed(self, block):
        return Placed(block, self.surface, self.real, self.bases[0].per_triangle)

    def _fill(self, out, row, col):
        """Add the tile between two placed Blocks to `out`, flat."""
        combined = self.operator.ALPHA != 1
        tile(out, row.rows, col.cols, self.corrections, self.characters, self.constants, combined)

    def between(self, row, col):
        """The tile between two placed Blocks for each parity, (rows, cols)."""
        shapes = [(a.stop - a.start, b.stop - b.start) for a, b in zip(row.spans, col.spans, strict=True)]
        ends = np.cumsum([0, *(rows * cols for rows, cols in shapes)]).tolist()
        out = np.zeros(2 * ends[-1], self.real)
        self._fill(out, row, col)
        entries = finite(out, "the matrix", self.wavenumber).view(self.dtype)
        return [entries[slice(*pair)].reshape(shape) for pair, shape in zip(pairwise(ends), shapes, strict=True)]

    def rows(self, numbers):
        """Whole rows of every parity's matrix, (len(numbers), N), of functions `numbers` of each parity."""
        reach = self.bases[0].halves.shape[1]  # triangles of a function, at most; of a loop they are half as many
        pieces = max(1, -(-reach * sum(map(len, numbers)) // TILE_TRIANGLES))
        parts = []
        for piece in zip(*(np.array_split(of_parity, pieces) for of_parity in numbers), strict=True):
            row = self._placed(block_of(self.bases, piece))
            wholes = zip(*(self.between(row, col) for col in self.blocks), strict=True)
            parts.append([np.concatenate(whole, axis=1) for whole in wholes])
        return [np.concatenate(of_parity) for of_parity in zip(*parts, strict=True)]


def assemble(entries, matrices, threads=1, progress=lambda done: None):
    """Fill every parity's matrix with Entries.

    matrices: for each parity an object that takes dense blocks, `put(row, col, block)`, from several threads if there
    are; progress(done) is called with the fraction done. For a symmetric matrix only the lower triangle is filled.
    """
    symmetric, placed = entries.operator.SYMMETRIC, entries.blocks

    def store(row, col):
        for matrix, rows, cols, block in zip(matrices, row.spans, col.spans, entries.between(row, col), strict=True):
            matrix.put(rows.start, cols.start, block)

    with Pool(threads) as pool:
        tasks = [
            [pool.submit(store, row, col) for col in (placed[: i + 1] if symmetric else placed)]
            for i, row in enumerate(placed)
        ]
        for i, of_row in enumerate(tasks):
            pool.wait(of_row)
            progress(((i + 1) / len(placed)) ** (2 if symmetric else 1))


class Placed:
    """A Block's triangles, spans and arrays for `tiles.tile`: as rows at the identity, as columns at all images."""

    def __init__(self, block, surface, real, per_triangle=3):
        self.spans, self.triangles, self.numbers = block.spans, block.triangles, block.numbers
        corners, lengths = surface.vertices[block.triangles], surface.lengths[block.triangles]
        center = corners.mean(1)
        nu, points = corners - center[:, None], RULES[3][0] @ corners
        # (rho_a - nu_i) . rho_a with rho_a = nu_a / 2
        corner_products = (nu**2).sum(2)[:, :, None] / 4 - np.einsum("tax,tix->tai", nu, nu) / 2
        halves, signs = np.concatenate(block.halves), np.concatenate(block.signs)
        triangle, corner = halves % TILE_TRIANGLES, halves // TILE_TRIANGLES
        weights = signs * lengths[triangle, corner % 3] / 6  # half functions lack their l / 6
        ends = np.cumsum([0, *map(len, block.halves)])
        numbers, count = per_triangle * triangle + corner, per_triangle * len(corners)
        starts, functions, of_rows = by_half(numbers, weights, np.diff(ends), count)
        geometry = points, nu, center, surface.normals[block.triangles], corner_products
        geometry = (np.ascontiguousarray(x, real) for x in geometry)
        self.rows = block.triangles, *geometry, starts, functions, of_rows.astype(real), ends
        vectors = np.concatenate([points, nu, corners], 1) * surface.reflections[:, None, None]  # (G, T, 9, 3)
        sources = np.zeros((len(vectors), 27, TILE_TRIANGLES), real)
        sources[:, :, : len(corners)] = vectors.reshape(*vectors.shape[:2], 27).swapaxes(1, 2)
        columns = sources.reshape(len(sources), -1), block.triangles
        self.cols = *columns, halves.T.astype(np.uint32), np.ascontiguousarray(weights.T, real), ends
