"""Closed solids that touch on fine faces, sit in each other's holes or are strewn on each other become one body."""

import numpy as np
import pytest
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation
from shapes_made import check_solid, cube, fine_cube, lofted, sphere, together, tube

from isarflow.mesh import symmetry, topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.io import write_ply
from isarflow.mesh.repair import arrange
from isarflow.mesh.repair.surface import repair

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
EDGE = 0.0299792458  # m
TURN = Rotation.from_rotvec(np.radians(17) * np.array([0.6, 0.0, 0.8])).as_matrix()


def ngon(count, radius, height, turn=0.0):
    angle = 2 * np.pi * (np.arange(count) + turn) / count
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle + height], axis=1)


def capped_half(ball, side, points, turn):
    """The half of a closed convex shape on one side of z = 0, closed by a face with `points` more points in it."""
    vertices, triangles = symmetry.positive_half(ball[0] * [1, 1, side], ball[1][:, ::side], 1e-9, 2)
    rim = np.unique(topology.rims(triangles)[0])
    share = (np.arange(points) + 0.5) / points
    angle = (points * share + turn) * np.pi * (3 - np.sqrt(5))
    radius = 0.97 * np.linalg.norm(vertices[rim], axis=1).min() * np.sqrt(share)
    inner = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    cap = Delaunay(np.concatenate([vertices[rim], inner])[:, :2]).simplices
    cap = np.concatenate([rim, len(vertices) + np.arange(points)])[cap]
    vertices, triangles = np.concatenate([vertices, inner]), np.concatenate([triangles, cap])
    triangles = triangles[topology.areas(vertices, triangles) > 1e-14]
    return vertices * [1, 1, side], topology.orient(vertices, triangles, "half")[0][:, ::side]


def closed_and_sound(vertices, triangles):
    return topology.is_watertight(triangles) and arrange.first_crossing(vertices, triangles) is None


@pytest.mark.parametrize(
    ("subdivisions", "points", "cuts", "shift", "turned"),
    [
        (3, 900, "alike", 0.0, True),
        (3, 900, "otherwise", 0.0, False),
        (3, 900, "otherwise", 1e-7, True),
        (4, 4000, "otherwise", 0.0, True),
    ],
)
def test_halves_with_a_fine_common_face_become_one(subdivisions, points, cuts, shift, turned):
    """5,000 and 21,000 triangles; caps cut otherwise would cut each other into as many pieces as their product."""
    ball = sphere(0.15, subdivisions)
    lower = capped_half(ball, -1, points, 0.0 if cuts == "alike" else 0.5)
    vertices, triangles = together(capped_half(ball, 1, points, 0.0), (lower[0] - [0, 0, shift], lower[1]))
    volume = topology.tetrahedra(vertices, triangles).sum()
    if turned:
        vertices = vertices @ TURN.T
    sound, faces, repairs, _ = repair(vertices, triangles, EDGE, "halves")
    assert closed_and_sound(sound, faces) and topology.components(faces)[0] == 1
    assert repairs["hidden_triangles"] > 0
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx(
        volume, rel=1e-5 if len(triangles) < 20_000 else 2e-3
    )
    assert len(faces) < len(ball[1]) + 200  # nothing is left of the common face, nor of the pieces that it was cut into


def test_a_stack_of_fine_cubes_becomes_one_block():
    side, places = 0.1, np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3)
    cubes = [(shape[0] + side * at, shape[1]) for at in places for shape in [fine_cube(side, 1 + at.sum() % 2)]]
    sound, faces, _, _ = repair(*together(*cubes), EDGE, "stack")
    assert closed_and_sound(sound, faces)
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx((3 * side) ** 3, rel=1e-9)
    assert topology.areas(sound, faces).sum() == pytest.approx(6 * (3 * side) ** 2, rel=1e-9)


HALF, THICK, HOLE, HEAD, HIGH, BELOW = 0.04, 0.02, 0.005, 0.008, 0.006, 0.01  # m, of a plate and the bolt in its hole


def bolt_in_hole(facets, turn, gap, bolt_facets):
    """A square plate with a hole and a bolt in it, its head on the plate, `gap` metres narrower and turned by facets.

    Also the volume without what is left of air between them.
    """
    square = ngon(facets, 1.0, 0.0)
    square *= HALF / np.abs(square).max(axis=1, keepdims=True)
    top = square + np.array([0, 0, THICK])
    sections = np.stack([square, top, ngon(facets, HOLE, THICK), ngon(facets, HOLE, 0)])
    plate = sections.reshape(-1, 3), tube(1, 1, 1, facets)[1]
    levels = [(HOLE - gap, -BELOW), (HOLE - gap, THICK), (HEAD, THICK), (HEAD, THICK + HIGH)]
    bolt = lofted([ngon(bolt_facets, *level, turn) for level in levels])
    unit = bolt_facets / 2 * np.sin(2 * np.pi / bolt_facets)
    volume = (2 * HALF) ** 2 * THICK + unit * ((HOLE - gap) ** 2 * BELOW + HEAD**2 * HIGH)
    return together(plate, bolt), volume


BOLTS = {
    "exact": (24, 0.0, 0.0, 24),
    "turned": (24, 0.5, 0.0, 24),
    "turned a little": (32, 0.02, 0.0, 32),
    "finer": (24, 0.13, 0.0, 48),
    "of many facets": (64, 0.5, 0.0, 64),
    "loose": (24, 0.0, 5e-5, 24),
    "loose and turned": (40, 0.5, 9e-5, 64),
}


@pytest.mark.parametrize("name", BOLTS)
def test_a_bolt_fills_its_hole(tmp_path, name):
    """Facets that do not match, and a gap of some hundredths of a millimetre, leave slits that no mesh can follow."""
    (vertices, triangles), volume = bolt_in_hole(*BOLTS[name])
    edge = 2 * HALF / 20
    sound, faces, repairs, _ = repair(vertices, triangles, edge, "bolt")
    assert closed_and_sound(sound, faces) and topology.components(faces)[0] == 1
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx(volume, rel=5e-4)
    assert (repairs["closed_slits"] > 0) == (name != "exact")
    if name == "turned":
        write_ply(tmp_path / "bolt.ply", vertices, triangles)
        (mesh,), measures = build_meshes(tmp_path / "bolt.ply", {}, MESH | {"edges_per_wavelength": 50}, RADAR)
        assert closed_and_sound(*mesh) and measures["bands"][0]["missed"] is None
        assert topology.tetrahedra(*mesh).sum() == pytest.approx(volume, rel=5e-3)


def test_a_slit_that_is_wider_than_the_tolerance_stays():
    shape = together(cube(0.2), (cube(0.2)[0] + [0.2 + EDGE / 39, 0, 0], cube(0.2)[1]))
    sound, _, repairs, _ = repair(*shape, EDGE, "two")
    assert not any(repairs.values()) and np.array_equal(sound, shape[0])
    shape[0][8:, 0] -= EDGE / 39 - EDGE / 50
    sound, faces, repairs, _ = repair(*shape, EDGE, "two")
    assert repairs["closed_slits"] == repairs["united_solids"] == 1 and closed_and_sound(sound, faces)
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx(0.2**2 * (0.4 + EDGE / 50), rel=1e-9)


def rivets(sides, shape, deep):
    """A box of 0.2 m with rivets of these `sides` (N,) in metres on its faces, sunk by a share of them."""
    generator, parts = np.random.default_rng(3), [cube(0.2)]
    for k, side in enumerate(sides):
        vertices, triangles = shape(side)
        at = np.append(generator.uniform(-0.09, 0.09, 2), 0.1 + side * (0.5 - deep))
        turn = np.roll(np.eye(3), k % 3, axis=0) * (1 - 2 * (k // 3 % 2))
        parts.append(((vertices + at) @ turn, triangles[:, :: 1 - 2 * (k // 3 % 2)]))
    return together(*parts)


def twelve_sided(side):
    return lofted([ngon(12, side / 2, height) for height in (-side / 2, side / 2)])


@pytest.mark.parametrize("shape", [cube, twelve_sided])
@pytest.mark.parametrize("deep", [0.0, 0.5])
def test_rivets_that_the_field_cannot_see_are_dropped(tmp_path, shape, deep):
    vertices, triangles = rivets(np.full(600, 0.002), shape, deep)
    vertices = vertices @ TURN.T
    _, faces, repairs, _ = repair(vertices, triangles, 0.01, "rivets")
    assert repairs["dropped_details"] == 600 and len(faces) == 12
    if shape is cube and deep:
        write_ply(tmp_path / "rivets.ply", vertices, triangles)
        (mesh,), measures = build_meshes(tmp_path / "rivets.ply", {}, MESH, RADAR)
        check_solid(EDGE, mesh, 0.2**3, 6 * 0.2**2)
        assert measures["repairs"]["dropped_details"] == 600


def test_what_is_large_free_or_a_joint_is_no_detail():
    some = rivets(np.linspace(0.001, 0.004, 13), twelve_sided, 0.5)
    _, faces, repairs, _ = repair(*some, 0.002, "finer edges")
    assert repairs["dropped_details"] == 0 and repairs["united_solids"] == 13
    for deep, dropped in ((0.5, 6), (0.0, 0)):  # of 3 mm, they may stand out by 2.5
        _, faces, repairs, _ = repair(*rivets(np.full(6, 0.003), cube, deep), 0.01, "low and high ones")
        assert repairs["dropped_details"] == dropped and (len(faces) == 12) == (dropped > 0)
    free = together(some, (cube(0.002)[0] + [0, 0, 0.15], cube()[1]))
    _, faces, repairs, _ = repair(*free, 0.01, "a free one")
    assert repairs["dropped_details"] == 13 and topology.components(faces)[0] == 2
    foot, mast = cube(0.002), cube(0.02)  # m: without the foot the mast would stand free
    joint = together(cube(0.2), (foot[0] + [0, 0, 0.101], foot[1]), (mast[0] + [0, 0, 0.112], mast[1]))
    _, faces, repairs, _ = repair(*joint, 0.01, "a mast on a foot")
    assert repairs["dropped_details"] == 0 and topology.components(faces)[0] == 1
