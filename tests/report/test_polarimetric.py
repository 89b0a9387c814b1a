"""Pages of a run whose images have several polarizations: the first one stands for all, and one figure shows all."""

import fake
import numpy as np
import pytest
import xarray as xr

from isarflow.report import section_alike, section_explore, section_images


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
    views = np.abs(store.sel(channel="HH").transpose("azimuth", "elevation", ...).values).reshape(24, 3, -1)
    views = views - views.mean(axis=-1, keepdims=True)
    views /= np.linalg.norm(views, axis=-1, keepdims=True)
    assert found["along"] == "azimuth"
    assert found["mean"] == pytest.approx((views * np.roll(views, -1, axis=0)).sum(axis=-1).mean(), abs=1e-5)
