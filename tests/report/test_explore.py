"""What the page's viewer is given: fields, ways to form images, meshes, and no more than a page bears."""

import base64
import copy

import fake
import numpy as np
import pytest
import xarray as xr

from isarflow.report import draw_images, section_explore
from isarflow.report.results import Results


def results_of(whole, settings=fake.SETTINGS):
    return Results(whole.parent, settings, fake.names(settings))


def samples_of(target, data):
    """A target's field as the viewer reads it, (polarization, frequency, elevation, azimuth) in m."""
    field = target["field"]
    parts = field["scale"] * np.frombuffer(base64.b64decode(field["samples"]), "<i2").astype(float)
    shape = [len(data[axis]) for axis in ("polarizations", "frequency", "elevations", "azimuths")]
    return parts.reshape(*shape, 2) @ [1, 1j]


def _sorted(corners):
    """Triangles (triangles, 3, 3) in an order that does not depend on theirs, nor on where each begins."""
    turned = [sorted(triangle[k:] + triangle[:k] for k in range(3))[0] for triangle in corners.tolist()]
    return np.array(sorted(turned))


def test_the_viewer_has_the_fields_and_meshes_of_the_stores(whole):
    results = results_of(whole)
    data = section_explore.explorer(results)
    assert [one["name"] for one in data["targets"]] == ["drone", "missile", "ufo"]
    assert data["elevations"] == [-30, 0, 30] and data["polarizations"] == ["VV", "HH"]
    assert data["snrs"] == [24, 12, 2.5, 0, -12]
    store = xr.open_zarr(whole.parent / "scattering" / "ufo.zarr").field.values
    np.testing.assert_allclose(samples_of(data["targets"][2], data), store, rtol=0, atol=2.2e-5 * np.abs(store).max())
    mesh = data["targets"][2]["mesh"]
    vertices = mesh["scale"] * np.frombuffer(base64.b64decode(mesh["vertices"]), "<i2").reshape(-1, 3)
    triangles = np.cumsum(np.frombuffer(base64.b64decode(mesh["triangles"]), "<i2")).reshape(-1, 3)
    points, corners = results.surfaces["ufo"]
    # The same triangles, of the same sense of rotation, in whatever order: each from its smallest corner.
    seen, made = (_sorted(np.round(one, 4)) for one in (vertices[triangles], points[corners]))
    np.testing.assert_allclose(seen, made, atol=1.1e-4)


def test_the_viewer_grows_no_further_than_a_page_bears(whole, monkeypatch):
    monkeypatch.setattr(section_explore, "MOST_TRIANGLES", 10)
    # 3 targets of 5 frequencies and 24 azimuths: 1440 bytes for each polarization and elevation.
    for most, polarizations, elevations in ((8_640, 2, 3), (8_639, 1, 3), (2_900, 1, 2), (100, 1, 1)):
        monkeypatch.setattr(section_explore, "MOST_BYTES", most)
        data = section_explore.explorer(results_of(whole))
        assert (len(data["polarizations"]), len(data["elevations"])) == (polarizations, elevations)
        size = sum(len(base64.b64decode(one["field"]["samples"])) for one in data["targets"])
        assert size == 1440 * polarizations * elevations
        assert [one["mesh"] for one in data["targets"]] == [None, None, None]


def test_the_run_s_own_way_comes_first_and_one_that_cannot_be_is_left_out(whole):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["imaging"]["reformat"] = "none"
    assert list(section_explore.explorer(results_of(whole, settings))["ways"]) == ["none", "polar", "exact"]
    frequency, angle = np.linspace(1e9, 1.4e9, 5), np.radians([-80.0, 0, 80])
    assert list(section_explore._ways(frequency, angle, "none")) == ["none"]


def test_of_an_imager_of_one_s_own_the_viewer_has_the_run_s_images(whole, monkeypatch):
    monkeypatch.setattr(section_explore, "OWN_AZIMUTHS", 8)
    results = results_of(whole)
    own = section_explore._own(results, [0.0, 30.0])
    assert own["azimuths"] == [15.0 * 3 * k for k in range(8)]
    levels = np.frombuffer(base64.b64decode(own["levels"][2]), np.uint8).reshape(2, 8, 5, 3)
    image = xr.open_zarr(whole.parent / "imaging" / "ufo" / "clean.zarr").image.sel(
        elevation=30, azimuth=own["azimuths"][5]
    )
    expected = np.maximum(draw_images.decibels(image.transpose("range", "crossrange").values), draw_images.FLOOR_DB)
    np.testing.assert_allclose(draw_images.FLOOR_DB * (1 - levels[1, 5] / 255), expected, atol=0.08)


@pytest.mark.parametrize("most", [1, 10**9])
def test_images_of_one_s_own_imager_grow_no_further_either(whole, monkeypatch, most):
    monkeypatch.setattr(section_explore, "MOST_BYTES", most)
    own = section_explore._own(results_of(whole), [0.0])
    assert len(own["azimuths"]) == (1 if most == 1 else 24)
