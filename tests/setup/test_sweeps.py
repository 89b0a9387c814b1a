"""Sweeps for the radar cross-section alone: lists, single directions, great circles; targets scaled and moved."""

import numpy as np
import pytest

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.mesh.read.target import in_metres
from isarflow.setup.config import ROOT, load_config
from isarflow.setup.overview import overview

ALONE = {"targets": {"*": None, "a": {"mesh": "resources/cad/drone.stl", "role": "other"}}}
CIRCLE = {"from": [0, 0], "through": [0, 90], "angle": {"count": 8}}


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_a_list_of_frequencies_stands_for_centre_and_bandwidth():
    radar = load_config(ALONE, {"radar": {"frequencies": ["3e9", 1e9, 1.5e9]}})["radar"]
    assert (radar["center_frequency"], radar["bandwidth"]) == (2e9, 2e9)
    assert sweep.frequencies(radar).tolist() == [1e9, 1.5e9, 3e9]
    assert [band.tolist() for band in sweep.bands(radar, 2)] == [[1e9, 1.5e9], [3e9]]


@pytest.mark.parametrize(
    "overlay",
    [
        {"radar": {"frequencies": [1e9]}},
        {"radar": {"frequencies": [1e9, 2e9]}},
        {"aspect": {"azimuth": [0, 90]}},
        {"aspect": {"directions": [[0, 0]]}},
        {"aspect": {"great_circle": CIRCLE}},
        {"radar": {"frequencies": 1, "bandwidth": 0}},
        {"scattering": {"bistatic": {"receivers": [[0, 30]]}}},
    ],
)
def test_what_makes_no_images_is_said_with_its_key(overlay):
    config = load_config(ALONE, overlay)
    (line,) = [line for line in overview(config, "results/none") if "No images" in line]
    (section,) = overlay
    assert f"'{section}" in line
    assert not sweep.images_are_made(config)


def test_a_list_of_elevations_still_makes_images():
    config = load_config({"aspect": {"elevation": [30, 0]}})
    assert sweep.images_are_made(config)
    assert sweep.elevations(config["aspect"]).tolist() == [0, 30]


@pytest.mark.parametrize(
    ("overlays", "message"),
    [
        (
            [{"radar": {"frequencies": [1e9], "bandwidth": 0}}],
            "'radar.bandwidth': 0 is not allowed. Expected: nothing beside a list",
        ),
        ([{"radar": {"frequencies": [1e9]}}, {"radar": {"frequencies": 3}}], "center_frequency' is missing"),
        ([{"radar": {"frequencies": [1e9, 5]}}], "'radar.frequencies.1': 5 is less than the minimum of 1000000"),
        ([{"radar": {"frequencies": []}}], "'radar.frequencies': [] should be non-empty"),
        ([{"aspect": {"directions": [[0, 0, 1]]}}], "'aspect.directions.0': [0, 0, 1] is too long"),
        ([{"aspect": {"directions": [[91, 0]]}}], "'aspect.directions.0.0': 91 is greater than the maximum of 90"),
        ([{"aspect": {"elevation": [0], "directions": [[0, 0]]}}], "it has directions, elevation"),
        ([{"aspect": {"directions": [[0, 0]]}}, {"aspect": {"azimuth": [0]}}], "it has azimuth"),
        ([{"aspect": {"great_circle": CIRCLE | {"through": [0, 180]}}}], "lie on one line"),
        ([{"aspect": {"great_circle": CIRCLE | {"angle": {"count": 3, "step": 1}}}}], "it has count, step"),
        ([{"aspect": {"azimuth": {"start": 0, "stop": 0, "step": 1}}}], "Write these as a list"),
        (
            [{"scattering": {"bistatic": {"receivers": [[0, 0]]}}, "targets": {"a": {"reference": "README.md"}}}],
            "'targets.a.reference': it is of backscatter",
        ),
        ([{"targets": {"a": {"reference": "README.md"}}}], "README.md is not one of .csv, .ffe"),
        ([{"targets": {"a": {"scale": 0}}}], "'targets.a.scale': 0 is less than or equal to the minimum of 0"),
        ([{"targets": {"a": {"translate": [1, 2]}}}], "'targets.a.translate': [1, 2] is too short"),
    ],
)
def test_a_bad_sweep_is_refused_with_its_key(overlays, message):
    with pytest.raises(InputError) as caught:
        load_config(ALONE, *overlays)
    assert message in str(caught.value)


def test_great_circles_are_where_they_should_be():
    elevation, azimuth = sweep.directions({"great_circle": CIRCLE})
    assert elevation.tolist() == [0] * 8
    assert (azimuth % 360).tolist() == (np.arange(8) * 45.0).tolist()
    elevation, azimuth = sweep.directions({"great_circle": CIRCLE | {"through": [90, 0]}})
    assert elevation.tolist() == [0, 45, 90, 45, 0, -45, -90, -45]
    assert np.abs(azimuth).tolist() == [0, 0, 0, 180, 180, 180, 180, 0]
    tilted = CIRCLE | {"from": [10, 20], "through": [50, 70]}
    u, *_ = sweep.unit_vectors(*sweep.directions({"great_circle": tilted}))
    normal = np.cross(*sweep.unit_vectors(np.array([10.0, 50.0]), np.array([20.0, 70.0]))[0])
    assert np.abs(u @ normal).max() < 1e-7
    assert np.sum(u[:-1] * u[1:], axis=1) == pytest.approx(np.cos(np.pi / 4), abs=1e-7)


def test_polarizations_stay_in_place_where_a_great_circle_goes_over_a_pole():
    u, v, h = sweep.unit_vectors(*sweep.directions({"great_circle": CIRCLE | {"from": [0, 30], "through": [90, 0]}}))
    assert np.abs(u[[2, 6], 2]) == pytest.approx(1)
    # V lies in the meridian all the way round, H across it.
    assert np.abs(h @ sweep.unit_vectors(0.0, 30.0)[2]) == pytest.approx(1)
    assert np.abs(np.sum(v[:-1] * v[1:], axis=1)) == pytest.approx(np.cos(np.pi / 4))


def test_a_reference_without_a_column_is_refused_before_any_work(tmp_path):
    (tmp_path / "r.csv").write_text("frequency_hz,rcs_dbsm\n1e9,0\n")
    target = {"mesh": "resources/cad/drone.stl", "role": "other", "reference": str(tmp_path / "r.csv")}
    aspect = {"elevation": [0, 30], "azimuth": [0, 90]}
    radar = {"frequencies": [1e9], "polarizations": ["VV"]}
    with pytest.raises(InputError, match=r"'targets.a.reference': .*no column elevation_deg, azimuth_deg; there are"):
        load_config({"targets": {"*": None, "a": target}, "radar": radar, "aspect": aspect})
    (tmp_path / "r.csv").write_text("elevation_deg,azimuth_deg,rcs_dbsm\n0,0,0\n")
    load_config({"targets": {"*": None, "a": target}, "radar": radar, "aspect": aspect})


@pytest.mark.parametrize(
    ("frequency", "message"),
    [
        ("1", r"has none of the run's, 1e\+09 to 2e\+09 Hz\. They look like GHz"),
        ("3e9", r"2e\+09 Hz\.$"),
        ("2e9", None),
    ],
)
def test_a_reference_at_other_frequencies_is_refused_before_any_work(tmp_path, frequency, message):
    (tmp_path / "r.csv").write_text(f"# measured\nfrequency_hz,azimuth_deg,rcs_dbsm\n{frequency},0,0\nx,0,0\n")
    target = {"mesh": "resources/cad/drone.stl", "role": "other", "reference": str(tmp_path / "r.csv")}
    radar = {"frequencies": [1e9, 2e9], "polarizations": ["VV"]}
    config = {"targets": {"*": None, "a": target}, "radar": radar, "aspect": {"elevation": [0], "azimuth": [0, 90]}}
    if message is None:
        load_config(config)
        return
    with pytest.raises(InputError, match=message):
        load_config(config)


def test_gigahertz_for_hertz_are_said(tmp_path):
    with pytest.raises(
        InputError, match=r"radar.center_frequency': 2.2 is less than the minimum of 1000000.0 Hz; did you mean 2.2e9\?"
    ):
        load_config({"radar": {"center_frequency": 2.2}})
    with pytest.raises(InputError, match=r"1 is less than the minimum of 1000000.0 Hz; did you mean 1e9\?"):
        load_config({"radar": {"frequencies": [1, 2]}})


def test_scale_comes_before_rotate_and_translate_last():
    moved = in_metres(np.array([[1.0, 0.0, 0.0]]), {"scale": 0.2, "rotate": [0, 0, 90], "translate": [1, 2, 3]})
    np.testing.assert_allclose(moved, [[1.0, 2.2, 3.0]], atol=1e-12)
