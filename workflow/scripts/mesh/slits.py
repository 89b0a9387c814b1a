"""Slits between solids, too narrow for a mesh to have two walls there: round a bolt in its hole, between its facets."""

import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.boxes import around, near_boxes
from isarflow.mesh.ground import Ground

PLACES = np.array([[1, 1, 1], [98, 1, 1], [1, 98, 1], [1, 1, 98], [1, 9, 9], [9, 1, 9], [9, 9, 1]])  # in a triangle
OPPOSED = -0.5  # cosine of the angle between the normals of walls that face each other, at most
DEEPER = 1 / 4  # of the widest slit: the fill goes into the other wall by that
MITRE = 1 / 3  # of its length: the least height of a corner's step above the walls that meet there


def close_slits(vertices, triangles, widest, close, name):
    """Move walls of slits `close` to `widest` metres wide across into the other wall; also the number of solids.

    A slit is where a whole triangle of a closed solid faces another's wall, from outside or a little from inside.
    """
    piece, closed = topology.closed_pieces(triangles)
    closed = closed[piece]
    if len(np.unique(piece[closed])) < 2:
        return vertices, triangles, 0
    solids, corners, normal = np.flatnonzero(closed), vertices[triangles], topology.shape(vertices[triangles])[0]
    pairs = solids[near_boxes(around(corners[closed], widest), around(corners[closed]), name)]
    pairs = pairs[piece[pairs[:, 0]] != piece[pairs[:, 1]]]
    walls, areas = {}, {}  # of one solid that face another: triangles, distances, and their area
    for mine in np.unique(piece[pairs[:, 0]]).tolist():
        here, there = (np.unique(side) for side in pairs[piece[pairs[:, 0]] == mine].T)
        points = (PLACES / PLACES.sum(axis=1, keepdims=True)) @ corners[here]
        flat, up = points.reshape(-1, 3), np.repeat(normal[here], len(PLACES), axis=0)
        apart, nearest = Ground(vertices, triangles[there]).distance(flat)
        other = there[nearest]
        above = ((flat - corners[other, 0]) * normal[other]).sum(axis=1) > 0
        facing = (apart <= widest) & ((normal[other] * up).sum(axis=1) < OPPOSED)
        gap = np.where(facing & above, apart, 0.0).reshape(points.shape[:2]).max(axis=1)
        good = facing.reshape(points.shape[:2]).all(axis=1) & (gap > close)
        theirs = piece[other].reshape(points.shape[:2])[:, 0]
        for solid in np.unique(theirs[good]).tolist():
            which = good & (theirs == solid)
            walls[mine, solid] = here[which], gap[which].max()
            areas[mine, solid] = topology.areas(vertices, triangles[here[which]]).sum()
    # Of two walls that face each other the one with more of the slit moves.
    moved = [pair for pair in walls if (areas[pair], pair) > (areas.get(pair[::-1], 0.0), pair[::-1])]
    gone, points, made = [], [vertices], []
    for mine in sorted({mine for mine, _ in moved}):
        of_mine = [walls[pair] for pair in moved if pair[0] == mine]
        gone.append(np.concatenate([which for which, _ in of_mine]))
        height = max(gap for _, gap in of_mine) + DEEPER * widest
        new, raised = _raised(vertices, triangles[gone[-1]], height, sum(map(len, points)))
        points.append(new)
        made.append(raised)
    if not gone:
        return vertices, triangles, 0
    triangles = np.concatenate([np.delete(triangles, np.concatenate(gone), axis=0), *made]).astype(triangles.dtype)
    return *topology.compact(np.concatenate(points), triangles), len(gone)


def _raised(vertices, triangles, height, first):
    """Move triangles by `height` metres where they face: new vertices, numbered from `first`; these, strips to rims."""
    normal, names = topology.shape(vertices[triangles])[0], topology.used(triangles)
    number = np.zeros(len(vertices), dtype=np.int64)
    number[names] = np.arange(len(names))
    raised = number[triangles]
    step = topology.unit(topology.gathered(raised, np.repeat(normal[:, None], 3, axis=1), len(names)))
    least = np.ones(len(names))
    np.minimum.at(least, raised, (step[raised] * normal[:, None]).sum(axis=2))
    new = vertices[names] + step * (height / np.maximum(least, MITRE))[:, None]
    _, triangle, side = topology.rims(triangles)
    start, stop = triangles[triangle, side], triangles[triangle, (side + 1) % 3]
    strips = [
        np.stack([start, stop, first + number[stop]], axis=1),
        np.stack([start, first + number[stop], first + number[start]], axis=1),
    ]
    return new, np.concatenate([first + raised, *strips])
