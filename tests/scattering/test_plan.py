"""What a solve is planned to need: memory, time, and what would fit."""

import multiprocessing
import re
from pathlib import Path

import numpy as np
import pytest
from test_magnetic import outward
from test_solve import octasphere

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, Sweep, sweeps
from isarflow.mesh.io import write_ply
from isarflow.scattering import needs
from isarflow.scattering.band import solve_band
from isarflow.scattering.costs import chosen_tolerance, planned
from isarflow.scattering.solve import solve
from isarflow.scattering.solver import build_solver
from isarflow.setup.config import load_config

RADAR = {"center_frequency": 2.775e9, "bandwidth": 1.5e9, "frequencies": 14, "polarizations": ["VV"]}
ASPECT = {"elevation": {"start": -45, "stop": 45, "step": 15}, "azimuth": {"count": 121}}
(SWEEP,) = sweeps(RADAR, ASPECT, 1)
RADIUS = 0.5  # m
SINGLE = {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5}
DOUBLE, COMBINED = SINGLE | {"precision": "double"}, SINGLE | {"formulation": "cfie"}
DIRECTIONS, WAVES = (np.arange(-40.0, 41.0, 10.0), np.arange(0.0, 360.0, 3.0)), ["VV", "HH"]
NODE_24_GIB = 24_684_084 * 1024 / 1e6  # MB that a machine sold with 24 GiB has


def plan(unknowns, planes, sweep=SWEEP, scattering=SINGLE, radius=RADIUS, tolerance=None):
    """Megabytes and seconds of a closed surface, with whole matrices unless a tolerance is given."""
    how = {"formulation": scattering["formulation"], "precision": scattering["precision"], "tolerance": tolerance}
    return planned(needs.closed(unknowns, [2 * radius, 0.0, 0.3]), planes, sweep, **how)


def test_largest_thesis_target_fits_into_24_gib():
    config = load_config({"radar": {"center_frequency": 5.55e9, "bandwidth": 3.0e9, "frequencies": 27},
                   "aspect": {"elevation": {"step": 5}, "azimuth": {"count": 242}}})  # fmt: skip
    *_, top = sweeps(config["radar"], config["aspect"], 7)
    assert 8 * 92_000**2 / 4 / 1e6 < plan(92_000, 1, top, radius=0.66)[0] <= NODE_24_GIB
    assert plan(92_000, 0, top, radius=0.66)[0] > NODE_24_GIB


@pytest.mark.parametrize("planes", [0, 1, 2])
@pytest.mark.parametrize("scattering", [SINGLE, DOUBLE, COMBINED], ids=["single", "double", "cfie"])
def test_what_fits_is_the_most_that_fits(planes, scattering):
    box = [2 * RADIUS, 0.0, 0.3]  # m
    most = needs.unknowns_that_fit(8000, 1e6, box, planes, SWEEP, scattering)

    def need(unknowns):
        return build_solver(scattering).plan(needs.closed(unknowns, box), planes, SWEEP)[0]

    assert need(most) <= 8000 < need(most + 200)
    assert needs.unknowns_that_fit(100, 1e6, box, planes, SWEEP, scattering) == 0


def test_a_plane_quarters_the_factorization():
    one = Sweep(SWEEP.frequency[-1:], SWEEP.elevation, SWEEP.azimuth, ["VV"])
    hours = [plan(200_000, planes, one)[1] for planes in (0, 1, 2)]
    assert hours[0] / hours[1] == pytest.approx(4, rel=0.15)
    assert hours[1] / hours[2] == pytest.approx(4, rel=0.2)
    assert plan(200_000, 0, one, DOUBLE)[1] == pytest.approx(2 * hours[0], rel=0.1)
    # (4/3) N^3 operations at 187 Gflop/s
    assert hours[0] == pytest.approx(4 / 3 * 200_000**3 / 1.87e11, rel=0.05)


# Seconds a frequency took on spheres, on two cores of the machine that the module describes with as much again to do;
# since tiles are compiled kernels less, by the ratio of a core's times before and after (0.68, 0.45, 0.53, 0.60).
@pytest.mark.parametrize(
    ("unknowns", "radius", "measured"),
    [(2352, 0.063, 0.7), (4800, 0.09, 0.95), (9408, 0.126, 3.2), (12288, 0.144, 6.4)],
)
def test_time_is_that_of_spheres(unknowns, radius, measured):
    assert 0.5 < plan(unknowns, 1, radius=radius)[1] / len(SWEEP.frequency) / measured < 2


def peak_of_solve(count, symmetry, tolerance, formulation):
    """Megabytes at the peak of a solve's process, its sweep and the mesh's measures."""
    vertices, triangles = outward(*octasphere(count, count * np.array([0.08, 0.07, 0.06])))
    solve(
        vertices, triangles, [C0], *DIRECTIONS, WAVES, symmetry, threads=2, tolerance=tolerance, formulation=formulation
    )
    measures = {"unknowns": 12 * count**2, "triangles": len(triangles), "box": np.ptp(vertices, axis=0)}
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", status).group(1)) * 1024 / 1e6, measures


@pytest.mark.parametrize(
    ("count", "symmetry", "formulation", "tolerance"),
    [
        (20, [], "efie", None),
        (18, [], "cfie", None),
        (26, ["xz", "yz"], "efie", None),
        (22, [], "efie", 1e-5),
        (26, ["xz"], "efie", 1e-5),
    ],
)
def test_memory_is_that_of_a_process(count, symmetry, formulation, tolerance, monkeypatch):
    monkeypatch.setenv("JAX_PLATFORMS", "cpu")  # the driver of a GPU has memory of its own
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        peak, measures = pool.apply(peak_of_solve, (count, symmetry, tolerance, formulation))
    sweep = Sweep(np.array([C0]), *DIRECTIONS, WAVES)
    expected = planned(measures, len(symmetry), sweep, formulation, "single", tolerance)[0]
    assert 1 / 1.3 < expected / peak < 1.3


def test_large_targets_are_compressed_where_that_saves_time_and_memory():
    def how(unknowns, scattering=SINGLE):
        settings = {key: value for key, value in scattering.items() if key != "solver"}
        return chosen_tolerance(needs.closed(unknowns, [1.0, 0.0, 0.3]), 1, SWEEP, **settings)

    assert how(5000) is None and how(100_000) == 1e-5
    assert how(100_000, DOUBLE) is None and how(100_000, COMBINED) is None
    for equation in ("pmchwt", "ibc", "tds"):  # of which every tile is filled whole
        assert how(5000, SINGLE | {"formulation": equation}) is None
        assert how(100_000, SINGLE | {"formulation": equation}) == 1e-5
        bodies = plan(100_000, 1, scattering=SINGLE | {"formulation": equation}, tolerance=1e-5)
        assert bodies[1] > plan(100_000, 1, tolerance=1e-5)[1]
    whole, compressed = plan(100_000, 1), plan(100_000, 1, tolerance=1e-5)
    assert compressed[0] < 0.5 * whole[0] and compressed[1] < 0.2 * whole[1]
    assert plan(100_000, 1, tolerance=1e-6)[1] > compressed[1] > plan(100_000, 1, tolerance=1e-3)[1]


def test_the_combined_equation_needs_twice_the_memory_and_factorization():
    efie, cfie = (plan(100_000, 1, scattering=method)[0] for method in (SINGLE, COMBINED))
    assert cfie / efie == pytest.approx(2, rel=0.1)
    efie, cfie = (plan(200_000, 1, scattering=method)[1] for method in (SINGLE, COMBINED))
    assert cfie / efie == pytest.approx(2, rel=0.1)


def test_what_does_not_fit_is_refused_with_what_would(monkeypatch):
    """A cube of 2 m with edges of 3 cm."""
    size, target = {"area": 24.0, "box": [2.0, 2.0, 2.0]}, {"mesh": "cube.ply"}
    config = {
        "radar": {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]},
        "aspect": {"elevation": {"start": 0, "stop": 0, "step": 1}, "azimuth": {"count": 36}},
        "mesh": {"edges_per_wavelength": 10, "bands": 1},
        "scattering": COMBINED,
        "targets": {"cube": target},
    }
    (solve,) = needs.expected(config, "cube", size)

    def check(extra, memory):
        monkeypatch.setattr(needs, "memory_megabytes", lambda: memory)
        needs.check_fit(config | {"targets": {"cube": target | extra}}, "cube", size)

    check({}, solve["megabytes"])
    with pytest.raises(InputError, match=r"would fit up to 0\.\d+ GHz, or with 'mesh.edges_per_wavelength: [\d.]+'"):
        check({}, 12_000.0)
    with pytest.raises(InputError, match=r"It is 2 m long, if its numbers are m; see its 'unit'\.$"):
        check({}, 12_000.0)
    with pytest.raises(InputError, match=r"It is 2 m long\.$"):
        check({"length": 2.0}, 12_000.0)
    # A density that the config refuses is no advice.
    with pytest.raises(InputError, match=r"would fit up to 0\.\d+ GHz; a mirror plane"):
        check({}, 4000.0)


def test_solve_that_does_not_fit_is_refused_before_it_begins(tmp_path, monkeypatch):
    corners = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0.3, 0.3, 0.0]])
    write_ply(tmp_path / "a.ply", corners, np.array([[0, 1, 2], [1, 3, 2]]))
    monkeypatch.setattr(needs, "memory_megabytes", lambda: 400.0)
    with pytest.raises(InputError, match=r"'targets\.sheet': .* 1 unknowns and 0\.5 GB; this machine has 0\.4 GB"):
        solve_band(tmp_path / "a.ply", tmp_path / "a.zarr", SWEEP, SINGLE, [], 1, "sheet")
    assert not (tmp_path / "a.zarr").exists()
