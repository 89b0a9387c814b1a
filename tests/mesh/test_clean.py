"""Reading, units, repair, symmetry and refusals on small shapes."""

import json

import numpy as np
import pymeshlab
import pytest

from common.errors import InputError
from mesh import clean, symmetry, topology
from mesh.build import build, load, write
from mesh.io import read_ply, write_ply

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1}
MESH = {"edges_per_wavelength": 10, "bands": 1}
WAVELENGTH = 0.299792458  # m


def save(path, vertices, triangles):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(np.asarray(vertices, float), np.asarray(triangles, np.int32)))
    meshes.save_current_mesh(str(path))
    return path


def sphere(radius=0.15, subdivisions=4):
    meshes = pymeshlab.MeshSet()
    meshes.create_sphere(radius=radius, subdiv=subdivisions)
    return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()


def cube(size=1.0):
    corners = np.array([[n & 1, n >> 1 & 1, n >> 2 & 1] for n in range(8)], float) - 0.5
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return size * corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


@pytest.mark.parametrize("mirror", [[], ["xz"]])
def test_sphere_keeps_area_and_volume(tmp_path, mirror):
    path = save(tmp_path / "sphere.ply", *sphere())
    (mesh,), described = build(path, {"symmetry": mirror}, MESH, RADAR)
    assert topology.is_watertight(mesh[1])
    assert topology.areas(*mesh).sum() == pytest.approx(4 * np.pi * 0.15**2, rel=0.01)
    assert topology.tetrahedra(*mesh).sum() == pytest.approx(4 / 3 * np.pi * 0.15**3, rel=0.01)
    assert described["bands"][0]["unknowns"] == 1.5 * len(mesh[1])
    assert described["symmetry"] == mirror
    assert topology.shape(mesh[0][mesh[1]])[2].min() > 20


def test_cube_keeps_its_edges_and_corners(tmp_path):
    path = save(tmp_path / "cube.off", *cube(0.2))
    (mesh,), described = build(path, {"symmetry": ["xz"]}, MESH, RADAR)
    assert topology.areas(*mesh).sum() == pytest.approx(6 * 0.2**2, rel=1e-6)
    assert np.abs(mesh[0]).max() == pytest.approx(0.1)
    assert max(described["bands"][0]["hausdorff"].values()) < 1e-6


def test_millimetres(tmp_path):
    vertices, triangles = cube(0.2)
    metres = load(save(tmp_path / "m.ply", vertices, triangles), {}, WAVELENGTH)[0]
    millimetres = load(save(tmp_path / "mm.ply", vertices * 1000, triangles), {"unit": "mm"}, WAVELENGTH)[0]
    assert millimetres == pytest.approx(metres)


def test_rotation_is_about_x_then_y_then_z():
    nose = np.array([[1.0, 0.0, 0.0]])
    assert clean.in_metres(nose, {"rotate": [90, 0, 90]}) == pytest.approx(np.array([[0, 1, 0]]))
    assert clean.in_metres(nose, {"rotate": [0, -90, 0]}) == pytest.approx(np.array([[0, 0, 1]]))
    assert clean.in_metres(np.array([[0, 1.0, 0]]), {"rotate": [90, 90, 0]}) == pytest.approx(np.array([[1, 0, 0]]))


def test_repairs_are_made_and_counted():
    vertices, triangles = cube()
    vertices = np.concatenate([vertices, vertices[:1] + 1e-9, [[5.0, 5, 5]]])
    triangles = np.concatenate([triangles, triangles[:2], [[3, 3, 5]]])
    triangles[1] = np.where(triangles[1] == 0, 8, triangles[1])
    triangles[4:8] = triangles[4:8, ::-1]
    vertices, triangles, counts = clean.repair(vertices, triangles, "cube.stl")
    assert len(vertices) == 8 and len(triangles) == 12
    assert topology.is_watertight(triangles)
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(1.0)
    assert counts["merged_vertices"] == 1
    assert counts["unused_vertices"] == 1
    assert counts["duplicate_triangles"] == 2
    assert counts["turned_triangles"] == 4


def test_inside_out_cube_is_turned():
    vertices, triangles, counts = clean.repair(cube()[0], cube()[1][:, ::-1], "cube.stl")
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(1.0)
    assert counts["turned_triangles"] == 12


def test_fin_on_a_cube_keeps_its_junction(tmp_path):
    vertices, triangles = cube(0.2)
    vertices = np.concatenate([vertices, [[0.2, -0.1, 0.1], [0.2, 0.1, 0.1]]])  # a sheet on the edge x = z = 0.1
    triangles = np.concatenate([triangles, [[5, 8, 9], [5, 9, 7]]])
    path = save(tmp_path / "fin.ply", vertices, triangles)
    (mesh,), described = build(path, {"symmetry": ["xz"]}, MESH, RADAR)
    valence = topology.valence(mesh[1])
    assert valence.max() == 3
    assert described["bands"][0]["junction_edges"] == (valence == 3).sum() >= 6
    assert topology.unknowns(mesh[1]) == (valence - 1).sum()
    assert topology.areas(*mesh).sum() == pytest.approx(0.26, rel=1e-6)


def test_unknowns_of_an_open_sheet_leave_out_its_rim():
    assert topology.unknowns(np.array([[0, 1, 2], [2, 1, 3]])) == 1


def test_half_of_a_shifted_grid_is_cut_in_the_plane():
    vertices, triangles = sphere(1.0, 2)
    half = symmetry.left_half(vertices, triangles, 1e-6, "sphere")
    assert half[0][:, 1].min() == 0
    whole = symmetry.with_mirror(*half)
    assert topology.is_watertight(whole[1])
    assert topology.tetrahedra(*whole).sum() == pytest.approx(topology.tetrahedra(vertices, triangles).sum())


def test_ply_keeps_every_bit(tmp_path):
    vertices, triangles = sphere()
    write_ply(tmp_path / "a.ply", vertices + 1 / 3, triangles)
    again = read_ply(tmp_path / "a.ply")
    assert (again[0] == vertices + 1 / 3).all() and again[0].dtype == np.float64
    assert (again[1] == triangles).all() and again[1].dtype == np.int32
    assert clean.read_cad(tmp_path / "a.ply")[0] == pytest.approx(vertices + 1 / 3)
    (tmp_path / "a.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:-5])
    with pytest.raises(InputError, match=r"a\.ply"):
        read_ply(tmp_path / "a.ply")


def test_written_files_agree(tmp_path):
    path = save(tmp_path / "cube.obj", *cube(0.2))
    write(path, {}, MESH, RADAR, tmp_path / "cube.json", [tmp_path / "cube-0.ply"])
    described = json.loads((tmp_path / "cube.json").read_text())
    vertices, triangles = read_ply(tmp_path / "cube-0.ply")
    (band,) = described["bands"]
    assert (band["vertices"], band["triangles"]) == (len(vertices), len(triangles))
    assert described["source"]["box"] == pytest.approx([0.2] * 3)
    assert set(described["repairs"]) >= {"merged_vertices", "turned_triangles"}


def moebius():
    angle = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    ring = [((1 + s * np.cos(a / 2)) * np.cos(a), (1 + s * np.cos(a / 2)) * np.sin(a), s * np.sin(a / 2))
            for a in angle for s in (-0.3, 0.3)]  # fmt: skip
    faces = [t for k in range(19) for a in [2 * k] for t in ((a, a + 1, a + 2), (a + 1, a + 3, a + 2))]
    return np.array(ring), np.array([*faces, (38, 39, 1), (39, 0, 1)])


BROKEN_MESHES = {
    "one_sided": (*moebius(), {}, "one-sided"),
    "not_symmetric": (cube(0.2)[0] + [0, 0.03, 0], cube()[1], {"symmetry": ["xz"]}, r"60 mm"),
    "sheet_in_plane": (
        [[0, 0, 0], [1, 0, 0], [0, 0, 1]],
        [[0, 1, 2]],
        {"symmetry": ["xz"]},
        "in its mirror plane",
    ),
    "no_area": ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], {}, "no area"),
    "nan": ([[0, 0, 0], [1, 0, np.nan], [0, 0, 1]], [[0, 1, 2]], {}, "NaN"),
    "points_only": ([[0, 0, 0], [1, 0, 0], [0, 0, 1]], np.zeros((0, 3)), {}, "no triangles"),
}


@pytest.mark.parametrize("name", BROKEN_MESHES)
def test_broken_mesh_is_refused_by_name(tmp_path, name):
    vertices, triangles, target, message = BROKEN_MESHES[name]
    path = tmp_path / f"{name}.ply"
    write_ply(path, np.asarray(vertices, float), np.asarray(triangles, int).reshape(-1, 3))
    with pytest.raises(InputError, match=message) as refusal:
        build(path, target, MESH, RADAR)
    assert f"{name}.ply" in str(refusal.value)


BROKEN_FILES = {
    "empty.stl": (b"", "empty"),
    "text.stl": (b"This is a letter, not a mesh. " * 20, "not an STL"),
    "cut_short.stl": (b"\0" * 80 + (100).to_bytes(4, "little") + b"\0" * 500, "cut short"),
    "empty.obj": (b"", "."),
    "rubbish.ply": (b"not a ply file", "."),
    "rubbish.off": (b"\x01\x02\x03", "."),
    "no_facets.stl": (b"solid nothing\nfacet\nendsolid nothing\n", "."),
}


@pytest.mark.parametrize("name", BROKEN_FILES)
def test_broken_file_is_refused_by_name(tmp_path, name):
    content, message = BROKEN_FILES[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message) as refusal:
        build(tmp_path / name, {}, MESH, RADAR)
    assert name in str(refusal.value)
