"""Broken inputs: each gives a good mesh, or a refusal that names the file, what is wrong, and where."""

import re
import resource

import numpy as np
import pytest
from shapes_made import (
    binary_stl,
    check_solid,
    cone,
    cube,
    fine_cube,
    moebius,
    needle_fan,
    save,
    soup,
    sphere,
    together,
    torus,
)

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.io import write_ply

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
EDGE = 0.0299792458  # m
PLACE = r"\(-?[\d.e-]+, -?[\d.e-]+, -?[\d.e-]+\) m"


def made(tmp_path, shape, target=None, name="shape.ply"):
    """The mesh of a shape and the measures of the whole, the band's among them."""
    path = tmp_path / name
    write_ply(path, np.asarray(shape[0], float), np.asarray(shape[1], int).reshape(-1, 3))
    (mesh,), measures = build_meshes(path, target or {}, MESH, RADAR)
    return mesh, measures, measures["bands"][0]


# Refusals

BROKEN_FILES = {
    "empty.stl": (b"", "empty"),
    "empty.obj": (b"", "empty"),
    "text.stl": (b"This is a letter, not a mesh. " * 20, "not an STL"),
    "cut_short.stl": (binary_stl(*cube(0.2))[:-7], "cut short"),
    "cut_short_text.stl": (
        b"solid cube\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nver",
        ".",
    ),
    "rubbish.ply": (b"not a ply file", "^[^:]*rubbish.ply is not a readable PLY mesh: Header not found.$"),
    "rubbish.off": (b"\x01\x02\x03", "^[^:]*rubbish.off is not a readable OFF mesh: Invalid file.$"),
    "rubbish.obj": (bytes(range(256)) * 4, "."),
    "no_facets.stl": (b"solid nothing\nfacet\nendsolid nothing\n", "."),
    "no_such_vertex.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "uses vertex 7, but there are 3"),
    "no_such_vertex.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 8\n", "uses vertex 8, but there are 3"),
    "nan.obj": (b"v 0 0 0\nv 0.1 nan 0\nv 0 0.1 0\nf 1 2 3\n", r"NaN.*line 2"),
    "nan.off": (b"OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", r"NaN.*line 4"),
    "nan.stl": (
        binary_stl(np.where(np.arange(24).reshape(8, 3) == 5, np.nan, cube(0.2)[0]), cube()[1]),
        r"NaN.*triangle 1, with corners .*nan",
    ),
}


@pytest.mark.parametrize("name", BROKEN_FILES)
def test_file_is_refused_by_name(tmp_path, name):
    content, message = BROKEN_FILES[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message) as refusal:
        build_meshes(tmp_path / name, {}, MESH, RADAR)
    assert name in str(refusal.value)


BROKEN_SURFACES = {
    "moebius": (moebius(), {}, "one-sided"),
    "not_symmetric": ((cube(0.2)[0] + [0, 0.03, 0], cube()[1]), {"symmetry": ["xz"]}, r"y = 0: near .* by 60 mm"),
    "half_symmetric": ((cube(0.2)[0] + [0.03, 0, 0], cube()[1]), {"symmetry": ["xz", "yz"]}, "x = 0: near .* by 60 mm"),
    "no_area": (([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]), {}, "without area"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN_SURFACES)
def test_surface_is_refused_with_the_place(tmp_path, name):
    shape, target, message = BROKEN_SURFACES[name]
    with pytest.raises(InputError, match=message) as refusal:
        made(tmp_path, shape, target, f"{name}.ply")
    assert f"{name}.ply" in str(refusal.value)
    assert re.search(PLACE, str(refusal.value))


def test_missing_numbers_are_refused_with_the_vertex(tmp_path):
    with pytest.raises(InputError, match=r"NaN or infinite.*the first is vertex 1, at \[1\.0, 0\.0, nan\]"):
        made(tmp_path, ([[0, 0, 0], [1, 0, np.nan], [0, 0, 1]], [[0, 1, 2]]))


def test_points_alone_are_refused(tmp_path):
    with pytest.raises(InputError, match="no triangles"):
        made(tmp_path, ([[0, 0, 0], [1, 0, 0], [0, 0, 1]], np.zeros((0, 3))))


# Repairs


def test_flipped_half_is_turned(tmp_path):
    vertices, triangles = cube(0.2)
    triangles[:6] = triangles[:6, ::-1]
    mesh, measures, _ = made(tmp_path, (vertices, triangles))
    check_solid(EDGE, mesh, 0.2**3, 6 * 0.2**2)
    assert measures["repairs"]["turned_triangles"] == 6


def test_doubled_faces_are_dropped(tmp_path):
    vertices, triangles = cube(0.2)
    mesh, measures, _ = made(tmp_path, (vertices, np.concatenate([triangles, triangles[:, ::-1]])))
    check_solid(EDGE, mesh, 0.2**3, 6 * 0.2**2)
    assert measures["repairs"]["duplicate_triangles"] == 12
    assert measures["source"]["area"] == pytest.approx(6 * 0.2**2)
    assert measures["source"]["raw"]["area"] == pytest.approx(12 * 0.2**2)
    assert measures["source"]["raw"]["triangles"] == 24


def test_shifted_corners_are_welded(tmp_path):
    vertices, triangles = soup(*cube(0.2))
    shift = np.random.default_rng(4).uniform(-1, 1, vertices.shape) * 3e-4
    mesh, measures, _ = made(tmp_path, (vertices + shift, triangles))
    check_solid(EDGE, mesh, 0.2**3, 6 * 0.2**2)
    assert measures["repairs"]["welded_vertices"] == 36 - 8
    assert measures["source"]["tolerance"] == pytest.approx(EDGE / 40)


def test_t_junctions_are_tied_in(tmp_path):
    """The cube's top in four quarters, so that its edges have middles that the sides do not know."""
    vertices, triangles = cube(0.2)
    top = (vertices[triangles][:, :, 2] > 0.09).all(axis=1)
    fine_vertices, fine_triangles = fine_cube(0.2, 1)
    fine_top = (fine_vertices[fine_triangles][:, :, 2] > 0.09).all(axis=1)
    shape = together(
        (vertices, triangles[~top]), (fine_vertices + np.array([1e-4, -2e-4, 1e-4]), fine_triangles[fine_top])
    )
    mesh, measures, _ = made(tmp_path, shape)
    check_solid(EDGE, mesh, 0.2**3, 6 * 0.2**2)
    assert measures["repairs"]["split_t_junctions"] == 4


def test_intersecting_boxes_are_united(tmp_path):
    vertices, triangles = cube(0.2)
    mesh, measures, band = made(tmp_path, together((vertices, triangles), (vertices + 0.1, triangles)))
    check_solid(EDGE, mesh, 2 * 0.2**3 - 0.1**3, 12 * 0.2**2 - 6 * 0.1**2)
    assert measures["repairs"]["united_solids"] == 1
    assert band["components"] == 1


def test_three_solids_in_a_row_and_one_inside_are_one(tmp_path):
    vertices, triangles = cube(0.2)
    inside = (vertices / 4, triangles[:, ::-1])
    parts = [(vertices + np.array([x, x / 3, x / 5]), triangles) for x in (0, 0.15, 0.3)]
    far = (vertices + np.array([0, 0.5, 0]), triangles)
    mesh, measures, band = made(tmp_path, together(*parts, inside, far))
    assert measures["repairs"]["united_solids"] == 3
    assert band["components"] == 2 and band["watertight"]
    overlap = 0.05 * 0.15 * 0.17
    assert topology.tetrahedra(*mesh).sum() == pytest.approx(4 * 0.2**3 - 2 * overlap, rel=0.01)


def test_boxes_that_touch_are_united(tmp_path):
    vertices, triangles = cube(0.2)
    mesh, _, _ = made(tmp_path, together((vertices, triangles), (vertices + np.array([0.2, 0.05, 0]), triangles)))
    check_solid(EDGE, mesh, 2 * 0.2**3, 12 * 0.2**2 - 2 * 0.2 * 0.15)


def test_small_holes_are_closed(tmp_path):
    vertices, triangles = sphere()
    mesh, measures, _ = made(tmp_path, (vertices, triangles[np.setdiff1d(np.arange(len(triangles)), [7, 100, 101])]))
    assert measures["repairs"]["closed_holes"] in (2, 3)
    check_solid(EDGE, mesh, 4 / 3 * np.pi * 0.15**3, 4 * np.pi * 0.15**2)


def test_open_box_stays_open(tmp_path):
    vertices, triangles = cube(0.2)
    top = (vertices[triangles][:, :, 2] > 0.09).all(axis=1)
    mesh, measures, band = made(tmp_path, (vertices, triangles[~top]))
    assert not band["watertight"] and band["boundary_edges"] >= 4 * 0.2 / (1.6 * EDGE)
    assert band["volume"]["after"] is None and measures["repairs"]["closed_holes"] == 0
    assert topology.areas(*mesh).sum() == pytest.approx(5 * 0.2**2, rel=1e-6)


def test_single_triangle_is_a_sheet(tmp_path):
    mesh, _, band = made(tmp_path, ([[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0]], [[0, 1, 2]]))
    assert topology.areas(*mesh).sum() == pytest.approx(0.02, rel=1e-6)
    assert band["unknowns"] > 30 and band["boundary_edges"] > 0


def test_triangle_smaller_than_an_edge_gets_edges_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr("isarflow.mesh.resolution.ACROSS", 20)
    mesh, _, band = made(tmp_path, ([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]], [[0, 1, 2]]), {"unit": "m"})
    assert topology.areas(*mesh).sum() == pytest.approx(5e-5, rel=1e-6)
    assert band["wanted_edge"] == pytest.approx(0.01 / 20) and band["unknowns"] > 300


def test_non_manifold_edge_is_a_junction(tmp_path):
    """A fin of no thickness on an edge of a cube: three surfaces meet there."""
    vertices, triangles = cube(0.2)
    vertices = np.concatenate([vertices, [[0.2, -0.1, 0.1], [0.2, 0.1, 0.1]]])
    triangles = np.concatenate([triangles, [[5, 8, 9], [5, 9, 7]]])
    mesh, _, band = made(tmp_path, (vertices, triangles), {"symmetry": ["xz"]})
    at_edges = topology.edges(mesh[1]).count
    assert at_edges.max() == 3
    assert band["junction_edges"] == (at_edges == 3).sum() >= 6
    assert band["unknowns"] == (at_edges - 1).sum()
    assert topology.areas(*mesh).sum() == pytest.approx(0.26, rel=1e-6)


def test_needles_become_good_triangles(tmp_path):
    mesh, _, band = made(tmp_path, needle_fan())
    assert topology.areas(*mesh).sum() == pytest.approx(np.pi * 0.15**2, rel=0.01)
    assert band["smallest_angle"]["median"] >= 40 and band["smallest_angle"]["p1"] >= 15
    assert band["unknowns"] <= 1.2 * band["ideal_unknowns"]


@pytest.mark.parametrize("shape", [needle_fan(count=20_000), cone(count=20_000)], ids=["disc", "cone"])
def test_many_needles_around_a_point_are_refused_before_all_are_paired_with_all(tmp_path, shape):
    """They are 4e8 pairs, of 6 GB; the place is in the disc of 0.15 m or the cone of 0.3 m."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match=rf"too many triangles lie side by side near {PLACE}.*needles") as refusal:
        made(tmp_path, shape)
    place = np.array(re.findall(r"-?[\d.e-]+(?=[,)])", re.search(PLACE, str(refusal.value))[0]), dtype=float)
    assert np.linalg.norm(place) <= 0.3
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 2e6  # KiB


def test_degenerate_triangles_are_dropped(tmp_path):
    """A cube with an edge cut in two on one side only, the gap filled by a triangle without area."""
    vertices, triangles = cube(0.2)
    vertices = np.concatenate([vertices, [(vertices[0] + vertices[1]) / 2]])
    one = next(k for k, corners in enumerate(triangles.tolist()) if {0, 1} <= set(corners))
    a, b, c = np.roll(triangles[one], -next(k for k in range(3) if triangles[one][k - 1] not in (0, 1)))
    triangles = np.concatenate([np.delete(triangles, one, axis=0), [[a, 8, c], [8, b, c], [a, b, 8]]])
    mesh, measures, _ = made(tmp_path, (vertices, triangles))
    check_solid(EDGE, mesh, 0.2**3, 6 * 0.2**2)
    assert measures["repairs"]["degenerate_triangles"] + measures["repairs"]["split_t_junctions"] >= 1


def test_two_million_triangles(tmp_path):
    path = tmp_path / "ring.stl"
    path.write_bytes(binary_stl(*torus(0.2, 0.08, 1250, 800)))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    (mesh,), measures = build_meshes(path, {}, MESH, RADAR)
    check_solid(EDGE, mesh, 2 * np.pi**2 * 0.2 * 0.08**2, 4 * np.pi**2 * 0.2 * 0.08)
    (band,) = measures["bands"]
    assert measures["repairs"]["thinned_triangles"] > 1_900_000
    assert 0 < measures["source"]["thinned_by"] < max(band["hausdorff"].values()) < band["wavelength"] / 40
    assert band["unknowns"] <= 1.2 * band["ideal_unknowns"]
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) < 3.5e6  # KiB


# Sizes


@pytest.mark.parametrize(("factor", "unit"), [(1000, "mm"), (100, "cm"), (1 / 0.0254, "in")])
def test_mistaken_unit_is_refused_unless_it_is_stated(tmp_path, factor, unit):
    vertices, triangles = cube(0.9)
    if unit == "in":
        vertices = vertices * 10
    path = save(tmp_path / "cube.ply", vertices * factor, triangles)
    if unit != "in":
        with pytest.raises(InputError, match=rf"cube\.ply would be {0.9 * factor:g} m .*'unit: {unit}' \(0\.9 m\)"):
            build_meshes(path, {}, MESH, RADAR)
    with pytest.raises(InputError, match=rf"'length' says 0\.9 m.*did you mean 'unit: {unit}'"):
        build_meshes(save(tmp_path / "cube.ply", cube(0.9)[0] * factor, triangles), {"length": 0.9}, MESH, RADAR)


def test_needle_of_which_nothing_is_left_is_refused(tmp_path):
    with pytest.raises(InputError, match="nothing is left of it: its triangles are too narrow"):
        made(tmp_path, (np.array([[-0.2, 0, 0], [0.2, 0, 0], [0, 1e-7, 0]]), np.array([[0, 1, 2]])))


def test_speck_is_refused(tmp_path):
    with pytest.raises(InputError, match="too short"):
        made(tmp_path, cube(1e-4))


def test_length_is_checked(tmp_path):
    _, measures, _ = made(tmp_path, (cube(0.2)[0] * 1000, cube()[1]), {"unit": "mm", "length": 0.203})
    assert measures["source"]["box"] == pytest.approx([0.2] * 3)
    with pytest.raises(InputError, match=r"0\.2 m .* long, but its 'length' says 0\.21 m"):
        made(tmp_path, cube(0.2), {"length": 0.21})


def test_mesh_of_another_target_is_refused(tmp_path, monkeypatch):
    """A twentieth of a wavelength, 15 mm, is the most that a mesh may be off."""
    path = save(tmp_path / "sphere.ply", *sphere())
    monkeypatch.setattr("isarflow.mesh.build.TRIES", 1)
    monkeypatch.setattr("isarflow.mesh.build.FINER", (1,))
    for off in (0.014, 0.016):
        monkeypatch.setattr("isarflow.mesh.build._whole", lambda *_, off=off: (sphere()[0] + [off, 0, 0], sphere()[1]))
        if off < EDGE / 2:
            assert build_meshes(path, {}, MESH, RADAR)[1]["bands"][0]["hausdorff"]["to_source"] == pytest.approx(
                off, rel=0.02
            )
        else:
            with pytest.raises(InputError, match=rf"sphere.ply: .* miss by 1[56]\.?\d* mm near {PLACE}"):
                build_meshes(path, {}, MESH, RADAR)


def test_asymmetry_is_refused_above_a_hundredth_of_a_wavelength(tmp_path):
    vertices, triangles = cube(0.2)
    made(tmp_path, (vertices + np.array([0, 0.0014, 0]), triangles), {"symmetry": ["xz"]})
    with pytest.raises(InputError, match=r"y = 0: near .* by 3\.2 mm \(at most 3 mm"):
        made(tmp_path, (vertices + np.array([0, 0.0016, 0]), triangles), {"symmetry": ["xz"]})


def test_sheets_a_two_hundredth_of_a_wavelength_apart_stay_two(tmp_path):
    square = np.array([[0, 0, 0], [0.2, 0, 0], [0.2, 0.2, 0], [0, 0.2, 0]])
    gap = 10 * EDGE / 200
    path = save(
        tmp_path / "two.ply",
        np.concatenate([square, square + np.array([0, 0, gap])]),
        np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]),
    )
    (mesh,), measures = build_meshes(path, {}, MESH, RADAR)
    assert topology.areas(*mesh).sum() == pytest.approx(2 * 0.2**2)
    assert measures["bands"][0]["components"] == 2


def test_wall_between_touching_solids_goes(tmp_path):
    vertices, triangles = cube(0.2)
    width = np.ptp(vertices[:, 0])
    path = save(
        tmp_path / "two.ply",
        np.concatenate([vertices, vertices * [-1, 1, 1] + [width, 0, 0]]),
        np.concatenate([triangles, triangles[:, ::-1] + len(vertices)]),
    )
    (mesh,), measures = build_meshes(path, {}, MESH, RADAR)
    assert measures["repairs"]["hidden_triangles"] > 0
    assert topology.is_watertight(mesh[1])
    assert topology.areas(*mesh).sum() == pytest.approx(10 * 0.2**2, rel=0.01)


def test_rod_a_tenth_of_an_edge_thick_is_kept(tmp_path):
    """With its volume and few sides it has the field of a round one, and is not refined for its area, nor warned of."""
    turn = np.arange(12) * 2 * np.pi / 12
    ring = np.stack([0 * turn, 0.0015 * np.cos(turn), 0.0015 * np.sin(turn)], 1)
    vertices = np.concatenate([ring, ring + np.array([0.3, 0, 0]), [[0, 0, 0], [0.3, 0, 0]]])
    i, j = np.arange(12), (np.arange(12) + 1) % 12
    sides = np.concatenate([np.stack([i, i + 12, j], 1), np.stack([j, i + 12, j + 12], 1)])
    ends = np.concatenate([np.stack([j * 0 + 24, i, j], 1), np.stack([j * 0 + 25, j + 12, i + 12], 1)])
    rod = save(tmp_path / "rod.ply", vertices, np.concatenate([sides, ends]))
    (mesh,), measures = build_meshes(rod, {}, MESH, RADAR)
    (band,) = measures["bands"]
    assert topology.is_watertight(mesh[1])
    assert band["area"]["after"] - band["area"]["of_rods"] == pytest.approx(band["area"]["before"], rel=0.01)
    assert band["volume"]["after"] == pytest.approx(band["volume"]["before"], rel=0.01)
    assert band["missed"] is None


def test_text_stl_cut_between_facets_is_refused(tmp_path):
    facet = "FACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 0.2 0 0\nVERTEX 0 0.2 0\nENDLOOP\nENDFACET\n"
    path = tmp_path / "text.stl"
    path.write_text("SOLID A B\n" + facet)
    with pytest.raises(InputError, match="endsolid"):
        build_meshes(path, {}, MESH, RADAR)
    path.write_text("SOLID A B\n" + facet + "ENDSOLID A B\n")
    assert len(build_meshes(path, {}, MESH, RADAR)[0][0][1]) > 10
