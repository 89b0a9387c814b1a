"""Meshes on disk: binary PLY, float64 metres, triangles. Numpy alone, so that every stage can read them."""

from pathlib import Path

import numpy as np

from isarflow.core.errors import InputError

HEADER = (
    "ply\nformat binary_little_endian 1.0\ncomment isarflow mesh, metres\n"
    "element vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n"
    "element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n"
)
FACE = np.dtype([("corners", "u1"), ("vertices", "<i4", 3)])


def write_ply(path, vertices, triangles):
    """Write vertices (V, 3) in metres and triangles (T, 3) of vertex indices."""
    faces = np.empty(len(triangles), dtype=FACE)
    faces["corners"] = 3
    faces["vertices"] = triangles
    header = HEADER.format(vertices=len(vertices), triangles=len(triangles))
    Path(path).write_bytes(header.encode() + np.asarray(vertices, "<f8").tobytes() + faces.tobytes())


def read_ply(path):
    """Read a mesh that `write_ply` wrote: vertices (V, 3) float64 in metres, triangles (T, 3) int32."""
    data = Path(path).read_bytes()
    header, _, body = data.partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in header.decode("latin-1").splitlines() if line.startswith("element")]
    if len(counts) != 2 or len(body) != counts[0] * 24 + counts[1] * FACE.itemsize:
        raise InputError(f"{path} is not a mesh of this workflow (binary PLY, float64): delete it and rerun.")
    vertices = np.frombuffer(body, "<f8", counts[0] * 3).reshape(-1, 3)
    faces = np.frombuffer(body, FACE, counts[1], offset=vertices.nbytes)
    return vertices.copy(), faces["vertices"].copy()
