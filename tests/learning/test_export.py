"""Exported images: both forms hold every image of the stores, and what is said of each is true of it."""

import doctest

import h5py
import numpy as np
import pytest
import xarray as xr
from scenes import APERTURE, AZIMUTHS, ELEVATION, PLANES, ROLES, SPLIT, aspects

from isarflow.learning.data import exported as exported_module
from isarflow.learning.data.export import export
from isarflow.learning.data.split import SIDES, divisions, split


def exported(stores, path, aperture=APERTURE):
    export(stores, path, ROLES, PLANES, SPLIT, 3, aperture)
    return path


@pytest.fixture(scope="module")
def noisy_stores(stores):
    return stores("snr_0dB", tuple(ROLES))


@pytest.fixture(scope="module")
def forms(noisy_stores, tmp_path_factory):
    """The HDF5 file and the zarr store, as mappings of name to array, each with its attributes."""
    folder = tmp_path_factory.mktemp("export")
    with h5py.File(exported(noisy_stores, folder / "snr_0dB.h5")) as file:
        attrs = {name: np.array(file.attrs[name]).tolist() for name in file.attrs}
        hdf5 = {name: file[name][:] for name in file}, attrs
    store = xr.open_zarr(exported(noisy_stores, folder / "snr_0dB.zarr")).load()
    return hdf5, ({name: store[name].values for name in store.variables}, store.attrs)


def test_both_forms_hold_the_same(forms):
    (hdf5, hdf5_attrs), (zarr, zarr_attrs) = forms
    assert hdf5.keys() == zarr.keys()
    for name in hdf5:
        assert hdf5[name].dtype == zarr[name].dtype, name
        np.testing.assert_array_equal(hdf5[name], zarr[name], name)
    assert hdf5_attrs == zarr_attrs


def test_the_example_of_load_runs(noisy_stores, tmp_path, monkeypatch):
    path = tmp_path / "results/example/learning/export/snr_0dB.h5"
    path.parent.mkdir(parents=True)
    exported(noisy_stores, path)
    monkeypatch.chdir(tmp_path)
    examples = doctest.testmod(exported_module)
    assert examples.attempted and not examples.failed


def test_axes_say_what_they_are_and_chunks_are_even(noisy_stores, tmp_path, monkeypatch):
    monkeypatch.setattr("isarflow.learning.data.export.ROWS", 100)
    store = xr.open_zarr(exported(noisy_stores, tmp_path / "snr_0dB.zarr"))
    of_images = xr.open_zarr(noisy_stores[0])
    assert store.image.dims == ("n", "range", "crossrange")
    for name in ("range", "crossrange"):
        assert store[name].attrs == of_images[name].attrs and store[name].units == "m"
    rows = store.image.encoding["chunks"][0]
    assert 50 < rows <= 100 and -store.sizes["n"] % rows < 10  # what the last chunk is padded with


def test_every_image_is_there_once_and_is_what_is_said_of_it(forms, noisy_stores):
    (data, attrs), _ = forms
    assert data["image"].shape[0] == len(ROLES) * 2 * len(ELEVATION) * AZIMUTHS
    assert attrs["roles"] == [ROLES[target] for target in attrs["targets"]]
    assert (data["snr"] == 0).all()
    seen = set()
    truth = {store.split("/")[-2]: xr.open_zarr(store).image.load() for store in noisy_stores}
    names = ("label", "realization", "elevation", "azimuth")
    for image, *origin in zip(data["image"], *(data[name] for name in names), strict=True):
        label, realization, elevation, azimuth = origin
        there = truth[attrs["targets"][label]].sel(realization=realization)
        there = there.sel(elevation=elevation, azimuth=azimuth, method="nearest")
        np.testing.assert_array_equal(image, there.transpose("range", "crossrange"))
        seen.add(tuple(origin))
    assert len(seen) == len(data["image"])


def test_sides_are_those_that_models_learn_by(forms):
    (data, attrs), _ = forms
    for scheme, names in {"random": ["random"], "sector": [f"sector_{fold}" for fold in (1, 2, 3, 4)]}.items():
        for name, division in zip(names, divisions(scheme, SPLIT, 3, APERTURE), strict=True):
            for label, target in enumerate(attrs["targets"]):
                sides = split(ELEVATION, aspects(), PLANES[target], division)
                for number, side in enumerate(SIDES):
                    assert attrs["sides"][number] == side
                    found = data["azimuth"][(data[f"split_{name}"] == number) & (data["label"] == label)]
                    np.testing.assert_allclose(np.unique(found), aspects()[sides[side].azimuth], rtol=1e-6)


def test_images_without_noise_have_an_infinite_snr(stores, tmp_path):
    with h5py.File(exported(stores("clean", tuple(ROLES)), tmp_path / "clean.h5")) as file:
        assert np.isinf(file["snr"]).all()
        assert not file["realization"][:].any()


def test_a_sweep_too_short_for_a_split_goes_without_it(stores, tmp_path, capsys):
    with h5py.File(exported(stores("clean", tuple(ROLES)), tmp_path / "clean.h5", aperture=15)) as file:
        assert "split_random" in file
        assert not [name for name in file if name.startswith("split_sector")]
    assert "Warning: no split_sector_1" in capsys.readouterr().out
