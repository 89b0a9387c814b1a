"""Images of the page, what its viewer makes them of, and files that it holds: packed, and to the letter."""

from types import SimpleNamespace

import fake
import numpy as np
import pytest
import xarray as xr
from pages import unpacked

from isarflow.learning.data import likeness
from isarflow.report import section_alike, section_explore, section_images
from isarflow.report.page import embedded


def test_the_images_are_shown_in_the_first_polarization_and_once_in_all(tmp_path, few_pictures):
    settings = fake.changed([], imaging={"polarizations": ["HH", "VV"]}, noise={"snr_db": [12]})
    fake.make(tmp_path, settings)
    results = fake.results(tmp_path, settings)
    text = " ".join(section_images.images_text(results))
    assert "a channel for each of HH, VV and one peak over all" in text
    # Elevations, azimuths, channels, pixels, bytes; of each SNR two realizations.
    size = 3 * 24 * 2 * 15 * 8 / 1e6
    assert f"Their store has {size:.3g} MB, the store of each SNR {2 * size:.3g} MB." in text
    store = xr.open_zarr(results.folder / "imaging/drone/clean.zarr").load().image
    drawn = {figure.name: figure for figure in section_images.galleries(results)}
    gallery = drawn["gallery_polarization"]
    for name, rows in gallery.data.groupby("image"):
        truth = store.sel(elevation=0, channel=name).isel(azimuth=24 // 8).values.ravel()
        np.testing.assert_allclose(rows["level_db"], 20 * np.log10(np.abs(truth)), atol=0.006)
    assert list(dict.fromkeys(gallery.data["image"])) == ["HH", "VV"]
    first = drawn["images_drone"].data
    azimuth = first["azimuth_deg"].iloc[0]
    truth = store.sel(elevation=0, azimuth=azimuth, channel="HH").values.ravel()
    shown = first[first["azimuth_deg"] == azimuth]["level_db"]
    np.testing.assert_allclose(shown, 20 * np.log10(np.abs(truth)), atol=0.006)
    # The viewer begins with the first, and likeness is of it: here of views a step of azimuth apart.
    assert section_explore.explorer(results)["polarizations"] == ["HH", "VV"]
    found = likeness.by_angle(results.images("drone", "clean").image, 15.0).iloc[0]
    views = np.abs(store.sel(channel="HH").transpose("elevation", "azimuth", ...).values).reshape(3, 24, -1)
    beside = [np.corrcoef(views[e, a], views[e, a - 1])[0, 1] for e in range(3) for a in range(24)]
    assert found["along"] == "azimuth" and found["mean"] == pytest.approx(np.mean(beside), abs=1e-5)


def test_the_images_that_look_alike_are_those_with_the_largest_correlation_of_magnitudes():
    """Noise of four targets, one image of an unknown one nearly the same as one of a known target."""
    random = np.random.default_rng(4)
    images = {name: random.standard_normal((2, 8, 6, 5, 2)) @ [1, 1j] for name in "abuv"}
    images["v"][1, 5] = images["b"][1, 2] * 1.3j + 0.05  # the phase counts for nothing, nor does the size
    images["u"][0, 0] = images["a"][0, 0]  # far from the horizon
    coords = {"elevation": [-30.0, 2.0], "azimuth": np.arange(8) * 45.0}
    coords |= {"range": np.arange(6) * 0.1, "crossrange": np.arange(5) * 0.1}
    stores = {name: xr.Dataset({"image": ([*coords], of.astype(np.complex64))}, coords) for name, of in images.items()}
    roles = {"known": ["a", "b"], "unknown": ["u", "v"]}
    (figure,) = section_alike.alike_figure(SimpleNamespace(of_role=roles.get, images=lambda name, _: stores[name]))
    assert "v 225° and b 90°, 1.00." in figure.caption
    shown = figure.data["image"].unique().tolist()
    assert shown[2:] == ["2: v 225°", "2: b 90°"] and shown[0].startswith("1: u ")
    assert "elevation 2°" in figure.caption and "u 0° and a 0°" not in figure.caption
    # Likeness is one for the same image, and none without contrast.
    images = np.random.default_rng(3).normal(size=(4, 5, 6, 2)) @ [1, 1j]
    rows = likeness.standardized(images)
    same = likeness.standardized((3 * np.abs(images) + 2).astype(complex))
    np.testing.assert_allclose(np.diag(rows @ same.T), 1)
    assert np.abs(rows @ rows.T - np.eye(4)).max() <= 1
    assert not likeness.standardized(np.ones((1, 5, 6))).any()


def _sorted(corners):
    """Return triangles (triangles, 3, 3) in an order that does not depend on theirs, nor on where each begins."""
    turned = [min(triangle[k:] + triangle[:k] for k in range(3)) for triangle in np.round(corners, 4).tolist()]
    return np.array(sorted(turned))


def test_the_viewer_has_the_fields_and_meshes_of_the_stores_and_the_run_s_ways(results):
    data = section_explore.explorer(results)
    assert [one["name"] for one in data["targets"]] == ["drone", "missile", "ufo"]
    assert data["elevations"] == [-30, 0, 30] and data["polarizations"] == ["VV", "HH"]
    assert data["snrs"] == [24, 12, 2.5, 0, -12]
    field, mesh = data["targets"][2]["field"], data["targets"][2]["mesh"]
    store = xr.open_zarr(results.folder / "scattering" / "ufo.zarr").field.values  # in the viewer's order
    largest = max(np.abs(store.real).max(), np.abs(store.imag).max())
    kept = largest / section_explore.FULL * np.reshape(field, (*store.shape, 2)) @ [1, 1j]
    np.testing.assert_allclose(kept, store, rtol=0, atol=2.2e-5 * np.abs(store).max())
    # The same triangles, of the same sense of rotation, in whatever order: each from its smallest corner.
    points, corners = results.surfaces["ufo"]
    seen = np.array(mesh["vertices"])[mesh["triangles"]]
    np.testing.assert_allclose(_sorted(seen), _sorted(points[corners]), atol=1.1e-4)
    # The run's own way comes first, and one that cannot be is left out.
    without = fake.results(results.folder, fake.changed(imaging={"reformat": "none"}))
    assert list(section_explore.explorer(without)["ways"]) == ["none", "polar"]
    frequency, angle = np.linspace(1e9, 1.4e9, 5), np.radians([-80.0, 0, 80])
    assert list(section_explore._ways(frequency, angle, "none")) == ["none"]


# 3 targets of 5 frequencies and 24 azimuths: 360 samples for each polarization and elevation.
@pytest.mark.parametrize(("most", "polarizations", "elevations"), [(2160, 2, 3), (2159, 1, 3), (725, 1, 2), (9, 1, 1)])
def test_the_viewer_grows_no_further_than_a_page_bears(results, monkeypatch, most, polarizations, elevations):
    monkeypatch.setattr(section_explore, "MOST_TRIANGLES", 10)
    monkeypatch.setattr(section_explore, "MOST_SAMPLES", most)
    data = section_explore.explorer(results)
    assert (len(data["polarizations"]), len(data["elevations"])) == (polarizations, elevations)
    assert sum(len(one["field"]) for one in data["targets"]) == 720 * polarizations * elevations
    assert [one["mesh"] for one in data["targets"]] == [None, None, None]


def test_what_is_held_is_put_together_to_the_letter(tmp_path):
    files = {
        "figures/a.svg": '<svg><path id="m1" d="M 0 0\nL 3 4\nz\n"/></svg>',
        "figures/b.svg": '<svg id="b"/>',
        "tables/a.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/same.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/one.csv": "a\n1\n",
        "tables/empty.csv": "a,b\n,\n,2\n",
        "tables/none.csv": "a,b\n",
        "tables/lines.csv": 'a,b\n"of two\nlines",1\n',
    }
    data = embedded(files, {"live": {"x": [1, 2]}})
    assert set(data) == {*list(files)[:2], "tables/a.csv tables/same.csv", *list(files)[4:], "live.json"}
    html = "".join(f'<script type="text/plain" data-file="{names}">{text}</script>\n' for names, text in data.items())
    (tmp_path / "index.html").write_text(html)
    held = unpacked(tmp_path / "index.html")
    assert held.pop("live.json") == b'{"x":[1,2]}'
    assert {name: text.encode() for name, text in files.items()} == held
