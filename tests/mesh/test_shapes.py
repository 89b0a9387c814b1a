"""Sound shapes: units, symmetry, measures, files."""

import json

import numpy as np
import pytest
from shapes_made import cube, save, sphere
from stored import unknowns

from isarflow.core.errors import InputError
from isarflow.mesh import symmetry, topology
from isarflow.mesh.build import build_meshes, write
from isarflow.mesh.ground import samples
from isarflow.mesh.io import read_ply, write_ply
from isarflow.mesh.read import target
from isarflow.mesh.remesh.misses import Followed
from isarflow.mesh.repair.surface import repair
from isarflow.scattering.mom.basis import fundamental_domain

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
PLANES = [[], ["xz"], ["yz"], ["xz", "yz"]]


def is_mirrored(vertices, triangles, axis):
    """True if every triangle has its exact image, and none crosses the plane or lies in it."""
    table = {tuple(point): number for number, point in enumerate((vertices + 0.0).tolist())}
    image = [table.get(tuple(point)) for point in (symmetry.mirrored(vertices, axis) + 0.0).tolist()]
    if None in image:
        return False
    faces = {frozenset(corners) for corners in triangles.tolist()}
    side = vertices[triangles][:, :, axis]
    apart = ((side >= 0).all(axis=1) ^ (side <= 0).all(axis=1)).all()
    return apart and {frozenset(corners) for corners in np.array(image)[triangles].tolist()} == faces


@pytest.mark.parametrize("mirror", PLANES)
def test_sphere_keeps_area_and_volume(tmp_path, mirror):
    path = save(tmp_path / "sphere.ply", *sphere())
    (mesh,), described = build_meshes(path, {"symmetry": mirror}, MESH, RADAR)
    assert topology.is_watertight(mesh[1])
    assert topology.areas(*mesh).sum() == pytest.approx(4 * np.pi * 0.15**2, rel=0.01)
    assert topology.tetrahedra(*mesh).sum() == pytest.approx(4 / 3 * np.pi * 0.15**3, rel=0.01)
    assert described["bands"][0]["unknowns"] == 1.5 * len(mesh[1])
    assert described["symmetry"] == mirror
    assert topology.shape(mesh[0][mesh[1]])[2].min() > 20
    assert all(is_mirrored(*mesh, axis) for axis in symmetry.axes(mirror))


@pytest.mark.parametrize("mirror", PLANES)
def test_cube_keeps_its_edges_and_corners(tmp_path, mirror):
    path = save(tmp_path / "cube.off", *cube(0.2))
    (mesh,), described = build_meshes(path, {"symmetry": mirror}, MESH, RADAR)
    assert all(is_mirrored(*mesh, axis) for axis in symmetry.axes(mirror))
    assert topology.areas(*mesh).sum() == pytest.approx(6 * 0.2**2, rel=1e-6)
    assert np.abs(mesh[0]).max() == pytest.approx(0.1)
    assert max(described["bands"][0]["hausdorff"].values()) < 1e-6


@pytest.mark.parametrize("mirror", PLANES[1:])
def test_solver_takes_the_planes(tmp_path, mirror):
    (mesh,), _ = build_meshes(save(tmp_path / "cube.ply", *cube(0.2)), {"symmetry": mirror}, MESH, RADAR)
    assert unknowns(fundamental_domain(*mesh, mirror)) == topology.unknowns(mesh[1])


def test_millimetres(tmp_path):
    vertices, triangles = cube(0.2)
    metres = build_meshes(save(tmp_path / "m.ply", vertices, triangles), {}, MESH, RADAR)[1]
    millimetres = build_meshes(save(tmp_path / "mm.ply", vertices * 1000, triangles), {"unit": "mm"}, MESH, RADAR)[1]
    assert millimetres["source"]["box"] == pytest.approx(metres["source"]["box"])
    assert millimetres["source"]["raw"]["box"] == pytest.approx([0.2] * 3)


def test_rotation_is_about_x_then_y_then_z():
    nose = np.array([[1.0, 0.0, 0.0]])
    assert target.in_metres(nose, {"rotate": [90, 0, 90]}) == pytest.approx(np.array([[0, 1, 0]]))
    assert target.in_metres(nose, {"rotate": [0, -90, 0]}) == pytest.approx(np.array([[0, 0, 1]]))
    assert target.in_metres(np.array([[0, 1.0, 0]]), {"rotate": [90, 90, 0]}) == pytest.approx(np.array([[1, 0, 0]]))


def test_repairs_are_made_and_counted():
    vertices, triangles = cube()
    vertices = np.concatenate([vertices, vertices[:1] + 1e-9, [[5.0, 5, 5]]])
    triangles = np.concatenate([triangles, triangles[:2], [[3, 3, 5]]])
    triangles[1] = np.where(triangles[1] == 0, 8, triangles[1])
    triangles[4:8] = triangles[4:8, ::-1]
    vertices, triangles, counts, _ = repair(vertices, triangles, 0.03, "cube.stl")
    assert len(vertices) == 8 and len(triangles) == 12
    assert topology.is_watertight(triangles)
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(1.0)
    assert counts["merged_vertices"] == 1
    assert counts["unused_vertices"] == 1
    assert counts["duplicate_triangles"] == 2
    assert counts["turned_triangles"] == 4


def test_inside_out_cube_is_turned():
    vertices, triangles, counts, _ = repair(cube()[0], cube()[1][:, ::-1], 0.03, "cube.stl")
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(1.0)
    assert counts["turned_triangles"] == 12


def test_hausdorff_is_the_largest_distance_and_its_place():
    """A flat square against one whose only inner vertex stands out by 20 mm."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]])
    triangles = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    raised = corners.copy()
    raised[4, 2] = 0.02
    (probes, there), (_, back), *_ = Followed(corners, triangles, 0.2).apart((raised, triangles))
    assert there.max() == pytest.approx(0.02) and probes[there.argmax()] == pytest.approx(raised[4])
    assert back.max() == pytest.approx(0.02, rel=1e-3)  # from the flat one's middle, straight up to the slopes


def test_unknowns_of_an_open_sheet_leave_out_its_rim():
    assert topology.unknowns(np.array([[0, 1, 2], [2, 1, 3]])) == 1


@pytest.mark.parametrize("mirror", [[], ["xz", "xy"]])
def test_open_round_walls_keep_their_radius(tmp_path, mirror):
    """A tube with a flat ring at one end; with chords inside alone they are 0.4 to 1.5 % smaller."""
    turn, here = 2 * np.pi * np.arange(96) / 96, np.arange(96)
    profile = [(-0.3, 0.1), (0.3, 0.1), (0.3, 0.16)]
    rings = [np.stack([0 * turn + x, r * np.cos(turn), r * np.sin(turn)], axis=1) for x, r in profile]
    quads = np.concatenate([np.stack([n, np.roll(n, -1), np.roll(n, -1) + 96, n + 96], 1) for n in (here, here + 96)])
    source = np.concatenate(rings), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    (mesh,), measures = build_meshes(save(tmp_path / "tube.ply", *source), {"symmetry": mirror}, MESH, RADAR)
    wall = mesh[1][np.abs(topology.shape(mesh[0][mesh[1]])[0][:, 0]) < 0.5]
    points, area, _ = samples(mesh[0], wall, 0.003)
    assert np.average(np.hypot(*points.T[1:]), weights=area) == pytest.approx(0.1, rel=2e-3)
    ends = mesh[0][topology.rims(mesh[1])[0]]
    for x, wanted in ((-0.3, 0.1), (0.3, 0.16)):
        start, stop = ends[np.abs(ends[:, 0, 0] - x) < 1e-6].transpose(1, 0, 2)
        along = start + np.linspace(0, 1, 11)[:, None, None] * (stop - start)
        assert np.hypot(*along.T[1:]).mean() == pytest.approx(wanted, rel=2e-3)
        assert np.abs(along[:, :, 0] - x).max() < 1e-6
    assert measures["bands"][0]["area"]["after"] == pytest.approx(topology.areas(*source).sum(), rel=5e-3)


@pytest.mark.parametrize("axis", [0, 1])
def test_half_of_a_shifted_grid_is_cut_in_the_plane(axis):
    vertices, triangles = sphere(1.0, 2)
    half = symmetry.positive_half(vertices, triangles, 1e-6, axis)
    assert half[0][:, axis].min() == 0
    whole = symmetry.with_mirror(*half, axis)
    assert topology.is_watertight(whole[1])
    assert topology.tetrahedra(*whole).sum() == pytest.approx(topology.tetrahedra(vertices, triangles).sum())


def test_ply_keeps_every_bit(tmp_path):
    vertices, triangles = sphere()
    write_ply(tmp_path / "a.ply", vertices + 1 / 3, triangles)
    again = read_ply(tmp_path / "a.ply")
    assert (again[0] == vertices + 1 / 3).all() and again[0].dtype == np.float64
    assert (again[1] == triangles).all() and again[1].dtype == np.int32
    assert target.read_cad(tmp_path / "a.ply")[0] == pytest.approx(vertices + 1 / 3)
    (tmp_path / "a.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:-5])
    with pytest.raises(InputError, match=r"a\.ply"):
        read_ply(tmp_path / "a.ply")


def test_written_files_agree(tmp_path):
    path = save(tmp_path / "cube.obj", *cube(0.2))
    mesh = MESH | {"edges_per_wavelength": 16}
    settings = {"target": {}, "mesh": mesh, "radar": RADAR}
    write(path, settings, tmp_path / "cube.json", tmp_path / "s.ply", [tmp_path / "cube-0.ply"])
    described = json.loads((tmp_path / "cube.json").read_text())
    vertices, triangles = read_ply(tmp_path / "cube-0.ply")
    (band,) = described["bands"]
    assert (band["vertices"], band["triangles"]) == (len(vertices), len(triangles))
    assert described["source"]["box"] == pytest.approx([0.2] * 3)
    assert set(described["repairs"]) >= {"merged_vertices", "turned_triangles"}
