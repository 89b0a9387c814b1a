"""Parts of a target by their names in one OBJ file: they are those of several files, and what is refused."""

import numpy as np
import pytest
from shapes_made import cube, sphere

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.mesh import topology
from isarflow.mesh.build import load_source, write
from isarflow.mesh.io import read_parts
from isarflow.mesh.read.target import REST, read_surfaces
from isarflow.mesh.shapes import write_stl

CARD = {"material": {"resistance": 377.0}}
MESH, RADAR = {"edges_per_wavelength": 10, "bands": 1}, {"center_frequency": C0, "bandwidth": 0.0, "frequencies": 1}
POINTS, CORNERS = sphere(0.4, 3)
PARTS = {"shell": (POINTS, CORNERS), "core": (POINTS / 2, CORNERS), "motor": (cube()[0] / 9 + [0.7, 0, 0], cube()[1])}
SAID = {"shell": CARD, "core": {}, "motor": {}}


def obj(parts, statement="g {}"):
    """Parts, {name: surface}, as the text of an OBJ file: `statement` is written before the faces of each."""
    text, first = "", 1
    for name, (points, corners) in parts.items():
        text += "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
        text += statement.format(name) + "\n" + "".join(f"f {a} {b} {c}\n" for a, b, c in (corners + first).tolist())
        first += len(points)
    return text


def read(path, text, said, **settings):
    path.write_text(text)
    return read_surfaces(path, {"parts": said, **settings})


@pytest.fixture
def alone(tmp_path):
    """The same parts, each with a file of its own."""
    for name, surface in PARTS.items():
        (tmp_path / f"{name}.obj").write_text(obj({name: surface}))
    return {name: {"mesh": str(tmp_path / f"{name}.obj"), **SAID[name]} for name in PARTS}


STATEMENTS = {
    "groups": "g {}",
    "objects": "o {}",
    "materials": "usemtl {}",
    "capitals": "G {} # a comment",
    "objects of one group": "g all\no {}",
    "materials of groups": "g group_{0}\nusemtl {0}",
    "groups before materials": "usemtl steel\ng {}",
}


@pytest.mark.parametrize("name", STATEMENTS)
def test_the_parts_of_a_file_are_those_of_several(tmp_path, alone, name):
    settings = {"unit": "mm", "scale": 3.0, "rotate": [10, 20, 30], "translate": [1.0, 2.0, 3.0]}
    found = read(tmp_path / "a.obj", obj(PARTS, STATEMENTS[name]), SAID, **settings)
    of_several = read_surfaces("", {"parts": alone, **settings})
    assert [*found] == [*of_several] == sorted(PARTS)
    for of_file, own in zip(found.values(), of_several.values(), strict=True):
        assert np.array_equal(of_file[0], own[0]) and np.array_equal(of_file[1], own[1])


def test_the_mesh_of_a_file_is_that_of_several_to_the_bit(tmp_path, alone):
    (tmp_path / "a.obj").write_text(obj(PARTS))
    for folder, parts in (("one", SAID | {REST: {}}), ("several", alone)):
        (tmp_path / folder).mkdir()
        files = [tmp_path / folder / name for name in ("a.json", "source.ply", "0.ply")]
        settings = {"target": {"parts": parts, "symmetry": ["xz"]}, "mesh": MESH, "radar": RADAR}
        write(tmp_path / "a.obj", settings, *files[:2], files[2:])
    for name in ("a.json", "source.ply", "0.ply"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "several" / name).read_bytes()
    assert read_parts(tmp_path / "one/0.ply")[1] == sorted(PARTS)  # of the rest nothing is there


def test_what_has_no_name_in_the_config_is_one_part(tmp_path):
    """Polygons without a group, too; a name is there once, however often its group is named."""
    points = "".join(f"v {x} {y} {z}\n" for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    text = f"{points}f 1 2 3\ng shell\nf 5 6 7\ng\nf 1 3 4\ng shell\nf 5 7 8\ng fin\nf 1 2 6 5\ng empty\n"
    found = read(tmp_path / "a.obj", text, {"shell": CARD})
    assert {name: len(surface[1]) for name, surface in found.items()} == {REST: 4, "shell": 2}
    assert {name: len(surface[0]) for name, surface in found.items()} == {REST: 6, "shell": 4}  # of the triangles alone
    source = load_source(tmp_path / "a.obj", {"parts": {"shell": CARD, REST: {}}}, MESH, RADAR)
    assert source.names == [REST, "shell"]
    area = np.bincount(source.part, topology.areas(source.vertices, source.triangles))
    assert area == pytest.approx([2, 1])


def test_the_rest_may_lie_in_metal(tmp_path):
    """A part that the config names may not."""
    hidden = {"shell": (POINTS, CORNERS), "core": (POINTS / 2, CORNERS)}
    (tmp_path / "a.obj").write_text(obj(hidden))
    source = load_source(tmp_path / "a.obj", {"parts": {"shell": {}, REST: {}}}, MESH, RADAR)
    assert source.names == [REST, "shell"] and {*source.part.tolist()} == {1}
    with pytest.raises(InputError, match="nothing is left of the part 'core'"):
        load_source(tmp_path / "a.obj", {"parts": {"shell": {}, "core": {}, REST: {}}}, MESH, RADAR)


def test_names_are_written_as_a_config_has_them(tmp_path):
    names = {"shell": "Körper (1), left", "core": "2", "motor": "_a.b-c"}
    text = obj({names[name]: surface for name, surface in PARTS.items()})
    said = {"K_rper_1_left": CARD, "a.b-c": {}, "part_2": {}}
    assert [*read(tmp_path / "a.obj", text, said)] == [*said]


REFUSED = {
    "unknown": (obj(PARTS), {"shel": {}}, r"no part 'shel'; did you mean 'shell'\? It has the groups core, motor, she"),
    "empty": (obj(PARTS) + "g hub\n", {"hub": {}}, r"no part 'hub'\. It has the groups core, motor, shell\.$"),
    "of two kinds": (
        obj(PARTS, "g {0}\nusemtl of_{0}"),
        {"shell": {}, "core": {}, "of_motor": {}},
        r"'of_motor'; did you mean 'motor'\? It has the groups core, .*; materials of_core, of_motor, of_shell\.$",
    ),
    "no groups": (obj(PARTS, "s 1"), {"shell": {}}, "has no named groups, objects, materials .* each part a 'mesh'"),
    "names that are none": (obj(PARTS, "g"), {"shell": {}}, "has no named groups"),
    "many": (obj({f"a_long_name_{k}": PARTS["motor"] for k in range(90)}), {"b": {}}, r"'b'\. It has .*\.\.\.\.$"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_names_that_a_file_does_not_have_are_refused(tmp_path, case):
    text, said, message = REFUSED[case]
    with pytest.raises(InputError, match=message) as refused:
        read(tmp_path / "a.obj", text, said)
    assert str(refused.value).startswith(str(tmp_path / "a.obj")) and len(str(refused.value)) < 800


def test_a_file_of_triangles_alone_has_no_parts(tmp_path):
    write_stl(tmp_path / "a.stl", PARTS["motor"])
    with pytest.raises(InputError, match=r"a\.stl has no named groups"):
        read_surfaces(tmp_path / "a.stl", {"parts": {"shell": {}}})
