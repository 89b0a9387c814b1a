"""Fill low-rank matrices from samples: a few rows and columns determine most tiles.

In every patch some triangles are chosen, as far apart as possible. The coupling of their half functions with another
patch's functions gives columns C and rows R of a tile, and W where both cross: the tile is C W^+ R
(cross approximation: Goreinov, Tyrtyshnikov, Zamarashkin, Linear Algebra Appl. 261, 1997), with W's pseudo-inverse
regularized (Tikhonov). Half of the samples are tried first, then three quarters. Two things check every tile: the next
quarter of the samples must follow, and so must true entries between a few functions. One that fails, and every tile
with near pairs, is filled whole.

The samples of twelve patches make one panel of a tile's usual size, and so do functions for checks. Every task of a
thread computes the entries that it compresses.
"""

from itertools import pairwise

import numpy as np
from scipy import sparse

from isarflow.scattering.mom.assembly import Block, Placed, block_of
from isarflow.scattering.mom.lowrank import RANDOM, compress
from isarflow.scattering.mom.tiles import TILE_TRIANGLES
from isarflow.scattering.threads import Pool

SAMPLED_TRIANGLES = 32  # triangles of a patch
CHECK_FUNCTIONS = SAMPLED_TRIANGLES // 2  # functions of a patch, on two triangles each
PANEL_PATCHES = TILE_TRIANGLES // SAMPLED_TRIANGLES  # of a panel
# Singular values of W count down to the larger of these.
DAMPING_SHARE = 0.003  # of the tolerance
ROUNDING_SHARE = 2e-7  # of W's norm, the rounding in single precision


def fill(entries, matrices, tolerance, threads, progress=lambda done: None):
    """Fill every parity's LowRankMatrix with the Entries of a symmetric operator. Return the share of whole tiles.

    tolerance: of a tile, relative to the 2-norm of the diagonal blocks; progress(done) gets the fraction done
    """
    placed, count = entries.blocks, len(entries.blocks)
    panels, near = _panels(entries), _near_tiles(entries)
    total, done, wholes = max(count * (count - 1) // 2, 1), 0, 0

    def whole(i, j, kept=False):
        for matrix, block in zip(matrices, entries.between(placed[i], placed[j]), strict=True):
            matrix.tiles[i, j] = (block.copy(), None) if kept else _from_whole(block, matrix.cut)
        return 1, 1

    def far(j, col_panel, row_panel, columns, crossing, exact):
        """Fill the tiles of a column j of `col_panel` in the rows of `row_panel`: how many, and how many whole."""
        rows, failed = entries.between(placed[j], row_panel.placed), 0
        numbers = [i for i in row_panel.patches if i > j and (i, j) not in near]
        for i in numbers:
            places, tiles = (row_panel.patches[i], col_panel.patches[j]), []
            for p, matrix in enumerate(matrices):
                samples = columns[i][p][:, places[1]], rows[p][:, places[0]].T, crossing[p][places]
                checked = row_panel.checks[i][p], col_panel.checks[j][p]
                true = exact[p][row_panel.places[i], col_panel.places[j]]
                tiles.append(_from_samples(*samples, checked, true, matrix.cut))
            if any(tile is None for tile in tiles):
                failed += 1
                whole(i, j)
            else:
                for matrix, tile in zip(matrices, tiles, strict=True):
                    matrix.tiles[i, j] = tile
        return len(numbers), failed

    with Pool(threads) as pool:
        for i, blocks in enumerate(pool.map(lambda block: entries.between(block, block), placed)):
            for matrix, block in zip(matrices, blocks, strict=True):
                matrix.diagonal[i] = block
        for matrix in matrices:
            norms = [norm for norm in pool.map(_norm, matrix.diagonal) if norm]
            matrix.cut = tolerance * float(np.median(norms or [0.0]))
        for number, col_panel in enumerate(panels):
            below = range(PANEL_PATCHES * number, count)
            columns = pool.map(lambda i, panel=col_panel: entries.between(placed[i], panel.placed), below)
            columns, tasks = dict(zip(below, columns, strict=True)), []
            for row_panel in panels[number:]:
                crossing = entries.between(row_panel.placed, col_panel.placed)
                exact = entries.between(row_panel.checking, col_panel.checking)
                given = col_panel, row_panel, columns, crossing, exact
                tasks += [pool.submit(far, j, *given) for j in col_panel.patches]
            # Near tiles have a high rank: they are compressed with their updates. The first column has none.
            tasks += [pool.submit(whole, *pair, pair[1] > 0) for pair in near if pair[1] in col_panel.patches]
            for task in tasks:
                filled, failed = task.result()
                done, wholes = done + filled, wholes + failed
                progress(done / total)
    return wholes / total


class _Panel:
    """Samples of some patches, and functions that check their tiles, each as a placed Block.

    placed: half functions of the samples, `patches[number]` the part of a patch; checking: the functions,
    `places[number]` the part of a patch; its functions are numbers `checks[number]` of each parity within its span
    """

    def __init__(self, entries, checks):
        sampled = [_spread(entries.surface, entries.blocks[number].triangles) for number in checks]
        ends = np.cumsum([0, *map(len, sampled)]).tolist()
        self.patches = {n: slice(3 * a, 3 * b) for n, (a, b) in zip(checks, pairwise(ends), strict=True)}
        # Triangle by triangle, so that the first of a patch's samples are a sample of fewer triangles.
        of_patches = [
            (TILE_TRIANGLES * np.arange(3) + np.arange(*pair)[:, None]).reshape(-1) for pair in pairwise(ends)
        ]
        halves = np.repeat(np.concatenate(of_patches)[:, None], 2, 1)
        parities, signs = len(entries.bases), np.tile([1.0, 0.0], (len(halves), 1))
        spans = [slice(0, len(halves))] * parities
        block = Block(np.concatenate(sampled), spans, [halves] * parities, [signs] * parities)
        self.placed = Placed(block, entries.surface, entries.real)
        numbers = [np.concatenate(of_parity) for of_parity in zip(*checks.values(), strict=True)]
        self.checking = Placed(block_of(entries.bases, numbers), entries.surface, entries.real)
        ends = np.cumsum([0, *(len(of_parities[0]) for of_parities in checks.values())]).tolist()
        self.places = {n: slice(*pair) for n, pair in zip(checks, pairwise(ends), strict=True)}
        self.checks = {
            n: [numbers - span.start for numbers, span in zip(of_parities, entries.blocks[n].spans, strict=True)]
            for n, of_parities in checks.items()
        }


def _panels(entries):
    """A _Panel for every PANEL_PATCHES patches, each checked by evenly chosen functions, the same for all parities."""
    # A function of two halves exists in every parity that has both its triangles.
    keys = [basis.halves @ [3 * len(entries.surface.vertices), 1] for basis in entries.bases]
    shared = np.logical_and.reduce([np.isin(keys[0], key) for key in keys])
    checks = []
    for block in entries.blocks:
        checking = keys[0][block.spans[0]][shared[block.spans[0]]]
        checking = checking[np.linspace(0, len(checking) - 1, min(CHECK_FUNCTIONS, len(checking))).astype(int)]
        checks.append([np.flatnonzero(np.isin(key, checking)) for key in keys])
    numbered = list(enumerate(checks))
    return [_Panel(entries, dict(numbered[n : n + PANEL_PATCHES])) for n in range(0, len(numbered), PANEL_PATCHES)]


def _spread(surface, triangles):
    """Choose SAMPLED_TRIANGLES of the triangles, each as far as possible from those before it."""
    if len(triangles) == 0:  # of a patch without functions
        return triangles
    centers, chosen = surface.vertices[triangles].mean(1), []
    farthest, apart = np.linalg.norm(centers - centers.mean(0), axis=1), np.inf
    for _ in range(min(SAMPLED_TRIANGLES, len(triangles))):
        chosen.append(int(farthest.argmax()))
        farthest = apart = np.minimum(apart, np.linalg.norm(centers - centers[chosen[-1]], axis=1))
    return triangles[chosen]


def _from_samples(columns, rows, crossing, checked, exact, cut):
    """U and V of a tile from C (M, S), R (S, N), W (S, S); None if its samples or `exact` entries contradict them."""
    if exact.size == 0:  # no functions to check it with
        return None
    # W's pseudo-inverse is large, but its product with C or R is not: only these are of single precision.
    crossing, width = crossing.astype(np.complex128), rows.shape[1]
    most = 2 * cut * np.sqrt(exact.size / (len(columns) * width))
    for quarters in (2, 3):
        (row_samples, more_rows), (col_samples, more_cols) = (_few(count, quarters) for count in crossing.shape)
        c, r, inverse = columns[:, col_samples], rows[row_samples], _inverse(crossing[row_samples, col_samples], cut)
        of_rows = rows[more_rows] - (crossing[more_rows, col_samples] @ inverse).astype(np.complex64) @ r
        of_columns = columns[:, more_cols] - c @ (inverse @ crossing[row_samples, more_cols]).astype(np.complex64)
        follow = all(np.linalg.norm(left) <= cut for left in (of_rows, of_columns))  # not so with a NaN
        if follow and np.linalg.norm(exact - c[checked[0]] @ (inverse @ r[:, checked[1]])) < most:
            break
    else:
        return None
    return compress(
        lambda run: c @ (inverse @ (r @ RANDOM[:width, run])).astype(np.complex64),
        lambda basis: ((basis.conj().T @ c) @ inverse).astype(np.complex64) @ r,
        width,
        cut,
        first=2 * c.shape[1] // 3,  # what so few samples determine is of a lower rank
    )


def _few(count, quarters):
    """Of `count` samples, three functions a triangle, so many quarters, and the next quarter: two slices."""
    ends = [3 * (count // 3 * share // 4) for share in (quarters, quarters + 1)]
    return slice(0, ends[0]), slice(*ends)


def _inverse(crossing, cut):
    """W^+."""
    adjoint = crossing.conj().T
    damping = max(DAMPING_SHARE * cut, ROUNDING_SHARE * np.linalg.norm(crossing)) ** 2 or 1.0  # where W is zero
    # SciPy's routines would keep other threads waiting.
    return np.linalg.solve(adjoint @ crossing + damping * np.eye(len(adjoint)), adjoint)


def _from_whole(block, cut):
    """U and V of a tile (M, N)."""
    width = block.shape[1]
    return compress(lambda run: block @ RANDOM[:width, run], lambda basis: basis.conj().T @ block, width, cut)


def _norm(block):
    """Compute the 2-norm of a symmetric block, to a few per cent, by iteration."""
    if block.size == 0:
        return 0.0
    x = RANDOM[: len(block), :1]
    for _ in range(20):
        x = (block @ (block @ (x / np.linalg.norm(x))).conj()).conj()
    return float(np.sqrt(np.linalg.norm(x)))


def _near_tiles(entries):
    """The tiles (i, j), i > j, with near pairs, a set."""
    triangles, count = [block.triangles for block in entries.blocks], len(entries.surface.vertices)
    rows = np.repeat(np.arange(len(triangles)), [len(of_block) for of_block in triangles])
    holds = sparse.csr_array((np.ones(len(rows)), (rows, np.concatenate(triangles))), (len(triangles), count))
    rows, cols = np.concatenate(entries.near.pairs).T
    touch = (holds @ sparse.csr_array((np.ones(len(rows)), (rows, cols)), 2 * (count,)) @ holds.T).tocoo()
    return {(i, j) for i, j in zip(*(numbers.tolist() for numbers in touch.coords), strict=True) if i > j}
