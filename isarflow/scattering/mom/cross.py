"""Fill low-rank matrices from samples: a few rows and columns determine most tiles.

In every patch some triangles are chosen, as far apart as possible. The coupling of their half functions with another
patch's functions gives columns C and rows R of a tile, and W where both cross: the tile is C W^+ R
(cross approximation: Goreinov, Tyrtyshnikov, Zamarashkin, Linear Algebra Appl. 261, 1997), with W's pseudo-inverse
regularized (Tikhonov). Half of the samples are tried first, then three quarters. Two things check every tile: the next
quarter of the samples must be reproduced, and so must the exact entries between a few functions. One that fails, and
every tile with near pairs, is computed in full. Where there are magnetic currents, too, all tiles are, and far ones
are then compressed.

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
# Singular values of W are damped below the larger of these (Tikhonov).
DAMPING_SHARE = 0.003  # of the tolerance
ROUNDING_SHARE = 2e-7  # of W's norm, the rounding in single precision


def fill(entries, matrices, tolerance, threads, progress=lambda done: None):
    """Fill every parity's LowRankMatrix with the Entries of a symmetric operator.

    Returns the share of the tiles that were computed in full.
    tolerance: of a tile, relative to the 2-norm of the diagonal blocks; progress(done) gets the fraction done
    """
    placed, count = entries.blocks, len(entries.blocks)
    panels, near = _panels(entries) if entries.bases[0].per_triangle == 3 else [], _near_tiles(entries)
    total, done, full = max(count * (count - 1) // 2, 1), 0, 0

    def fill_in_full(i, j, dense=False):
        """Compute all entries of a tile; dense: store them so, else compressed. Returns as `fill_far`: 1 of 1."""
        for matrix, block in zip(matrices, entries.between(placed[i], placed[j]), strict=True):
            matrix.tiles[i, j] = (block.copy(), None) if dense else _from_block(block, matrix.error_limit)
        return 1, 1

    def fill_far(j, col_panel, row_panel, columns, crossing, exact):
        """Fill the tiles of a column j of `col_panel` in the rows of `row_panel`: how many, and how many in full."""
        rows, failed = entries.between(placed[j], row_panel.samples), 0
        numbers = [i for i in row_panel.sample_slices if i > j and (i, j) not in near]
        for i in numbers:
            crossing_part, tiles = (row_panel.sample_slices[i], col_panel.sample_slices[j]), []
            for p, matrix in enumerate(matrices):
                of_rows, of_columns = crossing_part
                samples = columns[i][p][:, of_columns], rows[p][:, of_rows].T, crossing[p][crossing_part]
                check_numbers = row_panel.check_numbers[i][p], col_panel.check_numbers[j][p]
                exact_part = exact[p][row_panel.check_slices[i], col_panel.check_slices[j]]
                tiles.append(_from_samples(*samples, check_numbers, exact_part, matrix.error_limit))
            if any(tile is None for tile in tiles):
                failed += 1
                fill_in_full(i, j)
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
            matrix.error_limit = tolerance * float(np.median(norms or [0.0]))
        if not panels:  # with magnetic currents every tile is computed in full, and far ones are compressed at once
            pairs = [(i, j) for j in range(count) for i in range(j + 1, count)]
            for one in [pool.submit(fill_in_full, i, j, dense=(i, j) in near and j > 0) for i, j in pairs]:
                one.result()
                done += 1
                progress(done / total)
            return 1.0
        for number, col_panel in enumerate(panels):
            below = range(PANEL_PATCHES * number, count)
            columns = pool.map(lambda i, panel=col_panel: entries.between(placed[i], panel.samples), below)
            columns, tasks = dict(zip(below, columns, strict=True)), []
            for row_panel in panels[number:]:
                crossing = entries.between(row_panel.samples, col_panel.samples)
                exact = entries.between(row_panel.check_functions, col_panel.check_functions)
                given = col_panel, row_panel, columns, crossing, exact
                tasks += [pool.submit(fill_far, j, *given) for j in col_panel.sample_slices]
            # Near tiles have a high rank: they are compressed with their updates. The first column has none.
            in_panel = [(i, j) for i, j in near if j in col_panel.sample_slices]
            tasks += [pool.submit(fill_in_full, i, j, dense=j > 0) for i, j in in_panel]
            for task in tasks:
                filled, failed = task.result()
                done, full = done + filled, full + failed
                progress(done / total)
    return full / total


class _Panel:
    """Samples of some patches, and functions that check their tiles, each as a placed Block.

    samples: half functions of the chosen triangles, sample_slices[n] those of patch n; check_functions: functions for
    checks, check_slices[n] those of patch n, check_numbers[n] their numbers within the patch for each parity
    """

    def __init__(self, entries, chosen):
        sampled = [_spread(entries.surface, entries.blocks[number].triangles) for number in chosen]
        ends = np.cumsum([0, *map(len, sampled)]).tolist()
        self.sample_slices = {n: slice(3 * a, 3 * b) for n, (a, b) in zip(chosen, pairwise(ends), strict=True)}
        # Triangle by triangle, so that the first of a patch's samples are a sample of fewer triangles.
        of_patches = [
            (TILE_TRIANGLES * np.arange(3) + np.arange(*pair)[:, None]).reshape(-1) for pair in pairwise(ends)
        ]
        halves = np.repeat(np.concatenate(of_patches)[:, None], 2, 1)
        parities, signs = len(entries.bases), np.tile([1.0, 0.0], (len(halves), 1))
        spans = [slice(0, len(halves))] * parities
        block = Block(np.concatenate(sampled), spans, [halves] * parities, [signs] * parities)
        self.samples = Placed(block, entries.surface, entries.real)
        numbers = [np.concatenate(of_parity) for of_parity in zip(*chosen.values(), strict=True)]
        self.check_functions = Placed(block_of(entries.bases, numbers), entries.surface, entries.real)
        ends = np.cumsum([0, *(len(of_parities[0]) for of_parities in chosen.values())]).tolist()
        self.check_slices = {n: slice(*pair) for n, pair in zip(chosen, pairwise(ends), strict=True)}
        self.check_numbers = {
            n: [numbers - span.start for numbers, span in zip(of_parities, entries.blocks[n].spans, strict=True)]
            for n, of_parities in chosen.items()
        }


def _panels(entries):
    """A _Panel for every PANEL_PATCHES patches, each checked by evenly chosen functions, the same for all parities."""
    # A function of two halves exists in every parity that has both its triangles.
    keys = [basis.halves @ [3 * len(entries.surface.vertices), 1] for basis in entries.bases]
    shared = np.logical_and.reduce([np.isin(keys[0], key) for key in keys])
    chosen = []
    for block in entries.blocks:
        of_patch = keys[0][block.spans[0]][shared[block.spans[0]]]
        even = of_patch[np.linspace(0, len(of_patch) - 1, min(CHECK_FUNCTIONS, len(of_patch))).astype(int)]
        chosen.append([np.flatnonzero(np.isin(key, even)) for key in keys])
    numbered = list(enumerate(chosen))
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


def _from_samples(columns, rows, crossing, check_numbers, exact, error_limit):
    """U and V of a tile from C (M, S), R (S, N), W (S, S); None if its samples or `exact` entries contradict them.

    check_numbers: rows and columns of the exact entries; error_limit: of the tile, 2-norm.
    """
    if exact.size == 0:  # no functions to check it with
        return None
    # W's pseudo-inverse is large, but its product with C or R is not: only these are of single precision.
    crossing, width = crossing.astype(np.complex128), rows.shape[1]
    # Twice the exact entries' part of an error that is spread evenly over the tile.
    exact_limit = 2 * error_limit * np.sqrt(exact.size / (len(columns) * width))
    check_rows, check_columns = check_numbers
    for quarters in (2, 3):
        (row_samples, more_rows), (col_samples, more_cols) = (_quarters(count, quarters) for count in crossing.shape)
        c, r = columns[:, col_samples], rows[row_samples]
        inverse = _inverse(crossing[row_samples, col_samples], error_limit)
        row_errors = rows[more_rows] - (crossing[more_rows, col_samples] @ inverse).astype(np.complex64) @ r
        column_errors = columns[:, more_cols] - c @ (inverse @ crossing[row_samples, more_cols]).astype(np.complex64)
        # Not so with a NaN.
        reproduced = all(np.linalg.norm(errors) <= error_limit for errors in (row_errors, column_errors))
        if reproduced and np.linalg.norm(exact - c[check_rows] @ (inverse @ r[:, check_columns])) < exact_limit:
            break
    else:
        return None
    return compress(
        lambda run: c @ (inverse @ (r @ RANDOM[:width, run])).astype(np.complex64),
        lambda basis: ((basis.conj().T @ c) @ inverse).astype(np.complex64) @ r,
        width,
        error_limit,
        first_columns=2 * c.shape[1] // 3,  # what so few samples determine is of a lower rank
    )


def _quarters(count, quarters):
    """Two slices of `count` samples, three a triangle, whole triangles: the first `quarters` quarters, and the next."""
    ends = [3 * (count // 3 * share // 4) for share in (quarters, quarters + 1)]
    return slice(0, ends[0]), slice(*ends)


def _inverse(crossing, error_limit):
    """W^+."""
    adjoint = crossing.conj().T
    damping = max(DAMPING_SHARE * error_limit, ROUNDING_SHARE * np.linalg.norm(crossing)) ** 2 or 1.0  # where W is zero
    # SciPy's routines would keep other threads waiting.
    return np.linalg.solve(adjoint @ crossing + damping * np.eye(len(adjoint)), adjoint)


def _from_block(block, error_limit):
    """U and V of a tile (M, N)."""
    width = block.shape[1]
    return compress(lambda run: block @ RANDOM[:width, run], lambda basis: basis.conj().T @ block, width, error_limit)


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
