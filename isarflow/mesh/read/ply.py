"""PLY files of other programs, in text or either binary order. (`mesh.io` reads and writes the workflow's own.)"""

import re
import struct

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.text import BOM
from isarflow.mesh.read.formats import Surface
from isarflow.mesh.read.text import elements_of, rows, unix

# Names of the types for both numpy and struct.
TYPES = {
    **{"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"},
    **{"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"},
    **{"float32": "f", "float64": "d"},
}
LISTS = "vertex_indices", "vertex_index"  # of the vertices of a face
REST = "ply", "comment", "obj_info", "end_header"  # words of a header that announce nothing
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
    points = values.pop("vertex", {})
    if not {"x", "y", "z"} <= set(points) or any(isinstance(points[axis], tuple) for axis in "xyz"):
        raise InputError("it has no vertices with x, y and z.")
    sizes, corners = _corners("face", values.pop("face", {}))
    strips = list(_strips(*_corners("tristrips", values.pop("tristrips", {}))))
    for name, other in values.items():
        lists = {key: value for key, value in other.items() if "vert" in key and isinstance(value, tuple)}
        if any(max(lengths, default=0) > 2 for lengths, _ in lists.values()):
            wrong = f"lists of vertices, {', '.join(lists)}, in its element '{name}'"
            raise InputError(f"it has {wrong}, which is not read: write them as 'face' with the list {LISTS[0]}.")
    return Surface(
        np.stack([np.asarray(points[axis], float) for axis in "xyz"], axis=1),
        np.concatenate([np.asarray(sizes, np.int64), np.full(len(strips), 3)]),
        np.concatenate([np.asarray(corners), np.array(strips).ravel()]),
        lines.get("vertex"),
        None if strips else lines.get("face"),
    )


def _corners(name, element):
    """The lists of vertices of an element, by property: their lengths, and the entries one after the other."""
    lists = [element[key] for key in LISTS if isinstance(element.get(key), tuple)]
    if not lists and any(len(value[0] if isinstance(value, tuple) else value) for value in element.values()):
        raise InputError(f"its element '{name}' has no list {' or '.join(LISTS)}, but {', '.join(element)}.")
    return lists[0] if lists else ([], [])


def _header(lines):
    """The format, and elements [(name, count, [(property, type)])] of a header's words; lists have two types."""
    form, elements = None, []
    for words in lines:
        try:
            if words[:1] == ["format"]:
                form = words[1]
            elif words[:1] == ["element"]:
                if int(words[2]) < 0 or words[1] in (name for name, *_ in elements):
                    raise ValueError
                elements.append((words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                elements[-1][2].append((words[4], TYPES[words[2]] + TYPES[words[3]]))
            elif words[:1] == ["property"]:
                elements[-1][2].append((words[2], TYPES[words[1]]))
            elif words and words[0].lower() not in REST:
                raise ValueError
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
