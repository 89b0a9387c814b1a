"""From a CAD file's triangles to a sound surface. Every repair is counted; what cannot be repaired is refused."""

import numpy as np
import pymeshlab

from core.errors import InputError
from mesh import topology
from mesh.arrange import arrange, crossings
from mesh.boxes import check_hubs
from mesh.contact import land
from mesh.details import without_details
from mesh.distance import distances
from mesh.joins import close_gaps, join_exactly, left_open
from mesh.meshlab import loaded
from mesh.progress import going
from mesh.slits import close_slits

CLOSE = 1e-6  # vertices nearer than this fraction of the target's diagonal are one
WELD = 1 / 40  # wanted edges: rims that miss each other by less are joined; sheets 1/200 wavelength apart are two
TOUCH = 1 / 4000  # wanted edges: surfaces no farther apart lie on each other; a text file's rounding is less
MANY = 20_000  # triangles; larger sources are thinned if they are much finer than needed
THINNER = 1 / 3, 1 / 5, 1 / 8  # wanted edges: what a larger source is thinned to, or else to less


def repair(vertices, triangles, edge, name):
    """Merge, weld, close, thin, orient and unite a surface for meshes of `edge` metres.

    Returns vertices, triangles, a mapping of how many of each repair were made, and a mapping of `tolerance` (metres
    within which rims were joined), `joined_by` (widest gap in metres that was closed between rims), `thinned_by`
    (largest distance in metres of the source's vertices from the surface that stands for it; 0 if the source was not
    thinned) and `warnings` (sentences about what is open). Raises InputError, naming `name`.
    """
    vertices, triangles, counts = _clean(vertices, triangles, name)
    check_hubs(vertices, triangles, name)
    tolerance, close = WELD * edge, CLOSE * np.linalg.norm(np.ptp(vertices, axis=0))
    vertices, triangles, tied = join_exactly(vertices, triangles, tolerance, close, name)
    vertices, counts["landed_vertices"] = land(vertices, triangles, tolerance, close, name)
    vertices, triangles, joined, joined_by = close_gaps(vertices, triangles, edge, tolerance, close, name)
    counts |= joined | {"split_t_junctions": joined["split_t_junctions"] + tied}
    vertices, triangles, counts["dropped_details"] = without_details(vertices, triangles, edge, name)
    whole = vertices, triangles
    vertices, triangles = _thinned(vertices, triangles, edge)
    counts["thinned_triangles"] = len(whole[1]) - len(triangles)
    thinned_by = float(distances(whole[0], vertices, triangles).max()) if counts["thinned_triangles"] else 0.0
    triangles, counts["turned_triangles"] = topology.orient(vertices, triangles, name)
    close = max(close, TOUCH * edge)
    vertices, triangles, counts["closed_slits"] = close_slits(vertices, triangles, tolerance, close, name)
    vertices, triangles, arranged = arrange(vertices, triangles, close, name)
    if len(vertices) == 0:
        raise InputError(f"{name}: nothing is left of it: its triangles are too narrow to have two sides.")
    triangles, turned = topology.orient(vertices, triangles, name)
    counts["turned_triangles"] += turned
    counts |= arranged
    warnings = left_open(vertices, triangles, edge, tolerance, name)
    limits = {"tolerance": tolerance, "joined_by": joined_by, "thinned_by": thinned_by, "warnings": warnings}
    return vertices, triangles, counts, limits


def thin(vertices, triangles, edge):
    """A surface with about as many triangles as edges of `edge` metres need, if it has far more; else as it is."""
    enough = int(topology.areas(vertices, triangles).sum() / (np.sqrt(3) / 4 * edge**2))
    if len(triangles) <= max(MANY, 2 * enough):
        return vertices, triangles
    going(f"thin {len(triangles)} triangles")
    meshes = loaded(vertices, triangles)
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=max(enough, MANY // 2),
        preserveboundary=True,
        preservenormal=True,
        preservetopology=True,
        planarquadric=True,
        autoclean=False,
    )
    mesh = meshes.current_mesh()
    return topology.compact(mesh.vertex_matrix(), mesh.face_matrix())


def _thinned(vertices, triangles, edge):
    """The surface thinned as far as no solid's walls come to cross, which would open it where solids are united."""
    for share in THINNER:
        made = thin(vertices, triangles, share * edge)
        crossed = _crosses_itself(*made) if len(made[1]) < len(triangles) else 0
        if not crossed or crossed <= _crosses_itself(vertices, triangles):
            return made
    return vertices, triangles


def _crosses_itself(vertices, triangles):
    """How many pairs of triangles of one piece cross; those of solids that overlap do not count."""
    pairs, piece = crossings(vertices, triangles), topology.components(triangles)[1]
    return int((piece[pairs[:, 0]] == piece[pairs[:, 1]]).sum()) if len(pairs) else 0


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
