"""The stores: layout, what they hold, and what they do not depend on."""

import numpy as np
import pytest
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.imaging.formation import apertures
from isarflow.imaging.noise import definition_offset
from isarflow.imaging.store import make_clean, make_noisy


def noisy(store, name="noisy", target="drone", snr_db=6, **noise):
    path = store.folder / name / f"snr_{snr_db}dB.zarr"
    make_noisy(store.path, [path], store.imaging, target, store.noise | noise)
    return xr.open_zarr(path).load()


def clean(store, path=None):
    make_clean(path or store.path, store.folder / "clean.zarr", store.imaging)
    return xr.open_zarr(store.folder / "clean.zarr").load()


def same(first, second):
    return first.image.values.tobytes() == second.image.values.tobytes() and (first.peak == second.peak).all()


def test_layout(store):
    for data, extra in ((clean(store), ()), (noisy(store), ("realization",))):
        assert data.image.dims == (*extra, "elevation", "azimuth", "range", "crossrange")
        assert data.image.dtype == np.complex64 and data.peak.dtype == np.float32
        assert data.peak.dims == (*extra, "elevation", "azimuth")
        assert data.image.shape[-4:] == (3, 60, 8, 5)
        for name, variable in data.variables.items():
            assert variable.attrs["units"] and variable.attrs["long_name"], name
        assert data.attrs["polarization"] == "VV"
        assert data.attrs["window"] == "hamming" and data.attrs["aperture_angle"] == pytest.approx(30)
        np.testing.assert_allclose(np.abs(data.image).max(["range", "crossrange"]), 1, rtol=1e-6)


def test_clean_states_the_offset_of_the_definitions(store):
    rows = [definition_offset(apertures(store.field[:, e], store.azimuth, 5)) for e in range(3)]
    assert clean(store).attrs["snr_definition_offset_db"] == pytest.approx(np.mean(rows), abs=1e-3)
    assert np.mean(rows) > 0.5


def test_every_image_states_its_own_snr(store):
    offset = clean(store).snr_definition_offset
    for elevation in range(3):
        samples = apertures(store.field[:, elevation], store.azimuth, 5)
        np.testing.assert_allclose(offset[elevation], definition_offset(samples), atol=1e-4)
    each = noisy(store)
    np.testing.assert_allclose(each.snr_peak_3db, 6, atol=1e-4)
    np.testing.assert_allclose(each.snr_mean, 6 - offset, atol=1e-4)
    shared = noisy(store, definition="mean", per="sweep")
    np.testing.assert_allclose(shared.snr_peak_3db - shared.snr_mean, offset, atol=1e-4)
    power = 10 ** (shared.snr_mean / 10)  # over that of the noise, which is the same in all images of an elevation
    np.testing.assert_allclose(power.mean("azimuth"), 10**0.6, rtol=1e-4)
    assert power.std("azimuth").min() > 0.1


@pytest.mark.parametrize(
    ("per", "shared"), [("sweep", [1, 0.8, 0.6, 0.4, 0.2, 0, 0]), ("image", [1, 0, 0, 0, 0, 0, 0])]
)
def test_noise_of_neighbouring_apertures_correlates_by_the_samples_they_share(store, per, shared):
    store.imaging |= {"window": "boxcar", "reformat": "none"}
    signal, data = clean(store), noisy(store, per=per, snr_db=20, realizations=12)
    noise = (data.image * data.peak - signal.image * signal.peak).values
    noise = noise / np.sqrt((np.abs(noise) ** 2).mean(axis=(0, 2, 3, 4), keepdims=True))
    # A pixel's phase turns from one aperture to the next as its scatterer would come nearer: alike in all of them.
    for lag, expected in enumerate(shared):
        pairs = (noise * np.roll(noise, lag, axis=2).conj()).mean(axis=(0, 1, 2)) / (np.abs(noise) ** 2).mean()
        assert np.abs(pairs).mean() == pytest.approx(expected, abs=0.04), lag


def test_strong_signal_hides_the_noise(store):
    first, second = clean(store), noisy(store, snr_db=90)
    np.testing.assert_allclose(second.image.isel(realization=1), first.image, atol=1e-3)
    np.testing.assert_allclose(second.peak.isel(realization=0), first.peak, rtol=1e-3)


def test_same_seed_same_bits(store):
    assert same(noisy(store, "a"), noisy(store, "b"))
    files = [sorted(p for p in (store.folder / n).rglob("*") if p.is_file()) for n in ("a", "b")]
    assert len(files[0]) == len(files[1]) > 5
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(*files, strict=True))


def test_an_snr_is_the_same_beside_others(store):
    paths = [store.folder / "together" / f"snr_{snr}dB.zarr" for snr in (-3, 6, 20)]
    make_noisy(store.path, paths, store.imaging, "drone", store.noise)
    for path, snr in zip(paths, (-3, 6, 20), strict=True):
        assert same(xr.open_zarr(path).load(), noisy(store, snr_db=snr))


def test_realizations_are_a_prefix(store):
    one, three = noisy(store, realizations=1), noisy(store, realizations=3)
    assert same(one, three.isel(realization=slice(1)))
    assert not np.isclose(three.image[0], three.image[1]).any(axis=(1, 2, 3)).all()


@pytest.mark.parametrize("change", [{"seed": 4}, {"target": "ufo"}, {"snr_db": 6.5}, {"per": "sweep"}])
def test_other_names_other_noise(store, change):
    first, second = noisy(store), noisy(store, **change)
    noise = [data.image * data.peak - clean(store).image * clean(store).peak for data in (first, second)]
    noise = [part.values[0].ravel() for part in noise]
    cosine = abs(np.vdot(*noise)) / np.linalg.norm(noise[0]) / np.linalg.norm(noise[1])
    assert cosine < 0.1


def test_partial_sweep_gives_whole_apertures_only(store):
    part = slice(7, 30)
    path = store.write(
        store.folder / "part.zarr", store.field[..., part], store.frequency, store.elevation, store.azimuth[part]
    )
    whole, piece = clean(store), clean(store, path)
    np.testing.assert_array_equal(piece.azimuth, store.azimuth[9:28])
    np.testing.assert_allclose(piece.image, whole.image.sel(azimuth=piece.azimuth), atol=1e-6)


def test_turning_the_target_turns_the_images(store):
    path = store.write(
        store.folder / "turned.zarr", np.roll(store.field, 4, -1), store.frequency, store.elevation, store.azimuth
    )
    np.testing.assert_allclose(clean(store, path).image, clean(store).image.roll(azimuth=4), atol=1e-6)


def test_bad_fields_are_refused(store):
    store.field[0, 0, 0] = np.nan
    path = store.write(store.folder / "nan.zarr", store.field, store.frequency, store.elevation, store.azimuth)
    with pytest.raises(InputError, match=r"nan\.zarr"):
        clean(store, path)
    store.imaging["aperture"] = 61
    with pytest.raises(InputError, match=r"imaging\.aperture"):
        clean(store)
