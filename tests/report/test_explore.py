"""What the page's viewer is given: fields, ways to form images, meshes, and no more than a page bears."""

import copy

import fake
import numpy as np
import pytest
import xarray as xr

from isarflow.report import section_explore
from isarflow.report.results import Results


def explorer(whole, settings=fake.SETTINGS):
    return section_explore.explorer(Results(whole.parent, settings, fake.names(settings)))


def _sorted(corners):
    """Return triangles (triangles, 3, 3) in an order that does not depend on theirs, nor on where each begins."""
    turned = [min(triangle[k:] + triangle[:k] for k in range(3)) for triangle in np.round(corners, 4).tolist()]
    return np.array(sorted(turned))


def test_the_viewer_has_the_fields_and_meshes_of_the_stores(whole):
    data = explorer(whole)
    assert [one["name"] for one in data["targets"]] == ["drone", "missile", "ufo"]
    assert data["elevations"] == [-30, 0, 30] and data["polarizations"] == ["VV", "HH"]
    assert data["snrs"] == [24, 12, 2.5, 0, -12]
    field, mesh = data["targets"][2]["field"], data["targets"][2]["mesh"]
    store = xr.open_zarr(whole.parent / "scattering" / "ufo.zarr").field.values  # in the viewer's order
    largest = max(np.abs(store.real).max(), np.abs(store.imag).max())
    kept = largest / section_explore.FULL * np.reshape(field, (*store.shape, 2)) @ [1, 1j]
    np.testing.assert_allclose(kept, store, rtol=0, atol=2.2e-5 * np.abs(store).max())
    # The same triangles, of the same sense of rotation, in whatever order: each from its smallest corner.
    points, corners = Results(whole.parent, fake.SETTINGS, fake.names(fake.SETTINGS)).surfaces["ufo"]
    seen = np.array(mesh["vertices"])[mesh["triangles"]]
    np.testing.assert_allclose(_sorted(seen), _sorted(points[corners]), atol=1.1e-4)


# 3 targets of 5 frequencies and 24 azimuths: 360 samples for each polarization and elevation.
@pytest.mark.parametrize(("most", "polarizations", "elevations"), [(2160, 2, 3), (2159, 1, 3), (725, 1, 2), (9, 1, 1)])
def test_the_viewer_grows_no_further_than_a_page_bears(whole, monkeypatch, most, polarizations, elevations):
    monkeypatch.setattr(section_explore, "MOST_TRIANGLES", 10)
    monkeypatch.setattr(section_explore, "MOST_SAMPLES", most)
    data = explorer(whole)
    assert (len(data["polarizations"]), len(data["elevations"])) == (polarizations, elevations)
    assert sum(len(one["field"]) for one in data["targets"]) == 720 * polarizations * elevations
    assert [one["mesh"] for one in data["targets"]] == [None, None, None]


def test_the_run_s_own_way_comes_first_and_one_that_cannot_be_is_left_out(whole):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["imaging"]["reformat"] = "none"
    assert list(explorer(whole, settings)["ways"]) == ["none", "polar"]
    frequency, angle = np.linspace(1e9, 1.4e9, 5), np.radians([-80.0, 0, 80])
    assert list(section_explore._ways(frequency, angle, "none")) == ["none"]
