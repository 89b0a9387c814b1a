"""Edges of a triangle mesh, and its unknowns, components and orientation."""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from isarflow.core.errors import InputError

FEATURE_ANGLE = 40.0  # degrees between face normals; sharper edges are features and stay
TINY = np.finfo(float).tiny  # keeps divisions by a length of zero finite


class Edges(NamedTuple):
    """The edges of a mesh. Side k of a triangle runs from its corner k to its corner k + 1."""

    ends: np.ndarray  # (E, 2) unique, ascending pairs of vertices
    sides: np.ndarray  # (T, 3) the edge that each side of a triangle is
    count: np.ndarray  # (E,) triangles at each edge: 1 = boundary, 2 = ordinary, 3 and more = junction


# Equations that hold for closed surfaces alone: what they need, and what to do where there are none.
CLOSED = {
    "cfie": "'formulation: cfie' needs closed surfaces with outward normals; use efie for this target.",
    "ibc": "A surface impedance, of an opaque body or a coating, needs closed surfaces.",
    "pmchwt": "A solid body needs closed surfaces; give the wall's 'thickness' in 'material' if it is a shell.",
}


def edges(triangles):
    """Return the Edges of triangles (T, 3)."""
    after = np.roll(triangles, -1, axis=1)
    low, high = np.minimum(triangles, after).astype(np.int64), np.maximum(triangles, after)
    # One number for each pair sorts much faster than pairs do, in the same order.
    size = int(high.max(initial=0)) + 1
    pair, sides, count = np.unique(low * size + high, return_inverse=True, return_counts=True)
    return Edges(np.stack(np.divmod(pair, size), axis=1), sides.reshape(-1, 3), count)


def turned(triangles, edges):
    """Return True for each of two triangles' `edges` (E,) where their normals are on different sides."""
    turn = np.zeros(len(edges.count))
    np.add.at(turn, edges.sides, np.sign(np.roll(triangles, -1, axis=1) - triangles))  # opposite ways cancel
    return (turn != 0) & (edges.count == 2)


def rims(triangles):
    """Return edges with one triangle, (R, 2), the triangle of each, (R,), and its side there, (R,)."""
    ends, sides, count = edges(triangles)
    triangle, side = np.nonzero(count[sides] == 1)
    return ends[sides[triangle, side]], triangle, side


def side_pairs(edges, chosen):
    """Return the two sides at each of the `chosen` edges (a mask, (E,)), (P, 2): side k of triangle t is 3 t + k."""
    order = np.argsort(edges.sides, axis=None, kind="stable")
    return order[chosen[edges.sides.ravel()[order]]].reshape(-1, 2)


def stars(triangles, chosen, size):
    """Return the triangles at each of `chosen` vertices (N,): which of these it is, (P,), and the triangle, (P,)."""
    order = np.argsort(triangles.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(triangles.ravel(), minlength=size))])
    many = start[chosen + 1] - start[chosen]
    which = np.repeat(np.arange(len(chosen)), many)
    offset = np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many)
    return which, order[start[chosen][which] + offset] // 3


def groups(pairs, size):
    """Count the groups of nodes 0 to `size` - 1 connected by pairs (P, 2); also the group of each node, (size,)."""
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(size, size))
    return connected_components(graph, directed=False)


def features(vertices, triangles):
    """Return True for each edge that is a crease, a boundary or a junction, (E,)."""
    mesh_edges = edges(triangles)
    feature = mesh_edges.count != 2
    pairs = side_pairs(mesh_edges, ~feature)
    first, second = shape(vertices[triangles])[0][pairs.T // 3]
    feature[mesh_edges.sides.ravel()[pairs[:, 0]]] = (first * second).sum(axis=1) < np.cos(np.radians(FEATURE_ANGLE))
    return feature


def unknowns(triangles):
    """Count the RWG functions: an edge shared by n triangles carries n - 1."""
    return int((edges(triangles).count - 1).sum())


def is_watertight(triangles):
    """Return True if every edge has exactly two triangles, which run through it in opposite directions."""
    _, sides, count = edges(triangles)
    forward = triangles < np.roll(triangles, -1, axis=1)
    return bool((count == 2).all() and (np.bincount(sides.ravel(), weights=forward.ravel()) == 1).all())


def components(triangles):
    """Count the connected pieces; also the piece of each triangle, (T,)."""
    label = groups(triangles[:, [0, 1, 1, 2]].reshape(-1, 2), triangles.max() + 1)[1]
    pieces, piece = np.unique(label[triangles[:, 0]], return_inverse=True)
    return len(pieces), piece


def edge_pieces(triangles):
    """Count the pieces connected by edges; also the piece of each triangle, (T,)."""
    sides, size = edges(triangles).sides, len(triangles)
    # Triangles and edges are the two kinds of nodes.
    pairs = np.stack([np.repeat(np.arange(size), 3), size + sides.ravel()], axis=1)
    pieces, label = groups(pairs, size + sides.max() + 1)
    return pieces, label[:size]


def closed_pieces(triangles):
    """Return the piece by edges of each triangle, (T,), and whether all edges of each piece have two triangles."""
    pieces, piece = edge_pieces(triangles)
    _, sides, count = edges(triangles)
    return piece, np.bincount(piece, (count[sides] != 2).any(axis=1), pieces) == 0


def place(point):
    """Return a point (3,) in metres as text for a message."""
    return f"({', '.join(f'{x:.4g}' for x in np.asarray(point, float) + 0.0)}) m"


def orient(vertices, triangles, name):
    """Turn triangles so that neighbours agree and closed surfaces point outward; also the number turned.

    This passes through ordinary edges, not junctions. Open surfaces keep the side that most of their triangles had.
    """
    mesh_edges, size = edges(triangles), len(triangles)
    ordinary = mesh_edges.count == 2
    sides = side_pairs(mesh_edges, ordinary)
    pairs = sides // 3
    forward = (triangles < np.roll(triangles, -1, axis=1)).ravel()[sides]
    disagree = (forward[:, 0] == forward[:, 1])[:, None]
    # Each triangle is two nodes, as it is and turned; neighbours' nodes that agree are joined.
    nodes = np.concatenate([pairs + [0, size] * disagree, pairs + [size, 0] + [0, size] * ~disagree])
    side = groups(nodes, 2 * size)[1].reshape(2, size)
    wrong = side[0] == side[1]
    if wrong.any():
        point = place(vertices[triangles[wrong.argmax()]].mean(axis=0))
        raise InputError(f"{name} has a one-sided surface near {point} (like a Moebius strip or a doubled face).")
    pieces, piece = groups(pairs, size)
    start = np.unique(piece, return_index=True)[1]
    turned = side[1] == side[0, start][piece]
    closed = np.bincount(piece, weights=~ordinary[mesh_edges.sides].all(axis=1), minlength=pieces) == 0
    sign = np.where(turned, -1, 1)
    volume = np.bincount(piece, weights=sign * tetrahedra(vertices, triangles), minlength=pieces)
    majority = np.bincount(piece, weights=sign, minlength=pieces)
    turned ^= np.where(closed, volume < 0, majority < 0)[piece]
    return np.where(turned[:, None], triangles[:, ::-1], triangles), int(turned.sum())


def tetrahedra(vertices, triangles):
    """Return signed volumes in m^3 between triangles and the origin, (T,); over a closed mesh they sum to its own."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return (a * np.cross(b, c)).sum(axis=1) / 6


def winding_number(point, vertices, triangles):
    """Return how often triangles (T, 3) go round a point (3,): 1 within a closed surface, and 0 outside.

    van Oosterom, Strackee, IEEE Trans. BME-30, 1983.
    """
    a, b, c = (vertices[triangles] - point).transpose(1, 0, 2)
    x, y, z = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    ab, bc, ca = ((first * second).sum(1) for first, second in ((a, b), (b, c), (c, a)))
    volume = (a * np.cross(b, c)).sum(1)
    return float(np.arctan2(volume, x * y * z + ab * z + bc * x + ca * y).sum() / (2 * np.pi))


def check_closed(vertices, triangles, equation):
    """Raise InputError unless every part is closed, as one of CLOSED needs, and for cfie its normals point outwards."""
    vertices, triangles = np.asarray(vertices, float), np.asarray(triangles)
    _, sides, count = edges(triangles)
    forward = triangles < np.roll(triangles, -1, axis=1)
    wrong = np.bincount(sides.ravel(), np.where(forward, 1, -1).ravel()) != 0
    if wrong.any():
        disagree = f"at {wrong.sum()} of {len(count)} edges"
        raise InputError(f"the mesh is open or its triangles disagree {disagree}. {CLOSED[equation]}")
    if equation != "cfie":  # they have no side: of a hollow body the inner surface may be turned either way
        return
    pieces, piece = edge_pieces(triangles)
    volume = np.bincount(piece, tetrahedra(vertices - vertices[triangles].mean((0, 1)), triangles), pieces)
    if not (volume > 0).all():
        raise InputError(
            f"normals point inwards on {(volume <= 0).sum()} of {pieces} closed surfaces. {CLOSED[equation]}"
        )


def normals(corners):
    """Return the normals of triangles (T, 3, 3), each twice the area long, (T, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def areas(vertices, triangles):
    """Return the area of each triangle in m^2, (T,)."""
    return np.linalg.norm(normals(vertices[triangles]), axis=1) / 2


def unit(vectors):
    """Return vectors (N, 3) divided by their lengths; those of length 0 stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1), TINY)[:, None]


def _sides(corners):
    """Return sides (T, 3, 3) of triangles, from corner k to k + 1, their `normals`, and the length of these, (T,)."""
    # Called very often: `take`, `einsum` and this cross product are much faster than np.roll, sums and np.cross.
    ahead = corners.take((1, 2, 0), axis=1) - corners
    first, second = ahead[:, 0], -ahead[:, 2]
    cross = first.take((1, 2, 0), axis=1) * second.take((2, 0, 1), axis=1)
    cross -= first.take((2, 0, 1), axis=1) * second.take((1, 2, 0), axis=1)
    return ahead, cross, np.sqrt(np.einsum("tx,tx->t", cross, cross))


def _angles(ahead, double_area):
    return np.degrees(np.arctan2(double_area[:, None], -np.einsum("tkx,tkx->tk", ahead, ahead.take((2, 0, 1), axis=1))))


def _largest(values):
    """Return the largest of each row of values (T, 3), (T,)."""
    return np.maximum(np.maximum(values[:, 0], values[:, 1]), values[:, 2])


def shape(corners):
    """Return unit normal (T, 3), smallest height (T,) and smallest angle in degrees (T,) of triangles (T, 3, 3)."""
    ahead, cross, double_area = _sides(corners)
    normal = cross / np.maximum(double_area, TINY)[:, None]
    longest = np.sqrt(_largest(np.einsum("tkx,tkx->tk", ahead, ahead)))
    return normal, double_area / np.maximum(longest, TINY), -_largest(-_angles(ahead, double_area))


def angles(corners):
    """Return the angles in degrees at the corners of triangles (T, 3, 3), (T, 3)."""
    ahead, _, double_area = _sides(corners)
    return _angles(ahead, double_area)


def vertex_normals(vertices, triangles):
    """Return unit normals at the vertices, (V, 3), weighted by angles."""
    weight, normal = angles(vertices[triangles]), shape(vertices[triangles])[0]
    return unit(gathered(triangles, weight[:, :, None] * normal[:, None], len(vertices)))


def lengths(vertices, ends):
    """Return metres between each of the pairs of vertices `ends` (E, 2), (E,)."""
    start, stop = vertices[ends].transpose(1, 0, 2)
    return np.linalg.norm(stop - start, axis=1)


def edge_lengths(vertices, triangles):
    """Return the length of each edge in metres, (E,)."""
    return lengths(vertices, edges(triangles).ends)


def shortest_edges(vertices, triangles):
    """Return the length in metres of the shortest edge at each vertex, (V,); infinite where there is none."""
    shortest = np.full(len(vertices), np.inf)
    np.minimum.at(shortest, edges(triangles).ends, edge_lengths(vertices, triangles)[:, None])
    return shortest


def used(triangles):
    """Return the vertices that triangles use, ascending."""
    return np.flatnonzero(np.bincount(triangles.ravel()))


def compact(vertices, triangles):
    """Return the same mesh without the vertices that no triangle uses."""
    kept = used(triangles)
    number = np.zeros(len(vertices), dtype=np.int32)
    number[kept] = np.arange(len(kept))
    return vertices[kept], number.take(triangles)


def have_three_corners(triangles):
    """Return True for triangles whose corners are three vertices, (T,)."""
    return (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)


def first_of_each(triangles):
    """Return True for the first of all triangles with the same corners, in any order, (T,)."""
    first = np.zeros(len(triangles), dtype=bool)
    first[np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1]] = True
    return first


def triple(triangles, size):
    """Return a number for each triangle, (T,), that only those with the same corners share; all are below `size`."""
    low, middle, high = np.sort(triangles.astype(np.int64), axis=1).T
    return (low * size + middle) * size + high


def gathered(names, values, size):
    """Sum values (N, K, D) over the places where names (N, K) have each number below `size`, (size, D)."""
    names, values = names.ravel(), values.reshape(-1, values.shape[-1])
    # Without any place np.bincount returns whole numbers.
    return np.stack([np.bincount(names, column, minlength=size) for column in values.T], axis=1, dtype=float)
