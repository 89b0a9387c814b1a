"""Rims that meet, nearly meet or miss each other: what is closed depends on how wide gaps are, on nothing else."""

import itertools

import numpy as np
import pytest
from habits_made import revolved
from patches_made import WEDGE, octants, patch, skins, slotted, surface, turned, wedge
from shapes_made import cone, cube, soup, sphere, together

from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes, write
from isarflow.mesh.io import write_ply
from isarflow.mesh.repair import joins
from isarflow.mesh.repair.openings import across, openings
from isarflow.mesh.repair.surface import WELD, repair
from isarflow.scattering.solve import solve

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
EDGE = 0.0299792458  # m
TOLERANCE = WELD * EDGE  # 0.75 mm
BALL = 4 / 3 * np.pi * 0.15**3  # m^3


def euler(vertices, triangles):
    return len(vertices) - len(topology.edges(triangles).ends) + len(triangles)


def check_closed(parts, volume, accuracy):
    """The repairs of patches that become one closed surface of this volume in m^3."""
    sound, faces, repairs, limits = repair(*surface(parts), EDGE, "patches")
    assert topology.is_watertight(faces) and euler(sound, faces) == 2
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx(volume, rel=accuracy)
    assert limits["warnings"] == []
    return repairs


def reversed_some(parts):
    return [part[:, ::-1] if k % 2 else part for k, part in enumerate(parts)]


DIVISIONS = [
    (((1, 2), (1, 2), (2, 3)), (1, 1)),
    (((3, 4), (2, 5), (3, 1)), (2, 4)),
    (((1, 1), (4, 1), (1, 7)), (3, 1)),
    (((5, 3), (2, 2), (4, 4)), (1, 3)),
]
CHANGES = {
    "as drawn": lambda parts: parts,
    "turned": lambda parts: turned(parts, 1),
    "single precision": lambda parts: [part.astype(np.float32).astype(float) for part in turned(parts, 2)],
    "text in mm": lambda parts: [part.round(9) for part in turned(parts, 3)],
    "reversed": lambda parts: reversed_some(turned(parts, 4)),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("trailing", [1e-4, 3e-4, 1e-3])
def test_patches_that_meet_exactly_close_a_wing_thinner_than_the_tolerance_at_its_edge(trailing, change):
    for divisions, caps in DIVISIONS:
        parts = CHANGES[change](wedge(trailing, divisions, caps))
        repairs = check_closed(parts, WEDGE[0] * WEDGE[1] * trailing / 2, 1e-3)
        assert repairs["split_t_junctions"] > 0 and repairs["closed_cracks"] == 0


@pytest.mark.parametrize("trailing", [1e-4, 3e-4])
def test_a_trailing_edge_of_needles_is_joined_before_it_is_put_onto_what_it_stands_on(trailing):
    """No edge of it is short, so that nothing else says how far its corners may move."""
    low, high = np.array([[-WEDGE[0] / 2, y, -trailing / 2] for y in (0, WEDGE[1])])
    for divisions, caps in DIVISIONS:
        for count in (2, 4, 6):
            parts, top = wedge(trailing, divisions, caps), np.linspace(low, high, count) * [1, 1, -1]
            parts[2] = np.array([*[(a, low, b) for a, b in itertools.pairwise(top)], (low, high, top[-1])])
            check_closed(parts, WEDGE[0] * WEDGE[1] * trailing / 2, 1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_patches_that_miss_each_other_by_less_than_the_trailing_edge_close_a_wing(seed):
    trailing, random = 1e-3, np.random.default_rng(seed)
    for divisions, caps in DIVISIONS:
        parts = [part + random.uniform(-2e-5, 2e-5, 3) for part in turned(wedge(trailing, divisions, caps), seed)]
        repairs = check_closed(parts, WEDGE[0] * WEDGE[1] * trailing / 2, 0.1)
        assert repairs["closed_cracks"] > 0 and repairs["closed_holes"] == 0


FINE, COARSE = (12, 17, 13, 19, 15, 11, 18, 14), (7, 12, 9, 13, 10, 8, 11, 14)
SPHERES = {
    "on the sphere": octants(FINE),
    "chords 0.9 mm apart": octants(COARSE),
    "0.3 mm apart": octants(FINE, gap=3e-4),
    "overlapping by 0.3 mm": octants(FINE, gap=-3e-4),
    "rounded": [part.round(6) for part in turned(octants(FINE), 5)],
    "reversed": reversed_some(octants(FINE)),
}


@pytest.mark.parametrize("name", SPHERES)
def test_octants_that_sample_their_seams_apart_become_a_sphere(name):
    """Chords of the coarse one take 1.5 % of the volume."""
    repairs = check_closed(SPHERES[name], BALL, 0.016)
    assert repairs["closed_cracks"] > 0 and repairs["split_t_junctions"] > 100


def test_an_unsewn_sphere_is_meshed_as_a_closed_one(tmp_path):
    write_ply(tmp_path / "sphere.ply", *surface(octants(COARSE)))
    (mesh,), measures = build_meshes(tmp_path / "sphere.ply", {}, MESH, RADAR)
    assert topology.is_watertight(mesh[1]) and measures["source"]["warnings"] == []
    assert 9.2e-4 < measures["source"]["joined_by"] < 9.6e-4  # m; a chord of 33.7 mm is 0.94 mm from its arc
    assert measures["bands"][0]["unknowns"] == 1.5 * measures["bands"][0]["triangles"]


def test_seams_wider_than_the_tolerance_stay_open_and_are_told(tmp_path, capsys):
    _, faces, repairs, limits = repair(*surface(octants(FINE, gap=1.5e-3)), EDGE, "sphere")
    assert topology.components(faces)[0] == 8 and repairs["closed_cracks"] == 0
    (warning,) = limits["warnings"]
    assert "patches do not meet: near (" in warning and "mm away" in warning and "0.75 mm within" in warning
    write_ply(tmp_path / "sphere.ply", *surface(octants((3,) * 8, gap=1.5e-3)))
    settings = {"target": {}, "mesh": MESH, "radar": RADAR}
    write(tmp_path / "sphere.ply", settings, tmp_path / "m.json", tmp_path / "source.ply", [tmp_path / "mesh.ply"])
    assert "Warning: Its patches do not meet" in capsys.readouterr().out


@pytest.mark.parametrize(("trailing", "edge", "closed"), [
    (0, EDGE, True), (2e-4, EDGE, True), (5e-4, EDGE, True), (2e-4, EDGE / 3, True), (5e-4, EDGE / 3, False),
])  # fmt: skip
def test_two_skins_of_a_wing_are_joined_within_the_tolerance_and_what_is_open_is_told(trailing, edge, closed):
    sound, faces, _, limits = repair(*surface(skins(trailing)), edge, "wing")
    assert (topology.components(faces)[0] == 1) == closed
    assert topology.edges(faces).count.max() == 2  # no side is tied to the inside of the other
    (warning,) = limits["warnings"]
    if closed:
        tips = vertices_at_rims(sound, faces)
        assert np.abs(np.abs(tips[:, 1]) - 0.3).max() < 1e-9  # m: the tips alone are open
        assert "nearly closed" in warning and "2 openings" in warning and "19 mm wide" in warning  # of 24
    else:
        assert "0.5 mm away" in warning and "0.25 mm within which they are joined" in warning


def test_a_slit_that_goes_round_is_as_wide_as_across_it():
    """By the triangles between its rim and their middle it would be the whole ball that is open."""
    turn, width = np.linspace(0, np.pi, 41), 0.0025  # m; wider than what is called near
    profile = 0.15 * np.stack([-np.cos(turn), np.sin(turn)], axis=1)
    profile[:20, 0], profile[21:, 0] = profile[:20, 0] - width / 2, profile[21:, 0] + width / 2
    profile = np.concatenate([profile[:20], [[-width / 2, 0.15], [width / 2, 0.15]], profile[21:]])
    vertices, triangles = revolved(profile, 72)
    middle = vertices[triangles].mean(axis=1)
    slit = (np.abs(middle[:, 0]) < width / 2) & (np.arctan2(*middle[:, 1:].T) < 2.5)
    _, _, _, limits = repair(vertices, triangles[~slit], EDGE, "ball")
    (warning,) = limits["warnings"]
    assert "the largest of 1 openings" in warning and "about 2.5 mm wide" in warning
    for counts in COUNTS:
        sound, faces, _, _ = repair(*surface([slotted(9e-4, counts)]), EDGE, "slot")
        opened = openings(sound, faces)
        slot = opened.rims[opened.number == opened.length.argmin()]
        assert across(sound, slot) == pytest.approx(9e-4, rel=1e-3)
    ring = np.stack([np.arange(64), np.roll(np.arange(64), -1)], axis=1)
    assert across(cone(0.05, 0.3, 64)[0], ring) == pytest.approx(0.1, rel=0.01)


def vertices_at_rims(vertices, triangles):
    return vertices[np.unique(topology.rims(triangles)[0])]


COUNTS = [(1, 1), (12, 12), (1, 12), (5, 12), (7, 11), (40, 40), (150, 150)]


@pytest.mark.parametrize("change", [lambda part: part, lambda part: turned([part], 6)[0].round(6)])
def test_a_crack_is_closed_by_its_width_whatever_its_sides_are_cut_into(change):
    for counts in COUNTS:
        sound, faces, repairs, limits = repair(*surface([change(slotted(3e-4, counts))]), EDGE, "slot")
        assert euler(sound, faces) == 1  # a sheet without a hole
        assert topology.areas(sound, faces).sum() == pytest.approx(0.09, rel=1e-5)
        assert (repairs["closed_cracks"], repairs["closed_holes"]) == (1, 0)
        assert limits["joined_by"] == pytest.approx(3e-4, rel=0.02) and limits["warnings"] == []


def test_a_slot_wider_than_the_tolerance_stays_whatever_its_sides_are_cut_into():
    for counts in COUNTS:
        sound, faces, repairs, _ = repair(*surface([slotted(9e-4, counts)]), EDGE, "slot")
        assert euler(sound, faces) == 0
        assert topology.areas(sound, faces).sum() == pytest.approx(0.09 - 0.15 * 9e-4, rel=1e-6)
        assert repairs["closed_cracks"] == repairs["closed_holes"] == repairs["split_t_junctions"] == 0


def test_a_short_slot_is_closed_whatever_its_sides_are_cut_into():
    """Its rim of 62 mm is no longer than three edges: a fifth of a wavelength."""
    for counts in COUNTS:
        sound, faces, repairs, _ = repair(*surface([slotted(9e-4, counts, length=0.03)]), EDGE, "slot")
        assert euler(sound, faces) == 1
        assert (repairs["closed_cracks"], repairs["closed_holes"]) == (1, 0)


def test_a_slot_has_one_field_however_its_rim_is_cut(tmp_path):
    """Half a wave long at 1 GHz: as a slot it would resonate, and change the field by half of its peak."""
    fields, unknowns = [], []
    for counts in ((1, 1), (12, 12)):
        write_ply(tmp_path / "slot.ply", *surface([slotted(3e-4, counts)]))
        (mesh,), measures = build_meshes(tmp_path / "slot.ply", {}, MESH, RADAR | {"center_frequency": 2.0e9})
        unknowns.append(measures["bands"][0]["unknowns"])
        fields.append(solve(*mesh, [0.8e9, 1.0e9], [0, 30], [0], ["VV", "HH"], threads=1).field)
    assert unknowns[0] == pytest.approx(unknowns[1], rel=0.01)
    apart = np.abs(fields[0] - fields[1]).max() / np.abs(fields[0]).max()
    assert apart < 10 ** (0.05 / 20) - 1  # 0.0027 when this was set


def test_sheets_upon_each_other_and_the_rims_of_ribbons_stay_apart():
    sheet = cube(0.2)[0][:4], np.array([[0, 1, 2], [1, 3, 2]])
    sound, faces, repairs, _ = repair(*together(sheet, (sheet[0] + [0, 0, TOLERANCE / 2], sheet[1])), EDGE, "sheets")
    assert topology.components(faces)[0] == 2 and repairs["closed_cracks"] == 0
    for width, cuts in ((TOLERANCE / 2, (20, 1)), (TOLERANCE / 2, (20, 2)), (TOLERANCE / 3, (40, 3)), (0.002, (3, 2))):
        ribbon = patch([[0, 0, 0], [0.2, 0, 0], [0.2, width, 0], [0, width, 0]], *cuts)
        sound, faces, repairs, _ = repair(*surface([ribbon]), EDGE, "ribbon")
        assert topology.areas(sound, faces).sum() == pytest.approx(0.2 * width)
        assert repairs["closed_cracks"] == repairs["closed_holes"] == 0


def test_a_soup_of_loose_triangles_is_joined_in_few_rounds(monkeypatch):
    """Nearest pairs first, but everywhere at once: with one place after the other this sphere took 40 rounds."""
    monkeypatch.setattr(joins, "ROUNDS", 15)
    whole = sphere(0.15, 3)
    vertices, triangles = soup(*whole)
    vertices = vertices + np.random.default_rng(0).uniform(-2e-5, 2e-5, vertices.shape)
    sound, faces, repairs, _ = repair(vertices, triangles, EDGE, "soup")
    assert topology.is_watertight(faces) and (len(sound), len(faces)) == (642, 1280)
    assert repairs["welded_vertices"] == 3 * 1280 - 642
    assert topology.tetrahedra(sound, faces).sum() == pytest.approx(topology.tetrahedra(*whole).sum(), rel=1e-4)


@pytest.mark.parametrize("trailing", [1e-4, 3e-4])
def test_cracks_in_the_feet_of_fins_in_a_cross_close_each_by_itself(trailing):
    """All four feet lie along one line; with the cracks joined to each other the fins would be one torn surface."""
    turns = [np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    for divisions, caps in DIVISIONS[:2]:
        parts = wedge(trailing, divisions, caps)
        del parts[3]  # the cap at their foot
        sound, faces, _, limits = repair(*surface([part @ turn.T for turn in turns for part in parts]), EDGE, "fins")
        assert topology.is_watertight(faces) and topology.components(faces)[0] == 1 and limits["warnings"] == []
        volume = 4 * WEDGE[0] * WEDGE[1] * trailing / 2
        assert topology.tetrahedra(sound, faces).sum() == pytest.approx(volume, rel=2e-3)
