"""Targets far smaller than a wavelength, or too large for the machine: refused before meshing, with a remedy."""

import re

import numpy as np
import pytest
from shapes_made import cube, save

from core.errors import InputError
from core.sweep import C0
from mesh.build import build
from mesh.io import write_ply
from mesh.repair import repair
from scattering.solve import solve
from setup.config import load
from setup.overview import overview

RADAR = {"center_frequency": C0, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}  # wavelength 1 m
ASPECT = {"elevation": {"start": 0, "stop": 0, "step": 1}, "azimuth": {"count": 8}}
SCATTERING = {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5}


def plate(path, side):
    corners = side * np.array([[0, -0.5, -0.5], [0, 0.5, -0.5], [0, 0.5, 0.5], [0, -0.5, 0.5]])
    write_ply(path, corners, np.array([[0, 1, 2], [0, 2, 3]]))
    return path


def meshed(path, density, radar=RADAR, bands=1):
    mesh = {"edges_per_wavelength": density, "bands": bands}
    return build(path, {"unit": "m"}, mesh, radar, to_solve=True)


@pytest.mark.parametrize(("side", "density"), [(1 / 15, 151), (1 / 50, 501)])
def test_a_small_sheet_is_refused_unless_its_edges_are_fine(tmp_path, monkeypatch, side, density):
    path = plate(tmp_path / "plate.ply", side)
    with monkeypatch.context() as before_any_work:
        before_any_work.setattr("mesh.build.repair", None)
        with pytest.raises(InputError, match=rf"'mesh\.edges_per_wavelength: {density}' would do") as refusal:
            meshed(path, 10)
    assert ("precision: double" in str(refusal.value)) == (side < 1 / 30)
    _, measures = meshed(path, density)
    assert measures["bands"][0]["unknowns"] > 300
    load({"mesh": {"edges_per_wavelength": density}})


def test_every_band_needs_ten_edges(tmp_path):
    """A plate of a wavelength at the upper band is half of one at the lower."""
    radar = {**RADAR, "center_frequency": 0.75 * C0, "bandwidth": 0.5 * C0, "frequencies": 2}
    path = plate(tmp_path / "plate.ply", 1.001)
    meshed(path, 10, {**radar, "center_frequency": C0, "bandwidth": 0.0, "frequencies": 1})
    with pytest.raises(InputError, match="edges_per_wavelength: 20' would do"):
        meshed(path, 10, radar, 2)


def test_a_density_beyond_what_the_config_allows_is_no_advice(tmp_path):
    path, target = plate(tmp_path / "plate.ply", 1e-3), {"unit": "m", "length": 1e-3}
    with pytest.raises(InputError, match="raise the frequency"):
        build(path, target, {"edges_per_wavelength": 10, "bands": 1}, RADAR, to_solve=True)


def test_the_advised_density_gives_the_field_of_a_small_plate(tmp_path):
    """0.19 dB from edges half as long, whose field is 0.1 dB from the limit; five edges across it are 2 dB away."""
    path, fields = plate(tmp_path / "plate.ply", 1 / 15), []
    for density in (151, 302):
        ((mesh,), _) = meshed(path, density)
        field = solve(*mesh, np.array([C0]), np.array([0.0]), np.array([0.0, 45.0]), ("VV", "HH")).field
        fields.append(20 * np.log10(np.abs(field)))
    assert np.abs(fields[0] - fields[1]).max() < 0.2


def config_of(path, density):
    return load(
        {
            "targets": {"*": None, "large": {"mesh": str(path), "role": "known", "length": 0.9}},
            "mesh": {"edges_per_wavelength": density, "bands": 1},
            "radar": {"center_frequency": 0.6e9, "bandwidth": 0, "frequencies": 1},
            "scattering": {"precision": "double"},  # whole matrices
            "learning": {"experiments": {"*": None}},
        }
    )


def test_solves_are_foretold_and_refused_where_they_cannot_fit(tmp_path, monkeypatch):
    monkeypatch.setattr("scattering.needs.memory_megabytes", lambda: 16_000.0)
    path = save(tmp_path / "cube.ply", *cube(0.9))
    with pytest.raises(InputError, match=r"'targets\.large': .*'mesh\.edges_per_wavelength: [\d.]+'") as refusal:
        overview(config_of(path, 50), tmp_path, refuse=True)
    density = float(re.search(r"wavelength: ([\d.]+)'", str(refusal.value))[1])
    lines = overview(config_of(path, density), tmp_path, refuse=True)
    assert any(re.match(r"  large: up to [\d,]+ unknowns, 1[45]\.\d GB, \d+ to \d+ (s|min|h)$", line) for line in lines)
    # Elsewhere it may fit.
    assert any("Warning: config key 'targets.large'" in line for line in overview(config_of(path, 50), tmp_path))
    # Half of the unknowns may go when solids are united.
    assert overview(config_of(path, 1.3 * density), tmp_path, refuse=True)
    # What is solved needs no memory any more.
    (tmp_path / "scattering/large.zarr").mkdir(parents=True)
    assert overview(config_of(path, 50), tmp_path, refuse=True)


def test_a_repair_names_what_is_left_of_a_target_without_area(tmp_path):
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0, 0]])
    with pytest.raises(InputError, match="without area"):
        repair(points, np.array([[0, 1, 2], [0, 0, 1]]), 0.03, "sliver.stl")


def test_a_file_that_cannot_be_read_stops_a_run_before_any_work(tmp_path):
    (tmp_path / "page.stl").write_bytes(b"<!DOCTYPE html>" + bytes(100))
    with pytest.raises(InputError, match=r"config key 'targets\.large\.mesh': .*page\.stl is not an STL file, but a"):
        overview(config_of(tmp_path / "page.stl", 10), tmp_path, refuse=True)
    lines = overview(config_of(tmp_path / "page.stl", 10), tmp_path)
    assert sum(line.startswith("Warning: large: ") and "a web page" in line for line in lines) == 1
    # So does one of another size than its config says.
    with pytest.raises(InputError, match=r"its 'length' says 0\.9 m"):
        overview(config_of(save(tmp_path / "cube.ply", *cube(0.5)), 10), tmp_path, refuse=True)
