"""What is too small for edges to follow: details are dropped, and slits closed.

Details are rivets, nuts and knobs on a much larger part, too small for the field to see. Slits are between solids, too
narrow for a mesh to have two walls there: round a bolt in its hole, between its facets.
"""

import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.ground import Ground
from isarflow.mesh.repair.boxes import around, near_boxes

SMALL, LOW = 1 / 2, 1 / 4  # wanted edges: a detail's largest extent, and the most it may stick out of its part
MUCH = 8  # times its own extent: the least extent of its part
TOUCH = 0.6  # of its extent: no corner of a detail that is sunk into its part is farther from it than half
PLACES = np.array([[1, 1, 1], [98, 1, 1], [1, 98, 1], [1, 1, 98], [1, 9, 9], [9, 1, 9], [9, 9, 1]])  # in a triangle
OPPOSED = -0.5  # cosine of the angle between the normals of walls that face each other, at most
DEEPER = 1 / 4  # of the widest slit: the fill goes into the other wall by that
MITRE = 1 / 3  # of its length: the least height of a corner's step above the walls that meet there


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
