"""Where surfaces lie in each other or touch but for rounding: there they are given common vertices and edges.

Exact arithmetic sees two sheets 1e-9 m apart as two; a part that was rotated, or placed in single precision, is that
far from the one that it lies on. `birth` is everywhere the source triangle that each triangle is a part of, (T,).
"""

import itertools
from typing import NamedTuple

import numpy as np
from igl.copyleft import cgal

from mesh import topology
from mesh.boxes import CHUNK, around, near_boxes
from mesh.progress import going

STEEP = np.cos(np.radians(30.0))  # a rim is put onto what its sheet stands on, not onto what it runs along
FLAT = 1 - 1e-6  # cosine of the angle between normals of one plane
APART = 0.4  # of the shortest edge at a vertex: nothing moves further


def land(vertices, triangles, tolerance, close, name):
    """Rim vertices within `tolerance` metres of a triangle that their sheet stands on, put onto it; and how many."""
    rim = np.unique(topology.rims(triangles)[0])
    if len(rim) == 0:
        return vertices, 0
    corners = vertices[triangles]
    pairs = near_boxes(around(vertices[rim][:, None], tolerance), around(corners), name)
    vertex, triangle = rim[pairs[:, 0]], pairs[:, 1]
    normal = topology.shape(corners)[0]
    height = ((vertices[vertex] - corners[triangle, 0]) * normal[triangle]).sum(axis=1)
    reach = np.minimum(tolerance, APART * topology.shortest_edges(vertices, triangles)[vertex])
    good = (np.abs(height) <= reach) & (triangles[triangle] != vertex[:, None]).all(axis=1)
    for k in range(3):
        inward = _inward(corners[triangle], normal[triangle], k)
        good &= ((vertices[vertex] - corners[triangle, k]) * inward).sum(axis=1) >= -close
    vertex, triangle, height = vertex[good], triangle[good], height[good]
    # Every triangle at the vertex must stand on the one that it is put on.
    order = np.argsort(triangles.ravel(), kind="stable")
    start = np.searchsorted(triangles.ravel()[order], [vertex, vertex + 1])
    stands = [
        (np.abs(normal[order[a:b] // 3] @ normal[t]) < STEEP).all() for a, b, t in zip(*start, triangle, strict=True)
    ]
    stands = np.array(stands, dtype=bool) & (np.abs(height) > close)
    vertices, landed = vertices.copy(), set()
    for k in np.argsort(np.abs(height), kind="stable"):
        if stands[k] and vertex[k] not in landed:
            landed.add(vertex[k])
            vertices[vertex[k]] -= height[k] * normal[triangle[k]]
    return vertices, len(landed)


def tie(vertices, triangles, birth, close, name):
    """Edges cut at the vertices within `close` metres of them: triangles, and their birth.

    Triangles that are all but a line vanish.
    """
    size, free = len(vertices), np.zeros(0, dtype=np.int64)
    for _ in range(20):
        going(f"tie the edges of {len(triangles)} triangles to vertices that they pass")
        edges = topology.edges(triangles).ends
        edges = edges[~np.isin(edges @ [size, 1], free)]  # vertices stay, so what had none near it has none now
        used = topology.used(triangles)
        ends = vertices[edges]
        pairs = near_boxes(around(ends, close), around(vertices[used][:, None]), name)
        edge, vertex = pairs[:, 0], used[pairs[:, 1]]
        start, along = ends[edge, 0], ends[edge, 1] - ends[edge, 0]
        length = np.linalg.norm(along, axis=1)
        along /= np.maximum(length, np.finfo(float).tiny)[:, None]
        reach = ((vertices[vertex] - start) * along).sum(axis=1)
        off = np.linalg.norm(vertices[vertex] - start - reach[:, None] * along, axis=1)
        good = (
            (off <= close) & (reach > close) & (reach < length - close) & (edges[edge] != vertex[:, None]).all(axis=1)
        )
        if not good.any():
            break
        edge, vertex, reach = edge[good], vertex[good], reach[good]
        free = np.union1d(free, np.delete(edges, edge, axis=0) @ [size, 1])
        chains = {}
        for k in np.lexsort((reach, edge)):
            chains.setdefault(tuple(edges[edge[k]].tolist()), []).append(int(vertex[k]))
        triangles, birth = _cut_sides(triangles, birth, chains)
        once = topology.first_of_each(triangles)  # or needles upon each other are cut again and again
        triangles, birth = triangles[once], birth[once]
    return triangles, birth


def _cut_sides(triangles, birth, chains):
    """Triangles cut along their sides: `chains` maps an edge (low, high) to the vertices on it, from low to high."""
    size = int(triangles.max()) + 1
    keys = np.array([a * size + b for a, b in chains if a < size and b < size], dtype=np.int64)
    after = np.roll(triangles, -1, axis=1)
    sides = np.minimum(triangles, after).astype(np.int64) * size + np.maximum(triangles, after)
    hit = np.isin(sides, keys).any(axis=1)
    whole, parents = [], []
    for corners, parent in zip(triangles[hit].tolist(), birth[hit].tolist(), strict=True):
        pieces = [corners]
        for a, b in itertools.pairwise([*corners, corners[0]]):
            chain = chains.get((min(a, b), max(a, b)))
            if not chain:
                continue
            for k, piece in enumerate(pieces):
                if a in piece and b in piece:  # the one that has the whole side
                    (c,) = set(piece) - {a, b}
                    line = [a, *(chain if a < b else chain[::-1]), b]
                    pieces[k : k + 1] = [[p, q, c] for p, q in itertools.pairwise(line) if c not in (p, q)]
                    break
        whole += pieces
        parents += [parent] * len(pieces)
    pieces = np.array(whole, dtype=triangles.dtype).reshape(-1, 3)
    return np.concatenate([triangles[~hit], pieces]), np.concatenate([birth[~hit], np.array(parents, birth.dtype)])


def overlay(vertices, triangles, birth, close, name):
    """Parts within `close` metres of one plane that lie on each other cut along each other's edges.

    An edge that lies in a triangle, the foot of a sheet, cuts it too. Returns vertices, triangles, birth, and whether
    there was anything to cut; what lies on each other is then there twice.
    """
    boxes, edges = around(vertices[triangles], close), topology.edges(triangles).ends
    lying = _in_chunks(_lying, near_boxes(boxes, boxes, name), vertices, triangles, close)
    feet = _in_chunks(_feet, near_boxes(around(vertices[edges]), boxes, name), vertices, triangles, close)
    if len(lying) == 0 and len(feet) == 0:
        return vertices, triangles, birth, False
    # An edge where planes meet lies in triangles of each; only those of one plane are laid out together.
    feet = feet[np.argsort(feet[:, 0], kind="stable")]
    same = np.stack([feet[:-1, 1], feet[1:, 1]], axis=1)[feet[:-1, 0] == feet[1:, 0]]
    same = same[_cosine(topology.shape(vertices[triangles])[0], same) > FLAT]
    label = topology.groups(np.concatenate([lying, same]), len(triangles))[1]
    involved = np.unique(np.concatenate([lying.ravel(), feet[:, 1]]))
    rest = np.delete(np.arange(len(triangles)), involved)
    points, pieces, parents, chains = [vertices], [triangles[rest]], [birth[rest]], {}
    for cluster in np.unique(label[involved]):
        going("cut parts that lie on each other")
        flat = involved[label[involved] == cluster]
        layout = _laid_out(vertices, triangles[flat], edges[np.unique(feet[np.isin(feet[:, 1], flat), 0])])
        number, new = _numbers(layout, vertices, triangles[flat], sum(map(len, points)))
        points.append(new)
        kept = layout.parent < len(flat)
        pieces.append(number[layout.pieces[kept]])
        parents.append(birth[flat[layout.parent[kept]]])
        _add_chains(chains, layout, number, len(flat), close)
    triangles, birth = np.concatenate(pieces).astype(np.int32), np.concatenate(parents)
    chains = {edge: sorted(share, key=share.get) for edge, share in chains.items() if share}
    triangles, birth = _cut_sides(triangles, birth, chains)
    solid = topology.have_three_corners(triangles)
    return np.concatenate(points), triangles[solid], birth[solid], True


def _in_chunks(keep, pairs, *arguments):
    """Those of many pairs (P, 2) that `keep` keeps, a part at a time to save memory."""
    return np.concatenate([keep(part, *arguments) for part in np.array_split(pairs, 1 + len(pairs) // CHUNK)])


def _cosine(normal, pairs):
    """Cosine of the angle between the planes of pairs (P, 2) of triangles with unit normals (T, 3), (P,)."""
    return np.abs((normal[pairs[:, 0]] * normal[pairs[:, 1]]).sum(axis=1))


def _inward(corners, normal, k):
    """Unit vectors (P, 3) in the planes of triangles (P, 3, 3), square to their sides k; NaN without area."""
    inward = np.cross(normal, corners[:, (k + 1) % 3] - corners[:, k])
    with np.errstate(invalid="ignore"):
        return inward / np.linalg.norm(inward, axis=1)[:, None]


def _lying(pairs, vertices, triangles, close):
    """Those pairs (P, 2) of triangles that lie on each other within `close` metres, the larger first."""
    corners = vertices[triangles]
    normal = topology.shape(corners)[0]
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    pairs = pairs[_cosine(normal, pairs) > STEEP]
    size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    pairs = np.where((size[pairs[:, 0]] >= size[pairs[:, 1]])[:, None], pairs, pairs[:, ::-1])
    large, small = pairs.T
    height = np.einsum("pkx,px->pk", corners[small] - corners[large, 0][:, None], normal[large])
    pairs = pairs[(np.abs(height) <= close).all(axis=1)]
    overlap = np.full(len(pairs), np.inf)
    for this, that in (pairs.T, pairs.T[::-1]):
        for k in range(3):
            inward = _inward(corners[this], normal[this], k)
            reach = np.einsum("pkx,px->pk", corners[that] - corners[this, k][:, None], inward)
            overlap = np.minimum(overlap, reach.max(axis=1))
    pairs = pairs[overlap > 4 * close]
    same = np.sort(corners[pairs].reshape(-1, 2, 9), axis=2)
    return pairs[(same[:, 0] != same[:, 1]).any(axis=1)]


def _feet(pairs, vertices, triangles, close):
    """Those pairs (P, 2) of an edge and a triangle where the edge lies in the triangle, within `close` metres."""
    corners, edges = vertices[triangles], topology.edges(triangles).ends
    normal, ends = topology.shape(corners)[0], vertices[edges]
    edge, triangle = pairs.T
    pairs = pairs[(triangles[triangle][:, :, None] == edges[edge][:, None]).any(axis=1).sum(axis=1) < 2]
    for k in (0, 1):
        height = ((ends[pairs[:, 0], k] - corners[pairs[:, 1], 0]) * normal[pairs[:, 1]]).sum(axis=1)
        pairs = pairs[np.abs(height) <= close]
    edge, triangle = pairs.T
    start, along = ends[edge, 0], ends[edge, 1] - ends[edge, 0]
    low, high = np.zeros(len(pairs)), np.ones(len(pairs))  # shares of the edge between which it is inside
    for k in range(3):
        inward = _inward(corners[triangle], normal[triangle], k)
        depth, slope = ((start - corners[triangle, k]) * inward).sum(axis=1) - 2 * close, (along * inward).sum(axis=1)
        share = np.divide(-depth, slope, out=np.full(len(depth), np.nan), where=slope != 0)
        low = np.where(slope > 0, np.maximum(low, share), low)
        high = np.where(slope < 0, np.minimum(high, share), high)
        high = np.where((slope == 0) & (depth < 0), -1.0, high)
    return pairs[(high - low) * np.linalg.norm(along, axis=1) > 4 * close]


class Layout(NamedTuple):
    """Triangles of one plane and edges in it, laid out flat and cut along each other.

    An edge is given to the arrangement as a side of a flat triangle, a helper, that is dropped afterwards.
    """

    names: np.ndarray  # (N,) the vertices that the triangles and edges use
    plan: np.ndarray  # (N + M, 2) where these are in the plane, in metres, and the apexes of the M edges' helpers
    faces: np.ndarray  # (F + M, 3) points of the triangles, then of the helpers, whose first side is the edge
    points: np.ndarray  # (Q, 2) of the arrangement
    pieces: np.ndarray  # (P, 3) triangles of the arrangement
    parent: np.ndarray  # (P,) the face that each is a piece of


def _laid_out(vertices, triangles, edges):
    """The Layout of triangles (F, 3) and edges (M, 2) that lie in the plane of the largest of these triangles."""
    corners = vertices[triangles[topology.areas(vertices, triangles).argmax()]]
    names = np.unique(np.concatenate([triangles.ravel(), edges.ravel()]))
    along = corners[1] - corners[0]
    along = along / np.linalg.norm(along)
    frame = np.stack([along, np.cross(topology.shape(corners[None])[0][0], along)])
    place = (vertices[names] - corners[0]) @ frame.T
    foot = np.searchsorted(names, edges)
    along = place[foot[:, 1]] - place[foot[:, 0]]
    apexes = place[foot].mean(axis=1) + 0.1 * np.stack([-along[:, 1], along[:, 0]], axis=1)
    plan = np.concatenate([place, apexes])
    helpers = np.column_stack([foot, len(place) + np.arange(len(foot))])
    faces = np.concatenate([np.searchsorted(names, triangles), helpers]).astype(np.int64)
    points, pieces, _, parent, _ = cgal.remesh_self_intersections(
        np.column_stack([plan, np.zeros(len(plan))]), faces, stitch_all=True
    )
    return Layout(names, plan, faces, points[:, :2], pieces, parent)


def _numbers(layout, vertices, triangles, first):
    """The vertex of each point (Q,) of a layout, and where new ones, numbered from `first`, are in space, (N, 3).

    Points beyond all of the triangles have none: -1.
    """
    names, plan, points = layout.names, layout.plan, layout.points
    known = {point.tobytes(): name for point, name in zip(plan[: len(names)] + 0.0, names.tolist(), strict=True)}
    number = np.array([known.get(point.tobytes(), -1) for point in points + 0.0])
    owner = np.full(len(points), -1)  # a triangle that each point is in
    for k in np.flatnonzero(layout.parent < len(triangles))[::-1]:
        owner[layout.pieces[k]] = layout.parent[k]
    new = np.flatnonzero((number < 0) & (owner >= 0))
    number[new] = first + np.arange(len(new))
    origin, *others = plan[layout.faces[owner[new]]].transpose(1, 0, 2)
    u, v, s = *(other - origin for other in others), points[new] - origin
    double_area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    b = ((s[:, 0] * v[:, 1] - s[:, 1] * v[:, 0]) / double_area)[:, None]
    c = ((u[:, 0] * s[:, 1] - u[:, 1] * s[:, 0]) / double_area)[:, None]
    first_corner, second, third = vertices[triangles[owner[new]]].transpose(1, 0, 2)
    return number, first_corner + b * (second - first_corner) + c * (third - first_corner)


def _add_chains(chains, layout, number, count, close):
    """Note in `chains` the vertices on each edge of a layout: {edge (low, high): {vertex: share of the edge}}.

    Its first `count` faces are triangles, with three edges each.
    """
    for k, face in enumerate(layout.faces):
        touched = np.unique(layout.pieces[layout.parent == k])
        for a, b in ((0, 1), (1, 2), (2, 0)) if k < count else ((0, 1),):
            start, along = layout.plan[face[a]], layout.plan[face[b]] - layout.plan[face[a]]
            share = (layout.points[touched] - start) @ along / (along @ along)
            off = np.linalg.norm(layout.points[touched] - start - share[:, None] * along, axis=1)
            on = (off <= 1e-3 * close) & (share > 0) & (share < 1)
            low, high = layout.names[face[[a, b]]]
            chain = chains.setdefault((min(low, high), max(low, high)), {})
            for vertex, at in zip(number[touched[on]].tolist(), share[on].tolist(), strict=True):
                if vertex >= 0 and vertex not in (low, high):
                    chain[vertex] = at if low < high else 1 - at
