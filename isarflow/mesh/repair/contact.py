"""Give surfaces that touch up to rounding common vertices and edges; `birth` is the source of each triangle, (T,)."""

import itertools
from typing import NamedTuple

import numpy as np
from igl.copyleft import cgal

from isarflow.mesh import topology
from isarflow.mesh.progress import going
from isarflow.mesh.repair.boxes import CHUNK, around, near_boxes

STEEP = np.cos(np.radians(30.0))  # a rim is moved onto a surface that its sheet ends on, not along which it runs
FLAT = 1 - 1e-6  # cosine of the angle between normals of one plane
ON = 1e-12  # of a plane's extent: a point this near to a triangle's side is in it
APART = 0.4  # of the shortest edge at a vertex: nothing moves farther


def land(vertices, triangles, tolerance, close, name):
    """Move rim vertices within `tolerance` metres of a triangle that their sheet ends on onto it; also their number."""
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
    # Every triangle at the vertex must end on the one that the vertex is moved onto.
    which, star = topology.stars(triangles, vertex, len(vertices))
    along = which[np.abs((normal[star] * normal[triangle[which]]).sum(axis=1)) >= STEEP]
    stands = (np.bincount(along, minlength=len(vertex)) == 0) & (np.abs(height) > close)
    nearest = np.argsort(np.abs(height), kind="stable")
    nearest = nearest[stands[nearest]]
    nearest = nearest[np.unique(vertex[nearest], return_index=True)[1]]
    vertices = vertices.copy()
    vertices[vertex[nearest]] -= height[nearest, None] * normal[triangle[nearest]]
    return vertices, len(nearest)


def tie(vertices, triangles, birth, close, name):
    """Cut edges at the vertices within `close` metres of them: triangles, without those that are a line, and birth."""
    size, free = len(vertices), np.zeros(0, dtype=np.int64)
    for _ in range(20):
        going(f"tie the edges of {len(triangles)} triangles to vertices that they pass")
        edges = topology.edges(triangles).ends
        edges = edges[~np.isin(edges @ [size, 1], free)]  # vertices stay, so an edge that had none near it has none now
        used = topology.used(triangles)
        ends = vertices[edges]
        pairs = near_boxes(around(ends, close), around(vertices[used][:, None]), name)
        edge, vertex = pairs[:, 0], used[pairs[:, 1]]
        start, along = ends[edge, 0], ends[edge, 1] - ends[edge, 0]
        length, along = np.linalg.norm(along, axis=1), topology.unit(along)
        reach = ((vertices[vertex] - start) * along).sum(axis=1)
        off = np.linalg.norm(vertices[vertex] - start - reach[:, None] * along, axis=1)
        good = (off <= close) & (reach > close) & (reach < length - close)
        good &= (edges[edge] != vertex[:, None]).all(axis=1)
        if not good.any():
            break
        edge, vertex, reach = edge[good], vertex[good], reach[good]
        free = np.union1d(free, np.delete(edges, edge, axis=0) @ [size, 1])
        chains = {}
        for k in np.lexsort((reach, edge)):
            chains.setdefault(tuple(edges[edge[k]].tolist()), []).append(int(vertex[k]))
        triangles, birth = _cut_sides(triangles, birth, chains)
        once = topology.first_of_each(triangles)  # or needles on each other are cut again and again
        triangles, birth = triangles[once], birth[once]
    return triangles, birth


def _cut_sides(triangles, birth, chains):
    """Cut triangles along their sides: `chains` maps an edge (low, high) to the vertices on it, from low to high."""
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
    """Cut parts that lie on each other, within `close` metres of one plane, along each other's outlines.

    So do the feet of sheets. Of triangles on each other the larger keeps its edges, or there would be too many. Returns
    vertices, triangles, birth, and whether anything was cut; parts that lie on each other are then duplicates.
    """
    boxes, edges = around(vertices[triangles], close), topology.edges(triangles)
    lying = _in_chunks(_lying, near_boxes(boxes, boxes, name), vertices, triangles, close)
    feet = _in_chunks(_feet, near_boxes(around(vertices[edges.ends]), boxes, name), vertices, triangles, close)
    if len(lying) == 0 and len(feet) == 0:
        return vertices, triangles, birth, False
    # An edge where planes meet lies in triangles of each; only those of one plane are laid out together.
    feet = feet[np.argsort(feet[:, 0], kind="stable")]
    same = np.stack([feet[:-1, 1], feet[1:, 1]], axis=1)[feet[:-1, 0] == feet[1:, 0]]
    same = same[_cosine(topology.shape(vertices[triangles])[0], same) > FLAT]
    label = topology.groups(np.concatenate([lying, same]), len(triangles))[1]
    involved = np.unique(np.concatenate([lying.ravel(), feet[:, 1]]))
    involved = involved[np.argsort(label[involved], kind="stable")]
    rest = np.delete(np.arange(len(triangles)), involved)
    beneath = np.bincount(lying[:, 1], minlength=len(triangles)) > 0
    points, pieces, parents, chains = [vertices], [triangles[rest]], [birth[rest]], {}
    for flat in np.split(involved, np.flatnonzero(np.diff(label[involved])) + 1):
        going(f"cut {len(flat)} triangles that lie on each other")
        layout = _laid_out(vertices, triangles, edges, flat, beneath[flat], feet[np.isin(feet[:, 1], flat), 0])
        number, new = _numbers(layout, vertices, chains, sum(map(len, points)))
        points.append(new)
        made, owner = _covered(layout, name)
        pieces.append(number[made])
        parents.append(birth[flat[owner]])
    triangles, birth = np.concatenate(pieces).astype(np.int32), np.concatenate(parents)
    chains = {edge: sorted(share, key=share.get) for edge, share in chains.items()}
    triangles, birth = _cut_sides(triangles, birth, chains)
    solid = topology.have_three_corners(triangles)
    return np.concatenate(points), triangles[solid], birth[solid], True


def _in_chunks(keep, pairs, *arguments):
    """Pairs of many (P, 2) that `keep` keeps, a part at a time to save memory."""
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
    """Pairs of `pairs` (P, 2) of triangles that lie on each other within `close` metres, the larger first."""
    corners = vertices[triangles]
    normal = topology.shape(corners)[0]
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    pairs = pairs[_cosine(normal, pairs) > STEEP]
    size = np.linalg.norm(topology.normals(corners), axis=1)
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
    """Pairs of `pairs` (P, 2), an edge and a triangle, with the edge in the triangle within `close` metres."""
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
    """Triangles of one plane laid out flat, and the cells between lines: outlines of patches, edges in triangles."""

    names: np.ndarray  # (N,) the vertices that the triangles and lines use
    plan: np.ndarray  # (N, 2) where these are in the plane, in metres
    faces: np.ndarray  # (F, 3) the triangles, by their place in `names`
    turned: np.ndarray  # (F,) True for those that are clockwise in the plane
    patch: np.ndarray  # (F,) the patch of each: itself, or connected triangles beneath others
    lines: np.ndarray  # (M, 2) the ends of lines, by their place in `names`
    points: np.ndarray  # (Q, 2) of the arrangement
    on_line: np.ndarray  # (L, 2) pairs of a line and a point on it
    cells: np.ndarray  # (P, 3) triangles of the arrangement


def _laid_out(vertices, triangles, edges, flat, beneath, feet):
    """The Layout of the triangles `flat` (F,), some `beneath` others, and edges `feet`, in the plane of the largest."""
    mine = triangles[flat]
    corners = vertices[mine[topology.areas(vertices, mine).argmax()]]
    along = corners[1] - corners[0]
    along = along / np.linalg.norm(along)
    frame = np.stack([along, np.cross(topology.shape(corners[None])[0][0], along)])
    numbers, side = np.unique(edges.sides[flat], return_inverse=True)
    side = side.reshape(-1, 3)
    names = np.unique(np.concatenate([mine.ravel(), edges.ends[feet].ravel()]))
    plan = (vertices[names] - corners[0]) @ frame.T
    faces = np.searchsorted(names, mine)
    u, v = plan[faces[:, 1]] - plan[faces[:, 0]], plan[faces[:, 2]] - plan[faces[:, 0]]
    turned = u[:, 0] * v[:, 1] < u[:, 1] * v[:, 0]
    forward = (faces < np.roll(faces, -1, axis=1)) ^ turned[:, None]
    inner = (edges.count[numbers] == 2) & (np.bincount(side.ravel(), weights=np.repeat(beneath, 3)) == 2)
    inner &= np.bincount(side.ravel(), weights=forward.ravel()) == 1  # not where two are folded onto each other
    joined = inner[side]
    pairs = np.stack([np.nonzero(joined)[0], len(flat) + side[joined]], axis=1)
    patch = topology.groups(pairs, len(flat) + len(numbers))[1][: len(flat)]
    lines = np.union1d(numbers[~inner], np.setdiff1d(feet, numbers[inner]))
    lines = np.searchsorted(names, edges.ends[lines])
    lines = lines[(plan[lines[:, 0]] != plan[lines[:, 1]]).any(axis=1)]
    points, on_line, cells = _arrangement(plan, lines)
    return Layout(names, plan, faces, turned, patch, lines, points, on_line, cells)


def _arrangement(plan, lines):
    """Points (Q, 2), pairs (L, 2) of a line and a point on it, and cells (P, 3) between lines (M, 2) of plan (N, 2)."""
    # The exact arithmetic of surfaces gets each line as the foot of a triangle that ends on one beneath them all.
    start, stop = plan[lines].transpose(1, 0, 2)
    apexes = np.column_stack([(start + stop) / 2, np.linalg.norm(stop - start, axis=1)])
    centre, far = plan.mean(axis=0), 10 * np.ptp(plan, axis=0).max()
    floor = np.column_stack([centre + far * np.array([[0, 1], [-1, -1], [1, -1]]), np.zeros(3)])
    size = len(plan)
    standing = np.column_stack([lines, size + np.arange(len(lines))])
    faces = np.concatenate([standing, size + len(lines) + np.arange(3)[None]]).astype(np.int64)
    space = np.concatenate([np.column_stack([plan, np.zeros(size)]), apexes, floor])
    points, pieces, _, parent, _ = cgal.remesh_self_intersections(space, faces, stitch_all=True)
    on_floor = points[:, 2] == 0
    upright = parent < len(lines)
    pairs = np.stack([np.repeat(parent[upright], 3), pieces[upright].ravel()], axis=1)
    pairs = np.unique(pairs[on_floor[pairs[:, 1]]], axis=0)
    return points[:, :2], pairs, pieces[~upright]


def _numbers(layout, vertices, chains, first):
    """The vertex of each point (Q,) of a layout (-1 on no line), and new ones' places (N, 3), numbered from `first`."""
    names, plan, points = layout.names, layout.plan, layout.points
    known = {point.tobytes(): name for point, name in zip(plan + 0.0, names.tolist(), strict=True)}
    number = np.array([known.get(point.tobytes(), -1) for point in points + 0.0])
    line, point = layout.on_line.T
    low, high = np.sort(names[layout.lines], axis=1)[line].T
    start = plan[np.searchsorted(names, low)]
    along = plan[np.searchsorted(names, high)] - start
    share = ((points[point] - start) * along).sum(axis=1) / (along**2).sum(axis=1)
    new, first_line = np.unique(point[number[point] < 0], return_index=True)
    at = np.flatnonzero(number[point] < 0)[first_line]
    number[new] = first + np.arange(len(new))
    inside = (share > 0) & (share < 1) & (number[point] != low) & (number[point] != high)
    for k in np.flatnonzero(inside).tolist():  # {edge (low, high): {vertex: share of the edge}}
        chains.setdefault((int(low[k]), int(high[k])), {})[int(number[point[k]])] = share[k]
    return number, vertices[low[at]] + share[at, None] * (vertices[high[at]] - vertices[low[at]])


def _covered(layout, name):
    """Cells (C, 3) of a layout for each patch that covers them, facing as it does, and the patch's face there, (C,)."""
    middle, corners = layout.points[layout.cells].mean(axis=1), layout.plan[layout.faces]
    boxes = [np.pad(side, ((0, 0), (0, 1))) for side in (*around(middle[:, None]), *around(corners))]
    cell, face = near_boxes(boxes[:2], boxes[2:], name).T
    inside, least = np.ones(len(cell), dtype=bool), -ON * np.ptp(layout.plan)
    for k in range(3):
        along, to = corners[face, (k + 1) % 3] - corners[face, k], middle[cell] - corners[face, k]
        left = along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]
        inside &= np.where(layout.turned[face], -left, left) >= least * np.linalg.norm(along, axis=1)
    cell, face = cell[inside], face[inside]
    once = np.unique(layout.patch[face].astype(np.int64) * len(middle) + cell, return_index=True)[1]
    cell, face = cell[once], face[once]
    return np.where(layout.turned[face, None], layout.cells[cell][:, ::-1], layout.cells[cell]), face
