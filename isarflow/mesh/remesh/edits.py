"""Cut, collapse and flip edges of a triangle mesh: the first of their neighbourhoods at once, then search again."""

from typing import NamedTuple

import numpy as np

from isarflow.mesh import topology
from isarflow.mesh.progress import going

TURN = np.cos(np.radians(40.0))  # no triangle may turn by more
CREASE = np.cos(np.radians(topology.FEATURE_ANGLE))  # edges between faces that turn by more are features
CAP = np.cos(np.radians(150.0))  # a triangle with a wider angle is almost a line
GAIN = 1.0  # degrees by which a flip must widen the smallest angle
SLIVER = 0.01  # wanted edges: the normal of a triangle less high is meaningless
FAIR = 15.0  # degrees; a collapse may reduce the smallest angle to this, or to half of its value
TIP = 0.7  # of a full turn: a vertex whose faces have less in all is a tip and stays
STRAIGHT = np.cos(np.radians(40.0))  # where a feature turns by more is a corner, which stays
TINY = 1 / 25  # wanted edges: across narrower strips features may be joined
SWEPT = 1 / 10  # of the volume beneath the triangles that such a step moves: more would remove a thin part
ALIKE = 1 / 4  # octaves: lengths within these are taken in any order
GOLDEN = (np.sqrt(5) - 1) / 2  # its multiples' fractions are evenly spread
DEEP = 4  # steps: parts deeper than that are not examined
ALONG = 0.3  # sine of the angle between such a step and a triangle
FEW = 1 / 400  # of the edges: a round with fewer collapses is the last
ROUNDS = 200  # of one edit; it ends long before


class Lines(NamedTuple):
    """The features of a mesh as its vertices see them."""

    edges: topology.Edges
    feature: np.ndarray  # (E,) creases, boundaries and junctions
    count: np.ndarray  # (V,) features at each vertex
    rim: np.ndarray  # (V,) True for vertices of boundaries and junctions
    fixed: np.ndarray  # (V,) corners, ends and tips, which do not move


def lines(vertices, triangles):
    """The Lines of a mesh."""
    edges, size = topology.edges(triangles), len(vertices)
    feature = topology.features(vertices, triangles)
    ends = edges.ends[feature]
    count = np.bincount(ends.ravel(), minlength=size)
    rim = np.zeros(size, dtype=bool)
    rim[edges.ends[edges.count != 2]] = True
    along = topology.unit(vertices[ends[:, 1]] - vertices[ends[:, 0]])
    away = np.zeros_like(vertices)  # the two directions of a straight line cancel
    np.add.at(away, ends[:, 0], along)
    np.add.at(away, ends[:, 1], -along)
    bent = (away**2).sum(axis=1) > 2 - 2 * STRAIGHT
    turn = np.bincount(triangles.ravel(), weights=topology.angles(vertices[triangles]).ravel(), minlength=size)
    fixed = ((count != 0) & (count != 2)) | ((count == 2) & bent) | ((count == 0) & (turn < TIP * 360))
    return Lines(edges, feature, count, rim, fixed)


def _mixed(length):
    """Ranks (N,) by length (N,); mixed where lengths are alike, or one edge would wait for the other."""
    octave = np.floor(np.log2(np.maximum(length, topology.TINY)) / ALIKE)
    return octave + np.arange(len(length)) * GOLDEN % 1.0


def cut_edges(vertices, triangles, sides, weight, points):
    """Cut edges, with `sides` (T, 3), of positive weight (E,) at points (E, 3), the heaviest of each neighbourhood."""
    # An edge is cut if no side of its triangles is heavier: then each triangle has one cut at most.
    rank = np.argsort(np.argsort(_mixed(weight), kind="stable"))
    side = rank[sides].argmax(axis=1)
    best = np.take_along_axis(sides, side[:, None], axis=1)[:, 0]
    cut = (np.bincount(best, minlength=len(weight)) == np.bincount(sides.ravel())) & (weight > 0)
    number = len(vertices) + np.cumsum(cut) - 1
    hit = cut[best]
    a, b, c = np.take_along_axis(triangles[hit], (side[hit, None] + np.arange(3)) % 3, axis=1).T
    middle = number[best[hit]]
    halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
    return np.concatenate([vertices, points[cut]]), np.concatenate([triangles[~hit], *halves]).astype(np.int32)


class Limits(NamedTuple):
    """Limits of a collapse, as functions of points (P, 3) where lengths follow the mesh's size."""

    size: object  # wanted edges in metres, (P,), at points
    shortest: float  # wanted edges: shorter ones are collapsed
    longest: float  # wanted edges: none longer is made
    deviation: float  # wanted edges: how far a triangle may move
    axes: tuple  # mirror planes: no edge beside them may come to lie in them
    thickness: object  # metres of metal beneath points (P, 3), (P,)


def collapse(vertices, triangles, limits):
    """Move an end of edges that are too short onto the other, shortest first, where features and Limits allow it."""
    size = len(vertices)
    wanted, refused = limits.size(vertices), np.zeros(0, dtype=np.int64)
    for _ in range(ROUNDS):
        going(f"collapse short edges of {len(triangles)} triangles")
        seen = lines(vertices, triangles)
        ends = seen.edges.ends
        ratio = topology.lengths(vertices, ends) / wanted[ends].mean(axis=1)
        key = ends @ [size, 1]
        short = np.flatnonzero((ratio < limits.shortest) & ~np.isin(key, refused))
        if len(short) == 0:
            break
        # The shortest edge of each neighbourhood goes first.
        rank = np.full(len(ends), np.inf)
        rank[short] = _mixed(ratio[short])
        first = np.full(size, np.inf)
        np.minimum.at(first, ends, rank[:, None])
        around = first.copy()  # also of the neighbours
        np.minimum.at(around, ends, first[ends[:, ::-1]])
        tried = short[(around[ends[short]] == rank[short, None]).all(axis=1)]
        gone, kept = np.concatenate([ends[tried], ends[tried][:, ::-1]]).T
        cost = _cost(vertices, triangles, seen, gone, kept, np.tile(tried, 2), wanted, limits).reshape(2, -1)
        good = np.isfinite(cost.min(axis=0))
        refused = np.concatenate([refused, key[tried[~good]]])
        pick = cost.argmin(axis=0)[good], np.flatnonzero(good)
        target = np.arange(size)
        target[gone.reshape(2, -1)[pick]] = kept.reshape(2, -1)[pick]
        triangles = target[triangles].astype(np.int32)
        triangles = triangles[topology.have_three_corners(triangles)]
        if len(tried) < FEW * len(ends):
            break
    return topology.compact(vertices, triangles)


def _cost(vertices, triangles, seen, gone, kept, edge, wanted, limits):
    """Metres by which triangles move if the vertices `gone` (N,) are pulled onto `kept`; infinite if not allowed."""
    size, count = len(vertices), len(gone)
    step = vertices[kept] - vertices[gone]
    deviation = limits.deviation * wanted[gone]
    which, star = topology.stars(triangles, gone, size)
    corners = triangles[star]
    points = vertices[corners]
    normal, height, angle = topology.shape(points)
    moves = (corners != kept[which, None]).all(axis=1)
    cost = np.zeros(count)
    np.maximum.at(cost, which, np.abs((normal * step[which]).sum(axis=1)))
    bad = cost > deviation
    # The ends may have no other neighbours in common than the apexes of the triangles between them.
    near = np.unique((which[:, None] * size + corners).ravel())
    other, far = topology.stars(triangles, kept, size)
    far = np.unique((other[:, None] * size + triangles[far]).ravel())
    common = np.bincount(np.intersect1d(near, far, assume_unique=True) // size, minlength=count) - 2
    bad |= common != np.bincount(which[~moves], minlength=count)
    bad |= np.bincount(which[moves], minlength=count) == 0
    # Features keep their course, unless the step is so small that they may leave it.
    feature = seen.feature[edge]
    tiny = (step**2).sum(axis=1) <= (TINY * wanted[gone]) ** 2
    # Only from line to line: through the area between them a plate would shrink little by little.
    tiny &= (seen.count[gone] > 0) & (seen.count[kept] > 0) & ~feature
    _keep_thin(tiny, which, points, normal, step, limits)
    bad |= seen.rim[gone] & (seen.edges.count[edge] == 2)
    bad |= (seen.count[gone] > 0) & ~feature & ~(tiny & (seen.count[gone] <= 2))
    bad |= seen.fixed[gone] & ~tiny
    bent = _bend(vertices, seen, gone, step)
    cost = np.maximum(cost, bent)
    bad |= bent > deviation
    least = np.full(count, 2 * FAIR)
    np.minimum.at(least, which, angle)
    which = which[moves]
    new = np.where(corners[moves] == gone[which, None], kept[which, None], corners[moves])
    fresh, fresh_height, fresh_angle = topology.shape(vertices[new])
    turn = (fresh * normal[moves]).sum(axis=1)
    wrong = turn < np.where(height[moves] > SLIVER * wanted[gone[which]], TURN, -TURN)
    wrong |= (fresh_height == 0) | (fresh_angle < least[which] / 2)
    span = np.linalg.norm(vertices[new] - vertices[kept[which]][:, None], axis=2)
    wrong |= (span > limits.longest * (wanted[new] + wanted[kept[which], None]) / 2).any(axis=1)
    for axis in limits.axes:  # neither an edge inside the half nor a triangle may come to lie in the mirror plane
        on = vertices[:, axis] == 0
        wrong |= on[kept[which]] & ~on[gone[which]] & (on[new].sum(axis=1) >= 2)
    bad[which[wrong]] = True
    there = topology.triple(triangles, size)
    bad[which[np.isin(topology.triple(new, size), there)]] = True
    return np.where(bad, np.inf, cost)


def _keep_thin(tiny, which, points, normal, step, limits):
    """Remove from the `tiny` steps (N,) those that would remove a thin part, like the rim of a plate."""
    height, length = np.abs((normal * step[which]).sum(axis=1)), np.linalg.norm(step, axis=1)[which]
    mine = tiny[which] & (height > ALONG * length)  # a step sweeps no volume at triangles that it runs along
    which, height, length, points = which[mine], height[mine], length[mine], points[mine]
    area = np.linalg.norm(topology.normals(points), axis=1)
    deep = np.minimum(limits.thickness(points.mean(axis=1)), DEEP * length)
    swept, beneath = (np.bincount(which, area * each, minlength=len(tiny)) for each in (height / 3, deep))
    tiny &= swept <= SWEPT * beneath


def _bend(vertices, seen, gone, step):
    """Metres by which the features at the vertices `gone` (N,) leave their course when these make their step (N, 3)."""
    bend, place = np.zeros(len(gone)), np.full(len(vertices), -1)
    place[gone] = np.arange(len(gone))  # no vertex occurs twice
    ends = seen.edges.ends[seen.feature]
    for here, there in (ends.T, ends.T[::-1]):
        mine = place[here] >= 0
        at, along = place[here[mine]], vertices[there[mine]] - vertices[here[mine]]
        length = np.maximum(np.linalg.norm(along, axis=1), topology.TINY)
        np.maximum.at(bend, at, np.linalg.norm(np.cross(along, step[at]), axis=1) / length)
    return bend


def flip(vertices, triangles, wanted, deviation, axes=()):
    """Exchange diagonals where angles widen and the surface moves by at most `deviation` of the `wanted` edges (V,)."""
    triangles, refused, size = triangles.copy(), np.zeros(0, dtype=np.int64), len(vertices)
    for _ in range(ROUNDS):
        edges = topology.edges(triangles)
        keys = edges.ends @ [size, 1]
        pairs = topology.side_pairs(edges, edges.count == 2)
        opposite = np.roll(topology.angles(vertices[triangles]), 1, axis=1).ravel()  # of corner k + 2, opposite side k
        pairs = pairs[opposite[pairs].sum(axis=1) > 180]  # not Delaunay
        pairs = pairs[~np.isin(keys[edges.sides.ravel()[pairs[:, 0]]], refused)]
        triangle, side = pairs // 3, pairs % 3
        # From the diagonal a-b of triangles a-b-c and b-a-d to c-d.
        a, b, c = (triangles[triangle[:, 0], (side[:, 0] + k) % 3] for k in range(3))
        d = triangles[triangle[:, 1], (side[:, 1] + 2) % 3]
        opposed = triangles[triangle[:, 1], side[:, 1]] == b
        first, second = np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)
        before = [topology.shape(vertices[triangles[triangle[:, k]]]) for k in (0, 1)]
        after = [topology.shape(vertices[corners]) for corners in (first, second)]
        gain = np.minimum(after[0][2], after[1][2]) - np.minimum(before[0][2], before[1][2])
        across = np.cross(vertices[b] - vertices[a], vertices[d] - vertices[c])
        gap = np.abs((across * (vertices[c] - vertices[a])).sum(axis=1))
        gap /= np.maximum(np.linalg.norm(across, axis=1), topology.TINY)
        good = opposed & (c != d) & (gain > GAIN) & (gap <= deviation * wanted[a])
        # A crease stays, and none comes to be.
        sharp = [(one[0] * other[0]).sum(axis=1) < CREASE for one, other in (before, after)]
        flat = gap <= SLIVER * wanted[a]
        for (normal, height, _), apex in zip(before, (c, d), strict=True):
            # The normal of a triangle whose apex is almost on the edge to be flipped is meaningless.
            start, stop = vertices[a] - vertices[apex], vertices[b] - vertices[apex]
            length = np.maximum(np.linalg.norm(start, axis=1) * np.linalg.norm(stop, axis=1), topology.TINY)
            cap = (height < SLIVER * wanted[a]) & ((start * stop).sum(axis=1) / length < CAP)
            good &= cap | np.all([(new[0] * normal).sum(axis=1) > TURN for new in after], axis=0)
            flat |= height < SLIVER * wanted[a]
        good &= flat | ~(sharp[0] | sharp[1])
        # An edge from c to d must not exist already.
        good &= ~np.isin(np.minimum(c, d).astype(np.int64) * size + np.maximum(c, d), keys)
        for axis in axes:  # no edge inside a half may lie in the mirror plane
            beside = (vertices[a, axis] != 0) | (vertices[b, axis] != 0)
            good &= ~beside | (vertices[c, axis] != 0) | (vertices[d, axis] != 0)
        refused = np.concatenate([refused, keys[edges.sides.ravel()[pairs[~good, 0]]]])
        # The best flip of each triangle's neighbourhood goes first; the others are looked at again.
        rank = np.full(len(pairs), -1)
        rank[good] = np.argsort(np.argsort(gain[good], kind="stable"), kind="stable")
        best = np.full(size, -1)
        quad = np.stack([a, b, c, d], axis=1)
        np.maximum.at(best, quad.ravel(), np.repeat(rank, 4))
        go = good & (best[quad] == rank[:, None]).all(axis=1)
        if not go.any():
            break
        triangles[triangle[go, 0]], triangles[triangle[go, 1]] = first[go], second[go]
    return triangles
