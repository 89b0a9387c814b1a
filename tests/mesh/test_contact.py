"""Surfaces that cross, touch or lie in each other: their union, hung together by common edges, of closed-form area."""

import numpy as np
import pytest
from shapes_made import cube, fine_cube, lofted, sphere, together, torus
from stored import unknowns

from isarflow.core.errors import InputError
from isarflow.mesh import symmetry, topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.io import write_ply
from isarflow.mesh.repair import arrange
from isarflow.mesh.repair.boxes import near_boxes
from isarflow.mesh.repair.surface import repair
from isarflow.scattering.mom.basis import fundamental_domain

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
EDGE = 0.0299792458  # m
SIDE = 0.2  # m, of every sheet and cube
TURN = np.linalg.qr([[0.3, -1.0, 0.2], [0.8, 0.1, -0.5], [0.1, 0.4, 1.0]])[0]


def sheet(cuts=1, scale=1.0):
    x, y = np.meshgrid(*[np.linspace(-SIDE / 2, SIDE / 2, cuts + 1) * scale] * 2, indexing="ij")
    first = (np.arange(cuts)[:, None] * (cuts + 1) + np.arange(cuts)).reshape(-1, 1)
    faces = np.concatenate([first + np.array([0, cuts + 1, cuts + 2]), first + np.array([0, cuts + 2, 1])])
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), faces


def upright(cuts=1, scale=1.0):
    vertices, faces = sheet(cuts, scale)
    return vertices[:, [0, 2, 1]], faces


def moved(shape, *shift):
    return shape[0] + np.array(shift), shape[1]


def dented():
    """A cube whose top is pushed in until it comes out at the bottom, by a fourth of a side."""
    vertices, triangles = fine_cube(SIDE, 1)
    vertices[np.abs(vertices - [0, 0, SIDE / 2]).max(axis=1) < 1e-9] = 0, 0, -0.75 * SIDE
    return vertices, triangles


# Shape, area in m^2, triangles at each edge of the line where surfaces meet (0: none is left), its length in m, and
# repairs counted.
LONG, WIDE = 1.6 * SIDE, (1.6 * SIDE) ** 2
CASES = {
    "X along edges": (together(sheet(), upright()), 0.08, 4, SIDE, {"connected_crossings": 4}),
    "X of fine plates": (together(sheet(6), upright(6)), 0.08, 4, SIDE, {"merged_vertices": 7}),
    "X elsewhere": (together(sheet(), moved(upright(), 0.013, 0, 0.021)), 0.08, 4, 0.187, {"connected_crossings": 4}),
    "T": (together(sheet(), moved(upright(), 0, 0, 0.1)), 0.08, 3, SIDE, {"connected_crossings": 3}),
    "T inside": (together(sheet(5), moved(upright(1, 0.7), 0.013, 0.003, 0.07)), 0.0596, 3, 0.14, {}),
    "T above": (together(sheet(), moved(upright(), 0, 0, 0.1002)), 0.08004, 3, SIDE, {"landed_vertices": 2}),
    "T below": (together(sheet(), moved(upright(), 0, 0, 0.0998)), 0.07996, 3, SIDE, {"landed_vertices": 2}),
    "overlap": (together(sheet(), moved(sheet(), 0.05, 0.03, 0)), 0.0545, 0, 0, {}),
    "fine overlap": (together(sheet(3), moved(sheet(4), 0.05, 0.03, 0)), 0.0545, 0, 0, {}),
    "doubled, cut otherwise": (together(sheet(), (sheet()[0] * [1, -1, 1], sheet()[1])), 0.04, 0, 0, {}),
    "overlapping cubes": (together(cube(SIDE), moved(cube(SIDE), 0.1, 0.1, 0.1)), 0.42, 0, 0, {"united_solids": 1}),
    "cubes face to face": (together(cube(SIDE), moved(cube(SIDE), 0.2, 0.05, 0)), 0.42, 0, 0, {"united_solids": 1}),
    "wall cut otherwise": (together(cube(SIDE), moved(fine_cube(SIDE, 2), 0.2, 0, 0)), 0.4, 0, 0, {"united_solids": 1}),
    "cubes at an edge": (together(cube(SIDE), moved(cube(SIDE), 0.2, 0.2, 0.03)), 0.48, 4, 0.17, {}),
    "sheet shut in": (together(cube(SIDE), sheet(1, 0.7)), 0.24, 0, 0, {"hidden_triangles": 2}),
    "cube shut in": (together(cube(SIDE), cube(SIDE / 2)), 0.24, 0, 0, {"hidden_triangles": 12, "united_solids": 1}),
    "sheet through cube": (together(cube(SIDE), sheet(1, 1.6)), 0.2 + WIDE, 3, 0.8, {"hidden_triangles": 6}),
    "cube on plate": (together(moved(cube(SIDE), 0, 0, 0.1), sheet(1, 1.6)), 0.2 + WIDE, 3, 0.8, {}),
    "fin on cube": (together(cube(SIDE), moved(upright(), 0, 0, 0.2)), 0.28, 3, SIDE, {"connected_crossings": 5}),
}  # fmt: skip


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("name", CASES)
def test_union_has_its_closed_form_area_and_junctions(tmp_path, name, turned):
    (vertices, triangles), area, meeting, length, counts = CASES[name]
    if turned:  # and rounded as a CAD file rounds it: nothing lies in one plane exactly
        vertices = (vertices @ TURN.T).astype(np.float32).astype(float)
    sound, faces, repairs, _ = repair(vertices, triangles, EDGE, name)
    assert topology.areas(sound, faces).sum() == pytest.approx(area, rel=1e-6)
    if not turned:
        assert {key: repairs[key] for key in counts} == counts
    if name in ("overlap", "fine overlap") or "face" in name or "otherwise" in name or "plate" in name.split():
        assert repairs["overlapping_triangles"] > 0
    path = tmp_path / "shape.ply"
    write_ply(path, vertices, triangles)
    (mesh,), measures = build_meshes(path, {}, MESH, RADAR)
    (band,) = measures["bands"]
    assert len(arrange.crossings(*mesh)) == 0
    edges, _, many = topology.edges(mesh[1])
    assert topology.areas(*mesh).sum() == pytest.approx(area, rel=1e-5)
    assert set(many[many > 2]) == ({meeting} if meeting else set())
    ends = mesh[0][edges[many > 2]]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(length, rel=0.01)
    assert band["unknowns"] == (many - 1).sum() == pytest.approx(band["ideal_unknowns"], rel=0.2)
    assert band["watertight"] == ((many == 2).all())
    assert band["components"] == 1
    assert max(band["hausdorff"].values()) <= band["wavelength"] / 40
    assert band["edge"]["mean"] <= EDGE and band["edge"]["p99"] <= 1.35 * EDGE and band["edge"]["max"] <= 1.6 * EDGE
    assert band["smallest_angle"]["median"] >= 40 and band["smallest_angle"]["p1"] >= 15


def test_a_dent_through_the_bottom_keeps_all_that_waves_reach():
    vertices, triangles = dented()
    sound, faces, repairs, _ = repair(vertices, triangles, EDGE, "dent")
    assert topology.areas(sound, faces).sum() == pytest.approx(topology.areas(vertices, triangles).sum(), rel=1e-6)
    assert repairs["connected_crossings"] == 12 and repairs["hidden_triangles"] == 0
    assert np.bincount(topology.edges(faces).count)[[1, 2, 3, 4]].tolist() == [0, 96, 0, 6]


LONG_ARM, HALF, TOP = 0.24, 0.004, 0.008  # m: two crossed arms of 8 mm by 8 mm, motors from HALF / 2 below to TOP
MOTOR = 0.006  # m, the radius of a motor of 16 sides


def bar(low, high):
    vertices, triangles = cube()
    return np.array(low) + (vertices + 0.5) * (np.array(high) - low), triangles


def quadcopter(at):
    """Two arms, turned by 45 degrees about z, and motors at (+-at, +-at), all closed; and the union's volume in m^3."""
    cos = np.sqrt(0.5)
    arm, triangles = bar((-LONG_ARM / 2, -HALF, -HALF), (LONG_ARM / 2, HALF, HALF))
    arms = [(arm @ np.array([[cos, s * cos, 0], [-s * cos, cos, 0], [0, 0, 1]]), triangles) for s in (1, -1)]
    angle = np.pi / 8 * np.arange(16)
    motor = lofted(
        [np.stack([MOTOR * np.cos(angle), MOTOR * np.sin(angle), 0 * angle + z], 1) for z in (-HALF / 2, TOP)]
    )
    motors = [moved(motor, x, y, 0) for x in (-at, at) for y in (-at, at)]
    # Of a motor's section the arm holds what is within HALF of its axis, up to its end.
    side, across = MOTOR * np.cos(angle[:3]), MOTOR * np.sin(angle[:3])
    across = np.append(across[:2], HALF)
    side = np.interp(across, MOTOR * np.sin(angle[:3]), side)
    held = 2 * np.trapezoid(side + np.minimum(side, LONG_ARM / 2 - np.sqrt(2) * at), across)
    section = 8 * MOTOR**2 * np.sin(np.pi / 8)
    volume = 2 * LONG_ARM * (2 * HALF) ** 2 - (2 * HALF) ** 3 + 4 * (section * (TOP + HALF / 2) - held * 1.5 * HALF)
    return together(*arms, *motors), volume


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("at", [0.075, 0.085])
def test_a_quadcopter_of_overlapping_solids_becomes_one(tmp_path, at, turned):
    """The arms' sides lie in one plane and cut each other and the motors at slivers of a few um."""
    (vertices, triangles), volume = quadcopter(at)
    edge = 0.00857  # m, a tenth of a wavelength at 3.5 GHz
    if turned:
        vertices = vertices @ TURN.T
    vertices = vertices.astype(np.float32).astype(float)
    sound, faces, repairs, _ = repair(vertices, triangles, edge, "quadcopter")
    assert topology.is_watertight(faces) and arrange.first_crossing(sound, faces) is None
    assert repairs["united_solids"] == 5
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx(volume, rel=1e-5)
    again = repair(vertices, triangles, edge, "quadcopter")
    assert np.array_equal(sound, again[0]) and np.array_equal(faces, again[1])
    if at == 0.085:
        write_ply(tmp_path / "shape.ply", vertices, triangles)
        (mesh,), measures = build_meshes(tmp_path / "shape.ply", {}, MESH, RADAR | {"center_frequency": 3.5e9})
        assert topology.is_watertight(mesh[1]) and arrange.first_crossing(*mesh) is None
        assert topology.tetrahedra(*mesh).sum() == pytest.approx(volume, rel=0.01)
        assert measures["bands"][0]["smallest_angle"]["median"] >= 35


def test_a_solid_through_itself_keeps_its_outside():
    """A ring whose tube is thicker than the ring: what is left is the outside of two circles' turn."""
    large, small = 0.08, 0.1
    sound, faces, repairs, _ = repair(*torus(large, small, 60, 40), EDGE, "ring")
    assert topology.is_watertight(faces) and repairs["hidden_triangles"] > 0
    low = np.sqrt(small**2 - large**2)
    half = (np.pi / 2 * small**2 + large * low + small**2 * np.arcsin(large / small)) / 2  # of the part of a circle
    volume = 4 * np.pi * (low**3 / 3 + large * half)
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx(volume, rel=0.01)


def test_fine_spheres_that_overlap_are_united_without_being_thinned():
    """Their edges are a third of the wanted ones; the lens that they share has a volume of closed form."""
    radius, apart = 0.15, 0.151
    ball = sphere(radius, 5)
    sound, faces, repairs, _ = repair(*together(ball, moved(ball, apart, 0, 0)), 0.015, "spheres")
    assert repairs["thinned_triangles"] == 0 and repairs["united_solids"] == 1
    assert topology.is_watertight(faces) and arrange.first_crossing(sound, faces) is None
    lens = np.pi * (4 * radius + apart) * (2 * radius - apart) ** 2 / 12
    volume = topology.tetrahedra(sound, faces).sum()
    assert volume == pytest.approx(8 / 3 * np.pi * radius**3 - lens, rel=2e-3)


def test_what_does_not_touch_stays_as_it_is():
    vertices, triangles = together(sphere(0.1, 3), moved(sphere(0.1, 3), 0.3, 0, 0))
    sound, faces, counts = arrange.arrange(vertices, triangles, 1e-6, "two")
    assert sound is vertices and faces is triangles and not any(counts.values())


def test_sheets_that_part_at_the_touch_tolerance_are_refused_with_what_would_do():
    """Hinged at x = -0.1 m, 0.01 degrees open: they part by the tolerance, an edge / 4000, 43 mm from there."""
    angle = np.radians(0.01)
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    vertices, triangles = sheet(4)
    tilted = (vertices + np.array([SIDE / 2, 0.01, 0])) @ turn.T - [SIDE / 2, 0, 0]
    with pytest.raises(InputError, match=r"near \(.*\) m .* about 0\.015 mm .* neither apart .* Separate them"):
        repair(*together(sheet(5), (tilted, triangles)), EDGE, "wedge")
    apart = tilted + np.array([0, 0, 1e-3])  # m, more than an edge / 40, within which rims are joined
    sound, faces, _, _ = repair(*together(sheet(5), (apart, triangles)), EDGE, "apart")
    assert topology.components(faces)[0] == 2
    assert topology.areas(sound, faces).sum() == pytest.approx(2 * SIDE**2, rel=1e-6)
    assert topology.areas(*repair(*together(sheet(5), moved(sheet(4), 0, 0.01, 0)), EDGE, "one")[:2]).sum() == (
        pytest.approx(SIDE**2 + 0.01 * SIDE, rel=1e-6)
    )


def test_near_sheets_stay_two_and_open_boxes_keep_their_inside():
    gap = 0.004  # m, in a box of plates that do not meet: nothing crosses, nothing is shut in
    vertices, triangles = cube(SIDE)
    plates = []
    for pair in triangles.reshape(6, 2, 3):
        names, index = np.unique(pair, return_inverse=True)
        out = vertices[names].mean(axis=0)
        plates.append((vertices[names] + gap * out / np.linalg.norm(out), index.reshape(-1, 3)))
    sound, faces, repairs, _ = repair(*together(*plates, sheet(1, 0.5)), EDGE, "plates")
    assert not any(repairs.values())
    assert topology.areas(sound, faces).sum() == pytest.approx(0.25)


def test_what_cannot_be_resolved_is_refused_with_the_place(monkeypatch):
    monkeypatch.setattr(arrange, "ROUNDS", 1)
    with pytest.raises(InputError, match=r"X: surfaces cross near \(.*\) m"):
        repair(*CASES["X elsewhere"][0], EDGE, "X")


def test_boxes_that_overlap_are_all_found_once():
    generator = np.random.default_rng(3)
    low, other = generator.uniform(0, 1, (2, 900, 3)).round(2)
    high, other_high = low + generator.exponential(0.05, (900, 3)), other + generator.exponential(0.05, (900, 3))
    meet = ((low[:, None] <= other_high) & (high[:, None] >= other)).all(axis=2)
    pairs = near_boxes((low, high), (other, other_high), "boxes")
    assert sorted(map(tuple, pairs.tolist())) == list(zip(*(x.tolist() for x in np.nonzero(meet)), strict=True))


FIN = moved(upright(1, 0.7), 0, 0, 0.17)
ACROSS = FIN[0][:, [1, 0, 2]], FIN[1]
IN_PLANES = {
    "a sheet": (upright(), ["xz"], 0.04),
    "X": (together(sheet(), upright()), ["xz"], 0.08),
    "a fin": (together(cube(SIDE), FIN), ["xz"], 0.24 + 0.14**2),
    "a fin across": (together(cube(SIDE), FIN), ["xz", "yz"], 0.24 + 0.14**2),
    "two fins": (together(cube(SIDE), FIN, ACROSS), ["xz", "yz"], 0.24 + 2 * 0.14**2),
    "three sheets": (together(sheet(), upright(), (sheet()[0][:, [2, 0, 1]], sheet()[1])), ["xz", "yz"], 0.12),
}


@pytest.mark.parametrize("name", IN_PLANES)
def test_faces_in_a_mirror_plane_are_there_once(tmp_path, name):
    (vertices, triangles), planes, area = IN_PLANES[name]
    write_ply(tmp_path / "shape.ply", vertices, triangles)
    (mesh,), measures = build_meshes(tmp_path / "shape.ply", {"symmetry": planes}, MESH, RADAR)
    assert topology.areas(*mesh).sum() == pytest.approx(area, rel=1e-6)
    table = {tuple(point): number for number, point in enumerate((mesh[0] + 0.0).tolist())}
    faces = [frozenset(corners) for corners in mesh[1].tolist()]
    assert len(set(faces)) == len(faces)
    for axis in symmetry.axes(planes):
        image = np.array([table[tuple(point)] for point in (symmetry.mirrored(mesh[0], axis) + 0.0).tolist()])
        assert {frozenset(corners) for corners in image[mesh[1]].tolist()} == set(faces)
    assert (mesh[0][mesh[1]][:, :, 1] == 0).all(axis=1).sum() > 20 or name == "a fin across"
    assert unknowns(fundamental_domain(*mesh, planes)) == topology.unknowns(mesh[1]) == measures["bands"][0]["unknowns"]


def test_closed_solids_stay_closed_or_are_refused(monkeypatch):
    """As if a cut had lost a triangle: one of the union's that can be seen is taken for hidden."""
    one = together(cube(SIDE), moved(cube(SIDE), 0.1, 0.07, 0.05))
    hidden = arrange.hidden

    def one_more(vertices, triangles, passed):
        shut = hidden(vertices, triangles)
        shut[np.flatnonzero(~shut)[0]] = True
        return shut

    monkeypatch.setattr(arrange, "hidden", one_more)
    with pytest.raises(InputError, match=r"cross near \(.*\) m in a way that cannot be resolved"):
        arrange.arrange(*one, 1e-6, "two")
