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
PART, NAMED = "property uchar part\n", "comment part "  # of each face, and its name: the first line's is number 0
WITH_PART = np.dtype([*FACE.descr, ("part", "u1")])


def write_ply(path, vertices, triangles, part=None, names=()):
    """Write vertices (V, 3) in metres and triangles (T, 3); with `names` of parts also the number of each one's."""
    faces = np.empty(len(triangles), dtype=FACE if part is None else WITH_PART)
    faces["corners"] = 3
    faces["vertices"] = triangles
    header = HEADER.format(vertices=len(vertices), triangles=len(triangles))
    if part is not None:
        faces["part"] = part
        lines = "".join(f"{NAMED}{name}\n" for name in names)
        header = header.replace("element vertex", f"{lines}element vertex").replace("end_header", f"{PART}end_header")
    Path(path).write_bytes(header.encode() + np.asarray(vertices, "<f8").tobytes() + faces.tobytes())


def read_ply(path):
    """Read a mesh that `write_ply` wrote: vertices (V, 3) float64 in metres, triangles (T, 3) int32."""
    vertices, faces, _ = _read(path)
    return vertices, faces["vertices"].copy()


def read_parts(path):
    """Read the part of each triangle of such a mesh, (T,), and the names of the parts; None and [] without any."""
    _, faces, header = _read(path)
    names = [line.removeprefix(NAMED) for line in header.splitlines() if line.startswith(NAMED)]
    return (faces["part"].astype(int), names) if names else (None, [])


def _read(path):
    data = Path(path).read_bytes()
    header, _, body = data.partition(b"end_header\n")
    header = header.decode("latin-1")
    face = WITH_PART if header.endswith(PART) else FACE
    counts = [int(line.split()[2]) for line in header.splitlines() if line.startswith("element")]
    if len(counts) != 2 or len(body) != counts[0] * 24 + counts[1] * face.itemsize:
        raise InputError(f"{path} is not a mesh of this workflow (binary PLY, float64): delete it and rerun.")
    vertices = np.frombuffer(body, "<f8", counts[0] * 3).reshape(-1, 3)
    return vertices.copy(), np.frombuffer(body, face, counts[1], offset=vertices.nbytes), header
