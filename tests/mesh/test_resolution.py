"""Targets far smaller than a wavelength are meshed by their own size; what does not fit the machine is refused."""

import re

import numpy as np
import pytest
from shapes_made import cube, save, sphere, together

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes
from isarflow.mesh.io import write_ply
from isarflow.mesh.repair.surface import repair
from isarflow.mesh.resolution import check_resolution
from isarflow.scattering.solve import solve
from isarflow.setup.checkup import checkup
from isarflow.setup.config import load_config
from isarflow.setup.overview import overview

RADAR = {"center_frequency": C0, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}  # wavelength 1 m
ASPECT = {"elevation": {"start": 0, "stop": 0, "step": 1}, "azimuth": {"count": 8}}
SCATTERING = {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5}


def plate(path, side):
    corners = side * np.array([[0, -0.5, -0.5], [0, 0.5, -0.5], [0, 0.5, 0.5], [0, -0.5, 0.5]])
    write_ply(path, corners, np.array([[0, 1, 2], [0, 2, 3]]))
    return path


def meshed(path, density, radar=RADAR, bands=1):
    mesh = {"edges_per_wavelength": density, "bands": bands}
    return build_meshes(path, {"unit": "m"}, mesh, radar)


def test_every_band_has_twenty_edges_across_the_target(tmp_path):
    """A plate of two wavelengths at the upper band is one of one at the lower."""
    radar = {**RADAR, "center_frequency": 0.75 * C0, "bandwidth": 0.5 * C0, "frequencies": 2}
    _, measures = meshed(plate(tmp_path / "plate.ply", 2.0), 12, radar, 2)
    assert [band["wanted_edge"] for band in measures["bands"]] == pytest.approx([0.1, 1 / 12])


def test_a_small_piece_has_twelve_edges_across_it(tmp_path):
    large, small = cube(0.5), cube(0.02)
    path = save(tmp_path / "two.ply", *together(large, (small[0] + [0.5, 0, 0], small[1])))
    ((mesh,), _) = meshed(path, 10)
    piece = topology.components(mesh[1])[1]
    lengths = [topology.edge_lengths(mesh[0], mesh[1][piece == number]).mean() for number in range(2)]
    assert min(lengths) <= 0.02 / 12 and max(lengths) > 0.02


def test_a_mesh_as_drawn_has_the_files_own_surface(tmp_path):
    """Triangles are divided to a hundredth of the target, at any wavelength; they stay in the file's planes."""
    vertices, triangles = cube(1.0)
    path, waves = save(tmp_path / "bar.ply", vertices * [1, 0.05, 0.05], triangles), {"center_frequency": 100 * C0}
    mesh = {"edges_per_wavelength": 10, "bands": 1, "remesh": False}
    ((vertices, triangles),), measures = build_meshes(path, {"unit": "m"}, mesh, RADAR | waves)
    (band,) = measures["bands"]
    assert topology.is_watertight(triangles)
    assert topology.edge_lengths(vertices, triangles).max() <= band["wanted_edge"] == pytest.approx(0.01)
    assert band["area"]["after"] == pytest.approx(measures["source"]["area"], rel=1e-9)
    assert band["volume"]["after"] == pytest.approx(measures["source"]["volume"], rel=1e-9)


def test_a_sphere_far_smaller_than_the_wavelength_scatters_as_rayleigh_says(tmp_path):
    """ka = 0.01: its cross-section is 9 (ka)^4 of pi a^2; 0.02 dB away when this was written."""
    radius = 0.01 / (2 * np.pi)
    target = {"unit": "m", "length": 2 * radius, "symmetry": ["xz", "yz"]}
    path, mesh = save(tmp_path / "sphere.ply", *sphere(radius, 3)), {"edges_per_wavelength": 10, "bands": 1}
    ((made,), _) = build_meshes(path, target, mesh, RADAR)
    here = [C0], [0.0], [0.0, 45.0], ("VV",), ("xz", "yz")
    field = solve(*made, *map(np.array, here[:3]), *here[3:], precision="double").field
    section = 4 * np.pi * np.abs(field) ** 2 / (np.pi * radius**2)
    assert 10 * np.log10(section / (9 * 0.01**4)) == pytest.approx(0, abs=0.1)


def test_what_single_precision_cannot_do_is_said_before_any_work(tmp_path):
    settings = {"center_frequency": C0, "bandwidth": 0.0, "frequencies": 1}
    mesh = {"edges_per_wavelength": 10, "bands": 1}
    check_resolution([1 / 15] * 3, mesh, settings, "plate", "single")
    with pytest.raises(InputError, match=r"1000 in a wavelength, and 300 .*'scattering.precision: double'"):
        check_resolution([1 / 50] * 3, mesh, settings, "plate", "single")
    with pytest.raises(InputError, match="raise the frequency"):
        build_meshes(plate(tmp_path / "plate.ply", 1e-3), {"unit": "m", "length": 1e-3}, mesh, RADAR)


def test_a_small_plate_has_the_field_of_a_finer_mesh(tmp_path):
    """0.096 dB from edges half as long; beyond 300 edges in a wavelength single precision is not enough."""
    path, fields = plate(tmp_path / "plate.ply", 1 / 15), []
    for density in (10, 600):
        ((mesh,), _) = meshed(path, density)
        here = np.array([C0]), np.array([0.0]), np.array([0.0, 45.0]), ("VV", "HH")
        fields.append(20 * np.log10(np.abs(solve(*mesh, *here, precision="double").field)))
    assert np.abs(fields[0] - fields[1]).max() < 0.12


def config_of(path, density):
    return load_config(
        {
            "targets": {"*": None, "large": {"mesh": str(path), "role": "known", "length": 0.9}},
            "mesh": {"edges_per_wavelength": density, "bands": 1},
            "radar": {"center_frequency": 0.6e9, "bandwidth": 0, "frequencies": 1},
            "scattering": {"precision": "double"},  # whole matrices
            "learning": {"experiments": {"*": None}},
        }
    )


def test_solves_are_foretold_and_refused_where_they_cannot_fit(tmp_path, monkeypatch):
    monkeypatch.setattr("isarflow.scattering.needs.memory_megabytes", lambda: 16_000.0)
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
    with pytest.raises(InputError, match=r"config key 'targets\.large\.mesh': .*page\.stl is no CAD file, but a"):
        overview(config_of(tmp_path / "page.stl", 10), tmp_path, refuse=True)
    lines = overview(config_of(tmp_path / "page.stl", 10), tmp_path)
    assert sum(line.startswith("Warning: large: ") and "a web page" in line for line in lines) == 1
    # So does one of another size than its config says.
    with pytest.raises(InputError, match=r"its 'length' says 0\.9 m"):
        overview(config_of(save(tmp_path / "cube.ply", *cube(0.5)), 10), tmp_path, refuse=True)


def of_plate(path, target, precision="single"):
    """A config of a plate far smaller than the wavelength of 30 m."""
    return load_config(
        {
            "targets": {"*": None, "plate": {"mesh": str(path), "role": "other", **target}},
            "mesh": {"edges_per_wavelength": 10, "bands": 1},
            "radar": {"center_frequency": 1e7, "bandwidth": 0, "frequencies": 1},
            "scattering": {"precision": precision},
            "learning": {"experiments": {"*": None}},
        }
    )


@pytest.mark.parametrize("target", [{}, {"unit": "m"}, {"unit": "cm", "length": 0.18}])
def test_all_that_a_small_target_needs_is_said_at_once(tmp_path, target):
    """The unit, the length and the precision were three refusals, the last one after the solve had begun."""
    path = plate(tmp_path / "plate.ply", 0.18)
    with pytest.raises(InputError, match=r"plate\.ply .*0\.18.*'scattering.precision: double'") as refusal:
        overview(of_plate(path, target), tmp_path, refuse=True)
    assert re.search(r"length: 0\.18\)|'unit: m' \(0\.18 m\)", str(refusal.value))
    with pytest.raises(InputError, match="3331 in a wavelength, and 300 are the most for single"):
        overview(of_plate(path, target), tmp_path, refuse=True)
    right = {"unit": "m", "length": 0.18}
    assert not any(
        "Warning: config" in line for line in overview(of_plate(path, right, "double"), tmp_path, refuse=True)
    )
    assert overview(of_plate(path, {"length": 0.18}, "double"), tmp_path, refuse=True)


def test_a_precision_that_cannot_do_is_refused_before_any_work(tmp_path):
    config = of_plate(plate(tmp_path / "plate.ply", 0.18), {"unit": "m", "length": 0.18})
    with pytest.raises(
        InputError, match=r"'targets\.plate': .*plate\.ply is too small.*'scattering.precision: double'"
    ):
        overview(config, tmp_path, refuse=True)
    assert sum("Warning: config key 'targets.plate'" in line for line in overview(config, tmp_path)) == 1
    assert any(line.startswith("  refused: ") and "for single precision" in line for line in checkup(config, "plate"))
    (tmp_path / "scattering/plate.zarr").mkdir(parents=True)  # what is solved is right
    assert overview(config, tmp_path, refuse=True)
