"""Fill low-rank matrices from samples: of most tiles a few rows and columns say all.

Of every patch some triangles are chosen, spread as far apart as they can be. What their half functions and another
patch's functions do to each other are columns C and rows R of a tile, and W where both cross: the tile is C W^+ R
(cross approximation: Goreinov, Tyrtyshnikov, Zamarashkin, Linear Algebra Appl. 261, 1997), with W's pseudo-inverse
regularized (Tikhonov). True rows of a few functions check every tile; one that they contradict, and every tile with
near pairs, is filled whole.

The samples of twelve patches make one panel of a tile's usual size: JAX compiles nothing but tiles.
"""

import numpy as np

from scattering.assembly import TILE, Block, block_of
from scattering.factorization import Pool
from scattering.lowrank import RANDOM, compress

SAMPLES = 32  # triangles of a patch
PATCHES = TILE // SAMPLES  # of a panel
CHECKS = 8  # functions of a patch and parity
# Singular values of W count down to this share of the tolerance, or to what single precision leaves of W's norm.
DAMPING, ROUNDING = 0.003, 2e-7


def fill(entries, matrices, tolerance, threads, progress=lambda done: None):
    """Fill every parity's LowRankMatrix with the Entries of a symmetric operator.

    tolerance: of a tile, relative to the 2-norm of the diagonal's blocks; progress(done) is called with the fraction
    done. Returns the share of tiles that were filled whole.
    """
    placed, count = entries.placed, len(entries.placed)
    corrections = [correction.tocsr() for correction in entries.corrections]

    def whole(i, j):
        """For each parity the whole tile (i, j), corrections included."""
        return [
            tile + correction[placed[i].spans[p], placed[j].spans[p]].toarray().astype(tile.dtype)
            for p, (tile, correction) in enumerate(zip(entries.between(placed[i], placed[j]), corrections, strict=True))
        ]

    for i in range(count):
        for matrix, block in zip(matrices, whole(i, i), strict=True):
            matrix.diagonal[i] = block
    with Pool(threads):  # for BLAS's threads would change the norm's last bit
        for matrix in matrices:
            norms = [np.linalg.norm(block, 2) for block in matrix.diagonal if block.size]
            matrix.cut = tolerance * float(np.median(norms or [0.0]))

    panels, checks, near = _panels(entries), _Checks(entries), _near_tiles(entries)
    tiles, done, total = 0, 0, count * (count - 1) // 2
    with Pool(threads) as pool:
        for number, panel in enumerate(panels):
            first = PATCHES * number
            columns = {i: entries.between(placed[i], panel) for i in range(first, count)}
            crossings = [entries.between(other, panel) for other in panels[number:]]
            for j in range(first, min(first + PATCHES, count)):
                rows = [entries.between(placed[j], other) for other in panels[number:]]
                exact, tasks = checks.rows(j), {}
                for i in (i for i in range(j + 1, count) if (i, j) not in near):
                    at, place = i // PATCHES - number, i % PATCHES
                    for p, matrix in enumerate(matrices):
                        crossing = _of_patch(_of_patch(crossings[at][p], j - first).T, place).T
                        samples = _of_patch(columns[i][p], j - first), _of_patch(rows[at][p], place).T, crossing
                        tasks[i, p] = pool.submit(_from_samples, *samples, *checks.of(exact, i, p), matrix.cut)
                sampled = {i for i, _ in tasks} - {i for (i, _), task in tasks.items() if task.result() is None}
                missed = [i for i in range(j + 1, count) if i not in sampled]
                for i in missed:
                    for p, block in enumerate(whole(i, j)):
                        tasks[i, p] = pool.submit(_from_whole, block, matrices[p].cut)
                for (i, p), task in tasks.items():
                    matrices[p].tiles[i, j] = task.result()
                tiles, done = tiles + len(missed), done + count - j - 1
                progress(done / max(total, 1))
    return tiles / max(total, 1)


def _panels(entries):
    """Placed Blocks of all half functions of the patches' samples."""
    surface, parities = entries.surface, len(entries.bases)
    halves = np.tile(np.arange(3 * TILE)[:, None], (parities, 1, 2))
    signs = np.tile([1.0, 0.0], (parities, 3 * TILE, 1))
    panels = []
    for begin in range(0, len(entries.blocks), PATCHES):
        triangles = np.full(TILE, len(surface.vertices))
        for place, block in enumerate(entries.blocks[begin : begin + PATCHES]):
            chosen = _spread(surface, block.triangles[block.triangles < len(surface.vertices)])
            triangles[place * SAMPLES :][: len(chosen)] = chosen
        panels.append(entries.place(Block(triangles, [slice(0, 3 * TILE)] * parities, halves, signs)))
    return panels


def _spread(surface, triangles):
    """SAMPLES of the triangles, each as far as can be from those before it."""
    if len(triangles) == 0:  # of a patch without functions
        return triangles
    centers = surface.vertices[triangles].mean(1)
    chosen = [int(np.linalg.norm(centers - centers.mean(0), axis=1).argmax())]
    apart = np.linalg.norm(centers - centers[chosen[0]], axis=1)
    while len(chosen) < min(SAMPLES, len(triangles)):
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(centers - centers[chosen[-1]], axis=1))
    return triangles[chosen]


def _of_patch(columns, place):
    """Of a panel's half functions (M, 3 TILE) those of the patch at a place, (M, 3 SAMPLES)."""
    taken = columns.reshape(len(columns), 3, TILE)[:, :, place * SAMPLES : (place + 1) * SAMPLES]
    return taken.reshape(len(columns), 3 * SAMPLES)


def _from_samples(columns, rows, crossing, checked, exact, cut):
    """U and V of a tile from C (M, S), R (S, N) and W (S, S); None if its true rows `checked` contradict them."""
    crossing = crossing.astype(np.complex128)
    adjoint = crossing.conj().T
    damping = max(DAMPING * cut, ROUNDING * np.linalg.norm(crossing)) ** 2
    # In double precision: W's pseudo-inverse is large, and only its product with R is not.
    rows = np.linalg.solve(adjoint @ crossing + damping * np.eye(len(crossing)), adjoint @ rows).astype(np.complex64)
    error = np.linalg.norm(exact - columns[checked] @ rows) * np.sqrt(len(columns) / max(len(checked), 1))
    if not (len(checked) and error <= cut):
        return None
    width = rows.shape[1]
    return compress(
        lambda count: columns @ (rows @ RANDOM[:width, :count]),
        lambda basis: (basis.conj().T @ columns) @ rows,
        width,
        cut,
    )


def _from_whole(block, cut):
    """U and V of a tile (M, N)."""
    width = block.shape[1]
    return compress(lambda count: block @ RANDOM[:width, :count], lambda basis: basis.conj().T @ block, width, cut)


class _Checks:
    """A few functions of every patch, of which true rows check its tiles."""

    def __init__(self, entries):
        self.entries, self.each = entries, TILE // (2 * CHECKS * len(entries.bases))
        self.chosen = [[self._some(span) for span in block.spans] for block in entries.blocks]
        count = len(entries.surface.vertices)
        groups = [self.chosen[begin : begin + self.each] for begin in range(0, len(self.chosen), self.each)]
        numbers = [[np.concatenate(of_parity) for of_parity in zip(*group, strict=True)] for group in groups]
        self.placed = [entries.place(block_of(entries.bases, own, count)) for own in numbers]

    @staticmethod
    def _some(span):
        return np.unique(np.linspace(span.start, span.stop - 1, min(CHECKS, span.stop - span.start)).astype(int))

    def rows(self, j):
        """The true rows of all functions that may check tiles of column j, by group and parity."""
        column = self.entries.placed[j]
        return {g: self.entries.between(self.placed[g], column) for g in range((j + 1) // self.each, len(self.placed))}

    def of(self, exact, i, p):
        """Where in block i its functions of a parity are, and their rows."""
        group, own = i // self.each, self.chosen[i][p]
        begin = sum(len(self.chosen[b][p]) for b in range(group * self.each, i))
        return own - self.entries.blocks[i].spans[p].start, exact[group][p][begin : begin + len(own)]


def _near_tiles(entries):
    """The tiles (i, j) with near pairs in any parity."""
    pairs = set()
    for p, correction in enumerate(entries.corrections):
        ends = [block.spans[p].stop for block in entries.blocks]
        rows, cols = (np.searchsorted(ends, numbers, side="right").tolist() for numbers in correction.coords)
        pairs |= set(zip(rows, cols, strict=True))
    return pairs
