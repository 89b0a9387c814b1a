"""Read STL, OBJ and OFF files unchanged: vertices, and faces with any number of corners. PLY files are in `mesh.ply`.

Readers take a file's bytes; they repair nothing, and raise InputError without the file's name, which `mesh.read` adds.
"""

import io
import re
from array import array
from typing import NamedTuple

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.text import BOM
from isarflow.mesh.read.text import elements_of, numbered, point, quoted, rows, unix

STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
# What is saved under the name of a CAD file, and other formats under that of an STL file, by their first bytes.
NO_CAD = {
    b"<!doctype": "a web page",
    b"<html": "a web page",
    b"version https://git-lfs": "a pointer of Git LFS; fetch the file itself (git lfs pull)",
    b"pk\x03\x04": "a zip archive; unpack it",
}
OTHERS = {b"v ": "an OBJ file; name it so", b"ply": "a PLY file; name it so"}
TEXT_STL = re.compile(rb"[\r\n]\s*(facet|end\s*solid)", re.IGNORECASE)
STL_REST = b"outer", b"outerloop", b"endloop", b"end", b"color"  # words that begin a line of a text STL without surface
# Statements of OBJ files, small letters, beside v, f and fo: those of curves, points, groups and looks, and the others.
OBJ_REST = frozenset(
    b"vn vt vp p l t o g s mg usemtl mtllib usemap maplib lod shadow_obj trace_obj bevel c_interp d_interp ctech stech "
    b"cstype deg bmat step curv curv2 parm trim hole scrv sp end con cdc res".split()
)
OBJ_NAMES = b"usemtl ", b"mtllib ", b"usemap ", b"maplib ", b"o ", b"g "  # statements of names
FREE_FORM = "a free-form surface, which is not read; convert it to polygons before the export"
OBJ_UNREAD = {
    **dict.fromkeys((b"surf", b"bsp", b"bzp", b"cdp"), FREE_FORM),
    b"call": "another file, which is not read; put its lines here",
    b"csh": "a command, which is not run; put the lines that it makes here",
}
OBJ_VERTEX = 3, 4, 6, 7  # numbers: x, y, z, perhaps a weight, perhaps a colour
OBJ_KINDS = {b"g": "groups", b"o": "objects", b"usemtl": "materials"}  # of the names that faces have
XYZ, CORNERS = [("x", "d"), ("y", "d"), ("z", "d")], [("vertex_indices", "dd")]


class Surface(NamedTuple):
    """The content of a file."""

    vertices: np.ndarray  # (V, 3) float64, in the file's unit
    sizes: np.ndarray  # (F,) corners of each face
    corners: np.ndarray  # (sum of sizes,) vertices of the faces, one after the other
    lines: object = None  # (V,) the line of each vertex, in text files that have one
    face_lines: object = None  # (F,) the line of each face, in such files
    names: object = None  # of OBJ files, {kind: (names, number of each face's (F,))}


def read_stl(data):
    """Read a binary STL, with any header, or a text STL of one or more solids."""
    count = int.from_bytes(data[80:84], "little")
    announced = 84 + 50 * count
    if len(data) == announced:
        points = np.frombuffer(data, STL_RECORD, offset=84)["corners"].astype(float).reshape(-1, 3)
    elif data.removeprefix(BOM).lstrip()[:5].lower() == b"solid" and (
        TEXT_STL.search(data[:4096]) or b"\0" not in data[:4096]
    ):
        points = _stl_text(data)
    else:
        if other := beginning(data, OTHERS):
            raise InputError(f"it is not an STL file, but {other}.")
        size = f"{len(data)} bytes, not the {announced} of the {count} triangles that its header says"
        short = "; it may have been cut short" if len(data) < announced else ""
        raise InputError(f"it is not an STL file: it is no text that begins with 'solid', and has {size}{short}.")
    # Each point once, in the order in which they first occur, without a minus before a zero.
    points = np.ascontiguousarray(points + 0.0)
    _, first, index = np.unique(points.view("V24").ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    return Surface(points[first[order]], np.full(len(index) // 3, 3), np.argsort(order)[index])


def beginning(data, kinds):
    """Return what kinds, {first bytes: name}, say of a file's bytes; None if nothing."""
    begin = data.removeprefix(BOM).lstrip()[:30].lower()
    return next((name for start, name in kinds.items() if begin.startswith(start)), None)


def _stl_text(data):
    """The corners (3 T, 3) of all facets in a text STL."""
    points, begun, inside, ended, place, line, odd = array("d"), 0, False, False, 0, b"", None
    for place, line in numbered(data):
        words = line.split(b"#", 1)[0].split()
        word = words[0].lower() if words else b""
        if word == b"end" and len(words) > 1:
            word += words[1].lower()
        if word == b"vertex":
            points.extend(point(words[1:], place, line))
        elif word in (b"facet", b"endfacet"):
            if inside != (word == b"endfacet") or len(points) != begun + 9 * inside:
                raise InputError(f"{quoted(place, line)}: a facet must have three vertices, all on lines of their own.")
            begun, inside, ended = len(points), not inside, False
        elif word in (b"solid", b"endsolid"):
            ended = word == b"endsolid"
        elif word and word not in STL_REST:
            odd = odd or quoted(place, line)
    if inside or len(points) != begun:
        raise InputError(f"its last facet does not end before {quoted(place, line)}; it may have been cut short.")
    if not ended:
        raise InputError(f"it does not end with a line 'endsolid', but with {quoted(place, line)}; is it cut short?")
    if odd:
        raise InputError(f"{odd} is no line of a text STL file, so that a part may be left out. Mend or delete it.")
    return np.frombuffer(points, float).reshape(-1, 3)


def read_obj(data):
    """Read all faces of an OBJ file, of any object, group and material; other surfaces are refused."""
    points, sizes, corners, lines, face_lines = array("d"), array("q"), array("q"), array("q"), array("q")
    joined, begun, width, marks = b"", 0, 0, {kind: [(0, "")] for kind in OBJ_KINDS.values()}
    for number, line in numbered(data):
        content = line.split(b"#", 1)[0].rstrip()
        # A name may end so, as a folder of Windows does; what would follow it is refused as no statement.
        if content.endswith(b"\\") and not content.lower().lstrip().startswith(OBJ_NAMES):
            joined, begun = joined + content[:-1] + b" ", begun or number
            continue
        words, at = (joined + content).split(), begun or number
        joined, begun = b"", 0
        if not words:
            continue
        word = words[0].lower()
        if word == b"v":
            points.extend(point(words[1:4], at, line))
            lines.append(at)
            if len(words) - 1 not in OBJ_VERTEX or width not in (0, len(words)):  # within an object
                others = f"but the vertex before it {width - 1}" if width else "not 3, 4, 6 or 7"
                raise InputError(f"{quoted(at, line)} gives {len(words) - 1} numbers of a vertex, {others}.")
            width = len(words)
        elif word in (b"f", b"fo"):
            try:
                face = [int(word.split(b"/", 1)[0]) for word in words[1:]]
            except ValueError:
                raise InputError(f"{quoted(at, line)} does not name a face's vertices by their numbers.") from None
            count, width = len(points) // 3, 0
            wrong = [corner for corner in face if corner == 0 or not -count <= corner < 2**31]
            if wrong:
                raise InputError(f"a face uses vertex {wrong[0]} in {quoted(at, line)}, of {count} vertices.")
            sizes.append(len(face))
            face_lines.append(at)
            corners.extend(corner - 1 if corner > 0 else count + corner for corner in face)
        elif word in OBJ_KINDS:
            width = width if word == b"usemtl" else 0
            marks[OBJ_KINDS[word]].append((len(sizes), b" ".join(words[1:]).decode("utf-8", "replace")))
        elif word not in OBJ_REST:
            why = "is no statement of an OBJ file, so that a part may be left out. Mend or delete the line"
            if word[:1] in b"+-.0123456789":
                why = "begins with a number, where an OBJ file says what the line is"
            elif word in OBJ_UNREAD:
                why = f"is {OBJ_UNREAD[word]}"
            raise InputError(f"{quoted(at, line)} {why}.")
    if joined:
        raise InputError(f"{quoted(number, line)} goes on, but it is the last; the file may have been cut short.")
    names = {}
    for kind, of_kind in marks.items():
        starts, said = zip(*of_kind, strict=True)
        names[kind] = said, np.repeat(np.arange(len(said)), np.diff([*starts, len(sizes)]))
    points = np.frombuffer(points, float).reshape(-1, 3)
    return Surface(points, *map(np.array, (sizes, corners, lines, face_lines)), names)


def read_off(data):
    """Read a text OFF file; colours, normals and texture of its vertices and faces are skipped."""
    text = re.sub(rb"#[^\n]*", b"", unix(data))
    stream = io.BytesIO(text)
    filled = ((place, line, line.split()) for place, line in enumerate(stream, 1) if line.strip())
    place, line, words = next(filled, (1, b"", [b""]))
    header = re.fullmatch(rb"(?:ST|C|N)*(4?n?)OFF", words[0])
    if header and (header[1] or words[1:] == [b"BINARY"]):
        raise InputError(f"{quoted(place, line)}: OFF files in binary or of other than three dimensions are not read.")
    words = words[1:] if header else words
    if not words:
        place, line, words = next(filled, (place, b"", []))
    try:
        vertices, faces, *_ = counts = [int(word) for word in words]
        if min(counts) < 0 or len(counts) > 3:
            raise ValueError
    except ValueError:
        if header:
            raise InputError(f"{quoted(place, line)} does not give the numbers of vertices, faces and edges.") from None
        raise InputError("it is not a readable OFF mesh: Invalid file.") from None
    announced = [("vertex", vertices, XYZ), ("face", faces, CORNERS)]
    values, lines = elements_of(rows(text, stream.tell()), announced)
    points = np.stack([values["vertex"][axis] for axis in "xyz"], axis=1)
    return Surface(points, *values["face"]["vertex_indices"], lines["vertex"], lines["face"])


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
    """Triangles of a polygon (N,): each time the least needle-like of three neighbours with no other corner between."""
    left, made = list(face), []
    while len(left) > 3:
        points = vertices[left]
        before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
        cross = np.cross(points - before, after - points) @ normal
        span = ((after - before) ** 2).sum(axis=1) + np.finfo(float).tiny
        best = int(np.argmax(cross))  # if a polygon crosses itself and has no ear left
        for k in np.argsort(-cross / span, kind="stable").tolist():
            a, b, c = before[k], points[k], after[k]
            inside = np.ones(len(left), dtype=bool)
            for start, stop in ((a, b), (b, c), (c, a)):
                inside &= np.cross(stop - start, points - start) @ normal >= 0
            # A face with a hole goes along a bridge to it and back: its corners there occur twice.
            inside &= ~(points[:, None] == np.stack([a, b, c])).all(axis=2).any(axis=1)
            if cross[k] > 0 and not inside.any():
                best = k
                break
        made.append((left[best - 1], left[best], left[(best + 1) % len(left)]))
        del left[best]
    return np.array([*made, left])
