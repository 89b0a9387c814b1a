"""Rivets, nuts and knobs: solids on a much larger part, too small for the field to see and for edges to follow."""

import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.boxes import near_boxes
from isarflow.mesh.ground import Ground

SMALL, LOW = 1 / 2, 1 / 4  # wanted edges: a detail's largest extent, and the most it may stick out of its part
MUCH = 8  # times its own extent: the least extent of its part
TOUCH = 0.6  # of its extent: no corner of a detail that is sunk into its part is farther from it than half


def without_details(vertices, triangles, edge, name):
    """Drop details from a surface for edges of `edge` metres; also the number dropped.

    Details are closed solids smaller than SMALL that touch one other part, MUCH larger, and nowhere stick out of it by
    more than LOW, which is as far as a mesh may be from its source. Those that touch each other stay if one stays.
    """
    piece, closed = topology.closed_pieces(triangles)
    corners, shape = vertices[triangles], (len(closed), 3)
    low, high = np.full(shape, np.inf), np.full(shape, -np.inf)
    np.minimum.at(low, piece, corners.min(axis=1))
    np.maximum.at(high, piece, corners.max(axis=1))
    extent = (high - low).max(axis=1)
    small = closed & (extent < SMALL * edge)
    if not small.any() or small.all():
        return vertices, triangles, 0
    few = np.flatnonzero(small)
    boxes = low[few], high[few]
    groups, group = topology.groups(near_boxes(boxes, boxes, name), len(few))
    mine = small[piece]
    points, owner = corners[mine].reshape(-1, 3), np.searchsorted(few, np.repeat(piece[mine], 3))
    parts, stays = np.zeros(groups, dtype=int), np.zeros(groups, dtype=bool)  # parts that each group touches
    for part in np.flatnonzero(~small):
        near = ((points >= low[part] - edge) & (points <= high[part] + edge)).all(axis=1)
        if not near.any():
            continue
        nearest, farthest = np.full(len(few), np.inf), np.zeros(len(few))
        apart = Ground(vertices, triangles[piece == part]).distance(points[near])[0]
        np.minimum.at(nearest, owner[near], apart)
        np.maximum.at(farthest, owner[near], apart)
        touches = nearest <= TOUCH * extent[few]
        parts[np.unique(group[touches])] += 1
        high_up = (farthest > LOW * edge) | (extent[part] < MUCH * extent[few])
        stays[group[touches & high_up]] = True
    dropped = few[((parts == 1) & ~stays)[group]]
    return *topology.compact(vertices, triangles[~np.isin(piece, dropped)]), len(dropped)
