"""Sizes of the sweep against the thesis's tables, and the refusals."""

import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.imaging.geometry import centres, describe, geometry, megabytes, uniform_step, warnings


def test_thesis_experiment(wide):
    sizes = geometry(wide.frequency, np.arange(-45, 46, 5.0), wide.azimuth, wide.imaging)
    assert sizes["range_resolution"] == pytest.approx(0.05, rel=0.05)
    assert sizes["crossrange_resolution"] == pytest.approx(0.05, rel=0.05)
    assert sizes["range_extent"] == pytest.approx(C0 / (2 * 115.3846e6), rel=1e-6)
    assert sizes["crossrange_extent"] == pytest.approx(C0 / 5.55e9 / (2 * 2 * np.pi / 242))
    assert sizes["aperture_angle"] == pytest.approx(31.24, abs=0.01)
    assert 5 * 17 * 3 * sizes["images"] == 1_172_490
    assert sizes["bytes"] == 19 * 242 * 27 * 21 * 8
    assert sizes["range_extent"] == pytest.approx(27 * sizes["range_resolution"])
    assert sizes["crossrange_extent"] == pytest.approx(21 * sizes["crossrange_resolution"])
    assert "range: resolution 0.0481 m, unambiguous extent 1.299 m, 27 pixels of 0.0495 m" in describe(sizes)


def test_centres():
    circle = np.arange(12) * 30.0
    np.testing.assert_array_equal(centres(circle, 5), circle)
    np.testing.assert_array_equal(centres(circle[:11], 5), circle[2:9])
    np.testing.assert_array_equal(centres(circle[:5], 5), circle[2:3])
    with pytest.raises(InputError, match=r"imaging\.aperture"):
        centres(circle[:4], 5)


def test_axes_must_be_even():
    assert uniform_step("azimuth", np.array([1.0, 3.0, 5.0])) == 2
    for bad in ([1.0], [1.0, 2.0, 4.0], [2.0, 1.0]):
        with pytest.raises(InputError, match="azimuth"):
            uniform_step("azimuth", np.array(bad))


def test_warnings(wide):
    sizes = geometry(wide.frequency, np.array([0.0]), wide.azimuth, wide.imaging)
    assert warnings(sizes, reach=0.4) == []
    (ghosts,) = warnings(sizes, reach=0.5)
    assert "reaches 0.50 m" in ghosts and "0.41 m to either side" in ghosts  # c / 7.05 GHz / (4 * 2 pi / 242)
    (fold,) = warnings(sizes, reach=0.6)
    assert "crossrange extent is only 0.52 m to either side" in fold
    plain = geometry(wide.frequency, np.array([0.0]), wide.azimuth, wide.imaging | {"reformat": "none"})
    (blur,) = warnings(plain, reach=0.4)
    assert "0.28 m" in blur
    sizes = geometry(wide.frequency, np.array([0.0, 90.0]), wide.azimuth, wide.imaging)
    (steep,) = warnings(sizes, reach=0.4)
    assert "range only" in steep


def test_planned_memory_grows_with_images_and_pixels(wide):
    sizes = geometry(wide.frequency, np.array([0.0]), wide.azimuth, wide.imaging)
    assert megabytes(sizes, 3) - megabytes(sizes, 0) > 3 * sizes["bytes"] / 1e6
    assert megabytes(sizes, 3) < 600
