"""Where surfaces lie in each other or touch but for rounding: there they are given common vertices and edges.

Exact arithmetic sees two sheets 1e-9 m apart as two; a part that was rotated, or placed in single precision, is that
far from the one that it lies on.
"""

import itertools

import numpy as np
from igl.copyleft import cgal
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from core.errors import InputError
from mesh import topology

STEEP = np.cos(np.radians(30.0))  # a rim is put onto what its sheet stands on, not onto what it runs along
FLAT = 1 - 1e-6  # cosine of the angle between normals of one plane
APART = 0.4  # of the shortest edge at a vertex: nothing moves further
LEAF, CHUNK = 5_000, 1_000_000  # pairs compared together, if space can be halved, and at most
PAIRS = 10_000_000  # boxes that may overlap; a sound surface has about 13 for each triangle
ALIKE = 5  # times PAIRS are compared where halving the space parts no boxes


def near_boxes(low, high, other_low, other_high, name):
    """Pairs (P, 2) of a box and another box that overlap, from their lowest and highest corners (N, 3), (M, 3).

    Raises InputError, naming `name`, where more than PAIRS overlap: time and memory would grow with the square of the
    boxes, here and in the exact arrangement.
    """
    everywhere = np.full(3, -np.inf), np.full(3, np.inf)
    cells, found = [(np.arange(len(low)), np.arange(len(other_low)), *everywhere)], [np.zeros((0, 2), int)]
    many = alike = 0
    while cells:  # halve the space until few boxes are left in a cell
        one, other, start, stop = cells.pop()
        if len(one) == 0 or len(other) == 0:
            continue
        if len(one) * len(other) > LEAF:
            centre = (low[one] + high[one]) / 2
            axis = np.ptp(centre, axis=0).argmax()
            middle = np.median(centre[:, axis])
            below, above = low[one, axis] < middle, high[one, axis] >= middle
            if max(below.sum(), above.sum()) < 0.9 * len(one):
                other_below, other_above = other_low[other, axis] < middle, other_high[other, axis] >= middle
                here = np.arange(3) == axis
                cells.append((one[below], other[other_below], start, np.where(here, middle, stop)))
                cells.append((one[above], other[other_above], np.where(here, middle, start), stop))
                continue
            alike += len(one) * len(other)
        for part in np.array_split(one, 1 + len(one) * len(other) // CHUNK):
            corner = np.maximum(low[part][:, None], other_low[other])
            meet = (corner <= np.minimum(high[part][:, None], other_high[other])).all(axis=2)
            # Boxes may share many cells; the lowest corner of their common part lies in one.
            meet &= ((corner >= start) & (corner < stop)).all(axis=2)
            first, second = np.nonzero(meet)
            found.append(np.stack([part[first], other[second]], axis=1))
            many += len(first)
            if many > PAIRS or alike > ALIKE * PAIRS:
                _refuse(np.median((low[one] + high[one]) / 2, axis=0), name)
    return np.concatenate(found)


def check_hubs(vertices, triangles, name):
    """Refuse a surface with a vertex that has more triangles than can be paired with each other."""
    count = np.bincount(triangles.ravel())
    if count.max() ** 2 > PAIRS:
        _refuse(vertices[count.argmax()], name)


def _refuse(point, name):
    raise InputError(
        f"{name}: too many triangles lie side by side near {topology.place(point)} to look for those that cross. "
        "Export the part there with fewer and rounder triangles: not as thousands of needles around one point, nor "
        "much finer than the edges of its mesh are to be."
    )


def _in_chunks(keep, pairs):
    """`keep` (pairs to those of them that it keeps) of many pairs (P, 2), a part at a time to save memory."""
    return np.concatenate([keep(part) for part in np.array_split(pairs, 1 + len(pairs) // CHUNK)])


def land(vertices, triangles, tolerance, close, name):
    """Rim vertices within `tolerance` metres of a triangle that their sheet stands on, put onto it; and how many."""
    unique = topology.edges(triangles)[0]
    rim = topology.rim(triangles)
    corners = vertices[triangles]
    pair = near_boxes(
        vertices[rim] - tolerance, vertices[rim] + tolerance, corners.min(axis=1), corners.max(axis=1), name
    )
    vertex, triangle = rim[pair[:, 0]], pair[:, 1]
    room = np.full(len(vertices), np.inf)
    length = np.linalg.norm(vertices[unique[:, 0]] - vertices[unique[:, 1]], axis=1)
    np.minimum.at(room, unique, length[:, None])
    normal = topology.shape(corners)[0]
    height = ((vertices[vertex] - corners[triangle, 0]) * normal[triangle]).sum(axis=1)
    reach = np.minimum(tolerance, APART * room[vertex])
    good = (np.abs(height) <= reach) & (triangles[triangle] != vertex[:, None]).all(axis=1)
    good &= _depth(corners[triangle], normal[triangle], vertices[vertex]) >= -close
    vertex, triangle, height = vertex[good], triangle[good], height[good]
    # Every triangle at the vertex must stand on the one that it is put on.
    order = np.argsort(triangles.ravel(), kind="stable")
    start = np.searchsorted(triangles.ravel()[order], [vertex, vertex + 1])
    stands = [
        (np.abs(normal[order[a:b] // 3] @ normal[t]) < STEEP).all() for a, b, t in zip(*start, triangle, strict=True)
    ]
    stands = np.array(stands, dtype=bool) & (np.abs(height) > close)
    vertices, done = vertices.copy(), set()
    for k in np.argsort(np.abs(height), kind="stable"):
        if stands[k] and vertex[k] not in done:
            done.add(vertex[k])
            vertices[vertex[k]] -= height[k] * normal[triangle[k]]
    return vertices, len(done)


def tie(vertices, triangles, birth, close, name):
    """Edges cut at the vertices within `close` metres of them: triangles, and of which source triangle each is a part.

    Triangles that are all but a line vanish.
    """
    size, free = len(vertices), np.zeros(0, dtype=np.int64)
    for _ in range(20):
        unique = topology.edges(triangles)[0]
        unique = unique[~np.isin(unique @ [size, 1], free)]  # vertices stay, so what had none near it has none now
        used = np.unique(triangles)
        ends = vertices[unique]
        pair = near_boxes(ends.min(axis=1) - close, ends.max(axis=1) + close, vertices[used], vertices[used], name)
        edge, vertex = pair[:, 0], used[pair[:, 1]]
        start, along = ends[edge, 0], ends[edge, 1] - ends[edge, 0]
        length = np.linalg.norm(along, axis=1)
        along /= np.maximum(length, np.finfo(float).tiny)[:, None]
        reach = ((vertices[vertex] - start) * along).sum(axis=1)
        off = np.linalg.norm(vertices[vertex] - start - reach[:, None] * along, axis=1)
        good = (
            (off <= close) & (reach > close) & (reach < length - close) & (unique[edge] != vertex[:, None]).all(axis=1)
        )
        if not good.any():
            break
        edge, vertex, reach = edge[good], vertex[good], reach[good]
        free = np.union1d(free, np.delete(unique, edge, axis=0) @ [size, 1])
        order = np.lexsort((reach, edge))
        chains = {}
        for k in order:
            chains.setdefault(tuple(unique[edge[k]].tolist()), []).append(int(vertex[k]))
        triangles, birth = cut_sides(triangles, birth, chains)
        once = np.sort(np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1])
        triangles, birth = triangles[once], birth[once]  # or needles upon each other are cut again and again
    return triangles, birth


def cut_sides(triangles, birth, chains):
    """Triangles cut along their sides: `chains` maps an edge (low, high) to the vertices on it, from low to high."""
    size = int(triangles.max()) + 1
    keys = np.array([a * size + b for a, b in chains if a < size and b < size], dtype=np.int64)
    after = np.roll(triangles, -1, axis=1)
    sides = np.minimum(triangles, after).astype(np.int64) * size + np.maximum(triangles, after)
    hit = np.isin(sides, keys).any(axis=1)
    whole, parents = [], []
    for corners, parent in zip(triangles[hit].tolist(), birth[hit].tolist(), strict=True):
        pieces = [corners]
        for one, other in ((0, 1), (1, 2), (2, 0)):
            a, b = corners[one], corners[other]
            chain = chains.get((min(a, b), max(a, b)))
            if not chain:
                continue
            for k, piece in enumerate(pieces):
                if a in piece and b in piece:  # the one that has the whole side
                    (c,) = set(piece) - {a, b}
                    line = [a, *(chain if a < b else chain[::-1]), b]
                    fan = [[p, q, c] for p, q in itertools.pairwise(line) if c not in (p, q)]
                    pieces[k : k + 1] = fan
                    break
        whole += pieces
        parents += [parent] * len(pieces)
    pieces = np.array(whole, dtype=triangles.dtype).reshape(-1, 3)
    return np.concatenate([triangles[~hit], pieces]), np.concatenate(
        [birth[~hit], np.array(parents, dtype=birth.dtype)]
    )


def overlay(vertices, triangles, birth, close, name):
    """Parts within `close` metres of one plane that lie on each other cut along each other's edges.

    An edge that lies in a triangle, the foot of a sheet, cuts it too. Returns vertices, triangles, birth, and whether
    there was anything to cut; what lies on each other is then there twice.
    """
    corners = vertices[triangles]
    normal = topology.shape(corners)[0]
    low, high = corners.min(axis=1) - close, corners.max(axis=1) + close
    lying = _in_chunks(lambda pair: _lying(corners, normal, close, pair), near_boxes(low, high, low, high, name))
    unique = topology.edges(triangles)[0]
    ends = vertices[unique]
    pair = near_boxes(ends.min(axis=1), ends.max(axis=1), low, high, name)
    feet = _in_chunks(lambda pair: _feet(ends, corners, normal, unique, triangles, close, pair), pair)
    if len(lying) == 0 and len(feet) == 0:
        return vertices, triangles, birth, False
    count = len(triangles)
    # An edge where planes meet lies in triangles of each; only those of one plane are laid out together.
    feet = feet[np.argsort(feet[:, 0], kind="stable")]
    same = np.stack([feet[:-1, 1], feet[1:, 1]], axis=1)[feet[:-1, 0] == feet[1:, 0]]
    same = same[np.abs((normal[same[:, 0]] * normal[same[:, 1]]).sum(axis=1)) > FLAT]
    graph = coo_array((np.ones(len(lying) + len(same)), np.concatenate([lying, same]).T), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    involved = np.unique(np.concatenate([lying.ravel(), feet[:, 1]]))
    area = topology.areas(vertices, triangles)
    gone, pieces, parents, points, chains = [], [], [], [vertices], {}
    made = len(vertices)
    for cluster in np.unique(label[involved]):
        flat = involved[label[involved] == cluster]
        edges = unique[np.unique(feet[np.isin(feet[:, 1], flat), 0])]
        largest = flat[area[flat].argmax()]
        frame, origin = _frame(corners[largest]), corners[largest, 0]
        names = np.unique(np.concatenate([triangles[flat].ravel(), edges.ravel()]))
        place = (vertices[names] - origin) @ frame.T
        local = np.searchsorted(names, triangles[flat])
        # An edge is given to the arrangement as a side of a flat triangle that is dropped afterwards.
        foot = np.searchsorted(names, edges)
        along = place[foot[:, 1]] - place[foot[:, 0]]
        apex = place[foot].mean(axis=1) + 0.1 * np.stack([-along[:, 1], along[:, 0]], axis=1)
        plan = np.concatenate([place, apex])
        faces = np.concatenate([local, np.column_stack([foot, len(place) + np.arange(len(foot))])]).astype(np.int64)
        cut, parts, _, parent, _ = cgal.remesh_self_intersections(
            np.column_stack([plan, np.zeros(len(plan))]), faces, stitch_all=True
        )
        cut = cut[:, :2]
        number, made, new = _numbers(cut, parts, parent, plan, names, vertices, triangles[flat], place[local], made)
        points.append(new)
        kept = parent < len(flat)
        gone.append(flat)
        pieces.append(number[parts[kept]])
        parents.append(birth[flat[parent[kept]]])
        for k, face in enumerate(faces):
            mine = np.unique(parts[parent == k])
            for a, b in ((0, 1), (1, 2), (2, 0)) if k < len(flat) else ((0, 1),):
                start, along = plan[face[a]], plan[face[b]] - plan[face[a]]
                share = (cut[mine] - start) @ along / (along @ along)
                off = np.linalg.norm(cut[mine] - start - share[:, None] * along, axis=1)
                on = (off <= 1e-3 * close) & (share > 0) & (share < 1)
                one, two = names[face[a]], names[face[b]]
                chain = chains.setdefault((min(one, two), max(one, two)), {})
                for n, at in zip(number[mine[on]].tolist(), share[on].tolist(), strict=True):
                    if n >= 0 and n not in (one, two):  # a point beyond all flat triangles has no number
                        chain[n] = at if one < two else 1 - at
    rest = np.setdiff1d(np.arange(count), np.concatenate(gone))
    triangles = np.concatenate([triangles[rest], *pieces]).astype(np.int32)
    birth = np.concatenate([birth[rest], *parents])
    triangles, birth = cut_sides(triangles, birth, {e: sorted(on, key=on.get) for e, on in chains.items() if on})
    solid = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return np.concatenate(points), triangles[solid], birth[solid], True


def _numbers(cut, parts, parent, plan, names, vertices, triangles, place, made):
    """The vertex number of each point of a flat arrangement, the next free number, and the new points in space."""
    old = {point.tobytes(): number for point, number in zip(plan[: len(names)] + 0.0, names.tolist(), strict=True)}
    number = np.array([old.get(point.tobytes(), -1) for point in cut + 0.0])
    owner = np.full(len(cut), -1)
    for k in np.flatnonzero(parent < len(triangles))[::-1]:
        owner[parts[k]] = parent[k]
    fresh = np.flatnonzero((number < 0) & (owner >= 0))
    number[fresh] = made + np.arange(len(fresh))
    base = place[owner[fresh]]
    u, v, s = base[:, 1] - base[:, 0], base[:, 2] - base[:, 0], cut[fresh] - base[:, 0]
    double = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    b = ((s[:, 0] * v[:, 1] - s[:, 1] * v[:, 0]) / double)[:, None]
    c = ((u[:, 0] * s[:, 1] - u[:, 1] * s[:, 0]) / double)[:, None]
    one, two, three = vertices[triangles[owner[fresh]]].transpose(1, 0, 2)
    return number, made + len(fresh), one + b * (two - one) + c * (three - one)


def _frame(corners):
    """Two unit vectors (2, 3) in the plane of a triangle (3, 3)."""
    normal = topology.shape(corners[None])[0][0]
    along = corners[1] - corners[0]
    along = along / np.linalg.norm(along)
    return np.stack([along, np.cross(normal, along)])


def _depth(corners, normal, points):
    """How far inside triangles (P, 3, 3) the points (P, 3), put onto their planes, lie in metres; negative outside."""
    depth = np.full(len(points), np.inf)
    for k in range(3):
        inward = np.cross(normal, corners[:, (k + 1) % 3] - corners[:, k])
        inward /= np.maximum(np.linalg.norm(inward, axis=1), np.finfo(float).tiny)[:, None]
        depth = np.minimum(depth, ((points - corners[:, k]) * inward).sum(axis=1))
    return depth


def _lying(corners, normal, close, pair):
    """Those pairs of triangles that lie on each other."""
    pair = pair[pair[:, 0] < pair[:, 1]]
    pair = pair[np.abs((normal[pair[:, 0]] * normal[pair[:, 1]]).sum(axis=1)) > STEEP]
    size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    pair = np.where((size[pair[:, 0]] >= size[pair[:, 1]])[:, None], pair, pair[:, ::-1])
    large, small = pair.T
    height = np.einsum("pkx,px->pk", corners[small] - corners[large, 0][:, None], normal[large])
    pair = pair[(np.abs(height) <= close).all(axis=1)]
    large, small = pair.T
    overlap = np.full(len(pair), np.inf)
    for one, other in ((large, small), (small, large)):
        for k in range(3):
            inward = np.cross(normal[one], corners[one, (k + 1) % 3] - corners[one, k])
            inward /= np.linalg.norm(inward, axis=1)[:, None]
            reach = np.einsum("pkx,px->pk", corners[other] - corners[one, k][:, None], inward)
            overlap = np.minimum(overlap, reach.max(axis=1))
    pair = pair[overlap > 4 * close]
    same = np.sort(corners[pair].reshape(-1, 2, 9), axis=2)
    return pair[(same[:, 0] != same[:, 1]).any(axis=1)]


def _feet(ends, corners, normal, unique, triangles, close, pair):
    """Those pairs of an edge and a triangle where the edge lies in the triangle, inside it."""
    edge, triangle = pair.T
    pair = pair[((triangles[triangle][:, :, None] == unique[edge][:, None]).any(axis=1).sum(axis=1)) < 2]
    for k in (0, 1):
        height = ((ends[pair[:, 0], k] - corners[pair[:, 1], 0]) * normal[pair[:, 1]]).sum(axis=1)
        pair = pair[np.abs(height) <= close]
    edge, triangle = pair.T
    start, along = ends[edge, 0], ends[edge, 1] - ends[edge, 0]
    low, high = np.zeros(len(pair)), np.ones(len(pair))
    for k in range(3):
        inward = np.cross(normal[triangle], corners[triangle, (k + 1) % 3] - corners[triangle, k])
        inward /= np.linalg.norm(inward, axis=1)[:, None]
        at, slope = ((start - corners[triangle, k]) * inward).sum(axis=1) - 2 * close, (along * inward).sum(axis=1)
        share = np.divide(-at, slope, out=np.full(len(at), np.nan), where=slope != 0)
        low = np.where(slope > 0, np.maximum(low, share), low)
        high = np.where(slope < 0, np.minimum(high, share), high)
        high = np.where((slope == 0) & (at < 0), -1.0, high)
    return pair[(high - low) * np.linalg.norm(along, axis=1) > 4 * close]
