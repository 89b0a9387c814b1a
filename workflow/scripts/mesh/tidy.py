"""Local repairs of a mesh's shape that the remesher leaves: long edges, short edges, slivers."""

import heapq

import numpy as np

from mesh import topology

TURN = np.cos(np.radians(40.0))  # no face may turn by more
GAIN = 1.0  # degrees by which a flip must widen the smallest angle
SLIVER = 30.0  # degrees; only triangles with a smaller angle are looked at for a flip


def split_long_edges(vertices, triangles, longest):
    """Cut every edge above `longest` metres at its middle, the longest of each neighbourhood first."""
    while True:
        unique, index = topology.edges(triangles)
        length = np.linalg.norm(vertices[unique[:, 0]] - vertices[unique[:, 1]], axis=1)
        # An edge is cut if no side of its triangles is longer: then each triangle has one cut at most.
        rank = np.empty(len(unique), dtype=int)
        rank[np.argsort(length, kind="stable")] = np.arange(len(unique))
        best = index[np.arange(len(index)), rank[index].argmax(axis=1)]
        wins = np.bincount(best, minlength=len(unique)) == np.bincount(index.ravel())
        cut = wins & (length > longest)
        if not cut.any():
            return vertices, triangles
        number = np.full(len(unique), -1)
        number[cut] = len(vertices) + np.arange(cut.sum())
        vertices = np.concatenate([vertices, vertices[unique[cut]].mean(axis=1)])
        hit = cut[best]
        side = (index[hit] == best[hit, None]).argmax(axis=1)
        turned = triangles[hit][np.arange(hit.sum())[:, None], (side[:, None] + np.arange(3)) % 3]
        middle = number[best[hit]]
        first = np.stack([turned[:, 0], middle, turned[:, 2]], axis=1)
        second = np.stack([middle, turned[:, 1], turned[:, 2]], axis=1)
        triangles = np.concatenate([triangles[~hit], first, second]).astype(np.int32)


def collapse_short_edges(vertices, triangles, shortest, longest, deviation):
    """Pull together the ends of edges below `shortest` metres, shortest first, where the surface allows it.

    One end moves onto the other if that moves no face by more than `deviation` metres, makes no edge above
    `longest` metres and no worse angle. Boundaries and junctions shrink along themselves only, so vertices in the
    mirror plane stay there.
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
        moves = [(_cost(vertices, faces, around, *ends, longest, deviation), ends) for ends in ((a, b), (b, a))]
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


def _cost(vertices, faces, around, gone, kept, longest, deviation):
    """Distance in metres by which faces move if vertex `gone` is pulled onto `kept`; infinite if that is not allowed."""
    shared = around[gone] & around[kept]
    near = _neighbours(faces, around, gone)
    apexes = {corner for number in shared for corner in faces[number]} - {gone, kept}
    if set(near) & set(_neighbours(faces, around, kept)) != apexes:
        return np.inf  # the surface would pinch
    step = vertices[kept] - vertices[gone]
    cost = 0.0
    rims = [other for other in near if len(around[gone] & around[other]) != 2]
    if rims:
        if kept not in rims:
            return np.inf
        for other in rims:
            along = vertices[other] - vertices[gone]
            cost = max(cost, np.linalg.norm(np.cross(along, step)) / np.linalg.norm(along))
    moved = sorted(around[gone] - shared)
    old = vertices[[faces[number] for number in sorted(around[gone])]]
    normal, height, _ = _shape(old)
    cost = max(cost, np.abs(normal @ step).max())
    if cost > deviation or not moved:
        return np.inf
    new_corners = np.array([[kept if corner == gone else corner for corner in faces[number]] for number in moved])
    taken = {frozenset(faces[number]) for number in around[kept]}
    if any(frozenset(corners) in taken for corners in new_corners.tolist()):
        return np.inf  # two faces with the same corners
    if (vertices[new_corners][:, :, 1] == 0).all(axis=1).any():
        return np.inf  # a face in the mirror plane
    before, after = vertices[[faces[number] for number in moved]], vertices[new_corners]
    new_normal, new_height, angle = _shape(after)
    old_normal, old_height, _ = _shape(before)
    turn = (new_normal * old_normal).sum(axis=1)
    # The normal of a face that is thinner than the deviation says nothing.
    if (turn < np.where(old_height > deviation, TURN, -TURN)).any() or new_height.min() == 0:
        return np.inf
    if angle.min() < _shape(old)[2].min() or np.linalg.norm(vertices[near] - vertices[kept], axis=1).max() > longest:
        return np.inf
    return cost


def _shape(corners):
    """Unit normal (T, 3), smallest height (T,) and smallest angle in degrees (T,) of triangles (T, 3, 3)."""
    ahead = np.roll(corners, -1, axis=1) - corners
    cross = np.cross(ahead[:, 0], -ahead[:, 2])
    double_area = np.linalg.norm(cross, axis=1)
    side = np.linalg.norm(ahead, axis=2)
    back = -np.roll(ahead, 1, axis=1)
    angle = np.degrees(np.arctan2(double_area[:, None], (ahead * back).sum(axis=2)))
    tiny = np.finfo(float).tiny
    return cross / np.maximum(double_area, tiny)[:, None], double_area / side.max(axis=1), angle.min(axis=1)


def flip_slivers(vertices, triangles, deviation):
    """Exchange the diagonal of two triangles where that widens their smallest angle.

    Only where the surface moves by less than `deviation` metres and no face turns much.
    """
    triangles = triangles.copy()
    while True:
        unique, index = topology.edges(triangles)
        count = np.bincount(index.ravel(), minlength=len(unique))
        angle = _shape(vertices[triangles])[2]
        order = np.argsort(index.ravel(), kind="stable")
        order = order[count[index.ravel()[order]] == 2].reshape(-1, 2)
        order = order[angle[order // 3].min(axis=1) < SLIVER]
        face, side = order // 3, order % 3
        a, b, c = (triangles[face[:, 0], (side[:, 0] + k) % 3] for k in range(3))
        d = triangles[face[:, 1], (side[:, 1] + 2) % 3]
        opposed = triangles[face[:, 1], side[:, 1]] == b
        before = [_shape(vertices[triangles[face[:, k]]]) for k in (0, 1)]
        first, second = np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)
        after = [_shape(vertices[corners]) for corners in (first, second)]
        gain = np.minimum(after[0][2], after[1][2]) - np.minimum(before[0][2], before[1][2])
        across = np.cross(vertices[b] - vertices[a], vertices[d] - vertices[c])
        gap = np.abs((across * (vertices[c] - vertices[a])).sum(axis=1))
        gap /= np.maximum(np.linalg.norm(across, axis=1), np.finfo(float).tiny)
        turns = [(new[0] * old[0]).sum(axis=1) for new in after for old in before]
        good = opposed & (c != d) & (gain > GAIN) & (gap <= deviation) & (np.min(turns, axis=0) > TURN)
        good &= ~_present(unique, np.sort(np.stack([c, d], axis=1), axis=1), len(vertices))
        in_plane = (vertices[:, 1] == 0)[np.stack([first, second], axis=1)].all(axis=2).any(axis=1)
        good &= ~in_plane
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


def _present(edges, wanted, size):
    return np.isin(
        wanted[:, 0].astype(np.int64) * size + wanted[:, 1], edges[:, 0].astype(np.int64) * size + edges[:, 1]
    )
