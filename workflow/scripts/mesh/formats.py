"""STL, OBJ and OFF files as they stand: vertices, and faces with any number of corners. PLY files are in `mesh.ply`.

Every reader takes a file's bytes and gives `Surface`; none drops, merges or mends anything but the corners that STL
files repeat. Readers raise InputError without the file's name, which `mesh.read` adds.
"""

import io
import re
from array import array
from typing import NamedTuple

import numpy as np

from core.errors import InputError

STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
# What is saved under the name of an STL file, by how it begins.
OTHERS = (
    (b"<!doctype", "a web page"),
    (b"<html", "a web page"),
    (b"version https://git-lfs", "a pointer of Git LFS; fetch the file itself (git lfs pull)"),
    (b"pk\x03\x04", "a zip archive; unpack it"),
    (b"v ", "an OBJ file; name it so"),
    (b"ply", "a PLY file; name it so"),
    (b"off", "an OFF file; name it so"),
    (b"iso-10303", "a STEP file; name it so"),
)
BOM = b"\xef\xbb\xbf"  # some editors put it in front of text


class Surface(NamedTuple):
    """What a file holds."""

    vertices: np.ndarray  # (V, 3) float64, in the file's unit
    sizes: np.ndarray  # (F,) corners of each face
    corners: np.ndarray  # (sum of sizes,) vertices of the faces, one after the other
    lines: object = None  # (V,) the line of each vertex, in text files that have one


def _lines(data):
    """Numbers, from 1, and contents of a text's lines, whatever ends them."""
    data = data.removeprefix(BOM).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return enumerate(io.BytesIO(data), 1)


def _quoted(number, line):
    return f"line {number}: {line.decode('latin-1').strip()[:80]!r}"


def _point(words, number, line):
    """The first three of these words as numbers."""
    try:
        x, y, z = map(float, words[:3])
    except ValueError:
        raise InputError(f"{_quoted(number, line)} does not give three numbers x, y, z.") from None
    return x, y, z


def _surface(points, sizes, corners, lines=None):
    return Surface(
        np.frombuffer(points, float).reshape(-1, 3),
        np.array(sizes, dtype=np.int64),
        np.array(corners, dtype=np.int64),
        None if lines is None else np.array(lines),
    )


def read_stl(data):
    """A binary STL, whatever its header says, or a text STL of one or more solids."""
    announced = 84 + 50 * int.from_bytes(data[80:84], "little") if len(data) >= 84 else None
    text = data.removeprefix(BOM).lstrip()[:5].lower() == b"solid"
    if len(data) == announced:
        points = np.frombuffer(data, STL_RECORD, offset=84)["corners"].astype(float).reshape(-1, 3)
    elif text and (b"facet" in data[:4096].lower() or b"\0" not in data[:4096]):
        points = _stl_text(data)
    else:
        other = next((name for start, name in OTHERS if data.lstrip()[: len(start)].lower() == start), None)
        if other:
            raise InputError(f"it is not an STL file, but {other}.")
        short = announced and len(data) < announced
        raise InputError(
            f"it is not an STL file: it has {len(data)} bytes"
            + (f", its header announces {announced}" if announced else "")
            + ("; it may have been cut short." if short else ".")
        )
    vertices, index = _merged(points)
    return Surface(vertices, np.full(len(index) // 3, 3), index)


def _stl_text(data):
    """The corners (3 T, 3) of all facets in a text STL."""
    if b"endsolid" not in data[-4096:].lower():
        raise InputError("it does not end with 'endsolid', as a text STL does; it may have been cut short.")
    points, begun, inside = array("d"), 0, False
    for number, line in _lines(data):
        word = line[:64].lower().split(None, 1)[:1]
        if word == [b"vertex"]:
            points.extend(_point(line.split()[1:], number, line))
        elif word in ([b"facet"], [b"endfacet"]):
            if inside != (word == [b"endfacet"]) or len(points) != begun + 9 * inside:
                raise InputError(f"{_quoted(number, line)}: a facet must have three vertices, between facet, endfacet.")
            begun, inside = len(points), not inside
    if inside or len(points) != begun:
        raise InputError("its last facet does not end; it may have been cut short.")
    return np.frombuffer(points, float).reshape(-1, 3)


def _merged(points):
    """Points (N, 3) without repeats, in the order in which they first occur, and which of these each one is, (N,)."""
    points = points + 0.0  # no minus before a zero
    number = np.zeros(len(points), dtype=np.int64)
    for coordinates in points.T:
        number = number * len(points) + np.unique(coordinates, return_inverse=True)[1]
        number = np.unique(number, return_inverse=True)[1]
    _, first, index = np.unique(number, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return points[first[order]], np.argsort(order)[index]


def read_obj(data):
    """All faces of an OBJ file, whatever objects, groups and materials they belong to."""
    points, sizes, corners, lines = array("d"), array("q"), array("q"), array("q")
    joined, begun = b"", 0
    for number, line in _lines(data):
        if line.rstrip().endswith(b"\\"):
            joined, begun = joined + line.rstrip()[:-1] + b" ", begun or number
            continue
        words, at = (joined + line).split(b"#", 1)[0].split(), begun or number
        joined, begun = b"", 0
        if not words:
            continue
        if words[0] == b"v":
            points.extend(_point(words[1:], at, line))
            lines.append(at)
        elif words[0] in (b"f", b"fo"):
            try:
                face = [int(word.split(b"/", 1)[0]) for word in words[1:]]
            except ValueError:
                raise InputError(f"{_quoted(at, line)} does not name a face's vertices by their numbers.") from None
            count = len(points) // 3
            wrong = [corner for corner in face if corner == 0 or not -count <= corner < 2**31]
            if wrong:
                raise InputError(
                    f"a face uses vertex {wrong[0]} in {_quoted(at, line)}, but there are {count} vertices."
                )
            sizes.append(len(face))
            corners.extend(corner - 1 if corner > 0 else count + corner for corner in face)
    return _surface(points, sizes, corners, lines)


def read_off(data):
    """A text OFF file; colours, normals and texture of its vertices and faces are passed over."""
    rows = ((number, line, line.split(b"#", 1)[0].split()) for number, line in _lines(data))
    rows = ((number, line, words) for number, line, words in rows if words)
    number, line, words = next(rows, (1, b"", [b""]))
    header = re.fullmatch(rb"(?:ST|C|N)*(4?n?)OFF", words[0])
    if header and (header[1] or words[1:] == [b"BINARY"]):
        raise InputError(
            f"{_quoted(number, line)}: OFF files in binary or with other than three dimensions are not read."
        )
    if header:
        words = words[1:]
        if not words:
            number, line, words = next(rows, (number, b"", []))
    try:
        vertex_count, face_count = int(words[0]), int(words[1])
    except (ValueError, IndexError):
        raise InputError("it is not a readable OFF mesh: Invalid file.") from None
    points, sizes, corners, lines = array("d"), array("q"), array("q"), array("q")
    for _, (number, line, words) in zip(range(vertex_count), rows, strict=False):
        points.extend(_point(words, number, line))
        lines.append(number)
    for _, (number, line, words) in zip(range(face_count), rows, strict=False):
        try:
            size, *face = map(int, words[: 1 + int(words[0])])
        except ValueError:
            size, face = -1, []
        if size != len(face):
            raise InputError(
                f"{_quoted(number, line)} does not give a face: its number of corners, and their vertices."
            )
        sizes.append(size)
        corners.extend(face)
    if len(lines) < vertex_count or len(sizes) < face_count:
        raise InputError("it ends before its last face; it may have been cut short.")
    return _surface(points, sizes, corners, lines)


def triangulated(vertices, sizes, corners):
    """Triangles (T, 3) of faces: fans of the convex ones, ears cut off the others. Vertices (V, 3) must be finite."""
    start = np.cumsum(sizes) - sizes
    triangles, number = [np.empty((0, 3), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for size in np.unique(sizes[sizes >= 3]):
        which = np.flatnonzero(sizes == size)
        faces = corners[start[which, None] + np.arange(size)]
        fans = np.stack([np.repeat(faces[:, :1], size - 2, 1), faces[:, 1:-1], faces[:, 2:]], axis=2)
        if size > 3:
            a, b, c = vertices[fans].transpose(2, 0, 1, 3)
            area = np.cross(b - a, c - a)  # (F, size - 2, 3)
            total = area.sum(axis=1, keepdims=True)
            convex = ((area * total).sum(axis=2) > 1e-9 * (total**2).sum(axis=2)).all(axis=1)
            for k in np.flatnonzero(~convex):
                fans[k] = _ears(vertices, faces[k], total[k, 0])
        triangles.append(fans.reshape(-1, 3))
        number.append(np.repeat(which, size - 2))
    return np.concatenate(triangles)[np.argsort(np.concatenate(number), kind="stable")]  # in the file's order


def _ears(vertices, face, normal):
    """The triangles of a polygon (N,): of three neighbours that no other corner lies between, the least needle-like."""
    left, made = list(face), []
    while len(left) > 3:
        best = None
        points = vertices[left]
        before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
        cross = np.cross(points - before, after - points) @ normal
        span = ((after - before) ** 2).sum(axis=1) + np.finfo(float).tiny
        for k in np.argsort(-cross / span, kind="stable"):
            a, b, c = before[k], points[k], after[k]
            inside = np.ones(len(left), dtype=bool)
            for start, stop in ((a, b), (b, c), (c, a)):
                inside &= np.cross(stop - start, points - start) @ normal >= 0
            # A face with a hole goes along a bridge to it and back: its corners there stand twice.
            inside &= ~(points[:, None] == np.stack([a, b, c])).all(axis=2).any(axis=1)
            if cross[k] > 0 and not inside.any():
                best = int(k)
                break
        best = int(np.argmax(cross)) if best is None else best  # a polygon that crosses itself has no ear left
        made.append((left[best - 1], left[best], left[(best + 1) % len(left)]))
        del left[best]
    return np.array([*made, left])
