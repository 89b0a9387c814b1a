"""Directions one by one, and targets that are scaled and moved."""

import numpy as np
import pytest
import xarray as xr
from test_solve import AZIMUTH, ELEVATION, FREQUENCY, octasphere

from isarflow.core.store import open_store
from isarflow.core.sweep import C0, Sweep, unit_vectors
from isarflow.mesh.io import write_ply
from isarflow.scattering.band import solve_band
from isarflow.scattering.fields.interpolation import between, is_dense, order
from isarflow.scattering.solve import solve

LETTERS = ["VV", "HH", "HV"]
METHOD = {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5}


@pytest.fixture(scope="module")
def ellipsoid():
    return octasphere(5, [0.4, 0.25, 0.3])


@pytest.fixture(scope="module")
def grid(ellipsoid):
    """(P, E, A) of a solve over elevations times azimuths."""
    return solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, LETTERS).field[:, 0]


def test_single_directions_are_those_of_the_grid(ellipsoid, grid):
    """In any order, one of them twice, and through the store."""
    places = np.array([[2, 5], [0, 1], [1, 7], [2, 0], [0, 1]]).T
    elevation, azimuth = ELEVATION[places[0]], AZIMUTH[places[1]]
    field = solve(*ellipsoid, [FREQUENCY], elevation, azimuth, LETTERS, paired=True).field[:, 0]
    np.testing.assert_allclose(field, grid[:, *places], atol=1e-5 * np.abs(grid).max())


def test_the_store_of_single_directions_says_where_they_are(ellipsoid, grid, tmp_path):
    write_ply(tmp_path / "a.ply", *ellipsoid)
    elevation, azimuth = np.array([20.0, -30.0]), np.array([0.0, 45.0])
    asked = Sweep(np.array([FREQUENCY]), elevation, azimuth, LETTERS, paired=True)
    solve_band(tmp_path / "a.ply", tmp_path / "a.zarr", asked, METHOD, [], 1, "a")
    field = open_store(tmp_path / "a.zarr").field
    assert field.dims == ("polarization", "frequency", "direction")
    assert xr.DataArray(elevation, dims="direction").equals(field.elevation.drop_vars(["elevation", "azimuth"]))
    np.testing.assert_allclose(field[:, 0, 1], grid[:, 0, 1], atol=1e-4 * np.abs(grid).max())


def test_a_moved_target_has_the_phase_of_its_place(ellipsoid, grid):
    place = np.array([0.3, -0.7, 0.45])
    moved = solve(ellipsoid[0] + place, ellipsoid[1], [FREQUENCY], ELEVATION, AZIMUTH, LETTERS).field[:, 0]
    u, *_ = unit_vectors(ELEVATION[:, None], AZIMUTH[None])
    turned = grid * np.exp(4j * np.pi * FREQUENCY / C0 * (u @ place))
    assert np.abs(moved - turned).max() < 1e-4 * np.abs(grid).max()


def test_a_scaled_target_is_the_same_at_a_scaled_wavelength(ellipsoid, grid):
    scaled = solve(ellipsoid[0] * 2.5, ellipsoid[1], [FREQUENCY / 2.5], ELEVATION, AZIMUTH, LETTERS).field[:, 0]
    assert np.abs(scaled - 2.5 * grid).max() < 1e-4 * np.abs(scaled).max()


@pytest.mark.parametrize("azimuth", [np.arange(0.0, 360.0, 7.5), np.arange(10.0, 121.0, 5.0)], ids=["circle", "arc"])
def test_the_series_between_azimuths_is_a_densely_solved_cut(ellipsoid, azimuth):
    dense = np.linspace(azimuth[0], azimuth[-1], 97)
    every = np.concatenate([azimuth, dense])
    field = solve(*ellipsoid, [FREQUENCY], np.full(len(every), 20.0), every, LETTERS, paired=True).field[:, 0]
    few, many = field[:, : len(azimuth)], field[:, len(azimuth) :]
    highest = order(FREQUENCY, 0.4, 20.0)
    assert is_dense(azimuth, highest)
    apart = np.abs(between(azimuth, few, highest, dense) - many) / np.abs(many).max()
    inner = slice(None) if len(azimuth) == 48 else (dense > azimuth[2]) & (dense < azimuth[-3])
    assert apart[:, inner].max() < METHOD["tolerance"]
    # Measured: 5.4e-5 in the gap at an arc's end, beyond which nothing is known.
    assert apart.max() < 1e-4
    assert np.abs(between(azimuth, few, highest, azimuth) - few).max() < METHOD["tolerance"] * np.abs(many).max()
