"""Surfaces that cross, touch or lie in each other become one that hangs together by common edges."""

import igl
import numpy as np
from igl.copyleft import cgal
from scipy.spatial import cKDTree

from core.errors import InputError
from mesh import contact, topology

ROUNDS = 8  # rounding the cuts may make surfaces cross anew, by less each time
FINER = 0.1  # of the distance that is closed before a cut: after it; closing it anew would move what was cut anew


def arrange(vertices, triangles, close, name):
    """A surface whose triangles meet at common edges and corners only, none of them there twice, none shut in.

    What is within `close` metres touches. Closed solids become their union. Returns vertices, triangles and how many of
    each repair were made: `connected_crossings` (triangles that were cut to share edges), `overlapping_triangles`
    (pieces that were there twice), `hidden_triangles` (pieces that no wave from outside reaches) and `united_solids`.
    Raises InputError, naming `name`.
    """
    whole, source, birth = vertices, triangles, np.arange(len(triangles))
    count, piece = topology.edge_pieces(triangles)
    unique, index = topology.edges(triangles)
    other = (np.bincount(index.ravel(), minlength=len(unique))[index] != 2).any(axis=1)
    solid = (np.bincount(piece, weights=other, minlength=count) == 0)[piece]
    solids = len(np.unique(piece[solid]))
    overlapping, near, most, crossed = 0, close, np.inf, "an unknown place"
    for k in range(ROUNDS):
        before, flat = len(triangles), False
        triangles, birth = contact.tie(vertices, triangles, birth, near, name)
        if k == 0:  # what is left between surfaces that part slowly is a wedge, not a contact
            vertices, triangles, birth, flat = contact.overlay(vertices, triangles, birth, close, name)
        pairs = crossings(vertices, triangles) if not flat else []
        if len(pairs):
            crossed = topology.place(_point(vertices, triangles, pairs))
            if len(pairs) > most:  # each cut makes more of them
                _refuse(crossed, name)
            most = len(pairs)
            vertices, triangles, _, parent, _ = cgal.remesh_self_intersections(
                vertices, triangles.astype(np.int64), stitch_all=True
            )
            birth = birth[parent]
        elif not flat and len(triangles) == before:
            break
        vertices, triangles, birth, twice = _tidy(vertices, triangles, birth, 2 * near)
        overlapping += twice
        near *= FINER if len(pairs) else 1
    else:
        _refuse(crossed, name)
    try:
        triangles = topology.orient(vertices, triangles, name)[0]
    except topology.OneSided as fault:  # it had two before surfaces were joined here and there
        raise InputError(
            f"{name}: near {topology.place(fault.point)} surfaces part so slowly that, about {2 * close * 1000:.2g} mm "
            "from each other, they can be told neither apart nor together. Separate them, or draw them as one."
        ) from None
    shut = hidden(vertices, triangles)
    cut = np.bincount(birth, minlength=len(source)) > 1
    rest = triangles[~shut]
    # A solid must not open; a sheet drawn twice encloses nothing and may become one.
    thick = np.bincount(piece, topology.tetrahedra(whole, source)) > close * np.bincount(
        piece, topology.areas(whole, source)
    )
    side = topology.edges(rest)[1]
    torn = (np.bincount(side.ravel())[side] == 1).any(axis=1) & (solid & thick[piece])[birth[~shut]]
    if torn.any():
        _refuse(topology.place(vertices[rest[torn][0]].mean(axis=0)), name)
    left = topology.edge_pieces(rest[solid[birth[~shut]]])[0] if solid[birth[~shut]].any() else 0
    counts = {
        "connected_crossings": int(cut.sum()),
        "overlapping_triangles": overlapping,
        "hidden_triangles": int(shut.sum()),
        "united_solids": solids - left,
    }
    if not any(counts.values()):
        return vertices, source, counts
    return *topology.compact(vertices, rest), counts


def crossings(vertices, triangles):
    """Pairs (P, 2) of triangles that meet elsewhere than at common corners and edges; exact."""
    return cgal.remesh_self_intersections(vertices, triangles.astype(np.int64), detect_only=True)[2]


def first_crossing(vertices, triangles):
    """A point (3,) in metres near which triangles meet elsewhere than at common corners and edges; None if none do."""
    pairs = crossings(vertices, triangles)
    return _point(vertices, triangles, pairs) if len(pairs) else None


def _point(vertices, triangles, pairs):
    return vertices[triangles[pairs[:, 0].min()]].mean(axis=0)


def _refuse(place, name):
    raise InputError(
        f"{name}: surfaces cross near {place} in a way that cannot be resolved. Unite or separate the parts in the CAD "
        "program."
    )


def _tidy(vertices, triangles, birth, close):
    """Vertices within `close` metres made one, triangles kept once; and how many were there twice."""
    pairs = cKDTree(vertices).query_pairs(close, output_type="ndarray")
    first = np.arange(len(vertices))
    for one, other in pairs[np.lexsort(pairs.T[::-1])].tolist():  # a chain of them may lead far: nothing moves further
        if first[one] == one and first[other] == other:
            first[other] = one
    triangles = first[triangles].astype(np.int32)
    kept = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles, birth = triangles[kept], birth[kept]
    once = np.sort(np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1])
    twice = len(triangles) - len(once)
    return *topology.compact(vertices, triangles[once]), birth[once], twice


def hidden(vertices, triangles):
    """True for triangles that are shut in on both sides, so that no wave from outside reaches them, (T,).

    The surface must meet itself at common edges only, and its neighbours agree on their sides.
    """
    triangles = triangles.astype(np.int64)
    shell = np.arange(len(triangles))
    while len(shell):  # a part with a rim shuts nothing in
        patch = igl.extract_manifold_patches(triangles[shell])[1]
        unique, index = topology.edges(triangles[shell])
        rim = (np.bincount(index.ravel(), minlength=len(unique)) == 1)[index].any(axis=1)
        if not rim.any():
            break
        shell = shell[~np.isin(patch, patch[rim])]
    shut = np.zeros(len(triangles), dtype=bool)
    if len(shell) == 0 or (len(np.unique(patch)) == 1 and len(shell) == len(triangles)):
        return shut
    # Without the parts that had a rim, patches grew together that may not agree on their sides.
    walls = topology.orient(vertices, triangles[shell], "the surface")[0].astype(np.int64)
    cells = cgal.extract_cells(vertices, walls)[1]
    shut[shell] = (cells != 0).all(axis=1)
    skin = (cells == 0).sum(axis=1) == 1
    skin = np.where((cells[:, 0] == 0)[:, None], walls, walls[:, ::-1])[skin]
    open_part = np.setdiff1d(np.arange(len(triangles)), shell)
    if len(open_part) == 0 or len(skin) == 0:
        return shut
    patch = igl.extract_manifold_patches(triangles)[1]
    area = topology.areas(vertices, triangles)
    order = open_part[np.lexsort((-area[open_part], patch[open_part]))]
    names, largest = np.unique(patch[order], return_index=True)
    inside = igl.winding_number(vertices, skin, vertices[triangles[order[largest]]].mean(axis=1)) > 0.5
    shut[open_part] = np.isin(patch[open_part], names[inside])
    return shut
