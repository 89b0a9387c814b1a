"""An operator's matrix between RWG functions, tile by tile.

Galerkin's method with exp(+j omega t) on an integral equation of `operators`; on the EFIE, divided by j k eta / (4 pi):

    z_mn = int int [ f_m . f_n' - div f_m div f_n' / k^2 ] exp(-j k R) / R dS dS'          (m^3)

(Harrington, Field Computation by Moment Methods, ch. 3; Rao, Wilton, Glisson 1982, eq. 17). Every tile is first
integrated between half functions with three points a triangle, then gathered into RWG functions. Triangles that are
near each other are integrated anew by the operator. For mirror planes the sources are also taken at their images; the
sums with the characters of the group give one matrix per parity (see `basis`).
"""

from collections import deque
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np

from scattering import nearfield
from scattering.kernel import distances, green_imag, green_real
from scattering.quadrature import points_of

# Triangles a tile holds, functions beyond its block's own included. Fixed, so that one compilation serves all.
TILE = 384
TILE_FUNCTIONS = 528
UNDER_WAY = 8  # tiles that JAX may compute ahead


@dataclass(frozen=True)
class Block:
    """The functions that begin on the triangles of a patch, padded to shapes that all blocks share.

    triangles: (TILE,) those that the functions touch, in any parity, padded with the number T
    spans: (G,) slices of each parity's functions; halves: (G, TILE_FUNCTIONS, 2) i * TILE + place in `triangles`;
    signs: (G, TILE_FUNCTIONS, 2), 0 where padded. Without these two it holds the 3 TILE half functions themselves.
    """

    triangles: np.ndarray
    spans: list
    halves: np.ndarray | None = None
    signs: np.ndarray | None = None


def blocks_of(bases, patches):
    """A Block for each of a Surface's `patches`; one whose functions touch too many triangles is cut in two."""
    touched = [basis.halves // 3 for basis in bases]
    first = [t.min(1) for t in touched]
    blocks, runs = [], list(pairwise(patches))[::-1]
    while runs:
        begin, end = runs.pop()
        spans = [slice(*np.searchsorted(f, [begin, end]).tolist()) for f in first]
        used = np.unique(np.concatenate([t[span].reshape(-1) for t, span in zip(touched, spans, strict=True)]))
        if len(used) > TILE or max(span.stop - span.start for span in spans) > TILE_FUNCTIONS:
            middle = (begin + end) // 2
            runs += [(middle, end), (begin, middle)]
            continue
        block = block_of(bases, [np.arange(span.start, span.stop) for span in spans], patches[-1])
        blocks.append(replace(block, spans=spans))
    return blocks


def block_of(bases, numbers, count):
    """The Block of chosen functions, `numbers` of each parity, on as many as TILE of `count` triangles."""
    chosen = [basis.halves[own] for basis, own in zip(bases, numbers, strict=True)]
    used = np.unique(np.concatenate([halves.reshape(-1) // 3 for halves in chosen]))
    halves = np.zeros((len(bases), TILE_FUNCTIONS, 2), np.int32)
    signs = np.zeros((len(bases), TILE_FUNCTIONS, 2))
    for p, (basis, own, mine) in enumerate(zip(bases, numbers, chosen, strict=True)):
        halves[p, : len(own)] = mine % 3 * TILE + np.searchsorted(used, mine // 3)
        signs[p, : len(own)] = basis.signs[own]
    triangles = np.pad(used, (0, TILE - len(used)), constant_values=count)
    return Block(triangles, [slice(0, len(own)) for own in numbers], halves, signs)


# Each step is compiled by itself: together XLA would evaluate Green's function for each output. Real and imaginary part
# are arrays of their own all the way, because it does not vectorize complex arithmetic on a CPU.


@jax.jit
def _sum(images, characters):
    """The tile between half functions with the images of the sources summed with one parity's characters."""
    (rows, cols), dtype = images[0][0][0].shape, images[0][0][0].dtype
    z = jnp.zeros((3 * rows, 3 * cols), dtype)
    for i, j in np.ndindex(3, 3):
        part = sum(character * image[i][j] for character, image in zip(characters, images, strict=True))
        # One after the other: XLA joins blocks at half the speed.
        z = jax.lax.dynamic_update_slice(z, part, (i * rows, j * cols))
    return z


# No number is beyond the ends: to make sure of that takes XLA as long as to gather.


@jax.jit
def _rows(z, halves, signs):
    """Rows of functions from those of their halves."""
    first, second = (z.at[halves[:, end]].get(mode="promise_in_bounds") for end in (0, 1))
    return first * signs[:, :1] + second * signs[:, 1:]


@jax.jit
def _columns(z, halves, signs):
    first, second = (z.at[:, halves[:, end]].get(mode="promise_in_bounds") for end in (0, 1))
    return first * signs[:, 0] + second * signs[:, 1]


@jax.jit
def _complex(real, imag):
    return jax.lax.complex(real, imag)


class Entries:
    """What every parity's matrix holds, in m^3, without the factor |G| of the group's order.

    operator: a module of `operators`; surface: Surface; bases: a Basis for each of surface.parities; wavenumber: rad/m;
    near: the operator's `near_terms` of the surface; dtype: complex64 or complex128
    """

    def __init__(self, operator, surface, bases, wavenumber, near, dtype):
        self.operator, self.surface, self.bases, self.near, self.dtype = operator, surface, bases, near, dtype
        self.real = np.float32 if dtype == np.complex64 else np.float64
        self.wavenumber, self.k = wavenumber, self.real(wavenumber)
        self.characters = [tuple(self.real(character) for character in parity) for parity in surface.parities]
        self.blocks = blocks_of(bases, surface.patches)

    @cached_property
    def placed(self):
        """The Blocks on JAX's device."""
        return [self.place(block) for block in self.blocks]

    @cached_property
    def corrections(self):
        """What three points a triangle leave out between near pairs, for each parity a sparse (N, N)."""
        of_halves = self.operator.corrections(self.near, self.surface, self.wavenumber, self.real)
        parities = zip(self.surface.parities, self.bases, strict=True)
        return [nearfield.between_functions(of_halves, parity, basis) for parity, basis in parities]

    def place(self, block):
        """A Block with what its tiles read, on JAX's device."""
        return _on_device(block, self.surface, self.real)

    def begin(self, row, col):
        """For each parity the tile between two placed Blocks, padded, which JAX computes in the background."""
        images = [_image(self.operator, self.k, row, source, col) for source in col.images]
        parts = list(zip(*images, strict=True))
        tiles = []
        for p, characters in enumerate(self.characters):
            sums = [_sum(part, characters) for part in parts]
            if row.halves is not None:
                sums = [_rows(z, row.halves[p], row.signs[p]) for z in sums]
            if col.halves is not None:
                sums = [_columns(z, col.halves[p], col.signs[p]) for z in sums]
            tiles.append(_complex(*sums))
        return tiles

    def between(self, row, col):
        """For each parity the tile between two placed Blocks, (rows, cols), without corrections."""
        parities = zip(self.begin(row, col), row.spans, col.spans, strict=True)
        return [_cut(tile, rows, cols) for tile, rows, cols in parities]

    def rows(self, numbers):
        """Whole rows of every parity's matrix, (len(numbers), N), of functions on no more than TILE triangles."""
        row = self.place(block_of(self.bases, numbers, len(self.surface.vertices)))
        wholes = zip(*(self.between(row, col) for col in self.placed), strict=True)
        return [
            (np.concatenate(whole, axis=1) + correction.tocsr()[own].toarray()).astype(self.dtype)
            for whole, correction, own in zip(wholes, self.corrections, numbers, strict=True)
        ]


def assemble(entries, matrices, progress=lambda done: None):
    """Fill every parity's matrix with Entries.

    matrices: for each parity an object that takes dense blocks, `put(row, col, block)`, and entries, `add(rows, cols,
    values)`; progress(done) is called with the fraction done. Of a symmetric matrix only the lower triangle is filled.
    """
    symmetric = entries.operator.SYMMETRIC
    # JAX computes in the background: a few tiles are under way while finished ones are stored.
    under_way = deque()
    for i, row in enumerate(entries.placed):
        for col in entries.placed[: i + 1] if symmetric else entries.placed:
            under_way.extend(zip(matrices, row.spans, col.spans, entries.begin(row, col), strict=True))
            while len(under_way) > UNDER_WAY:
                _store(*under_way.popleft())
        progress(((i + 1) / len(entries.placed)) ** (2 if symmetric else 1))
    while under_way:
        _store(*under_way.popleft())
    for correction, matrix in zip(entries.corrections, matrices, strict=True):
        matrix.add(*correction.coords, correction.data)


def _store(matrix, rows, cols, tile):
    matrix.put(rows.start, cols.start, _cut(tile, rows, cols))


def _cut(tile, rows, cols):
    return np.asarray(tile)[: rows.stop - rows.start, : cols.stop - cols.start]


def _image(operator, k, row, source, col):
    """Real and imaginary part of the half functions' tile for one image of the sources."""
    r = distances(row.images[0].points, source.points)
    return operator.half_functions(k, (green_real(k, r), green_imag(k, r)), r, row, source, col)


def _on_device(block, surface, real):
    """A Block with what its tiles read, on JAX's device: corners and points at each image, edge lengths, normals."""
    # One more triangle, of zero size, serves as padding.
    vertices = np.concatenate([surface.vertices, np.zeros((1, 3, 3))])[block.triangles]
    lengths = np.concatenate([surface.lengths, np.zeros((1, 3))])[block.triangles]
    normals = np.concatenate([surface.normals, np.zeros((1, 3))])[block.triangles]
    images = []
    for signs in surface.reflections:
        image = (vertices * signs).transpose(1, 2, 0)
        center = image.mean(0)
        nu = image - center
        images.append(
            SimpleNamespace(
                center=jnp.asarray(center, real),
                nu=jnp.asarray(nu, real),
                points=jnp.asarray(points_of(3, image).reshape(3, -1), real),
            )
        )
    return SimpleNamespace(
        spans=block.spans,
        images=images,
        lengths=jnp.asarray(lengths.T, real),
        normals=jnp.asarray(normals.T, real),
        halves=None if block.halves is None else [jnp.asarray(halves) for halves in block.halves],
        signs=None if block.signs is None else [jnp.asarray(signs, real) for signs in block.signs],
    )
