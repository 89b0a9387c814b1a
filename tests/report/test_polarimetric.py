"""Pages of a run whose images have several polarizations: the first one stands for all, and one figure shows all."""

import copy

import fake
import numpy as np
import pytest
import xarray as xr

from isarflow.report import section_alike, section_explore, section_images
from isarflow.report.results import Results


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["imaging"]["polarizations"] = ["HH", "VV"]
    settings["learning"]["experiments"] = {}
    settings["noise"]["snr_db"] = [12]
    folder = tmp_path_factory.mktemp("polarimetric")
    fake.make(folder, settings)
    return Results(folder, settings, fake.names(settings))


def test_the_images_are_shown_in_the_first_polarization_and_once_in_all(results, few_pictures):
    text = " ".join(section_images.images_text(results))
    assert "a channel for each of HH, VV and one peak over all" in text
    # Elevations, azimuths, channels, pixels, bytes; of each SNR two realizations.
    size = 3 * 24 * 2 * 15 * 8 / 1e6
    assert f"Their store has {size:.3g} MB, the store of each SNR {2 * size:.3g} MB." in text
    store = xr.open_zarr(results.folder / "imaging/drone/clean.zarr").load().image.sel(elevation=0)
    (gallery,) = section_images.channel_gallery(results, "drone")
    every = gallery.data
    for name, rows in every.groupby("image"):
        truth = store.isel(azimuth=24 // 8).sel(channel=name)
        np.testing.assert_allclose(rows["level_db"], 20 * np.log10(np.abs(truth.values.ravel())), atol=0.006)
    assert list(dict.fromkeys(every["image"])) == ["HH", "VV"]
    first = section_images.azimuth_gallery(results, "drone").data
    shown = first[first["azimuth_deg"] == first["azimuth_deg"].iloc[0]]["level_db"]
    truth = store.sel(azimuth=first["azimuth_deg"].iloc[0], channel="HH").values.ravel()
    np.testing.assert_allclose(shown, 20 * np.log10(np.abs(truth)), atol=0.006)


def test_the_viewer_begins_with_the_first_and_likeness_is_of_it(results):
    assert section_explore.explorer(results)["polarizations"] == ["HH", "VV"]
    found = section_alike.likeness_by_angle(results, "drone", 15.0).iloc[0]  # of views a step of azimuth apart
    store = xr.open_zarr(results.folder / "imaging/drone/clean.zarr").image.sel(channel="HH").load()
    views = np.abs(store.transpose("azimuth", "elevation", ...).stack(pixel=["range", "crossrange"]).values)
    views = views - views.mean(axis=-1, keepdims=True)
    views /= np.linalg.norm(views, axis=-1, keepdims=True)
    assert found["along"] == "azimuth"
    assert found["mean"] == pytest.approx((views * np.roll(views, -1, axis=0)).sum(axis=-1).mean(), abs=1e-5)
