"""Files much finer than needed are thinned: what is pointed, sharp or symmetric stays so."""

import numpy as np
import pytest
from habits_made import ogive, revolved
from pointed_made import karman, rimmed
from shapes_made import fine_cube, save, torus

from isarflow.core.errors import InputError
from isarflow.mesh import symmetry, topology
from isarflow.mesh.build import build_meshes, load_source
from isarflow.mesh.ground import Ground, samples
from isarflow.mesh.repair import decimate as thinning
from isarflow.mesh.repair.arrange import first_crossing
from isarflow.mesh.repair.decimate import thin

RADAR = {"center_frequency": 3.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
EDGE = 0.00999308  # m
SHAPES = {"karman": (karman, 60, 120), "rimmed": (rimmed, 80, 120)}


@pytest.fixture
def few(monkeypatch):
    """Small files are thinned too."""
    monkeypatch.setattr(thinning, "FEW", 1000)


@pytest.mark.parametrize("name", SHAPES)
def test_a_thinned_surface_stays_where_it_was(name, few):
    make, *fine = SHAPES[name]
    source = make(*fine)
    vertices, triangles, off = thin(*source, EDGE)
    assert len(triangles) < 0.6 * len(source[1])
    for surface, other in ((source, (vertices, triangles)), ((vertices, triangles), source)):
        assert Ground(*other).distance(samples(*surface, EDGE / 4)[0])[0].max() <= min(1.01 * off, EDGE / 40) + 1e-9
    assert topology.areas(vertices, triangles).sum() == pytest.approx(topology.areas(*source).sum(), rel=1e-3)
    assert topology.is_watertight(triangles) and first_crossing(vertices, triangles) is None


def thorned(height):
    """A ring with thorns a triangle wide, which are none of its area."""
    vertices, triangles = torus(0.02, 0.005, 200, 60)
    normal = topology.shape(vertices[triangles])[0]
    normal = topology.gathered(triangles, np.repeat(normal[:, None], 3, axis=1), len(vertices))
    some = np.arange(0, len(vertices), 997)
    vertices[some] += height * normal[some] / np.linalg.norm(normal[some], axis=1)[:, None]
    return vertices, triangles


@pytest.fixture
def tried(monkeypatch):
    """How many triangles each decimation came to."""
    counts, decimated = [], thinning._decimated

    def counted(*given):
        made = decimated(*given)
        counts.append(len(made[1]))
        return made

    monkeypatch.setattr(thinning, "_decimated", counted)
    return counts


def test_what_thinning_would_change_too_much_stays_as_it_was(few, tried, monkeypatch):
    source = rimmed(80, 120)
    monkeypatch.setattr(thinning, "OFF", 1e-6)
    vertices, triangles, off = thin(*source, EDGE)
    assert vertices is source[0] and triangles is source[1] and off == 0
    assert tried and max(tried) < len(source[1])


def test_thorns_of_less_than_half_a_millimetre_stay(few, tried):
    """Thinned to 1,000 triangles the ring loses them: 0.42 mm, where 0.25 are allowed."""
    vertices, triangles, _ = thin(*thorned(4e-4), EDGE)
    assert len(tried) > 1 and len(triangles) == tried[-1] > tried[0]
    assert Ground(vertices, triangles).distance(samples(*thorned(4e-4), EDGE / 8)[0])[0].max() <= 1.01 * EDGE / 40


def dome(wall, count=12, length=0.3, radius=0.04):
    """The front of an ogive, hollow and open at its back: a profile whose ends, on the axis, are two fans."""
    circle = (radius**2 + length**2) / (2 * radius)
    skins = []
    for tip, less in ((length, 0), (length - 8 * wall, wall)):
        x = np.linspace(2 / 3 * length, tip, count)
        skins.append(np.stack([x, np.sqrt(circle**2 - x**2) + radius - circle - less], axis=1))
        skins[-1][-1, 1] = 0
    return revolved(np.concatenate([skins[0][::-1], skins[1]]), 240)


def test_fans_of_240_sectors_one_in_the_other_do_not_cross_when_thinned(tmp_path, few, tried):
    """With half of an edge as the chord, walls of 0.1 mm cross."""
    source = dome(1e-4)
    vertices, triangles, _ = thin(*source, 0.015)
    assert len(tried) > 1 and len(triangles) < 0.2 * len(source[1])
    assert topology.is_watertight(triangles) and first_crossing(vertices, triangles) is None
    loaded = load_source(save(tmp_path / "dome.ply", *source), {}, MESH, RADAR | {"center_frequency": 2.0e9})
    assert loaded.repairs["thinned_triangles"] > 0 and topology.is_watertight(loaded.triangles)


def test_a_tip_of_240_sectors_is_meshed(tmp_path, few):
    path, radar = save(tmp_path / "ogive.ply", *revolved(ogive(40), 240)), RADAR | {"center_frequency": 2.0e9}
    (mesh,), measures = build_meshes(path, {"symmetry": ["xz", "xy"]}, MESH, radar)
    assert measures["repairs"]["thinned_triangles"] > 10_000 and measures["bands"][0]["missed"] is None
    assert topology.is_watertight(mesh[1]) and first_crossing(*mesh) is None
    assert mesh[0][:, 0].max() == pytest.approx(0.3, abs=2e-4)  # 0.11 mm when this was set; an edge is 15 mm


def test_flat_faces_are_thinned_without_moving(few):
    source = fine_cube(0.2, 5)
    vertices, triangles, off = thin(*source, 0.02)
    assert len(triangles) < len(source[1]) / 2 and off < 1e-9
    assert topology.areas(vertices, triangles).sum() == pytest.approx(6 * 0.2**2)
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(0.2**3)


def test_a_fine_symmetric_file_is_symmetric_and_keeps_its_area_and_volume(tmp_path):
    source = rimmed(125, 200)
    path = save(tmp_path / "rimmed.ply", *source)
    target = {"symmetry": ["xz", "xy"]}
    (mesh,), measures = build_meshes(path, target, MESH, RADAR)
    assert measures["repairs"]["thinned_triangles"] > 20_000
    assert 0 < measures["source"]["thinned_by"] < EDGE / 40
    (band,) = measures["bands"]
    area, volume = topology.areas(*source).sum(), topology.tetrahedra(*source).sum()
    assert band["area"]["before"] == measures["source"]["area"] == pytest.approx(area, rel=1e-9)
    assert band["volume"]["before"] == measures["source"]["volume"] == pytest.approx(volume, rel=1e-9)
    assert topology.tetrahedra(*mesh).sum() == pytest.approx(volume, rel=1e-3)
    assert band["missed"] is None and band["mirror_error"] == 0


def test_a_symmetric_file_is_taken_though_thinning_makes_its_sides_differ(tmp_path, few, monkeypatch):
    """By 0.06 mm here; what thinning does, up to twice as far as it moves the surface, is no fault of the file."""
    monkeypatch.setattr(symmetry, "allowed", lambda radar: 1e-5)
    path = save(tmp_path / "rimmed.ply", *rimmed(80, 120))
    measures = load_source(path, {"symmetry": ["xz", "xy"]}, MESH, RADAR).measures
    assert measures["thinned_by"] > 2e-5


def test_a_file_whose_sides_differ_is_refused_though_it_is_thinned(tmp_path, few):
    vertices, triangles = rimmed(80, 120)
    vertices[vertices[:, 2] < 0, 2] *= 1.1  # by 2.5 mm; a hundredth of the wavelength is 1 mm
    path = save(tmp_path / "rimmed.ply", vertices, triangles)
    with pytest.raises(InputError, match="not symmetric about z = 0"):
        load_source(path, {"symmetry": ["xy"]}, MESH, RADAR)
    assert load_source(path, {"symmetry": ["xz"]}, MESH, RADAR).repairs["thinned_triangles"] > 0
