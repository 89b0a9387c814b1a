"""Peak loss, ghosts and position error of the three ways to form images, against theory."""

import numpy as np
import pytest

from isarflow.core.sweep import C0
from isarflow.imaging.geometry import imager_of
from isarflow.imaging.point_response import point_response

EXTENT = np.array([C0 / (2 * 3e9 / 26), C0 / 5.55e9 / (2 * 2 * np.pi / 242)])  # m, eqs. 3.11, 3.13


def response(wide, reformat, down, cross):
    places = np.atleast_1d(down) * EXTENT[0], np.atleast_1d(cross) * EXTENT[1]
    return point_response(imager_of(wide.frequency, wide.azimuth, wide.imaging | {"reformat": reformat}), *places)


def test_exact_loses_nothing_and_stays_in_place(wide):
    found = response(wide, "exact", np.linspace(-0.48, 0.48, 9), np.linspace(-0.48, 0.48, 9))
    assert np.abs(found["loss_db"]).max() < 0.2 and found["error"].max() < 0.25


def test_polar_stays_in_place_in_the_inner_half(wide):
    found = response(wide, "polar", np.linspace(-0.25, 0.25, 9), np.linspace(-0.25, 0.25, 9))
    assert found["error"].max() < 0.25


@pytest.mark.parametrize("part", [0.1, 0.25, 0.4, -0.4])
def test_linear_interpolation_weakens_by_sinc_squared(wide, part):
    """Linear interpolation convolves the samples with a triangle: sinc^2 of the place in the extent, in the image."""
    for axis in (0, 1):
        place = np.zeros(2)
        place[axis] = part
        found = response(wide, "polar", *place)
        assert found["loss_db"][0, 0] == pytest.approx(-40 * np.log10(np.sinc(part)), abs=0.5)


def test_a_scatterer_at_the_origin_has_only_its_sidelobes(wide):
    for reformat in ("none", "polar", "exact"):
        found = response(wide, reformat, 0.0, 0.0)
        assert found["loss_db"] == pytest.approx(0, abs=0.05) and found["error"] == pytest.approx(0, abs=1e-3)
        assert -43 < found["ghost_db"][0, 0] < -40


def test_plain_fft_blurs_away_from_the_origin(wide):
    """Over 31 degrees a scatterer 0.3 m to the side walks over three range cells."""
    place = 0.0, 0.3 / EXTENT[1]
    assert response(wide, "none", *place)["loss_db"] > 2
    assert response(wide, "exact", *place)["loss_db"] < 0.1
