"""Files whose lines and header disagree: each is read by what it says without doubt, or refused with the line."""

import struct

import numpy as np
import pytest
from files_made import QUADS, T, V, obj, off, ply, text_stl
from shapes_made import binary_stl

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.read.formats import triangulated
from isarflow.mesh.read.target import READERS, read_cad

STL, BINARY = text_stl("cube", T), binary_stl(V, T)
OBJ, OFF, PLY, LITTLE = b"".join(obj(T)), off(T), ply(T, ""), ply(T, "<")
COLOUR = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha")).encode()
CORNER_COLOURS = b"".join(b"3 %d %d %d 9%s\n" % (*corners, b" 255" * 9) for corners in T)


def line(data, number, new):
    """A text with another line, or none, at this place, counted from 1."""
    lines = data.split(b"\n")
    lines[number - 1 : number] = new.split(b"\n") if new else []
    return b"\n".join(lines)


def more(data, first, word=b" 7", count=None):
    """A text with one more word on lines from one on."""
    lines = data.split(b"\n")
    last = len(lines) - 1 if count is None else first - 1 + count
    return b"\n".join(text + word * (first <= k <= last) for k, text in enumerate(lines, 1))


def words_of(data, start, width):
    """A text with the numbers after so many lines of header in lines of this width."""
    lines = data.split(b"\n")
    words = b" ".join(lines[start:]).split()
    wrapped = [b" ".join(words[k : k + width]) for k in range(0, len(words), width)]
    return b"\n".join([*lines[:start], *wrapped, b""])


def extended(element, body):
    """The text PLY with one more element: what its header says, and its lines."""
    return PLY.replace(b"end_header", b"element " + element + b"\nend_header") + body


# PLY: vertices from line 11, faces from 19 to 30. OFF: vertices from 3, faces from 11 to 22. OBJ: from 1, and from 9.
# STL: a facet from line 2, its vertices in lines 4 to 6.
CUBE = None
FILES = {
    # Text STL.
    "upper.stl": (STL.upper(), CUBE),
    "mixed_case.stl": (STL.replace(b"vertex", b"Vertex").replace(b"facet", b"FaceT", 5), CUBE),
    "end_solid.stl": (STL.upper().replace(b"END", b"END "), CUBE),
    "end_solid_crlf.stl": (STL.replace(b"end", b"end ").replace(b" ", b"\t").replace(b"\n", b"\r\n"), CUBE),
    "upper_no_name.stl": (text_stl("", T).upper(), CUBE),
    "fortran.stl": (STL.upper().replace(b"E-", b"D-"), CUBE),
    "blank_end.stl": (STL + b" \n" * 5000, CUBE),
    "comma.stl": (STL.replace(b".", b","), "line 4: .* does not give three numbers x, y, z; decimals are .* a point"),
    "cut_in_endsolid.stl": (STL[:-11] + b"\n", "not end with a line 'endsolid'.* line 86: 'end'.*cut short"),
    "second_solid_cut.stl": (STL + b"solid b\n", "with line 87: 'solid b'.*cut short"),
    "cut_in_facet.stl": (b"\n".join(STL.split(b"\n")[:60]) + b"\nendsolid\n", "not end before line 61"),
    "four_numbers.stl": (line(STL, 4, b"vertex 0 1 2 3"), "line 4: 'vertex 0 1 2 3' does not give three"),
    "four_vertices.stl": (line(STL, 4, b"vertex 0 0 0\nvertex 1 0 0"), "line 9: 'endfacet': a facet must have three"),
    "one_line.stl": (STL.replace(b"\n  ", b" "), "line 3: 'endfacet': a facet must have three vertices, .*on lines"),
    "short_exponent.stl": (STL.replace(b"e-0", b"-00"), CUBE),
    "end_of_file.stl": (STL + b"\x1a", CUBE),
    "comments.stl": (STL.replace(b" facet", b"# facet\n facet", 1).replace(b"  outer", b"color 1 0 0\n outer"), CUBE),
    "unknown.stl": (line(STL, 9, b"strip 0 1\n facet normal 0 0 0"), "line 9: 'strip 0 1' is no line of a text STL"),
    "binary_after.stl": (STL + BINARY, "line 87: .* is no line of a text STL file, so that a part may be left out"),
    # Binary STL.
    "more.stl": (BINARY + b"\n", "has 685 bytes, not the 684 of the 12 triangles that its header says"),
    "one_more.stl": (BINARY + bytes(50), "has 734 bytes, not the 684 of"),
    "wrong_count.stl": (BINARY[:80] + b"\r" + BINARY[81:], "684 bytes, not the 734 of the 13 .*cut short"),
    "solid_facet_wrong.stl": (b"solid facet".ljust(80) + BINARY[80:] + b"\1", "STL file: .* 685 bytes, not the 684"),
    # OBJ.
    "mixed_corners.obj": (OBJ.replace(b"f 1 3 4", b"vn 0 0 1\nvt 0 0\nf 1//1 3/1 4/1/1"), CUBE),
    "fortran.obj": (OBJ.replace(b"0.1", b"1.0D-01"), CUBE),
    "colours_and_weights.obj": (more(more(OBJ, 1, b" 1", 8), 1, b" 0.5 0.5 0.5", 8), CUBE),
    "one_weight.obj": (line(OBJ, 3, b"v 9 -0.1 0.1 -0.1"), "line 3: 'v 9 .*' gives 4 numbers of a vertex, but .* 3"),
    "five.obj": (more(OBJ, 1, b" 1 1", 8), "line 1: .* gives 5 numbers"),
    "two.obj": (line(OBJ, 3, b"v 0.1 0.1"), "line 3: 'v 0.1 0.1' does not give three"),
    "no_f.obj": (line(OBJ, 9, b"1 3 4"), "line 9: '1 3 4' begins with a number"),
    "no_v.obj": (line(OBJ, 1, b"-0.1 -0.1 -0.1"), "line 1: .* begins with a number"),
    "two_corners.obj": (line(OBJ, 9, b"f 1 3"), "line 9: a face has three corners or more, this one 2"),
    "beyond.obj": (line(OBJ, 9, b"f 1 3 9"), "line 9: a face uses vertex 9, but there are 8"),
    "fraction.obj": (line(OBJ, 9, b"f 1 3 4.5"), "line 9: 'f 1 3 4.5' does not name"),
    "f_before_v.obj": (b"f -1 -2 -3\n" + OBJ, "vertex -1 in line 1.*of 0 vertices"),
    "goes_on.obj": (OBJ + b"f 1 2 \\\n", "line 21: .* goes on, but it is the last"),
    "capitals.obj": (OBJ.upper(), CUBE),
    "short_exponent.obj": (OBJ.replace(b"0.1", b"1.0-001"), CUBE),
    "end_of_file.obj": (OBJ + b"\x1a\r\n", CUBE),
    "path_in_comment.obj": (b"# C:\\cad\\\n" + OBJ.replace(b"f 1 3 4", b"f 1 3 4 # \\"), CUBE),
    "curves.obj": (OBJ + b"p 1\nl 1 2\nvp 0 0\ncstype bezier\ndeg 1\ncurv 0 1 1 2\nparm u 0 1\nend\nusemtl a\n", CUBE),
    "names_of_windows.obj": (OBJ.replace(b"f 1 3 4", b"usemtl C:\\cad\\\nf 1 3 4"), CUBE),
    "tags.obj": (OBJ + b"t crease 2/1/0 1 2 3.0\n", CUBE),
    "surf.obj": (
        OBJ + b"cstype bspline\ndeg 1 1\nsurf 0 1 0 1 \\\n1 2 3 4\nparm u 0 0 1 1\nparm v 0 0 1 1\nend\n",
        "line 23: '.*' is a free-form surface, which is not read; convert it to polygons",
    ),
    "patch.obj": (OBJ + b"bzp 1 2 3 4 5 6 7 8 1 2 3 4 5 6 7 8\n", "line 21: 'bzp .*' is a free-form surface"),
    "call.obj": (OBJ + b"call rest.obj\n", "line 21: 'call rest.obj' is another file, which is not read"),
    "misspelt.obj": (line(OBJ, 9, b"face 1 3 4"), "line 9: 'face 1 3 4' is no statement of an OBJ file"),
    # OFF.
    "short_exponent.off": (OFF.replace(b"0.1", b"1.0-001"), CUBE),
    "end_of_file.off": (OFF + b"\x1a", CUBE),
    "three_more.off": (line(OFF, 12, b"3 0 5 3 1 4 6"), "line 12: .* does not give a face: .* .3. as on"),
    "three_more_on_vertices.off": (more(OFF, 4, b" 1 2 3", 2), "line 4: .* does not give a vertex: .* .3. as on"),
    "colour_on_some.off": (more(OFF, 11, b" 255 0 0", 4), CUBE),
    "colour_index.off": (more(OFF, 11, b" 4"), CUBE),
    "wrapped.off": (words_of(OFF, 2, 8), CUBE),
    "two_lines.off": (b"OFF 8 12 0\n" + b" ".join(OFF.split()[4:28]) + b"\n" + b" ".join(OFF.split()[28:]), CUBE),
    "fortran.off": (OFF.replace(b"0.1", b"1.0d-1"), CUBE),
    "comma.off": (OFF.replace(b".", b","), "line 3: .*: '-0,1' is not a number; decimals are .* a point"),
    "more_on_one.off": (line(OFF, 12, b"3 0 5 3 1"), "line 12: '3 0 5 3 1' does not give a face: .* .1. as on"),
    "more_on_vertex.off": (line(OFF, 5, b"0 -0.1 0.1 -0.1"), "line 5: .* does not give a vertex: .* .1. as on"),
    "too_few.off": (line(OFF, 5, b"0 -0.1"), "line 5: '0 -0.1' does not give a vertex: it has too few.* x, y, z"),
    "corners.off": (line(OFF, 12, b"4 0 3 1"), "line 12: .* does not give a face: it announces 4 .* but 3 follow"),
    "fewer_corners.off": (line(OFF, 12, b"2 0 3 1"), "line 12: .* not as many .* .1. as on"),
    "a_triangle_of_quads.off": (line(off(QUADS), 12, b"3 4 5 7 6"), "line 12: .* not as many .* .1. as on"),
    "two_corners.off": (line(OFF, 12, b"2 0 3"), "line 12: a face has three corners or more, this one 2"),
    "no_corners.off": (line(OFF, 12, b"0"), "line 12: a face has three corners or more, this one 0"),
    "negative.off": (line(OFF, 12, b"3 0 3 -1"), "line 12: a face uses vertex -1, but there are 8"),
    "fraction.off": (line(OFF, 12, b"3 0 3 1.5"), "line 12: a face uses vertex 1.5"),
    "line_less.off": (line(OFF, 12, b""), "8 of 'vertex' and 12 of 'face', but 19 lines .*line 21 is the last.*short"),
    "line_more.off": (OFF + b"3 0 1 2\n", "8 of 'vertex' and 12 of 'face', but 21 lines .*line 23 is the last"),
    "vertices_more.off": (line(OFF, 2, b"9 12 0"), "9 of 'vertex' and 12 of 'face', but 20 lines"),
    "faces_fewer.off": (line(OFF, 2, b"8 11 0"), "8 of 'vertex' and 11 of 'face', but 20 lines"),
    "negative_count.off": (line(OFF, 2, b"8 -12 0"), "line 2: '8 -12 0' does not give the numbers of vertices"),
    "counts.off": (line(OFF, 2, b"8"), "line 2: '8' does not give the numbers of vertices"),
    "many_counts.off": (line(OFF, 2, b"8 12 0 0"), "line 2: '8 12 0 0' does not give"),
    "nothing.off": (b"OFF\n8 12 0\n", "8 of 'vertex' and 12 of 'face', but 0 lines"),
    # Text PLY.
    "corner_colours.ply": (
        PLY[: PLY.index(b"end_header")] + COLOUR + b"\n".join(PLY.split(b"\n")[9:18]) + b"\n" + CORNER_COLOURS, CUBE),
    "more_on_faces.ply": (more(PLY, 19), CUBE),
    "more_on_vertices.ply": (more(PLY, 11, b" 0 0 1", 8), CUBE),
    "wrapped.ply": (words_of(PLY, 10, 6), CUBE),
    "wrapped_extra.ply": (words_of(ply(QUADS, "", extra=[("float", "quality", 1.0)]), 12, 2), CUBE),
    "one_line.ply": (words_of(PLY, 10, 1000), CUBE),
    "ten_a_line.ply": (words_of(PLY, 10, 10), CUBE),
    "one_line_more.ply": (words_of(PLY, 10, 1000)[:-1] + b" 3\n", "8 of 'vertex' and .* but 1 lines .*line 11 is the"),
    "face_among_vertices.off": (line(OFF, 10, b"3 1 3 7\n1 1 1"), "8 of 'vertex' and 12 of 'face', but 21 lines"),
    "fortran.ply": (PLY.replace(b"0.1", b"1.D-1"), CUBE),
    "whole_floats.ply": (line(ply(T, "", lists=("float", "float")), 19, b"3.0 0 2.0 3"), CUBE),
    "comma.ply": (line(PLY, 13, b"0 0,5 1"), "line 13: '0 0,5 1': '0,5' is not a number"),
    "word.ply": (line(PLY, 20, b"3 0 x 1"), "line 20: '3 0 x 1': 'x' is not a number"),
    "crlf_word.ply": (
        line(PLY, 20, b"3 0 x 1").replace(b"\n", b"\r\n"), "line 20: '3 0 x 1': 'x'"),
    "more_on_one.ply": (line(PLY, 20, b"3 0 5 3 1"), "line 20: .* does not give a face: .* .1. as on"),
    "more_on_vertex.ply": (line(PLY, 13, b"0 0 1 1"), "line 13: .* does not give a vertex: .* .1. as on"),
    "too_few.ply": (line(PLY, 13, b"0 1"), "line 13: '0 1' does not give a vertex: it has too few.* x, y, z"),
    "corners.ply": (line(PLY, 20, b"4 0 3 1"), "line 20: .*it announces 4 numbers in vertex_indices, but 3 follow"),
    "fraction_of_list.ply": (line(PLY, 20, b"2.5 0 3 1"), "line 20: .*it announces 2.5 numbers"),
    "two_corners.ply": (line(PLY, 20, b"2 0 3"), "line 20: a face has three corners or more, this one 2"),
    "negative.ply": (line(PLY, 20, b"3 0 3 -1"), "line 20: a face uses vertex -1, but there are 8"),
    "fraction.ply": (line(PLY, 20, b"3 0 3 1.5"), "line 20: a face uses vertex 1.5, but there are 8"),
    "beyond.ply": (line(PLY, 20, b"3 0 3 12345678"), "line 20: a face uses vertex 12345678, but there are 8"),
    "line_less.ply": (line(PLY, 20, b""), "8 of 'vertex' and 12 of 'face', but 19 lines .*29 is the last.*cut short"),
    "line_more.ply": (PLY + b"3 0 1 2\n", "8 of 'vertex' and 12 of 'face', but 21 lines .*line 31 is the last"),
    "vertices_more.ply": (PLY.replace(b"vertex 8", b"vertex 9"), "9 of 'vertex' and 12 of 'face', but 20 lines"),
    "faces_fewer.ply": (PLY.replace(b"face 12", b"face 11"), "8 of 'vertex' and 11 of 'face', but 20 lines"),
    "negative_count.ply": (PLY.replace(b"face 12", b"face -12"), "'element face -12', which no PLY file should have"),
    "edges_after.ply": (
        PLY.replace(b"end_header", b"element edge 2\nproperty int a\nproperty int b\nend_header") + b"0 1\n1 2\n",
        CUBE,
    ),
    "short_exponent.ply": (PLY.replace(b"0.1", b"1.0-001"), CUBE),
    "end_of_file.ply": (PLY + b"\x1a", CUBE),
    "edges_as_lists.ply": (extended(b"edge 1\nproperty list uchar int vertex_indices", b"2 0 1\n"), CUBE),
    "materials.ply": (extended(b"material 1\nproperty list uchar uchar name\nproperty int n", b"3 98 99 97 0\n"), CUBE),
    "patches.ply": (
        extended(b"multi_patch 1\nproperty list uchar int vertex_indices", b"4 0 1 3 2\n"),
        "has lists of vertices, vertex_indices, in its element 'multi_patch', which is not read",
    ),
    "faces_twice.ply": (
        extended(b"face 1\nproperty list uchar int vertex_indices", b"3 0 1 2\n"),
        "'element face 1', which no PLY file should have",
    ),
    "other_list.ply": (ply(T, "", name="corners"), "element 'face' has no list vertex_indices or .*, but corners"),
    "misspelt.ply": (PLY.replace(b"element face", b"elements face"), "its header has 'elements face 12', which no PLY"),
    # Binary PLY.
    "newline_after.ply": (LITTLE + b"\r\n", CUBE),
    "more_after.ply": (LITTLE + b"\3\1", "goes on for 2 bytes after all that its header announces"),
    "binary_faces_fewer.ply": (LITTLE.replace(b"face 12", b"face 11"), "goes on for 13 bytes"),
    "binary_vertices_more.ply": (LITTLE.replace(b"vertex 8", b"vertex 90"), "do not go with its header"),
    "binary_one_vertex_more.ply": (  # takes the first 12 of the 13 bytes of a face, and its last one for a face of none
        LITTLE.replace(b"vertex 8", b"vertex 9"),
        "face 0: a face has three corners or more, this one 0 .12 faces and 9 vertices are announced",
    ),
    "binary_fraction.ply": (
        ply([[0, 1, 2]], "<", lists=("uchar", "float"))[:-4] + struct.pack("<f", 1.5),
        "face 0: a face uses vertex 1.5",
    ),
    "facet_first.stl": (STL.replace(b"solid cube\n", b"", 1), "not an STL file: .* no text that begins with 'solid'"),
    "objects.obj": (more(OBJ, 1, b" 1 1 1", 8).replace(b"f", b"g a\nf", 1) + b"o b\nv 1 2 3\n", CUBE),
}  # fmt: skip


def read(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    vertices, triangles, _ = read_cad(tmp_path / name)
    return vertices[triangles]


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_as_it_is_meant_or_refused_with_the_line(tmp_path, name):
    data, message = FILES[name]
    if message is CUBE:
        corners = read(tmp_path, name, data)
        assert len(corners) == 12
        assert topology.areas(corners.reshape(-1, 3), np.arange(36).reshape(-1, 3)).sum() == pytest.approx(0.24)
        assert topology.tetrahedra(corners.reshape(-1, 3), np.arange(36).reshape(-1, 3)).sum() == pytest.approx(0.008)
        return
    with pytest.raises(InputError, match=message) as refusal:
        read(tmp_path, name, data)
    assert name in str(refusal.value)


# Damaged files. Coordinates of 0 and 1 are the worst to tell from numbers of vertices.
UNIT = (V > 0).astype(int)
SOUND = {  # with the numbers that each vertex and each face has beside its own
    "stl": (text_stl("cube", T), 0, 0),
    "obj": (b"".join(obj(T, vertices=UNIT)), 0, 0),
    "quads.obj": (b"".join(obj(QUADS, vertices=UNIT, after=" 1 0 1")), 3, 0),
    "off": (off(T, vertices=UNIT), 0, 0),
    "as_long.off": (off(T, after=" 1", vertices=UNIT), 1, 0),
    "coloured.off": (off([*QUADS[:3], *T[6:].tolist()], face_after=" 1 0 1", vertices=UNIT), 0, 3),
    "ply": (ply(T, "", vertices=UNIT), 0, 0),
    "quads.ply": (ply(QUADS, "", extra=[("float", "quality", 1)], vertices=UNIT), 1, 1),
}


def by_lines(form, data, of_vertex, of_face):
    """Corners (T, 3, 3) as one reads them who takes every line of a sound file for what it is, and nothing else."""
    rows, points, faces = [text.split() for text in data.decode().splitlines()], [], []
    if form == "stl":
        for k in range(1, len(rows) - 1, 7):
            keywords = [" ".join(row[:1]) for row in rows[k : k + 7]]
            assert keywords == ["facet", "outer", *3 * ["vertex"], "endloop", "endfacet"]
            points += [[float(word) for word in row[1:]] for row in rows[k + 2 : k + 5]]
        assert rows[0][0] == "solid" and rows[-1][0] == "endsolid"
        return np.array(points).reshape(-1, 3, 3)
    if form == "obj":
        assert all(row[0] in ("v", "f") for row in rows)
        points = [row[1:] for row in rows if row[0] == "v"]
        faces = [[len(row) - 1, *(int(word) - 1 for word in row[1:])] for row in rows if row[0] == "f"]
    else:
        if form == "ply":
            counts = [int(row[2]) for row in rows if row[0] == "element"]
            rows = rows[rows.index(["end_header"]) + 1 :]
        else:
            counts, rows = [int(word) for word in rows[1][:2]], rows[2:]
        assert len(rows) == sum(counts)
        points, faces = rows[: counts[0]], [[int(word) for word in row] for row in rows[counts[0] :]]
    points = np.array([[float(word) for word in point] for point in points])
    assert points.shape[1] == 3 + of_vertex and all(len(face) == 1 + face[0] + of_face for face in faces)
    corners = [face[1 : 1 + face[0]] for face in faces]
    sizes = np.array([face[0] for face in faces])
    assert sizes.min() >= 3 and min(map(min, corners)) >= 0
    return points[:, :3][triangulated(points[:, :3], sizes, np.concatenate(corners))]


def damaged(data, random):
    """A text with one word or line less, more, twice or another one there, or with another count."""
    lines = data.split(b"\n")[:-1]
    k = random.integers(len(lines))
    words = lines[k].split()
    w = random.integers(len(words))
    other = random.choice([word for text in lines for word in text.split()])
    kind = random.integers(8)
    if kind == 0:
        del words[w]
    elif kind == 1:
        words.insert(random.integers(len(words) + 1), other)
    elif kind == 2:
        words[w] = other
    elif kind == 3 and words[w].isdigit():
        words[w] = b"%d" % (int(words[w]) + random.choice([-1, 1]))
    lines[k] = b" ".join(words)
    if kind == 4:
        del lines[k]
    elif kind == 5:
        lines.insert(random.integers(len(lines) + 1), lines[k])
    elif kind == 6 and k:
        lines[k - 1] += b" " + lines.pop(k)
    elif kind == 7:
        lines[k : k + 1] = b" ".join(words[:w]), b" ".join(words[w:])
    return b"\n".join(lines) + b"\n"


@pytest.mark.parametrize("name", SOUND)
def test_a_damaged_text_is_refused_or_read_as_its_lines_say(tmp_path, name, monkeypatch):
    data, *numbers = SOUND[name]
    form, random, refused = name.split(".")[-1], np.random.default_rng(7), 0
    right = read(tmp_path, f"a.{form}", data)
    assert np.array_equal(right, by_lines(form, data, *numbers))
    reader = READERS[f".{form}"]
    for _ in range(400):
        mutant = damaged(data, random)
        monkeypatch.setitem(READERS, f".{form}", lambda _, mutant=mutant: reader(mutant))  # to write files takes longer
        try:
            vertices, triangles, _ = read_cad(tmp_path / f"a.{form}")
            corners = vertices[triangles]
        except InputError:
            refused += 1
            continue
        if not np.array_equal(corners, right):
            assert np.array_equal(corners, by_lines(form, mutant, *numbers)), mutant.decode()
    assert 150 < refused < 400


@pytest.mark.parametrize("form", ["stl", "ply"])
def test_a_binary_file_with_bytes_less_or_more_is_refused(tmp_path, form):
    data, random = {"stl": BINARY, "ply": ply(T, "<", vertices=UNIT)}[form], np.random.default_rng(7)
    for _ in range(30):
        at, count = random.integers(400, len(data)), random.integers(1, 60)
        for mutant in (data[:at] + data[at + count :], data[:at] + bytes([1]) * count + data[at:]):
            with pytest.raises(InputError):
                read(tmp_path, f"a.{form}", mutant)
