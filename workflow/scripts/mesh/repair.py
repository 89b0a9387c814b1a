"""From a CAD file's triangles to a sound surface. Every repair is counted; what cannot be repaired is refused."""

import itertools

import numpy as np
import pymeshlab
from scipy.spatial import cKDTree

from core.errors import InputError
from mesh import topology
from mesh.arrange import arrange
from mesh.boxes import check_hubs
from mesh.contact import APART, land
from mesh.meshlab import loaded
from mesh.thin import thin

CLOSE = 1e-6  # vertices nearer than this fraction of the target's diagonal are one
WELD = 1 / 40  # wanted edges: rims that miss each other by less are joined; sheets 1/200 wavelength apart are two
TOUCH = 1 / 4000  # wanted edges: surfaces no farther apart lie on each other; a text file's rounding is less
HOLE = 1.0  # wanted edges: openings no wider than this are closed


def repair(vertices, triangles, edge, name):
    """Merge, weld, close, thin, orient and unite a surface for meshes of `edge` metres.

    Returns vertices, triangles, a mapping of how many of each repair were made, and a mapping of `tolerance` (metres
    within which rims were joined), `thinned_by` (largest distance in metres between the CAD surface and what stands for
    it thinned; 0 if it was not thinned), `thinned_area` in m^2 and `thinned_volume` in m^3 (what the CAD surface has
    more than that). Raises InputError, naming `name`.
    """
    vertices, triangles, counts = _clean(vertices, triangles, name)
    check_hubs(vertices, triangles, name)
    tolerance, close = WELD * edge, CLOSE * np.linalg.norm(np.ptp(vertices, axis=0))
    vertices, counts["landed_vertices"] = land(vertices, triangles, tolerance, close, name)
    vertices, triangles, counts["welded_vertices"] = _weld(vertices, triangles, tolerance)
    triangles, counts["split_t_junctions"] = _split_t_junctions(vertices, triangles, tolerance)
    vertices, triangles, counts["closed_holes"] = _close_holes(vertices, triangles, HOLE * edge)
    triangles, counts["turned_triangles"] = topology.orient(vertices, triangles, name)
    whole = vertices, triangles
    vertices, triangles, thinned_by = thin(vertices, triangles, edge)
    counts["thinned_triangles"] = len(whole[1]) - len(triangles)
    area, volume = (
        float(measure(*whole).sum() - measure(vertices, triangles).sum())
        for measure in (topology.areas, topology.tetrahedra)
    )
    vertices, triangles, arranged = arrange(vertices, triangles, max(close, TOUCH * edge), name)
    if len(vertices) == 0:
        raise InputError(f"{name}: nothing is left of it: its triangles are too narrow to have two sides.")
    triangles, turned = topology.orient(vertices, triangles, name)
    counts["turned_triangles"] += turned
    counts |= arranged
    thinned = {"thinned_by": thinned_by, "thinned_area": area, "thinned_volume": volume}
    return vertices, triangles, counts, {"tolerance": tolerance} | thinned


def _clean(vertices, triangles, name):
    """Vertices all but equal merged; triangles without area or there twice dropped, unused vertices too."""
    # Corners that are one vertex, already or once close vertices are one, make a triangle without area.
    distinct = triangles[topology.have_three_corners(triangles)]
    if len(distinct) == 0:
        raise _without_area(vertices, triangles, name)
    meshes = loaded(vertices, distinct)
    mesh = meshes.current_mesh()
    close = pymeshlab.PureValue(CLOSE * np.linalg.norm(np.ptp(vertices[topology.used(triangles)], axis=0)))
    steps = {
        "merged_vertices": lambda: meshes.meshing_merge_close_vertices(threshold=close),
        "degenerate_triangles": meshes.meshing_remove_null_faces,
        "duplicate_triangles": meshes.meshing_remove_duplicate_faces,
        "unused_vertices": meshes.meshing_remove_unreferenced_vertices,
    }
    counts = {}
    for key, step in steps.items():
        count = mesh.vertex_number if key.endswith("vertices") else mesh.face_number
        before = count()
        step()
        counts[key] = before - count()
        if count() == 0:
            raise _without_area(vertices, triangles, name)
    kept = mesh.face_number() + counts["duplicate_triangles"]
    counts["degenerate_triangles"] = len(triangles) - kept  # the library drops some while it merges
    return mesh.vertex_matrix(), mesh.face_matrix(), counts


def _without_area(vertices, triangles, name):
    return InputError(
        f"{name}: all of its {len(triangles)} triangles are without area, near "
        f"{topology.place(vertices[triangles[0, 0]])}."
    )


def _weld(vertices, triangles, tolerance):
    """Vertices on rims that miss each other by at most `tolerance` metres made one. Also how many vanish."""
    border = np.unique(topology.rims(triangles)[0])
    if len(border) == 0:
        return vertices, triangles, 0
    pairs = border[cKDTree(vertices[border]).query_pairs(tolerance, output_type="ndarray")]
    apart = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    # Fine rims would else shrink to points.
    pairs = pairs[apart <= APART * topology.shortest_edges(vertices, triangles)[pairs].min(axis=1)]
    label = topology.groups(pairs, len(vertices))[1]
    first = np.unique(label, return_index=True)[1]
    joined = first[label][triangles]
    joined = joined[topology.have_three_corners(joined)]
    if not topology.first_of_each(joined).all():  # the rims of two sheets, one upon the other: not a crack
        return vertices, triangles, 0
    return *topology.compact(vertices, joined), len(vertices) - len(first)


def _split_t_junctions(vertices, triangles, tolerance):
    """Rim edges cut at the rim vertices of other triangles that lie within `tolerance` metres of them.

    Also how many vertices were tied in. The vertices stay; the cut edge bends to them.
    """
    tied = 0
    for _ in range(8):  # a triangle is cut along one of its sides at a time
        rims, owner, side = topology.rims(triangles)
        if len(rims) == 0:
            break
        border = np.unique(rims)
        start, stop = vertices[rims].transpose(1, 0, 2)
        length = np.linalg.norm(stop - start, axis=1)
        middle, reach = (start + stop) / 2, length / 2 + tolerance
        near = cKDTree(vertices[border]).query_ball_point(middle, reach, return_sorted=True)
        gone, pieces = [], []
        for k, candidates in enumerate(near):
            if owner[k] in gone[-2:]:
                continue
            candidates = np.setdiff1d(border[candidates], triangles[owner[k]])
            along = (stop[k] - start[k]) / length[k]
            reach = (vertices[candidates] - start[k]) @ along
            off = np.linalg.norm(vertices[candidates] - start[k] - reach[:, None] * along, axis=1)
            inside = (off <= tolerance) & (off < APART * reach) & (off < APART * (length[k] - reach))
            if not inside.any():
                continue
            a, b, c = np.roll(triangles[owner[k]], -side[k])
            chain = candidates[inside][np.argsort(reach[inside])]
            chain = [a, *(chain if a == rims[k, 0] else chain[::-1]), b]
            pieces += [(*pair, c) for pair in itertools.pairwise(chain)]
            gone.append(owner[k])
            tied += len(chain) - 2
        if not gone:
            break
        triangles = np.concatenate([np.delete(triangles, gone, axis=0), np.array(pieces, dtype=triangles.dtype)])
        triangles = triangles[topology.first_of_each(triangles)]
    return triangles, tied


def _close_holes(vertices, triangles, widest):
    """Openings at most `widest` metres wide closed, in pieces that are much larger; and how many."""
    rims = topology.rims(triangles)[0]
    if len(rims) == 0:
        return vertices, triangles, 0
    piece = topology.components(triangles)[1]
    piece_of = np.zeros(len(vertices), dtype=int)
    piece_of[triangles] = piece[:, None]
    border, index = np.unique(rims, return_inverse=True)
    index = index.reshape(-1, 2)
    loops, label = topology.groups(index, len(border))
    simple = np.ones(loops, dtype=bool)  # each of its vertices has two rims
    simple[label[np.bincount(index.ravel()) != 2]] = False
    centres, lids, closed = [], [], 0
    for loop in np.flatnonzero(simple):
        members = border[label == loop]
        width = np.linalg.norm(np.ptp(vertices[members], axis=0))
        if width > widest:
            continue
        around = vertices[np.unique(triangles[piece == piece_of[members[0]]])]
        if np.linalg.norm(np.ptp(around, axis=0)) < 3 * width:
            continue  # the rim of a small sheet, not a hole in a large one
        edges = rims[label[index[:, 0]] == loop]
        if len(edges) == 3:
            lids.append(members)
        else:
            lids += [(*ends, len(vertices) + len(centres)) for ends in edges]
            centres.append(vertices[members].mean(axis=0))
        closed += 1
    if closed == 0:
        return vertices, triangles, 0
    lids = np.array(lids, dtype=triangles.dtype)
    return np.concatenate([vertices, np.reshape(centres, (-1, 3))]), np.concatenate([triangles, lids]), closed
