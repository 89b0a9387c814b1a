"""Fill low-rank matrices from samples: of most tiles a few rows and columns say all.

Of every patch some triangles are chosen, spread as far apart as they can be. What their half functions and another
patch's functions do to each other are columns C and rows R of a tile, and W where both cross: the tile is C W^+ R
(cross approximation: Goreinov, Tyrtyshnikov, Zamarashkin, Linear Algebra Appl. 261, 1997), with W's pseudo-inverse
regularized (Tikhonov). Two things check every tile: a quarter of its samples must follow from the others, and so must
true entries between a few functions. One that fails, and every tile with near pairs, is filled whole.

The samples of twelve patches make one panel of a tile's usual size, and so do functions that check: JAX compiles
nothing but tiles. It computes them while threads compress those before.
"""

from collections import deque
from itertools import pairwise

import numpy as np

from scattering.assembly import TILE, Block, block_of
from scattering.device import give_back
from scattering.factorization import Pool
from scattering.lowrank import RANDOM, SKETCH, compress

SAMPLES = 32  # triangles of a patch
CHECKS = SAMPLES // 2  # functions of a patch, on two triangles each
PATCHES = TILE // SAMPLES  # of a panel
UNDER_WAY = 32  # tiles not yet compressed, each of some megabytes
# Singular values of W count down to this share of the tolerance, or to what single precision leaves of W's norm.
DAMPING, ROUNDING = 0.003, 2e-7


def fill(entries, matrices, tolerance, threads, progress=lambda done: None):
    """Fill every parity's LowRankMatrix with the Entries of a symmetric operator.

    tolerance: of a tile, relative to the 2-norm of the diagonal's blocks; progress(done) is called with the fraction
    done. Returns the share of tiles that were filled whole.
    """
    placed, count = entries.placed, len(entries.placed)
    corrections = [correction.tocsr() for correction in entries.corrections]
    give_back()
    total, done, wholes, under_way = count * (count - 1) // 2, 0, 0, deque()

    def begin(i, j):
        """For each parity the whole tile (i, j) as JAX will compute it, and what else it consists of."""
        spans = zip(placed[i].spans, placed[j].spans, strict=True)
        return [
            (tile, correction[rows, cols])
            for tile, correction, (rows, cols) in zip(
                entries.begin(placed[i], placed[j]), corrections, spans, strict=True
            )
        ]

    with Pool(threads) as pool:
        for i in range(count):
            for matrix, parts in zip(matrices, begin(i, i), strict=True):
                matrix.diagonal[i] = _whole(*parts)
        for matrix in matrices:
            norms = list(pool.map(_norm, matrix.diagonal))
            matrix.cut = tolerance * float(np.median([norm for norm in norms if norm] or [0.0]))

        def fill_whole(i, j, sketch):
            nonlocal wholes
            wholes += 1
            parts = zip(begin(i, j), matrices, strict=True)
            under_way.append((i, j, [pool.submit(_from_whole, *of, matrix.cut, sketch) for of, matrix in parts]))

        def settle(most):
            nonlocal done
            while len(under_way) > most:
                i, j, tasks = under_way.popleft()
                tiles = [task.result() for task in tasks]
                if any(tile is None for tile in tiles):
                    fill_whole(i, j, SKETCH)
                    continue
                for matrix, tile in zip(matrices, tiles, strict=True):
                    matrix.tiles[i, j] = tile
                done += 1
                progress(done / total)

        panels, checks, near = _panels(entries), _Checks(entries), _near_tiles(entries)
        for number, panel in enumerate(panels):
            first = PATCHES * number
            columns = {i: _all_by_patch(entries.between(placed[i], panel)) for i in range(first, count)}
            crossings = [_all_by_patch(entries.between(other, panel)) for other in panels[number:]]
            exact = [entries.between(other, checks.placed[number]) for other in checks.placed[number:]]
            for j in range(first, min(first + PATCHES, count)):
                rows = [_all_by_patch(entries.between(placed[j], other)) for other in panels[number:]]
                for i in range(j + 1, count):
                    if (i, j) in near:
                        fill_whole(i, j, 2 * SKETCH)  # of near tiles the rank is high
                    else:
                        at, place = i // PATCHES - number, i % PATCHES
                        tasks = []
                        for p, matrix in enumerate(matrices):
                            crossing = crossings[at][p][j - first].reshape(3, PATCHES, SAMPLES, -1)[:, place]
                            crossing = crossing.reshape(3 * SAMPLES, -1)
                            samples = columns[i][p][j - first], rows[at][p][place].T, crossing
                            true = exact[at][p][checks.places[i], checks.places[j]]
                            where = checks.numbers[i][p], checks.numbers[j][p]
                            tasks.append(pool.submit(_from_samples, *samples, where, true, matrix.cut))
                        under_way.append((i, j, tasks))
                    settle(UNDER_WAY)
        settle(0)
    return wholes / max(total, 1)


def _panels(entries):
    """Placed Blocks of all half functions of the patches' samples."""
    surface, panels = entries.surface, []
    for begin in range(0, len(entries.blocks), PATCHES):
        triangles = np.full(TILE, len(surface.vertices))
        for place, block in enumerate(entries.blocks[begin : begin + PATCHES]):
            chosen = _spread(surface, block.triangles[block.triangles < len(surface.vertices)])
            triangles[place * SAMPLES :][: len(chosen)] = chosen
        panels.append(entries.place(Block(triangles, [slice(0, 3 * TILE)] * len(entries.bases))))
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


def _by_patch(columns):
    """A panel's half functions (M, 3 TILE) patch by patch, (PATCHES, M, 3 SAMPLES)."""
    of_patches = columns.reshape(-1, 3, PATCHES, SAMPLES).transpose(2, 0, 1, 3)
    return of_patches.reshape(PATCHES, len(columns), 3 * SAMPLES)


def _all_by_patch(parities):
    return [_by_patch(columns) for columns in parities]


def _from_samples(columns, rows, crossing, checked, exact, cut):
    """U and V of a tile from C (M, S), R (S, N) and W (S, S); None if what is true of it contradicts them.

    exact: the tile's entries between some of its rows and some of its columns, `checked`
    """
    if exact.size == 0:  # none has functions to check it with
        return None
    # In double precision: W's pseudo-inverse is large, and only its product with C or R is not.
    crossing, rows = crossing.astype(np.complex128), rows.astype(np.complex128)
    if _left_out(columns, rows, crossing, cut) > cut:
        return None
    inverse, width = _divided(crossing, np.eye(len(crossing)), cut), rows.shape[1]
    difference = exact - columns[checked[0]] @ (inverse @ rows[:, checked[1]])
    if not np.linalg.norm(difference) < 2 * cut * np.sqrt(exact.size / (len(columns) * width)):
        return None
    return compress(
        lambda run: columns @ (inverse @ (rows @ RANDOM[:width, run])).astype(np.complex64),
        lambda basis: ((basis.conj().T @ columns) @ inverse @ rows).astype(np.complex64),
        width,
        cut,
    )


def _divided(crossing, right, cut):
    """W^+ right."""
    adjoint = crossing.conj().T
    damping = max(DAMPING * cut, ROUNDING * np.linalg.norm(crossing)) ** 2
    return np.linalg.solve(adjoint @ crossing + damping * np.eye(len(crossing)), adjoint @ right)


def _left_out(columns, rows, crossing, cut):
    """How far (Frobenius) true rows and columns of a quarter of the samples are from what the other samples say."""
    others, out = np.split(np.arange(3 * SAMPLES).reshape(3, SAMPLES), [SAMPLES - SAMPLES // 4], axis=1)
    others, out = others.reshape(-1), out.reshape(-1)
    inner, below, beside = (
        crossing[np.ix_(others, others)],
        crossing[np.ix_(out, others)],
        crossing[np.ix_(others, out)],
    )
    for_rows = _divided(inner.T, below.T, cut).T
    for_columns = _divided(inner, beside, cut).astype(np.complex64)
    of_rows = rows[out] - for_rows @ rows[others]
    of_columns = columns[:, out] - columns[:, others] @ for_columns
    return max(np.linalg.norm(of_rows), np.linalg.norm(of_columns))


def _from_whole(tile, correction, cut, sketch=SKETCH):
    """U and V of a tile (M, N)."""
    block = _whole(tile, correction)
    width = block.shape[1]
    return compress(lambda run: block @ RANDOM[:width, run], lambda basis: basis.conj().T @ block, width, cut, sketch)


def _whole(tile, correction):
    rows, cols = correction.shape
    return np.asarray(tile)[:rows, :cols] + correction.toarray().astype(tile.dtype)


def _norm(block):
    """2-norm, to a few per cent, by iteration."""
    if block.size == 0:
        return 0.0
    x = RANDOM[: len(block), :1]
    for _ in range(20):
        x = block.conj().T @ (block @ (x / np.linalg.norm(x)))
    return float(np.sqrt(np.linalg.norm(x)))


class _Checks:
    """Functions that check tiles: some of every patch, evenly chosen, the same for all parities.

    placed: Blocks of those of PATCHES patches each; numbers: for each patch and parity, within its span, (C,); places:
    the same within the placed Block, a slice
    """

    def __init__(self, entries):
        # A function of two halves is one of every parity that has both its triangles.
        keys = [basis.halves @ [3 * len(entries.surface.vertices), 1] for basis in entries.bases]
        shared = np.logical_and.reduce([np.isin(keys[0], key) for key in keys])
        own = [np.flatnonzero(shared[block.spans[0]]) + block.spans[0].start for block in entries.blocks]
        own = [keys[0][one[np.linspace(0, len(one) - 1, min(CHECKS, len(one))).astype(int)]] for one in own]
        chosen = [[np.flatnonzero(np.isin(key, one)) for key in keys] for one in own]
        self.placed, self.places = [], []
        for begin in range(0, len(chosen), PATCHES):
            group = chosen[begin : begin + PATCHES]
            numbers = [np.concatenate(of_parity) for of_parity in zip(*group, strict=True)]
            self.placed.append(entries.place(block_of(entries.bases, numbers, len(entries.surface.vertices))))
            self.places += [slice(*ends) for ends in pairwise(np.cumsum([0, *(len(one[0]) for one in group)]).tolist())]
        self.numbers = [
            [numbers - span.start for numbers, span in zip(one, block.spans, strict=True)]
            for one, block in zip(chosen, entries.blocks, strict=True)
        ]


def _near_tiles(entries):
    """The tiles (i, j) with near pairs in any parity."""
    pairs = set()
    for p, correction in enumerate(entries.corrections):
        ends = [block.spans[p].stop for block in entries.blocks]
        rows, cols = (np.searchsorted(ends, numbers, side="right") for numbers in correction.coords)
        pairs.update(divmod(pair, len(ends)) for pair in np.unique(rows * len(ends) + cols).tolist())
    return pairs
