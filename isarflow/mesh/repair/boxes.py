"""Find triangles, edges and vertices that are near each other: their boxes overlap."""

import numpy as np

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.progress import going

LEAF, CHUNK = 5_000, 1_000_000  # pairs compared together: if space can be halved, and at most
PAIRS = 10_000_000  # boxes that may overlap; a sound surface has about 13 for each triangle
ALIKE = 5  # times PAIRS are compared where halving the space separates no boxes


def around(points, margin=0.0):
    """The lowest and highest corners, two (N, 3), of boxes around points (N, P, 3) and `margin` metres more."""
    return points.min(axis=1) - margin, points.max(axis=1) + margin


def near_boxes(these, those, name):
    """Pairs (P, 2) of a box of `these` and one of `those` (from `around`) that overlap; InputError for too many."""
    (low, high), (other_low, other_high) = these, those
    everywhere = np.full(3, -np.inf), np.full(3, np.inf)
    cells, pairs = [(np.arange(len(low)), np.arange(len(other_low)), *everywhere)], [np.zeros((0, 2), int)]
    count = alike = 0
    while cells:  # halve the space until few boxes are left in a cell
        going(f"look for neighbours among {len(low)} triangles")
        here, there, start, stop = cells.pop()
        if len(here) == 0 or len(there) == 0:
            continue
        if len(here) * len(there) > LEAF:
            axis, middle, below, above = _halved(low[here], high[here])
            if max(below.sum(), above.sum()) < 0.9 * len(here):
                other_below, other_above = other_low[there, axis] < middle, other_high[there, axis] >= middle
                halved = np.arange(3) == axis
                cells.append((here[below], there[other_below], start, np.where(halved, middle, stop)))
                cells.append((here[above], there[other_above], np.where(halved, middle, start), stop))
                continue
            alike += len(here) * len(there)
        for part in np.array_split(here, 1 + len(here) * len(there) // CHUNK):
            corner = np.maximum(low[part][:, None], other_low[there])
            meet = (corner <= np.minimum(high[part][:, None], other_high[there])).all(axis=2)
            # Boxes may share many cells; the lowest corner of their common part lies in one.
            meet &= ((corner >= start) & (corner < stop)).all(axis=2)
            first, second = np.nonzero(meet)
            pairs.append(np.stack([part[first], there[second]], axis=1))
            count += len(first)
            if count > PAIRS or alike > ALIKE * PAIRS:
                _refuse(np.median((low[here] + high[here]) / 2, axis=0), name)
    return np.concatenate(pairs)


def _halved(low, high):
    """The axis and place to halve it so that the larger half of boxes (N, 3) is smallest; those below and above."""
    ways = []
    for axis in range(3):
        middle = np.median((low[:, axis] + high[:, axis]) / 2)
        below, above = low[:, axis] < middle, high[:, axis] >= middle
        ways.append((max(below.sum(), above.sum()), axis, middle, below, above))
    return min(ways, key=lambda way: way[:2])[1:]


def check_hubs(vertices, triangles, name):
    """Refuse a surface with a vertex that has more triangles than can be paired with each other."""
    count = np.bincount(triangles.ravel())
    if count.max() ** 2 > PAIRS:
        _refuse(vertices[count.argmax()], name)


def _refuse(point, name):
    where = f"too many triangles lie side by side near {topology.place(point)} to look for those that cross"
    raise InputError(f"{name}: {where}. Export fewer and rounder ones, not needles, nor finer than the mesh.")
