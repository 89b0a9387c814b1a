"""Make surfaces that cross, touch or lie in each other one surface, connected by common edges."""

import igl
import numpy as np
from igl.copyleft import cgal
from scipy.spatial import cKDTree

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.progress import say
from isarflow.mesh.repair import contact

ROUNDS = 8  # rounding of the cuts may make surfaces cross again, by less each time
FINER = 0.1  # after a cut, contacts are closed within this fraction: the whole distance would move the cuts again


def arrange(vertices, triangles, close, name, passed=None):
    """Make a surface whose triangles meet at common edges and corners only; closed solids become their union.

    Surfaces within `close` metres touch; passed: see `surface.repair`. Returns vertices, triangles and the number of
    each repair.
    """
    whole, source = vertices, triangles
    piece, closed = topology.closed_pieces(triangles)
    solid = closed[piece]
    # A solid must not open; a sheet drawn twice encloses nothing and may become one.
    volume = np.bincount(piece, topology.tetrahedra(whole, source))
    thick = solid & (volume > close * np.bincount(piece, topology.areas(whole, source)))[piece]
    vertices, triangles, birth, overlapping = _cut(vertices, triangles, close, name)
    triangles, birth = _without_fins(vertices, triangles, birth, thick, 2 * close)
    try:
        triangles = topology.orient(vertices, triangles, name)[0]
    except InputError as fault:  # it had two sides before surfaces were joined in places
        slow = f"Surfaces part there so slowly: about {2 * close * 1000:.2g} mm away they are neither apart nor one."
        raise InputError(f"{fault} {slow} Separate them, or draw them as one.") from None
    say(f"drop what no wave reaches of {len(triangles)} triangles")
    shut = hidden(vertices, triangles, passed(vertices, triangles) if passed else None)
    rest, of_solid = triangles[~shut], solid[birth[~shut]]
    _, sides, at_edge = topology.edges(rest)
    torn = (at_edge[sides] == 1).any(axis=1) & thick[birth[~shut]]
    if torn.any():
        _refuse(topology.place(vertices[rest[torn][0]].mean(axis=0)), name)
    left = topology.edge_pieces(rest[of_solid])[0] if of_solid.any() else 0
    counts = {
        "connected_crossings": int((np.bincount(birth, minlength=len(source)) > 1).sum()),
        "overlapping_triangles": overlapping,
        "hidden_triangles": int(shut.sum()),
        "united_solids": len(np.unique(piece[solid])) - left,
    }
    if not any(counts.values()) and len(vertices) == len(whole):  # else edges too short for two corners went
        return vertices, source, counts
    return *topology.compact(vertices, rest), counts


def _cut(vertices, triangles, close, name):
    """Cut surfaces along each other until none cross: vertices, triangles, their birth, number of duplicates."""
    birth, overlapping, near, most, crossed = np.arange(len(triangles)), 0, close, np.inf, "an unknown place"
    for k in range(ROUNDS):
        before, flat = len(triangles), False
        say(f"cut surfaces along each other, round {k + 1}: {before} triangles")
        triangles, birth = contact.tie(vertices, triangles, birth, near, name)
        if k == 0:  # the rest between surfaces that part slowly is a wedge, not a contact
            vertices, triangles, birth, flat = contact.overlay(vertices, triangles, birth, close, name)
        pairs = crossings(vertices, triangles) if not flat else []
        if len(pairs):
            crossed = topology.place(vertices[triangles[pairs[:, 0].min()]].mean(axis=0))
            if len(pairs) > most:  # each cut makes more of them
                break
            most = len(pairs)
            cut = cgal.remesh_self_intersections(vertices, triangles.astype(np.int64), stitch_all=True)
            vertices, triangles, _, parent, _ = cut
            birth = birth[parent]
        elif not flat and len(triangles) == before:
            return vertices, triangles, birth, overlapping
        vertices, triangles, birth, twice = _tidy(vertices, triangles, birth, 2 * near)
        overlapping += twice
        near *= FINER if len(pairs) else 1
    _refuse(crossed, name)


def _without_fins(vertices, triangles, birth, thick, close):
    """Drop needles at most `close` metres wide that rounding left sticking out of `thick` solids, (S,): see `_cut`."""
    while True:
        at_rim = topology.rims(triangles)[1]
        width = topology.shape(vertices[triangles[at_rim]])[1]
        fins = at_rim[thick[birth[at_rim]] & (width <= close)]
        if len(fins) == 0:
            return triangles, birth
        triangles, birth = np.delete(triangles, fins, axis=0), np.delete(birth, fins)


def crossings(vertices, triangles):
    """Pairs (P, 2) of triangles that meet elsewhere than at common corners and edges; exact."""
    return cgal.remesh_self_intersections(vertices, triangles.astype(np.int64), detect_only=True)[2]


def first_crossing(vertices, triangles):
    """A point (3,) in metres near which triangles meet elsewhere than at common corners and edges; None if none do."""
    pairs = crossings(vertices, triangles)
    return vertices[triangles[pairs[:, 0].min()]].mean(axis=0) if len(pairs) else None


def _refuse(place, name):
    raise InputError(f"{name}: surfaces cross near {place} in a way that cannot be resolved. Unite or separate them.")


def _tidy(vertices, triangles, birth, close):
    """Merge vertices within `close` metres, keep triangles once; also the number of duplicates."""
    pairs = cKDTree(vertices).query_pairs(close, output_type="ndarray")
    target = np.arange(len(vertices))
    for low, high in pairs[np.lexsort(pairs.T[::-1])].tolist():  # a chain may be long: nothing moves farther
        if target[low] == low and target[high] == high:
            target[high] = low
    triangles = target[triangles].astype(np.int32)
    kept = topology.have_three_corners(triangles)
    triangles, birth = triangles[kept], birth[kept]
    once = topology.first_of_each(triangles)
    return *topology.compact(vertices, triangles[once]), birth[once], int((~once).sum())


def hidden(vertices, triangles, passed=None):
    """True for triangles of an arranged and oriented surface that no wave from outside reaches, (T,).

    passed: True for triangles that waves pass, (T,); None if they pass none.
    """
    triangles = triangles.astype(np.int64)
    shell = np.arange(len(triangles))
    while len(shell):  # a part with a rim encloses nothing
        patch = igl.extract_manifold_patches(triangles[shell])[1]
        at_rim = topology.rims(triangles[shell])[1]
        if len(at_rim) == 0:
            break
        shell = shell[~np.isin(patch, patch[at_rim])]
    shut = np.zeros(len(triangles), dtype=bool)
    if len(shell) == 0 or (len(np.unique(patch)) == 1 and len(shell) == len(triangles)):
        return shut
    # Without the parts that had a rim, patches grew together that may not agree on their sides.
    walls = topology.orient(vertices, triangles[shell], "the surface")[0].astype(np.int64)
    cells = cgal.extract_cells(vertices, walls)[1]
    doors = cells[passed[shell]] if passed is not None else cells[:0]
    outside = topology.groups(doors, cells.max() + 1)[1]  # cells that sheets alone part are one
    reached = (outside == outside[0])[cells]
    shut[shell] = ~reached.any(axis=1)
    skin = reached.sum(axis=1) == 1
    skin = np.where(reached[:, :1], walls, walls[:, ::-1])[skin]
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
