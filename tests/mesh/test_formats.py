"""Files as programs write them, in every dialect: the same cube comes out of each, or the reason is named."""

import struct

import numpy as np
import pytest
from files_made import QUADS, T, V, obj, off, ply, text_stl
from shapes_made import binary_stl

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.read.target import read_cad

NAN = float("nan")
FLAT = [*T.tolist(), [0, 0, 1]]  # the last is without area
WITH_NAN = np.concatenate([V, [[NAN, 0, 0]]])  # no face uses the last
BOM = b"\xef\xbb\xbf"
BINARY = binary_stl(V, T)
NAN_NORMALS = BINARY[:84] + b"".join(
    struct.pack("<3f", NAN, NAN, NAN) + BINARY[84 + 50 * k + 12 : 134 + 50 * k] for k in range(12)
)
TEXT = text_stl("cube", T)
POINTS, FACES = obj(T)
SOUP = b"".join(b"o %d\n" % k + obj([], vertices=V[corners])[0] + b"f -3 -2 -1\n" for k, corners in enumerate(T))
CUBES = {
    "header_says_solid.stl": b"solid facet endsolid".ljust(80) + BINARY[80:],
    "nan_normals.stl": NAN_NORMALS,
    "several_solids.stl": text_stl("one", T[:4]) + text_stl("two three", T[4:]),
    "several_solids_crlf.stl": (text_stl("one", T[:4]) + text_stl("two", T[4:])).replace(b"\n", b"\r\n"),
    "mac_line_ends.stl": TEXT.replace(b"\n", b"\r"),
    "upper_case.stl": TEXT.upper(),
    "tabs.stl": TEXT.replace(b" ", b"\t"),
    "name_of_keywords.stl": text_stl("facet vertex 1 nan endsolid", T),
    "no_name.stl": text_stl("", T),
    "empty_lines.stl": b"\n\n" + TEXT.replace(b"\n", b"\n\n"),
    "bom.stl": BOM + TEXT,
    "text_nan_normals.stl": text_stl("cube", T, "nan nan nan"),
    "quads.obj": b"".join(obj(QUADS)),
    "objects.obj": b"mtllib x.mtl\no nan\n" + POINTS + b"g a b\nusemtl red\ns 1\n" + FACES.replace(b"f", b"o 2\nf", 1),
    "interleaved_objects.obj": SOUP,
    "negative.obj": b"".join(obj(T, -8)),
    "colours.obj": b"".join(obj(T, after=" 0.5 0.5 0.5")),
    "weights.obj": b"".join(obj(T, after=" 1.0")),
    "normals.obj": b"vn nan nan nan\nvt 0 0\n" + b"".join(obj(T, corner="{}/1/1")),
    "continued.obj": POINTS + FACES.replace(b" ", b" \\\n", 1),
    "crlf_tabs.obj": (POINTS + FACES).replace(b"\n", b"\r\n").replace(b" ", b"\t"),
    "comments.obj": BOM + b"# nan\n" + POINTS.replace(b"\n", b" # inf\n") + FACES,
    "unused_nan.obj": b"".join(obj(T, vertices=WITH_NAN)),
    "faces_first.obj": FACES + POINTS,
    "quads.off": off(QUADS),
    "colours.off": off(T, "COFF\n", " 255 0 0 255", " 3 1.0 0.0 0.0"),
    "normals.off": off(T, "NOFF\n", " nan nan nan"),
    "normals_colours.off": off(T, "NCOFF\n", " 1 0 0 1 0 0 1"),
    "counts_on_first_line.off": off(T, "OFF "),
    "comments.off": off(T, "# 3 4 5\nOFF # nan\n\n"),
    "no_header.off": off(T, ""),
    "bom_crlf.off": BOM + off(T).replace(b"\n", b"\r\n"),
    "unused_nan.off": off(T, vertices=WITH_NAN),
    "strips.ply": ply([], "").replace(b"element face 0", b"element tristrips 1")
    + f"48 {' -1 '.join(' '.join(map(str, corners)) for corners in T)} -1\n".encode(),
}  # fmt: skip
EXTRA = [("float", "nx", NAN), ("uchar", "red", 255), ("double", "quality", 1.0)]
for _order, _label in (("", "text"), ("<", "little"), (">", "big")):
    CUBES |= {
        f"{_label}_float.ply": ply(T, _order),
        f"{_label}_double.ply": ply(T, _order, "double"),
        f"{_label}_uint32.ply": ply(T, _order, "double", ("uint8", "uint32")),
        f"{_label}_ushort.ply": ply(T, _order, lists=("int", "ushort"), name="vertex_index"),
        f"{_label}_extra.ply": ply(T, _order, "double", extra=EXTRA),
        f"{_label}_quads.ply": ply(QUADS, _order),
        f"{_label}_mixed.ply": ply([*QUADS[:3], *T[6:].tolist()], _order, "double", extra=EXTRA),
        f"{_label}_faces_first.ply": ply(T, _order, faces_first=True),
        f"{_label}_unused_nan.ply": ply(T, _order, vertices=WITH_NAN),
        f"{_label}_crlf.ply": ply(T, _order, end="\r\n"),
    }


@pytest.mark.parametrize("name", CUBES)
def test_every_dialect_gives_the_cube(tmp_path, name):
    (tmp_path / name).write_bytes(CUBES[name])
    vertices, triangles, _ = read_cad(tmp_path / name)
    assert np.isfinite(vertices).all()
    assert len(triangles) == 12
    assert topology.areas(vertices, triangles).sum() == pytest.approx(0.24)
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(0.008)


DEGENERATE = {
    "binary.stl": binary_stl(V, np.array(FLAT)),
    "text.stl": text_stl("cube", FLAT),
    "a.obj": b"".join(obj(FLAT)),
    "a.off": off(FLAT),
    "a.ply": ply(FLAT, ">", "double"),
}


@pytest.mark.parametrize("name", DEGENERATE)
def test_a_triangle_without_area_is_a_repair(tmp_path, name):
    (tmp_path / name).write_bytes(DEGENERATE[name])
    radar = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1}
    _, measures = build_meshes(tmp_path / name, {}, {"edges_per_wavelength": 15, "bands": 1}, radar)
    assert measures["repairs"]["degenerate_triangles"] == 1
    assert measures["bands"][0]["watertight"]


@pytest.mark.parametrize("first", range(6))
def test_a_polygon_with_a_dent_keeps_it(tmp_path, first):
    """An L of three squares, its corners from each in turn."""
    outline = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]])
    face = (np.arange(6) + first) % 6
    (tmp_path / "l.obj").write_bytes(b"".join(obj([face], vertices=outline)))
    vertices, triangles, _ = read_cad(tmp_path / "l.obj")
    assert topology.areas(vertices, triangles).sum() == pytest.approx(3)
    assert topology.shape(vertices[triangles])[0] == pytest.approx(np.tile([0, 0, 1], (4, 1)))


def test_a_face_with_a_hole_keeps_it(tmp_path):
    """A square in a square, with a bridge between that the outline goes along twice."""
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    outline = obj([(0, 1, 2, 3, 0, 4, 7, 6, 5, 4)], vertices=np.concatenate([square, square / 2]))
    (tmp_path / "hole.obj").write_bytes(b"".join(outline))
    vertices, triangles, _ = read_cad(tmp_path / "hole.obj")
    assert topology.areas(vertices, triangles).sum() == pytest.approx(3)
    assert (np.abs(vertices[triangles].mean(axis=1)[:, :2]).max(axis=1) > 0.5).all()


REFUSED = {
    "page.stl": (b"<!DOCTYPE html><html>" + bytes(100), "is no CAD file, but a web page"),
    "page.obj": (b"<html>\n", "is no CAD file, but a web page"),
    "pointer.stl": (
        b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n" + bytes(50),
        "pointer of Git",
    ),
    "archive.stl": (b"PK\x03\x04" + bytes(100), "a zip archive"),
    "really_obj.stl": (b"".join(obj(T)), "an OBJ file; name it so"),
    "point.obj": (b"v 1 2 3\n" * 3 + b"f 1 2 3\n", "all corners of its triangles are at one place"),
    "huge.obj": (b"v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n", "coordinates of 1e.300"),
    "nan.ply": (ply(T, ">", "double", vertices=np.concatenate([V[:1], [[0, NAN, 0]], V[2:]])), "vertex 1, at .*nan"),
    "cut.ply": (ply(T, ">", "double")[:-5], "cut short"),
    "kind.ply": (ply(T, "").replace(b"float x", b"half x"), "'property half x'"),
    "format.ply": (ply(T, "").replace(b"ascii", b"utf8"), "'format utf8'"),
    "no_z.ply": (ply(T, "").replace(b"float z", b"float w"), "no vertices with x, y and z"),
    "missing.ply": (ply([[0, 1, 9]], ">"), "vertex 9, but there are 8"),
    "comma.obj": (b"v 0,1 0 0\n", "line 1: 'v 0,1 0 0' does not give three numbers"),
    "zero.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "uses vertex 0 in line 4"),
    "face.off": (off([["a", 1, 2]]), "line 11: '3 a 1 2': 'a' is not a number"),
    "cut.off": (off(T)[:-40], "."),
    "binary.off": (b"OFF BINARY\n" + bytes(100), "binary"),
    "huge_number.obj": (b"v 0 0 0\nf 1 1 99999999999999999999999\n", "in line 2"),
    "list_of_x.ply": (ply(T, "<").replace(b"float x", b"list uchar float x"), "."),
    "nan_corner.ply": (ply([[0, 1, 2]], "", lists=("int", "float")).replace(b"3 0 1 2", b"3 0 1 nan"), "vertex nan"),
    "endless_face.ply": (
        ply([[0, 1, 2]], "", lists=("float", "int")).replace(b"3 0 1 2", b"inf 0 1 2"),
        "it announces inf numbers",
    ),
    "two_corners.stl": (TEXT.replace(b"   vertex", b"   vortex", 1), "line 8: 'endfacet': a facet must have three"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_with_the_line(tmp_path, name):
    content, message = REFUSED[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message) as refusal:
        read_cad(tmp_path / name)
    assert name in str(refusal.value)


def test_a_target_too_far_from_the_origin_is_refused(tmp_path):
    """Its volume would have no digits left: it seemed to change by 700 %."""
    (tmp_path / "far.off").write_bytes(off(T, vertices=V + 1e6))
    radar = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1}
    with pytest.raises(InputError, match=r"far\.off is 0\.2 m long but 1e\+06 m from the origin.*Move it"):
        build_meshes(tmp_path / "far.off", {}, {"edges_per_wavelength": 15, "bands": 1}, radar)
