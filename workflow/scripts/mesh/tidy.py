"""Local repairs of a mesh's shape that the remesher leaves: long edges, short edges, slivers."""

import heapq

import numpy as np

from mesh import topology
from mesh.distance import distances

TURN = np.cos(np.radians(40.0))  # no face may turn by more
CAP = np.cos(np.radians(150.0))  # a triangle with a wider angle is all but a line
GAIN = 1.0  # degrees by which a flip must widen the smallest angle
SLIVER = 30.0  # degrees; only triangles with a smaller angle are looked at for a flip
SWEPT = 1 / 10  # of the volume beneath the faces that a collapse moves: more would eat up a thin part


def split_long_edges(vertices, triangles, edge, longest, features=False):
    """Cut every edge above `longest` metres, the longest of each neighbourhood first, into about `edge` metres.

    Each cut leaves whole numbers of equal parts on both sides: halving alone would end at any length. With `features`
    only creases, boundaries and junctions are cut.
    """
    while True:
        unique, index = topology.edges(triangles)
        start, stop = vertices[unique].transpose(1, 0, 2)
        length = np.linalg.norm(stop - start, axis=1)
        parts = np.maximum(np.rint(length / edge), 2)
        points = start + (parts // 2 / parts)[:, None] * (stop - start)
        cut = length > longest
        if features:
            cut &= topology.features(vertices, triangles)
        if not cut.any():
            return vertices, triangles
        vertices, triangles = cut_edges(vertices, triangles, index, np.where(cut, length, 0), points)


def lift_chords(vertices, triangles, source, axis):
    """Mend edges inside a half that lie in its mirror plane `axis`: there the mirror image would touch it.

    Their middle is put where the half `source` (vertices, triangles) passes over it.
    """
    while True:
        unique, index = topology.edges(triangles)
        chord = (vertices[unique][:, :, axis] == 0).all(axis=1) & (np.bincount(index.ravel()) > 1)
        chord[index[(vertices[triangles][:, :, axis] == 0).all(axis=1)]] = False  # sides of faces in the plane
        if not chord.any():
            return vertices, triangles
        points = vertices[unique].mean(axis=1)
        points[chord, axis] += distances(points[chord], *source)
        if (points[chord, axis] == 0).any():
            return vertices, triangles  # the source itself touches its mirror image
        vertices, triangles = cut_edges(vertices, triangles, index, chord, points)


def cut_edges(vertices, triangles, index, weight, points):
    """Cut the edges with a positive weight at their points, the heaviest of each neighbourhood only."""
    # An edge is cut if no side of its triangles is heavier: then each triangle has one cut at most.
    rank = np.empty(len(weight), dtype=int)
    rank[np.argsort(weight, kind="stable")] = np.arange(len(weight))
    best = index[np.arange(len(index)), rank[index].argmax(axis=1)]
    cut = (np.bincount(best, minlength=len(weight)) == np.bincount(index.ravel())) & (weight > 0)
    number = np.full(len(weight), -1)
    number[cut] = len(vertices) + np.arange(cut.sum())
    hit = cut[best]
    side = (index[hit] == best[hit, None]).argmax(axis=1)
    a, b, c = triangles[hit][np.arange(hit.sum())[:, None], (side[:, None] + np.arange(3)) % 3].T
    middle = number[best[hit]]
    halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
    return np.concatenate([vertices, points[cut]]), np.concatenate([triangles[~hit], *halves]).astype(np.int32)


def collapse_short_edges(vertices, triangles, shortest, longest, deviation, axes=(), thickness=None):
    """Pull together the ends of edges below `shortest` metres, shortest first, where the surface allows it.

    One end moves onto the other if that moves no face by more than `deviation` metres, makes no edge above
    `longest` metres and no worse angle. Boundaries and junctions shrink along themselves only, so vertices in the
    mirror planes `axes` stay there. `thickness` (T,) in metres of the solid beneath the faces keeps thin parts.
    """
    faces = [tuple(corners) for corners in triangles.tolist()]
    around = [set() for _ in vertices]
    for number, corners in enumerate(faces):
        for corner in corners:
            around[corner].add(number)
    unique = topology.edges(triangles)[0]
    length = np.linalg.norm(vertices[unique[:, 0]] - vertices[unique[:, 1]], axis=1)
    heap = [(float(length[k]), *map(int, unique[k])) for k in np.flatnonzero(length < shortest)]
    heapq.heapify(heap)
    while heap:
        _, a, b = heapq.heappop(heap)
        if not around[a] & around[b]:
            continue  # an end is gone
        moves = [
            (_cost(vertices, faces, around, *ends, longest, deviation, axes, thickness), ends)
            for ends in ((a, b), (b, a))
        ]
        cost, (gone, kept) = min(moves)
        if cost == np.inf:
            continue
        for number in sorted(around[gone]):
            corners = faces[number]
            if kept in corners:
                for corner in corners:
                    around[corner].discard(number)
                faces[number] = None
            else:
                faces[number] = tuple(kept if corner == gone else corner for corner in corners)
                around[kept].add(number)
        around[gone] = set()
        for other in _neighbours(faces, around, kept):
            span = float(np.linalg.norm(vertices[kept] - vertices[other]))
            if span < shortest:
                heapq.heappush(heap, (span, *sorted((kept, other))))
    return topology.compact(vertices, np.array([corners for corners in faces if corners], dtype=np.int32))


def _neighbours(faces, around, vertex):
    return sorted({corner for number in around[vertex] for corner in faces[number]} - {vertex})


def _cost(vertices, faces, around, gone, kept, longest, deviation, axes, thickness):
    """Metres by which faces move if vertex `gone` is pulled onto `kept`; infinite if that is not allowed."""
    shared = around[gone] & around[kept]
    near = _neighbours(faces, around, gone)
    apexes = {corner for number in shared for corner in faces[number]} - {gone, kept}
    if set(near) & set(_neighbours(faces, around, kept)) != apexes:
        return np.inf  # the surface would pinch
    step = vertices[kept] - vertices[gone]
    stars = sorted(around[gone])
    normal, _, old_angle = topology.shape(vertices[[faces[number] for number in stars]])
    cost = np.abs(normal @ step).max()
    if thickness is not None:
        area = topology.areas(vertices, np.array([faces[number] for number in stars]))
        if area @ np.abs(normal @ step) / 3 > SWEPT * (area @ thickness[stars]):
            return np.inf
    # Boundaries, junctions and creases are lines that must keep their course: planes alone would let go of the rim
    # of a thin blade.
    lines = []
    for other in near:
        sides = [k for k, number in enumerate(stars) if other in faces[number]]
        rim = len(sides) != 2
        if rim or normal[sides[0]] @ normal[sides[1]] < TURN:
            lines.append((other, rim))
    rims = [other for other, rim in lines if rim]
    if rims and kept not in rims:
        return np.inf
    if lines and np.linalg.norm(step) > deviation and kept not in [other for other, _ in lines]:
        return np.inf
    for other, _ in lines:
        along = vertices[other] - vertices[gone]
        cost = max(cost, np.linalg.norm(np.cross(along, step)) / np.linalg.norm(along))
    moved = sorted(around[gone] - shared)
    if cost > deviation or not moved:
        return np.inf
    new_corners = np.array([[kept if corner == gone else corner for corner in faces[number]] for number in moved])
    taken = {frozenset(faces[number]) for number in around[kept]}
    if any(frozenset(corners) in taken for corners in new_corners.tolist()):
        return np.inf  # two faces with the same corners
    others = sorted(set(near) - {kept})
    for axis in axes:
        if vertices[kept, axis] == 0 != vertices[gone, axis] and (vertices[others, axis] == 0).any():
            return np.inf  # an edge inside the half that lies in the mirror plane
    before, after = vertices[[faces[number] for number in moved]], vertices[new_corners]
    new_normal, new_height, angle = topology.shape(after)
    old_normal, old_height, _ = topology.shape(before)
    turn = (new_normal * old_normal).sum(axis=1)
    if (turn < np.where(old_height > deviation, TURN, -TURN)).any() or new_height.min() == 0:
        return np.inf
    if angle.min() < old_angle.min() or np.linalg.norm(vertices[near] - vertices[kept], axis=1).max() > longest:
        return np.inf
    return cost


def flip_slivers(vertices, triangles, deviation, axes=(), least=GAIN):
    """Exchange the diagonal of two triangles where that widens their smallest angle by at least `least` degrees.

    Only where the surface moves by less than `deviation` metres and no face turns much.
    """
    triangles = triangles.copy()
    while True:
        unique, index = topology.edges(triangles)
        count = np.bincount(index.ravel(), minlength=len(unique))
        angle = topology.shape(vertices[triangles])[2]
        order = np.argsort(index.ravel(), kind="stable")
        order = order[count[index.ravel()[order]] == 2].reshape(-1, 2)
        order = order[angle[order // 3].min(axis=1) < SLIVER]
        face, side = order // 3, order % 3
        a, b, c = (triangles[face[:, 0], (side[:, 0] + k) % 3] for k in range(3))
        d = triangles[face[:, 1], (side[:, 1] + 2) % 3]
        opposed = triangles[face[:, 1], side[:, 1]] == b
        before = [topology.shape(vertices[triangles[face[:, k]]]) for k in (0, 1)]
        first, second = np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)
        after = [topology.shape(vertices[corners]) for corners in (first, second)]
        gain = np.minimum(after[0][2], after[1][2]) - np.minimum(before[0][2], before[1][2])
        across = np.cross(vertices[b] - vertices[a], vertices[d] - vertices[c])
        gap = np.abs((across * (vertices[c] - vertices[a])).sum(axis=1))
        gap /= np.maximum(np.linalg.norm(across, axis=1), np.finfo(float).tiny)
        # The normal of a triangle whose apex lies all but on the edge to be flipped says nothing.
        flat = [
            (old[1] < deviation) & (_cosine(*vertices[[apex, a, b]]) < CAP)
            for old, apex in zip(before, (c, d), strict=True)
        ]
        turns = [
            np.where(cap, 1, (new[0] * old[0]).sum(axis=1))
            for new in after
            for old, cap in zip(before, flat, strict=True)
        ]
        good = opposed & (c != d) & (gain > least) & (gap <= deviation) & (np.min(turns, axis=0) > TURN)
        good &= ~_present(unique, np.sort(np.stack([c, d], axis=1), axis=1), len(vertices))
        for axis in axes:  # no edge inside a half may lie in the mirror plane
            beside = (vertices[a, axis] != 0) | (vertices[b, axis] != 0)
            good &= ~beside | (vertices[c, axis] != 0) | (vertices[d, axis] != 0)
        # The best flip of each triangle's neighbourhood goes first; the others are looked at again.
        rank = np.full(len(order), -1)
        rank[good] = np.argsort(np.argsort(gain[good], kind="stable"), kind="stable")
        best = np.full(len(vertices), -1)
        quad = np.stack([a, b, c, d], axis=1)
        np.maximum.at(best, quad.ravel(), np.repeat(rank, 4))
        go = good & (best[quad] == rank[:, None]).all(axis=1)
        if not go.any():
            return triangles
        triangles[face[go, 0]], triangles[face[go, 1]] = first[go], second[go]


def _cosine(apex, start, stop):
    """Cosine of the angle at `apex` (N, 3) between the directions to start and stop, (N,)."""
    first, second = start - apex, stop - apex
    return (first * second).sum(axis=1) / (np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1))


def _present(edges, wanted, size):
    return np.isin(
        wanted[:, 0].astype(np.int64) * size + wanted[:, 1], edges[:, 0].astype(np.int64) * size + edges[:, 1]
    )
