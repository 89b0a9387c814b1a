"""PLY files of other programs, in text or either binary order. (`mesh.io` reads and writes the workflow's own.)"""

import re
import struct

import numpy as np

from isarflow.core.errors import InputError
from isarflow.mesh.formats import Surface
from isarflow.mesh.text import BOM, elements_of, rows, unix

# Names of the types for both numpy and struct.
TYPES = {
    **{"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"},
    **{"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"},
    **{"float32": "f", "float64": "d"},
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def read_ply(data):
    """The Surface of a PLY file's bytes: its faces, and its strips of triangles."""
    end = re.search(rb"(?m)^end_header[ \t]*(\r\n|\n|\r)", data)
    if not data.removeprefix(BOM).startswith(b"ply") or not end:
        raise InputError("it is not a readable PLY mesh: Header not found.")
    header = unix(data[: end.end()])
    form, elements = _header([line.split() for line in header.decode("latin-1").split("\n")])
    if form == "ascii":
        values, lines = elements_of(rows(unix(data), len(header)), elements)
    else:
        values, lines, body, start = {}, {}, data[end.end() :], 0
        try:
            for name, count, properties in elements:
                values[name], start = _element(body, start, count, properties, ORDERS[form])
        except (ValueError, OverflowError, struct.error):
            raise InputError("its numbers do not go with its header; it may have been cut short.") from None
        if body[start:].strip(b" \t\r\n\0"):
            raise InputError(f"it goes on for {len(body) - start} bytes after all that its header announces.")
    points = values.get("vertex", {})
    if not {"x", "y", "z"} <= set(points) or any(isinstance(points[axis], tuple) for axis in "xyz"):
        raise InputError("it has no vertices with x, y and z.")
    faces = values.get("face", {})
    listed = (faces[key] for key in ("vertex_indices", "vertex_index") if isinstance(faces.get(key), tuple))
    sizes, corners = next(listed, ([], []))
    strips = [strip for lengths, ends in values.get("tristrips", {}).values() for strip in _strips(lengths, ends)]
    return Surface(
        np.stack([np.asarray(points[axis], float) for axis in "xyz"], axis=1),
        np.concatenate([np.asarray(sizes, np.int64), np.full(len(strips), 3)]),
        np.concatenate([np.asarray(corners), np.array(strips).ravel()]),
        lines.get("vertex"),
        None if strips else lines.get("face"),
    )


def _header(lines):
    """The format, and elements [(name, count, [(property, type)])] of a header's words; lists have two types."""
    form, elements = None, []
    for words in lines:
        try:
            if words[:1] == ["format"]:
                form = words[1]
            elif words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
                if elements[-1][1] < 0:
                    raise ValueError
            elif words[:2] == ["property", "list"]:
                elements[-1][2].append((words[4], TYPES[words[2]] + TYPES[words[3]]))
            elif words[:1] == ["property"]:
                elements[-1][2].append((words[2], TYPES[words[1]]))
        except (KeyError, IndexError, ValueError):
            raise InputError(f"its header has '{' '.join(words)}', which no PLY file should have.") from None
    if form not in ORDERS:
        raise InputError(f"its header says 'format {form}'; it must be one of {', '.join(ORDERS)}.")
    return form, elements


def _element(body, start, count, properties, order):
    """An element's values by property, of lists (lengths, entries), from `start` in the body, and where it ends."""
    values = {name: ([], []) if len(kind) == 2 else [] for name, kind in properties}
    if count == 0 or not properties:
        return values, start
    if not any(len(kind) == 2 for _, kind in properties):
        record = np.dtype([(str(k), order + kind) for k, (_, kind) in enumerate(properties)])
        rows = np.frombuffer(body, record, count, start)
        return {name: rows[str(k)] for k, (name, _) in enumerate(properties)}, start + rows.nbytes
    for _ in range(count):
        for name, kind in properties:
            (first,) = struct.unpack_from(order + kind[0], body, start)
            start += struct.calcsize(order + kind[0])
            if len(kind) == 1:
                values[name].append(first)
                continue
            entries = f"{order}{int(first)}{kind[1]}"
            values[name][0].append(int(first))
            values[name][1].extend(struct.unpack_from(entries, body, start))
            start += struct.calcsize(entries)
    return values, start


def _strips(sizes, entries):
    """The triangles of strips of vertices, in which -1 begins a new strip and every other triangle is turned."""
    entries, start = [int(entry) for entry in entries], 0
    for size in map(int, sizes):
        run = []
        for vertex in entries[start : start + size]:
            run = [] if vertex < 0 else [*run, vertex]
            if len(run) >= 3:
                yield run[-3:] if len(run) % 2 else [run[-2], run[-3], run[-1]]
        start += size
