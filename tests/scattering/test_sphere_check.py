"""The sphere that each run solves beside the Mie series, and fields of unknown reach between their samples."""

import json

import numpy as np
import pytest

from isarflow.scattering.fields import interpolation
from isarflow.scattering.sphere import backscatter, check


def test_mie_has_its_two_limits():
    # Rayleigh: |f| = 3/2 k^2 a^3 of a conducting sphere in backscatter. Large: the geometric cross section.
    assert abs(backscatter(0.01, 1.0)) == pytest.approx(1.5e-4, rel=1e-3)
    assert 4 * abs(backscatter(200.0, 1.0)) ** 2 == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("formulation", ["efie", "cfie"])
def test_a_run_s_sphere_is_solved_and_agrees_with_mie(tmp_path, formulation):
    settings = {"solver": "mom", "formulation": formulation, "precision": "single", "tolerance": 1e-5}
    check(tmp_path / "sphere.json", settings, 10, 1)
    found = json.loads((tmp_path / "sphere.json").read_text())
    # Measured: 0.006 dB and 0.02 degrees (efie), 0.018 dB and 0.14 degrees (cfie).
    assert 0 < abs(found["error_db"]) < 0.05 and abs(found["phase_deg"]) < 0.5
    assert found["rcs_db"] - found["mie_db"] == pytest.approx(found["error_db"])
    assert found["unknowns"] == 3 * found["triangles"] // 2 and 0 < found["residual"] < 1e-4


def test_a_field_of_unknown_reach_is_known_between_its_samples_where_they_are_dense():
    turn = np.arange(48) * 7.5
    wave = lambda azimuth: np.exp(12j * np.cos(np.radians(azimuth)))  # noqa: E731
    highest = interpolation.order_told(wave(turn))
    finer = np.linspace(0, 360, 241)
    # Its harmonics fall off beyond the 12th; the 24th is 1e-5 of the first.
    np.testing.assert_allclose(interpolation.between(turn, wave(turn), highest, finer), wave(finer), atol=1e-3)
    assert interpolation.order_told(wave(turn[::2])) is None
