"""Local repairs of a mesh's shape that the remesher leaves: long edges, short edges, slivers."""

import heapq
from typing import NamedTuple

import numpy as np

from mesh import topology
from mesh.distance import distances

TURN = np.cos(np.radians(40.0))  # no triangle may turn by more
CAP = np.cos(np.radians(150.0))  # a triangle with a wider angle is all but a line
GAIN = 1.0  # degrees by which a flip must widen the smallest angle
SLIVER = 30.0  # degrees; only triangles with a smaller angle are looked at for a flip
SWEPT = 1 / 10  # of the volume beneath the triangles that a collapse moves: more would eat up a thin part


def split_long_edges(vertices, triangles, edge, longest, features=False):
    """Cut every edge above `longest` metres, the longest of each neighbourhood first, into about `edge` metres.

    Each cut leaves whole numbers of equal parts on both sides: halving alone would end at any length. With `features`
    only creases, boundaries and junctions are cut.
    """
    while True:
        ends, sides, _ = topology.edges(triangles)
        start, stop = vertices[ends].transpose(1, 0, 2)
        length = np.linalg.norm(stop - start, axis=1)
        parts = np.maximum(np.rint(length / edge), 2)
        points = start + (parts // 2 / parts)[:, None] * (stop - start)
        cut = length > longest
        if features:
            cut &= topology.features(vertices, triangles)
        if not cut.any():
            return vertices, triangles
        vertices, triangles = cut_edges(vertices, triangles, sides, np.where(cut, length, 0), points)


def lift_chords(vertices, triangles, source, axis):
    """Mend edges inside a half that lie in its mirror plane `axis`: there the mirror image would touch it.

    Their middle is put where the half `source` (vertices, triangles) passes over it.
    """
    while True:
        ends, sides, count = topology.edges(triangles)
        chord = (vertices[ends][:, :, axis] == 0).all(axis=1) & (count > 1)
        chord[sides[(vertices[triangles][:, :, axis] == 0).all(axis=1)]] = False  # sides of triangles in the plane
        if not chord.any():
            return vertices, triangles
        points = vertices[ends].mean(axis=1)
        points[chord, axis] += distances(points[chord], *source)
        if (points[chord, axis] == 0).any():
            return vertices, triangles  # the source itself touches its mirror image
        vertices, triangles = cut_edges(vertices, triangles, sides, chord, points)


def cut_edges(vertices, triangles, sides, weight, points):
    """Cut the edges with a positive weight (E,) at their points (E, 3), the heaviest of each neighbourhood only.

    `sides` (T, 3) and the order of the edges are those of topology.edges.
    """
    # An edge is cut if no side of its triangles is heavier: then each triangle has one cut at most.
    rank = np.argsort(np.argsort(weight, kind="stable"))
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
    """What a collapse of an edge has to keep to; lengths in metres."""

    longest: float  # the longest edge that it may make
    deviation: float  # how far it may move a triangle
    axes: tuple = ()  # mirror planes: no edge beside them may come to lie in them
    thickness: np.ndarray | None = None  # (T,) of the solid beneath the triangles: with it thin parts are kept


class _Collapsing:
    """A surface while its edges are collapsed."""

    def __init__(self, vertices, triangles):
        self.vertices = vertices
        self.triangles = [tuple(corners) for corners in triangles.tolist()]  # None where one is gone
        self.around = [set() for _ in vertices]  # the triangles at each vertex
        for number, corners in enumerate(self.triangles):
            for corner in corners:
                self.around[corner].add(number)

    def neighbours(self, vertex):
        return sorted({corner for number in self.around[vertex] for corner in self.triangles[number]} - {vertex})

    def pull(self, gone, kept):
        """Move the vertex `gone` onto `kept`."""
        for number in sorted(self.around[gone]):
            corners = self.triangles[number]
            if kept in corners:
                for corner in corners:
                    self.around[corner].discard(number)
                self.triangles[number] = None
            else:
                self.triangles[number] = tuple(kept if corner == gone else corner for corner in corners)
                self.around[kept].add(number)
        self.around[gone] = set()


def collapse_short_edges(vertices, triangles, shortest, limits):
    """Pull together the ends of edges below `shortest` metres, shortest first, where the surface allows it.

    One end moves onto the other where that keeps to the Limits and makes no worse angle. Boundaries and junctions
    shrink along themselves only, so that vertices in mirror planes stay there.
    """
    surface = _Collapsing(vertices, triangles)
    ends, length = topology.edges(triangles).ends, topology.edge_lengths(vertices, triangles)
    heap = [(float(length[k]), *map(int, ends[k])) for k in np.flatnonzero(length < shortest)]
    heapq.heapify(heap)
    while heap:
        _, a, b = heapq.heappop(heap)
        if not surface.around[a] & surface.around[b]:
            continue  # an end is gone
        cost, (gone, kept) = min((_cost(surface, *pair, limits), pair) for pair in ((a, b), (b, a)))
        if cost == np.inf:
            continue
        surface.pull(gone, kept)
        for other in surface.neighbours(kept):
            span = float(np.linalg.norm(vertices[kept] - vertices[other]))
            if span < shortest:
                heapq.heappush(heap, (span, *sorted((kept, other))))
    return topology.compact(vertices, np.array([corners for corners in surface.triangles if corners], dtype=np.int32))


def _cost(surface, gone, kept, limits):
    """Metres by which triangles move if vertex `gone` is pulled onto `kept`; infinite if that is not allowed."""
    vertices, triangles, around = surface.vertices, surface.triangles, surface.around
    shared = around[gone] & around[kept]
    near = surface.neighbours(gone)
    apexes = {corner for number in shared for corner in triangles[number]} - {gone, kept}
    if set(near) & set(surface.neighbours(kept)) != apexes:
        return np.inf  # the surface would pinch
    if np.linalg.norm(vertices[near] - vertices[kept], axis=1).max() > limits.longest:
        return np.inf
    step = vertices[kept] - vertices[gone]
    star = sorted(around[gone])
    corners = np.array([triangles[number] for number in star])
    normal, height, angle = topology.shape(vertices[corners])
    cost = np.abs(normal @ step).max()
    if limits.thickness is not None:
        area = topology.areas(vertices, corners)
        if area @ np.abs(normal @ step) / 3 > SWEPT * (area @ limits.thickness[star]):
            return np.inf
    # Boundaries, junctions and creases are lines that must keep their course: planes alone would let go of the rim
    # of a thin blade.
    lines, rims = [], []
    for other in near:
        sides = [k for k, number in enumerate(star) if other in triangles[number]]
        if len(sides) != 2:
            rims.append(other)
        if len(sides) != 2 or normal[sides[0]] @ normal[sides[1]] < TURN:
            lines.append(other)
    if rims and kept not in rims:
        return np.inf
    if lines and np.linalg.norm(step) > limits.deviation and kept not in lines:
        return np.inf
    for other in lines:
        along = vertices[other] - vertices[gone]
        cost = max(cost, np.linalg.norm(np.cross(along, step)) / np.linalg.norm(along))
    moves = [number not in shared for number in star]
    if cost > limits.deviation or not any(moves):
        return np.inf
    moved = np.where(corners[moves] == gone, kept, corners[moves])
    taken = {frozenset(triangles[number]) for number in around[kept]}
    if any(frozenset(corners) in taken for corners in moved.tolist()):
        return np.inf  # two triangles with the same corners
    others = sorted(set(near) - {kept})
    for axis in limits.axes:
        if vertices[kept, axis] == 0 != vertices[gone, axis] and (vertices[others, axis] == 0).any():
            return np.inf  # an edge inside the half that lies in the mirror plane
    new_normal, new_height, new_angle = topology.shape(vertices[moved])
    turn = (new_normal * normal[moves]).sum(axis=1)
    if (turn < np.where(height[moves] > limits.deviation, TURN, -TURN)).any() or new_height.min() == 0:
        return np.inf
    return cost if new_angle.min() >= angle.min() else np.inf


def flip_slivers(vertices, triangles, deviation, axes=(), least=GAIN):
    """Exchange the diagonal of two triangles where that widens their smallest angle by at least `least` degrees.

    Only where the surface moves by less than `deviation` metres and no triangle turns much.
    """
    triangles = triangles.copy()
    while True:
        edges = topology.edges(triangles)
        angle = topology.shape(vertices[triangles])[2]
        pairs = topology.side_pairs(edges, edges.count == 2)
        pairs = pairs[angle[pairs // 3].min(axis=1) < SLIVER]
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
        gap /= np.maximum(np.linalg.norm(across, axis=1), np.finfo(float).tiny)
        good = opposed & (c != d) & (gain > least) & (gap <= deviation)
        for (normal, height, _), apex in zip(before, (c, d), strict=True):
            # The normal of a triangle whose apex lies all but on the edge to be flipped says nothing.
            cap = (height < deviation) & (_cosine(*vertices[[apex, a, b]]) < CAP)
            good &= cap | np.all([(new[0] * normal).sum(axis=1) > TURN for new in after], axis=0)
        size = len(vertices)  # an edge from c to d must not be there already
        good &= ~np.isin(np.minimum(c, d).astype(np.int64) * size + np.maximum(c, d), edges.ends @ [size, 1])
        for axis in axes:  # no edge inside a half may lie in the mirror plane
            beside = (vertices[a, axis] != 0) | (vertices[b, axis] != 0)
            good &= ~beside | (vertices[c, axis] != 0) | (vertices[d, axis] != 0)
        # The best flip of each triangle's neighbourhood goes first; the others are looked at again.
        rank = np.full(len(pairs), -1)
        rank[good] = np.argsort(np.argsort(gain[good], kind="stable"), kind="stable")
        best = np.full(len(vertices), -1)
        quad = np.stack([a, b, c, d], axis=1)
        np.maximum.at(best, quad.ravel(), np.repeat(rank, 4))
        go = good & (best[quad] == rank[:, None]).all(axis=1)
        if not go.any():
            return triangles
        triangles[triangle[go, 0]], triangles[triangle[go, 1]] = first[go], second[go]


def _cosine(apex, start, stop):
    """Cosine of the angle at `apex` (N, 3) between the directions to start and stop, (N,)."""
    first, second = start - apex, stop - apex
    return (first * second).sum(axis=1) / (np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1))
