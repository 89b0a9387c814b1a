"""From a CAD file to a sound triangle mesh in metres. Every repair is counted."""

from pathlib import Path

import numpy as np
import pymeshlab

from common.errors import InputError
from mesh import topology

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}  # metres
CLOSE = 1e-6  # vertices nearer than this fraction of the target's diagonal are one


def read_cad(path):
    """Vertices (V, 3) float64 and triangles (T, 3) as they stand in an STL, OBJ, PLY or OFF file.

    Raises InputError for a file that holds no usable triangles.
    """
    path = Path(path)
    _check_stl_length(path)
    meshes = pymeshlab.MeshSet()
    try:
        meshes.load_new_mesh(str(path))
        mesh = meshes.current_mesh()
        vertices, triangles = mesh.vertex_matrix(), mesh.face_matrix()
    except pymeshlab.PyMeshLabException as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path} cannot be read as a {path.suffix[1:].upper()} mesh: {reason}") from None
    if len(triangles) == 0:
        raise InputError(f"{path} holds no triangles; a surface mesh is needed.")
    bad = ~np.isfinite(vertices).all(axis=1)
    if bad.any():
        raise InputError(f"{path}: {bad.sum()} of {len(vertices)} vertices are not finite numbers (NaN or infinite).")
    if topology.areas(vertices, triangles).sum() == 0:
        raise InputError(f"{path}: its {len(triangles)} triangles have no area.")
    return vertices, triangles


def in_metres(vertices, target):
    """Vertices scaled by the target's `unit` and turned by its `rotate` (degrees about x, then y, then z)."""
    vertices = vertices * UNITS[target.get("unit", "m")]
    for axis, angle in enumerate(np.radians(target.get("rotate", [0, 0, 0]))):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[[j, j, k, k], [j, k, j, k]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
        vertices = vertices @ turn.T
    return vertices


def repair(vertices, triangles, name):
    """Merge, drop and orient. Returns vertices, triangles and how many of each repair were made."""
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, np.asarray(triangles, np.int32)))
    counts = {}

    def step(key, before, run):
        sizes = len(vertices_now()), len(faces_now())
        run()
        counts[key] = int(sizes[before] - (len(vertices_now()), len(faces_now()))[before])

    def vertices_now():
        return meshes.current_mesh().vertex_matrix()

    def faces_now():
        return meshes.current_mesh().face_matrix()

    close = pymeshlab.PureValue(CLOSE * diagonal)
    step("merged_vertices", 0, lambda: meshes.meshing_merge_close_vertices(threshold=close))
    step("degenerate_triangles", 1, meshes.meshing_remove_null_faces)
    step("duplicate_triangles", 1, meshes.meshing_remove_duplicate_faces)
    step("unused_vertices", 0, meshes.meshing_remove_unreferenced_vertices)
    vertices, triangles = vertices_now(), faces_now()
    if len(triangles) == 0:
        raise InputError(f"{name}: no triangle is left after dropping those without area.")
    triangles, counts["turned_triangles"] = topology.orient(vertices, triangles, name)
    return vertices, triangles, counts


def _check_stl_length(path):
    """A binary STL that is cut short would otherwise be read up to where it ends, or as rubbish."""
    if path.suffix.lower() != ".stl":
        return
    with open(path, "rb") as file:
        head = file.read(84)
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path} is empty.")
    if head.lstrip()[:5].lower() == b"solid" and b"facet" in path.read_bytes()[:4096]:
        return
    expected = 84 + 50 * int.from_bytes(head[80:84], "little") if len(head) == 84 else None
    if size != expected:
        raise InputError(
            f"{path} is not an STL file: it has {size} bytes"
            + (f", its header announces {expected}; it may have been cut short." if expected else ".")
        )
