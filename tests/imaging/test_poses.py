"""Targets whose parts move: the spectrum of a turning rod, which pose a pulse sees, and what stays as it was."""

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad
from scipy.special import jv

from isarflow.core.store import write
from isarflow.core.sweep import C0
from isarflow.imaging.motion import RANDOM, STILL, Motion, draw, poses
from isarflow.imaging.store import make_clean, make_noisy

LOUD = {"seed": 3, "realizations": 1, "definition": "peak_3db", "per": "image"}


def posed(store, fields, frequency, elevation, azimuth, folder):
    """A scattering store of several poses, from the field of each."""
    paths = [store.write(folder / f"{n}.zarr", field, frequency, elevation, azimuth) for n, field in enumerate(fields)]
    path = folder / "poses.zarr"
    write(xr.concat([xr.open_zarr(one).load() for one in paths], "pose"), path)
    return path


@pytest.fixture
def three(store, points_field):
    """A store of three poses: points that stand elsewhere in each; the first is that of `store`."""
    sweep = store.frequency, store.elevation, store.azimuth
    others = [points_field(np.array([[0.1 * n, 0.2, 0], [-0.2, 0, 0.1]]), [1, 0.7], *sweep) for n in (1, 2)]
    return posed(store, [store.field, *others], *sweep, store.folder)


def images(path, made, store, motion, noise=None):
    make_noisy(path, [made], store.imaging, "rod", noise or LOUD, motion)
    return xr.open_zarr(made).load()


def test_the_pulses_of_a_turning_rod_have_the_spectrum_of_its_closed_form(store):
    """A rod of uniform amplitude that turns half round in an aperture, one pose a pulse.

    Its field at an angle psi from its axis is the integral of exp(j k L u cos psi) over u from -1 to 1, times L / 2. By
    Jacobi and Anger it has the even orders n in psi, of size L times the integral of J_n(k L u) over u from 0 to 1.
    """
    pulses, length, azimuth = 31, 0.35, 100 + 1e-4 * np.arange(31)
    frequency = np.linspace(2.999e9, 3.001e9, 3)
    k = 2 * np.pi * frequency / C0
    turned = np.radians(azimuth - 180 / pulses * np.arange(pulses)[:, None])
    fields = [length * np.sinc(k[:, None] * length * np.cos(psi) / np.pi)[:, None] for psi in turned]
    path = posed(store, fields, frequency, [0.0], azimuth, store.folder)
    imaging = {**store.imaging, "aperture": pulses, "reformat": "none", "window": "boxcar"}
    make_noisy(path, [store.folder / "snr_90dB.zarr"], imaging, "rod", LOUD, Motion(poses=1.0))
    (data,) = xr.open_zarr(store.folder / "snr_90dB.zarr").load().image.values.reshape(1, 3, pulses)
    orders = 2 * (np.arange(pulses) - pulses // 2)
    wanted = np.array([quad(lambda u, n=n: jv(n, k[1] * length * u), 0, 1)[0] for n in np.abs(orders)])
    found, wanted = (20 * np.log10(np.abs(line) / np.abs(line).max()) for line in (data[1], wanted))
    strong = wanted > -40
    assert strong.sum() > 10 and found[strong] == pytest.approx(wanted[strong], abs=0.5)
    assert found[~strong].max() < -39


def test_a_still_target_and_one_without_poses_keep_their_images(store, three):
    assert images(three, store.folder / "snr_9dB.zarr", store, STILL, store.noise).identical(
        images(store.path, store.folder / "snr_9.0dB.zarr", store, STILL, store.noise)
    )
    for path in (three, store.path):
        make_clean(path, store.folder / f"{path.stem}-clean.zarr", store.imaging)
    one, other = (xr.open_zarr(store.folder / f"{path.stem}-clean.zarr").load() for path in (three, store.path))
    assert one.identical(other)
    moved = Motion(place=0.1, missing=0.2)
    plain = images(store.path, store.folder / "snr_12dB.zarr", store, moved, store.noise)
    turning = images(store.path, store.folder / "snr_12.0dB.zarr", store, moved._replace(poses=RANDOM), store.noise)
    assert np.array_equal(plain.image, turning.image) and "pose" not in turning
    assert np.array_equal(
        images(three, store.folder / "snr_12.00dB.zarr", store, moved, store.noise).image, plain.image
    )


def test_each_pulse_has_the_samples_of_the_pose_that_the_store_says(store, three, points_field):
    """Images are linear: they are the sum over poses of images of the pulses that saw each, the others being 0."""
    data = images(three, store.folder / "snr_80dB.zarr", store, Motion(poses=RANDOM))
    assert data.pose.dims == ("realization", "elevation", "azimuth", "pulse") and data.attrs["motion_poses"] == RANDOM
    assert {*np.unique(data.pose)} == {0, 1, 2}
    fields = xr.open_zarr(three).load()
    whole = data.image * data.peak
    parts = 0
    for number in range(3):
        alone = fields.isel(pose=number)
        path = store.write(store.folder / f"alone{number}.zarr", alone.field[0].values, *_axes(store))
        parts = parts + _images_of_pulses(store, path, data.pose.values == number)
    assert np.abs(whole.values[0] - parts).max() < 1e-3 * np.abs(parts).max()


def _axes(store):
    return store.frequency, store.elevation, store.azimuth


def _images_of_pulses(store, path, seen):
    """Images (elevation, azimuth, range, crossrange) of a field's samples at those pulses alone, not normalised."""
    from isarflow.imaging.formation import apertures, form_images
    from isarflow.imaging.geometry import imager_of

    field, rows = xr.open_zarr(path).field[0].values, []
    imager = imager_of(store.frequency, store.azimuth, store.imaging)
    for row in range(len(store.elevation)):
        samples = apertures(field[:, row], store.azimuth, store.imaging["aperture"])
        samples = samples * np.tile(seen[0, row], (1, len(store.frequency)))
        formed, peak = form_images(imager, samples[:, None])
        rows.append((formed * peak[:, None, None, None])[:, 0])
    return np.array(rows)


def test_poses_follow_from_the_seed_and_leave_other_errors_as_they_were():
    views = [(3, "drone", 0.0, azimuth, 0) for azimuth in range(400)]
    errors = draw(Motion(place=0.1), views, 21)
    drawn = poses(Motion(poses=RANDOM), errors.phase, 6)
    counts = np.bincount(drawn.ravel(), minlength=6)
    assert counts == pytest.approx(np.full(6, 1400), rel=0.1)
    assert np.corrcoef(drawn[:, 0], drawn[:, 1])[0, 1] == pytest.approx(0, abs=0.15)
    at_rate = poses(Motion(poses=2.5), errors.phase, 6)
    assert {*np.unique(at_rate[:, 0])} == {*range(6)}
    assert np.array_equal((at_rate - at_rate[:, :1])[:, :5] % 6, np.tile([0, 2, 5, 1, 4], (400, 1)))
    assert not poses(STILL, errors.phase, 6).any()
    assert np.array_equal(draw(Motion(place=0.1, poses=RANDOM), views, 21).place_range, errors.place_range)
