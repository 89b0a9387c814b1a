"""Images of several polarizations: one peak, one receiver's noise; those of one polarization stay what they were."""

import numpy as np
import pytest
import xarray as xr

from isarflow.imaging.formation import apertures
from isarflow.imaging.geometry import geometry, imager_of
from isarflow.imaging.noise import generator, signal_power, variances, white_noise
from isarflow.imaging.store import make_clean, make_noisy, make_pure_noise

ASPECT = {"elevation": {"start": -30, "stop": 30, "step": 30}, "azimuth": {"count": 60}}
RADAR = {"center_frequency": 2.75e9, "bandwidth": 1.5e9, "frequencies": 8, "polarizations": ["VV", "HH"]}


def made(store, *polarizations, noise=None, pure=False, **changes):
    """A store of images of these polarizations: clean, with noise (changes of its settings), or of noise alone."""
    imaging = store.imaging | changes | {"polarizations": list(polarizations)}
    path = store.folder / "-".join(polarizations) / "snr_6dB.zarr"
    if pure:
        make_pure_noise(RADAR, ASPECT, path, imaging, 4)
    elif noise is None:
        make_clean(store.path, path, imaging)
    else:
        make_noisy(store.path, [path], imaging, "drone", store.noise | noise)
    return xr.open_zarr(path).load()


def in_metres(data, channel=None):
    """The images as they were before they were divided by their peaks; of one channel."""
    image = data.image if channel is None else data.image.sel(channel=channel)
    return (image * data.peak).transpose(..., "range", "crossrange").values


def test_a_channel_is_the_image_of_its_polarization_and_the_peak_is_that_of_all(store):
    both, alone = made(store, "HH", "VV"), {name: made(store, name) for name in ("VV", "HH")}
    assert both.image.dims == ("elevation", "azimuth", "channel", "range", "crossrange")
    assert both.image.dtype == np.complex64 and both.peak.dims == ("elevation", "azimuth")
    assert both.channel.values.tolist() == ["HH", "VV"]
    for name, variable in both.variables.items():
        assert variable.attrs["units"] and variable.attrs["long_name"], name
    np.testing.assert_allclose(np.abs(both.image).max(["channel", "range", "crossrange"]), 1, rtol=1e-6)
    np.testing.assert_allclose(both.peak, np.maximum(alone["VV"].peak, alone["HH"].peak), rtol=1e-6)
    for name, data in alone.items():
        np.testing.assert_allclose(in_metres(both, name), in_metres(data), atol=1e-6)
    np.testing.assert_array_equal(both.snr_definition_offset, alone["HH"].snr_definition_offset)


@pytest.mark.parametrize("per", ["image", "sweep"])
def test_the_first_channel_has_the_noise_that_it_has_alone_and_the_others_as_much(store, per):
    plain = {"window": "boxcar", "reformat": "none"}
    both, alone = (made(store, *names, noise={"per": per}, **plain) for names in (("VV", "HH"), ("VV",)))
    np.testing.assert_allclose(in_metres(both, "VV"), in_metres(alone), atol=2e-6)
    for name in ("snr_mean", "snr_peak_3db"):
        np.testing.assert_array_equal(both[name], alone[name])
    clean = made(store, "VV", "HH", **plain)
    noise = {name: in_metres(both, name) - in_metres(clean, name) for name in ("VV", "HH")}
    # The field of HH has less than half the power, and yet the same noise.
    signal = {name: (np.abs(in_metres(clean, name)) ** 2).mean() for name in noise}
    power = {name: (np.abs(values) ** 2).mean() for name, values in noise.items()}
    assert power["HH"] / power["VV"] == pytest.approx(1, abs=0.1) and signal["HH"] < 0.5 * signal["VV"]
    cosine = abs(np.vdot(noise["VV"], noise["HH"])) / np.linalg.norm(noise["VV"]) / np.linalg.norm(noise["HH"])
    assert cosine < 0.1
    assert "that which gives the first one its SNR" in both.channel.attrs["comment"]


def test_pure_noise_has_the_channels_too(store):
    both, alone = made(store, "VV", "HH", pure=True), made(store, "HH", pure=True)
    np.testing.assert_allclose(np.abs(both.image).max(["channel", "range", "crossrange"]), 1, rtol=1e-6)
    # The first channel's numbers do not depend on what it is called.
    np.testing.assert_allclose(in_metres(both, "VV"), in_metres(alone), atol=2e-6)
    assert np.abs(in_metres(both, "VV") - in_metres(both, "HH")).max() > 0.1


@pytest.mark.parametrize("per", ["image", "sweep"])
def test_images_of_one_polarization_are_bit_for_bit_what_they_always_were(store, per):
    """Written out as it was before there were channels."""
    data = made(store, "VV", noise={"per": per})
    assert data.image.dims == ("realization", "elevation", "azimuth", "range", "crossrange")
    assert "channel" not in data.coords and data.attrs["polarization"] == "VV" and "polarizations" not in data.attrs
    imager = imager_of(store.frequency, store.azimuth, store.imaging)
    for number in (0, 1):
        random = generator(3, "drone", 6, number)
        for elevation in range(3):
            samples = apertures(store.field[:, elevation].astype(np.complex64), store.azimuth, 5)
            variance = variances(signal_power(samples, "peak_3db"), 6, per)
            if per == "image":
                noise = white_noise(variance, samples.shape[1], random)
            else:
                noise = apertures(white_noise(np.full(8, variance[0]), 60, random), store.azimuth, 5)
            image = imager.on_axes((samples + noise).reshape(60, 8, 5))
            image = image / np.abs(image).max(axis=(1, 2))[:, None, None]
            assert image.tobytes() == data.image.values[number, elevation].tobytes()


def test_stores_are_planned_for_all_channels(store):
    sweep = store.frequency, store.elevation, store.azimuth
    one, three = (geometry(*sweep, store.imaging | {"polarizations": names}) for names in (["VV"], ["VV", "HH", "HV"]))
    assert three["bytes"] == 3 * one["bytes"] and three["images"] == one["images"] and three["channels"] == 3
