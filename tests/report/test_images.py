"""Images on the page: in several polarizations, where the first stands for all; and which of them look alike."""

from types import SimpleNamespace

import fake
import numpy as np
import pytest
import xarray as xr

from isarflow.report import section_alike, section_explore, section_images
from isarflow.report.layout import style


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
    (gallery,) = section_images.channel_gallery(results, "drone")
    for name, rows in gallery.data.groupby("image"):
        truth = store.sel(elevation=0, channel=name).isel(azimuth=24 // 8).values.ravel()
        np.testing.assert_allclose(rows["level_db"], 20 * np.log10(np.abs(truth)), atol=0.006)
    assert list(dict.fromkeys(gallery.data["image"])) == ["HH", "VV"]
    first = section_images.azimuth_gallery(results, "drone").data
    azimuth = first["azimuth_deg"].iloc[0]
    truth = store.sel(elevation=0, azimuth=azimuth, channel="HH").values.ravel()
    shown = first[first["azimuth_deg"] == azimuth]["level_db"]
    np.testing.assert_allclose(shown, 20 * np.log10(np.abs(truth)), atol=0.006)
    # The viewer begins with the first, and likeness is of it: here of views a step of azimuth apart.
    assert section_explore.explorer(results)["polarizations"] == ["HH", "VV"]
    found = section_alike.likeness_by_angle(results, "drone", 15.0).iloc[0]
    views = np.abs(store.sel(channel="HH").transpose("elevation", "azimuth", ...).values).reshape(3, 24, -1)
    beside = [np.corrcoef(views[e, a], views[e, a - 1])[0, 1] for e in range(3) for a in range(24)]
    assert found["along"] == "azimuth" and found["mean"] == pytest.approx(np.mean(beside), abs=1e-5)


def test_the_images_that_look_alike_are_those_with_the_largest_correlation():
    """Noise of four targets, one image of an unknown one nearly the same as one of a known target."""
    random = np.random.default_rng(4)
    images = {name: random.standard_normal((2, 8, 6, 5, 2)) @ [1, 1j] for name in "abuv"}
    images["v"][1, 5] = images["b"][1, 2] * 1.3j + 0.05  # the phase counts for nothing, nor does the size
    images["u"][0, 0] = images["a"][0, 0]  # far from the horizon
    coords = {"elevation": [-30.0, 2.0], "azimuth": np.arange(8) * 45.0}
    coords |= {"range": np.arange(6) * 0.1, "crossrange": np.arange(5) * 0.1}
    stores = {name: xr.Dataset({"image": ([*coords], of.astype(np.complex64))}, coords) for name, of in images.items()}
    roles = {"known": ["a", "b"], "unknown": ["u", "v"]}
    with style():
        (figure,) = section_alike.alike_figure(SimpleNamespace(of_role=roles.get, images=lambda name, _: stores[name]))
    assert "v 225° and b 90°, 1.00." in figure.caption
    shown = figure.data["image"].unique().tolist()
    assert shown[2:] == ["2: v 225°", "2: b 90°"] and shown[0].startswith("1: u ")
    assert "elevation 2°" in figure.caption and "u 0° and a 0°" not in figure.caption


def test_likeness_is_one_for_the_same_image_and_none_without_contrast():
    images = np.random.default_rng(3).normal(size=(4, 5, 6, 2)) @ [1, 1j]
    rows = section_alike.standardized(images)
    same = section_alike.standardized((3 * np.abs(images) + 2).astype(complex))
    np.testing.assert_allclose(np.diag(rows @ same.T), 1)
    assert np.abs(rows @ rows.T - np.eye(4)).max() <= 1
    assert not section_alike.standardized(np.ones((1, 5, 6))).any()
