"""Files much finer than needed are thinned: what is pointed, sharp or symmetric stays so."""

import pytest
from pointed_made import karman, rimmed
from shapes_made import fine_cube, save

from core.errors import InputError
from mesh import thin as thinning
from mesh import topology
from mesh.arrange import first_crossing
from mesh.build import build, load
from mesh.distance import samples
from mesh.ground import Ground
from mesh.thin import thin

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


def test_what_thinning_would_change_too_much_stays_as_it_was(few, monkeypatch):
    source = rimmed(40, 60)
    monkeypatch.setattr(thinning, "OFF", 1e-6)
    vertices, triangles, off = thin(*source, EDGE)
    assert vertices is source[0] and triangles is source[1] and off == 0


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
    (mesh,), measures = build(path, target, MESH, RADAR)
    assert measures["repairs"]["thinned_triangles"] > 20_000
    assert 0 < measures["source"]["thinned_by"] < EDGE / 40
    (band,) = measures["bands"]
    area, volume = topology.areas(*source).sum(), topology.tetrahedra(*source).sum()
    assert band["area"]["before"] == measures["source"]["area"] == pytest.approx(area, rel=1e-9)
    assert band["volume"]["before"] == measures["source"]["volume"] == pytest.approx(volume, rel=1e-9)
    assert topology.tetrahedra(*mesh).sum() == pytest.approx(volume, rel=1e-3)
    assert band["missed"] is None and band["mirror_error"] == 0


def test_a_file_whose_sides_differ_is_refused_though_it_is_thinned(tmp_path, few):
    vertices, triangles = rimmed(80, 120)
    vertices[vertices[:, 2] < 0, 2] *= 1.1  # by 2.5 mm; a hundredth of the wavelength is 1 mm
    path = save(tmp_path / "rimmed.ply", vertices, triangles)
    with pytest.raises(InputError, match="not symmetric about z = 0"):
        load(path, {"symmetry": ["xy"]}, MESH, RADAR)
    assert load(path, {"symmetry": ["xz"]}, MESH, RADAR).repairs["thinned_triangles"] > 0
