"""Errors of place and motion: the shift theorem, closed forms, seeds, and what a store keeps of them."""

import numpy as np
import pytest
import xarray as xr

from isarflow.core.sweep import C0
from isarflow.imaging.formation import apertures
from isarflow.imaging.geometry import imager_of
from isarflow.imaging.motion import Motion, displaced, draw, nearer, phases, turned
from isarflow.imaging.store import make_noisy

EVERY = Motion(place=0.1, drift=0.5, jitter=0.05, turn=0.02, missing=0.2)


def moved_point(field_of, sweep, points, index, down, cross):
    """The imager, samples (F * A) of points, and the same displaced in the image of an azimuth's number."""
    imager = imager_of(sweep.frequency, sweep.azimuth, sweep.imaging)
    field = field_of(points, np.ones(len(points)), sweep.frequency, [0.0], sweep.azimuth)[:, 0]
    samples = apertures(field, sweep.azimuth, sweep.imaging["aperture"])[index]
    errors = draw(Motion(), [(0,)], len(imager.angle))._replace(
        place_range=np.array([down]), place_crossrange=np.array([cross])
    )
    return imager, samples, displaced(samples[None, None], sweep.frequency, imager.angle, errors)[0, 0]


def test_a_displaced_target_has_the_samples_of_points_that_stand_there(wide, points_field):
    index, down, cross = 40, 0.12, -0.21
    azimuth = np.radians(wide.azimuth[index])
    toward, right = np.array([np.cos(azimuth), np.sin(azimuth), 0]), np.array([-np.sin(azimuth), np.cos(azimuth), 0])
    points = np.array([[0.1, 0.2, 0.0], [-0.3, 0.05, 0.0]])
    *_, moved = moved_point(points_field, wide, points, index, down, cross)
    _, there, _ = moved_point(points_field, wide, points - down * toward + cross * right, index, 0, 0)
    assert np.abs(moved - there).max() < 1e-4 * np.abs(there).max()  # single precision: 7e-6


def test_drift_is_quadratic_and_jitter_is_each_pulses_own(wide):
    angle = np.radians(np.linspace(-15, 15, 21))
    assert nearer(angle, 0.05, drift=2.0)[[0, 10, -1]] == pytest.approx([0.1, 0.0, 0.1])
    jitter = np.random.default_rng(0).standard_normal((3, 21))
    assert nearer(angle, 0.05, np.zeros(3), np.zeros(3), np.zeros(3), jitter) == pytest.approx(0.05 * jitter)
    factor = phases(wide.frequency, np.full((1, 21), 0.01))
    assert np.angle(factor[0, :, 3]) == pytest.approx(
        np.angle(np.exp(4j * np.pi * wide.frequency / C0 * 0.01)), abs=1e-5
    )


def test_a_wrong_turn_samples_the_field_between_its_azimuths(wide, points_field):
    """The field of points at the angles that the radar truly has, from the closed form."""
    points, turn, index = np.array([[0.25, -0.2, 0.1], [-0.2, 0.25, 0.0]]), 0.04, 100
    imager = imager_of(wide.frequency, wide.azimuth, wide.imaging)
    field = points_field(points, [1, 0.5], wide.frequency, [10.0], wide.azimuth)[None, :, 0]
    found = turned(field, wide.azimuth, imager.angle, np.full(len(wide.azimuth), turn))[index, 0]
    true = wide.azimuth[index] + np.degrees(imager.angle) * (1 + turn)
    wanted = points_field(points, [1, 0.5], wide.frequency, [10.0], true)[:, 0].ravel()
    assert np.abs(found - wanted).max() < 2e-3 * np.abs(wanted).max()  # 4e-5


def test_errors_keep_their_limits_and_one_limit_changes_no_other_error():
    views = [(3, "drone", 0.0, azimuth, number) for azimuth in range(400) for number in range(2)]
    errors = draw(EVERY, views, 21)
    for name, limit in (("place_range", 0.1), ("place_crossrange", 0.1), ("drift", 0.5), ("turn", 0.02)):
        values = getattr(errors, name)
        assert np.abs(values).max() <= limit and np.std(values) == pytest.approx(limit / np.sqrt(3), rel=0.1)
    assert np.std(errors.jitter) == pytest.approx(0.05, rel=0.03)
    assert 1 - errors.received.mean() == pytest.approx(0.2, abs=0.01)
    assert set((21 - errors.received.sum(axis=1)).tolist()) == {4, 5}  # of 4.2
    same = draw(EVERY._replace(drift=0.0, missing=0.0), views, 21)
    assert np.array_equal(same.place_range, errors.place_range) and np.array_equal(same.jitter, errors.jitter)
    assert not same.drift.any() and same.received.all()
    assert not np.array_equal(draw(EVERY, [(4, *view[1:]) for view in views], 21).turn, errors.turn)


def test_a_store_keeps_the_errors_the_same_at_all_snrs_and_none_of_a_turntable(store):
    paths = [store.folder / label for label in ("snr_0dB.zarr", "snr_20dB.zarr")]
    make_noisy(store.path, paths, store.imaging, "drone", store.noise, EVERY)
    low, high = (xr.open_zarr(path).load() for path in paths)
    for name in ("place_range", "place_crossrange", "drift", "turn"):
        assert low[name].dims == ("realization", "elevation", "azimuth") and low[name].attrs["units"]
        xr.testing.assert_equal(low[name], high[name])
    assert low.received.dtype == bool and low.received.dims == ("realization", "elevation", "azimuth", "pulse")
    assert low.attrs["motion_place"] == 0.1 and "jitter" not in low
    still = store.folder / "still" / "snr_0dB.zarr"
    make_noisy(store.path, [still], store.imaging, "drone", store.noise)
    assert not {"place_range", "received"} & set(xr.open_zarr(still).variables)


def test_at_no_noise_a_moved_store_has_the_images_of_points_that_stand_elsewhere(store):
    """One scatterer at the origin, displaced: its peak is where the store says, and lost pulses weaken it."""
    field = np.ones((8, 3, 60))
    path = store.write(store.folder / "point.zarr", field, store.frequency, store.elevation, store.azimuth)
    made = store.folder / "snr_60dB.zarr"
    imaging = store.imaging | {"aperture": 15, "upsample": 128}
    make_noisy(path, [made], imaging, "point", store.noise, Motion(place=0.1))
    data = xr.open_zarr(made).load()
    for view in range(0, 60, 7):
        row, column = np.unravel_index(np.abs(data.image[1, 1, view].values).argmax(), (128, 128))
        cell = data.attrs["range_resolution"], data.attrs["crossrange_resolution"]
        assert data.range[row] == pytest.approx(float(data.place_range[1, 1, view]), abs=0.1 * cell[0])
        assert data.crossrange[column] == pytest.approx(float(data.place_crossrange[1, 1, view]), abs=0.1 * cell[1])
    make_noisy(path, [made], imaging, "point", store.noise, Motion(missing=0.4))
    data = xr.open_zarr(made).load()
    window = np.hamming(15) / np.hamming(15).sum()
    kept = (data.received * window).sum("pulse").values
    assert np.allclose(data.peak, kept, rtol=0.1)
