"""From a CAD file to a sound triangle mesh in metres. Every repair is counted."""

import contextlib
import re
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
        with contextlib.chdir("."):  # some readers change the working folder and leave it so
            meshes.load_new_mesh(str(path.resolve()))
        mesh = meshes.current_mesh()
        vertices, triangles = mesh.vertex_matrix(), mesh.face_matrix()
    except pymeshlab.PyMeshLabException as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path} cannot be read as a {path.suffix[1:].upper()} mesh: {reason}") from None
    kind, announced = _announced(path)
    missing = announced - {"vertices": len(vertices), "triangles": len(triangles)}[kind]
    if missing > 0:
        raise InputError(
            f"{path}: {missing} of its {announced} {kind} are not finite numbers (NaN or infinite), or are not there."
        )
    if len(triangles) == 0:
        raise InputError(f"{path} holds no triangles; a surface mesh is needed.")
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
    close = pymeshlab.PureValue(CLOSE * diagonal)
    steps = {
        "merged_vertices": lambda: meshes.meshing_merge_close_vertices(threshold=close),
        "degenerate_triangles": meshes.meshing_remove_null_faces,
        "duplicate_triangles": meshes.meshing_remove_duplicate_faces,
        "unused_vertices": meshes.meshing_remove_unreferenced_vertices,
    }
    counts = {}
    for key, step in steps.items():
        mesh = meshes.current_mesh()
        count = mesh.vertex_number if key.endswith("vertices") else mesh.face_number
        before = count()
        step()
        counts[key] = before - count()
    vertices, triangles = mesh.vertex_matrix(), mesh.face_matrix()
    if len(triangles) == 0:
        raise InputError(f"{name}: no triangle is left after dropping those without area.")
    triangles, counts["turned_triangles"] = topology.orient(vertices, triangles, name)
    return vertices, triangles, counts


def _announced(path):
    """What a file says that it holds, ("vertices" or "triangles", number): the reader drops what is not finite."""
    data = path.read_bytes()
    form = path.suffix.lower()
    if form == ".stl":
        ascii_facets = len(re.findall(rb"^\s*facet\b", data, re.MULTILINE)) if _is_ascii_stl(data) else None
        return "triangles", int.from_bytes(data[80:84], "little") if ascii_facets is None else ascii_facets
    if form == ".obj":
        return "vertices", len(re.findall(rb"^\s*v\s", data, re.MULTILINE))
    pattern = rb"element\s+vertex\s+(\d+)" if form == ".ply" else rb"(?m)^(?:[A-Z]*OFF\s)?\s*(\d+)\s+\d+"
    found = re.search(pattern, data)
    return "vertices", int(found[1]) if found else 0


def _is_ascii_stl(data):
    return data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:4096]


def _check_stl_length(path):
    """A binary STL that is cut short would otherwise be read up to where it ends, or as rubbish."""
    if path.suffix.lower() != ".stl":
        return
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path} is empty.")
    with open(path, "rb") as file:
        head = file.read(4096)
    if _is_ascii_stl(head):
        return
    head = head[:84]
    expected = 84 + 50 * int.from_bytes(head[80:84], "little") if len(head) == 84 else None
    if size != expected:
        raise InputError(
            f"{path} is not an STL file: it has {size} bytes"
            + (f", its header announces {expected}; it may have been cut short." if expected else ".")
        )
