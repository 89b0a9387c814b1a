"""Make a sound surface of a CAD file's triangles. Every repair is counted; others than these are refused."""

import numpy as np
import pymeshlab

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.distance import loaded
from isarflow.mesh.repair.arrange import arrange
from isarflow.mesh.repair.boxes import check_hubs
from isarflow.mesh.repair.contact import land
from isarflow.mesh.repair.decimate import thin
from isarflow.mesh.repair.details import close_slits, without_details
from isarflow.mesh.repair.joins import close_gaps, join_exactly, left_open

CLOSE = 1e-6  # vertices nearer than this fraction of the target's diagonal are one
WELD = 1 / 40  # wanted edges: rims that are nearer are joined; sheets 1/200 wavelength apart are two
TOUCH = 1 / 4000  # wanted edges: surfaces no farther apart lie on each other; a text file's rounding is smaller


def repair(vertices, triangles, edge, name, passed=None):
    """Merge, weld, close, thin, orient and unite a surface for meshes of `edge` metres.

    passed: None for metal, or a function of vertices and triangles (T, 3) that is True for those that waves pass, (T,).
    Returns vertices, triangles, the number of each repair, and a mapping of `tolerance` (metres within which rims were
    joined), `joined_by` (metres, the widest gap that was), `thinned_by` (metres between the CAD surface and the thinned
    one), `thinned_area` in m^2 and `thinned_volume` in m^3 (its minus the thinned one's), `warnings` about openings.
    """
    vertices, triangles, counts = _clean(vertices, triangles, name)
    check_hubs(vertices, triangles, name)
    tolerance, close = WELD * edge, CLOSE * np.linalg.norm(np.ptp(vertices, axis=0))
    vertices, triangles, tied = join_exactly(vertices, triangles, tolerance, close, name)
    vertices, counts["landed_vertices"] = land(vertices, triangles, tolerance, close, name)
    vertices, triangles, joined, joined_by = close_gaps(vertices, triangles, edge, tolerance, close, name)
    counts |= joined | {"split_t_junctions": joined["split_t_junctions"] + tied}
    vertices, triangles, counts["dropped_details"] = without_details(vertices, triangles, edge, name)
    triangles, counts["turned_triangles"] = topology.orient(vertices, triangles, name)
    whole = vertices, triangles
    vertices, triangles, thinned_by = thin(vertices, triangles, edge)
    counts["thinned_triangles"] = len(whole[1]) - len(triangles)
    limits = {"tolerance": tolerance, "joined_by": joined_by, "thinned_by": thinned_by}
    for kind, measure in (("area", topology.areas), ("volume", topology.tetrahedra)):
        limits[f"thinned_{kind}"] = float(measure(*whole).sum() - measure(vertices, triangles).sum())
    close = max(close, TOUCH * edge)
    vertices, triangles, counts["closed_slits"] = close_slits(vertices, triangles, tolerance, close, name)
    vertices, triangles, arranged = arrange(vertices, triangles, close, name, passed)
    if len(vertices) == 0:
        raise InputError(f"{name}: nothing is left of it: its triangles are too narrow to have two sides.")
    triangles, turned = topology.orient(vertices, triangles, name)
    counts["turned_triangles"] += turned
    limits["warnings"] = left_open(vertices, triangles, edge, tolerance, name)
    return vertices, triangles, counts | arranged, limits


def _clean(vertices, triangles, name):
    """Merge almost equal vertices; drop triangles without area or duplicate, and unused vertices."""
    # A triangle two of whose corners are one vertex, before or after merging, has no area.
    distinct = triangles[topology.have_three_corners(triangles)]
    place = topology.place(vertices[triangles[0, 0]])
    nothing = InputError(f"{name}: all of its {len(triangles)} triangles are without area, near {place}.")
    if len(distinct) == 0:
        raise nothing
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
            raise nothing
    kept = mesh.face_number() + counts["duplicate_triangles"]
    counts["degenerate_triangles"] = len(triangles) - kept  # the library drops some while it merges
    return mesh.vertex_matrix(), mesh.face_matrix(), counts
