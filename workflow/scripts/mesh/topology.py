"""Edges of a triangle mesh, and what follows from them: unknowns, components, orientation."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from core.errors import InputError

FEATURE_ANGLE = 40.0  # degrees between face normals; sharper edges are features and stay


class OneSided(InputError):
    """A surface has one side only near `point`, (3,) in metres."""

    def __init__(self, point, message):
        super().__init__(message)
        self.point = point


def edges(triangles):
    """Unique edges (E, 2), ascending vertex pairs, and the edge of each triangle's side, (T, 3).

    Side k of a triangle runs from its corner k to its corner k + 1.
    """
    after = np.roll(triangles, -1, axis=1)
    low, high = np.minimum(triangles, after).astype(np.int64), np.maximum(triangles, after)
    # One number for each pair sorts much faster than pairs do, in the same order.
    size = int(high.max(initial=0)) + 1
    pair, index = np.unique(low * size + high, return_inverse=True)
    return np.stack(np.divmod(pair, size), axis=1), index.reshape(-1, 3)


def triangles_at_edges(triangles):
    """How many triangles meet at each edge, (E,): 1 = boundary, 2 = ordinary, 3 and more = junction."""
    return np.bincount(edges(triangles)[1].ravel())


def rim(triangles):
    """The vertices at edges with one triangle, ascending, (R,)."""
    unique, index = edges(triangles)
    return np.unique(unique[np.bincount(index.ravel()) == 1])


def features(vertices, triangles):
    """True for each edge that is a crease, a boundary or a junction, (E,)."""
    index = edges(triangles)[1].ravel()
    feature = np.bincount(index) != 2
    order = np.argsort(index, kind="stable")
    order = order[~feature[index[order]]].reshape(-1, 2)
    one, other = shape(vertices[triangles])[0][order.T // 3]
    feature[index[order[:, 0]]] = (one * other).sum(axis=1) < np.cos(np.radians(FEATURE_ANGLE))
    return feature


def unknowns(triangles):
    """Number of RWG functions: an edge shared by n triangles carries n - 1."""
    return int((triangles_at_edges(triangles) - 1).sum())


def is_watertight(triangles):
    """True if every edge has exactly two triangles, which run through it in opposite directions."""
    index = edges(triangles)[1].ravel()
    forward = (triangles < np.roll(triangles, -1, axis=1)).ravel()
    total = np.bincount(index)
    return bool((total == 2).all() and (np.bincount(index, weights=forward) == 1).all())


def components(triangles):
    """Number of connected pieces, and the piece of each triangle, (T,)."""
    first, second = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    size = triangles.max() + 1
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(size, size))
    label = connected_components(graph, directed=False)[1]
    pieces, piece = np.unique(label[triangles[:, 0]], return_inverse=True)
    return len(pieces), piece


def edge_pieces(triangles):
    """Number of pieces that hang together by edges, and the piece of each triangle, (T,)."""
    index = edges(triangles)[1]
    size = len(triangles)
    # Triangles and edges are the two kinds of nodes.
    ends = np.repeat(np.arange(size), 3), size + index.ravel()
    graph = coo_array((np.ones(3 * size), ends), shape=(size + index.max() + 1,) * 2)
    pieces, label = connected_components(graph, directed=False)
    return pieces, label[:size]


def place(point):
    """A point (3,) in metres as text for a message."""
    return f"({', '.join(f'{x:.4g}' for x in np.asarray(point, float) + 0.0)}) m"


def orient(vertices, triangles, name):
    """Triangles turned so that neighbours agree and closed surfaces point outward; and how many were turned.

    Orientation passes through ordinary edges, not through junctions. Open surfaces keep the side that most of
    their triangles had. Raises OneSided (naming `name`) for a one-sided surface: RWG functions could live on it, but
    a target that should be one is always a mistake, and no side of it could be called its front.
    """
    index = edges(triangles)[1]
    count = np.bincount(index.ravel())
    forward = triangles < np.roll(triangles, -1, axis=1)
    order = np.argsort(index.ravel(), kind="stable")
    order = order[count[index.ravel()[order]] == 2].reshape(-1, 2)
    face = order // 3
    opposed = forward.ravel()[order[:, 0]] == forward.ravel()[order[:, 1]]  # they disagree across this edge
    size = len(triangles)
    # Each triangle is two nodes, as it is and turned; neighbours' nodes that agree are joined.
    one, other = face.T
    first = np.concatenate([one, one + size])
    second = np.concatenate([other + size * opposed, other + size * ~opposed])
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(2 * size, 2 * size))
    side = connected_components(graph, directed=False)[1].reshape(2, size)
    wrong = side[0] == side[1]
    if wrong.any():
        point = vertices[triangles[wrong.argmax()]].mean(axis=0)
        raise OneSided(
            point,
            f"{name} has a one-sided surface (like a Moebius strip or a doubled face) near {place(point)}; "
            "it must have two sides.",
        )
    graph = coo_array((np.ones(len(one)), (one, other)), shape=(size, size))
    pieces, piece = connected_components(graph, directed=False)
    start = np.unique(piece, return_index=True)[1]
    turned = side[1] == side[0, start][piece]
    inner = np.bincount(piece, weights=(count[index] == 2).all(axis=1) == 0, minlength=pieces) == 0
    sign = np.where(turned, -1, 1)
    volume = np.bincount(piece, weights=sign * tetrahedra(vertices, triangles), minlength=pieces)
    many = np.bincount(piece, weights=sign, minlength=pieces)
    turned ^= np.where(inner, volume < 0, many < 0)[piece]
    return np.where(turned[:, None], triangles[:, ::-1], triangles), int(turned.sum())


def tetrahedra(vertices, triangles):
    """Signed volume in m^3 between each triangle and the origin, (T,); over a closed mesh they add up to its volume."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return (a * np.cross(b, c)).sum(axis=1) / 6


def areas(vertices, triangles):
    """Area of each triangle in m^2, (T,)."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def shape(corners):
    """Unit normal (T, 3), smallest height (T,) and smallest angle in degrees (T,) of triangles (T, 3, 3)."""
    ahead = np.roll(corners, -1, axis=1) - corners
    cross = np.cross(ahead[:, 0], -ahead[:, 2])
    double_area = np.linalg.norm(cross, axis=1)
    side = np.linalg.norm(ahead, axis=2)
    tiny = np.finfo(float).tiny
    normal = cross / np.maximum(double_area, tiny)[:, None]
    return normal, double_area / side.max(axis=1), angles(corners).min(axis=1)


def angles(corners):
    """Angles in degrees at the corners of triangles (T, 3, 3), (T, 3)."""
    ahead = np.roll(corners, -1, axis=1) - corners
    double_area = np.linalg.norm(np.cross(ahead[:, 0], -ahead[:, 2]), axis=1)
    back = -np.roll(ahead, 1, axis=1)
    return np.degrees(np.arctan2(double_area[:, None], (ahead * back).sum(axis=2)))


def edge_lengths(vertices, triangles):
    """Length of each edge in metres, (E,)."""
    start, stop = vertices[edges(triangles)[0]].transpose(1, 0, 2)
    return np.linalg.norm(stop - start, axis=1)


def compact(vertices, triangles):
    """The same mesh without the vertices that no triangle uses."""
    used, index = np.unique(triangles, return_inverse=True)
    return vertices[used], index.reshape(-1, 3).astype(np.int32)
