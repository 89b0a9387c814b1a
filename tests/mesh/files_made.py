"""The cube of 0.2 m as bytes of every format, for tests of the readers."""

import struct

from shapes_made import cube

V, T = cube(0.2)
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def text_stl(name, triangles, normal="0 0 0"):
    facets = [
        f" facet normal {normal}\n  outer loop\n"
        + "".join(f"   vertex {x:.17e} {y:.17g} {z:.17g}\n" for x, y, z in V[corners])
        + "  endloop\n endfacet\n"
        for corners in triangles
    ]
    return f"solid {name}\n{''.join(facets)}endsolid {name}\n".encode()


def obj(faces, first=1, corner="{}", after="", vertices=V):
    points = "".join(f"v {x} {y} {z}{after}\n" for x, y, z in vertices)
    rows = ["f " + " ".join(corner.format(k + first) for k in face) + "\n" for face in faces]
    return points.encode(), "".join(rows).encode()


def off(faces, head="OFF\n", after="", face_after="", vertices=V):
    points = "".join(f"{x} {y} {z}{after}\n" for x, y, z in vertices)
    rows = "".join(f"{len(face)} {' '.join(map(str, face))}{face_after}\n" for face in faces)
    return f"{head}{len(vertices)} {len(faces)} 0\n{points}{rows}".encode()


def ply(faces, order, number="float", lists=("uchar", "int"), name="vertex_indices", extra=(), faces_first=False,
        end="\n", vertices=V):  # fmt: skip
    """order: "" for text, "<" or ">". extra: (type, name, value) of more properties of every vertex and face."""
    codes = {"float": "f", "double": "d", "uchar": "B", "uint8": "B", "int": "i", "uint32": "I", "ushort": "H"}
    form = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    properties = [f"property {kind} {one}" for kind, one, _ in extra]
    heads = [
        [f"element vertex {len(vertices)}", *(f"property {number} {axis}" for axis in "xyz"), *properties],
        [f"element face {len(faces)}", f"property list {lists[0]} {lists[1]} {name}", *properties],
    ]
    values = [value for *_, value in extra]
    rows = [
        [(codes[number] * 3, list(point)) for point in vertices],
        [(codes[lists[0]] + codes[lists[1]] * len(face), [len(face), *map(int, face)]) for face in faces],
    ]
    extras = "".join(codes[kind] for kind, *_ in extra)
    bodies = [
        b"".join(struct.pack(order + code + extras, *row, *values) for code, row in part)
        if order
        else "".join(" ".join(map(str, [*row, *values])) + end for _, row in part).encode()
        for part in rows
    ]
    if faces_first:
        heads, bodies = heads[::-1], bodies[::-1]
    head = ["ply", f"format {form} 1.0", "comment element vertex 99 nan", *heads[0], *heads[1], "end_header"]
    return (end.join(head) + end).encode() + bodies[0] + bodies[1]
