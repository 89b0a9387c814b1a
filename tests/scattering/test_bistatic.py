"""Receivers apart from the radar: the sphere's Mie series, reciprocity, mirror planes and the store."""

import mie
import numpy as np
import pytest
from test_solve import FREQUENCY, decibel, octasphere

from isarflow.core.store import open_store
from isarflow.core.sweep import Sweep
from isarflow.mesh.io import write_ply
from isarflow.scattering.band import solve_band
from isarflow.scattering.fields.cuts import by_transmitter, cut
from isarflow.scattering.fields.rcs import COLUMNS, RECEIVER, as_table, rcs_dbsm
from isarflow.scattering.solve import solve

LETTERS = ["VV", "HH", "HV", "VH"]
AROUND = np.arange(0.0, 360.0, 3.0)
METHOD = {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5}


@pytest.mark.parametrize(("edges", "bound"), [(10, 0.3), (14, 0.1)])
def test_a_sphere_agrees_with_the_mie_series(edges, bound):
    """Half a wavelength of radius, a transmitter at the nose, receivers round the horizon."""
    sphere = mie.icosphere(0.5, 1 / edges)
    found = solve(*sphere, [FREQUENCY], [0.0], [0.0], LETTERS, receivers=(0 * AROUND, AROUND)).field[:, 0, 0, 0]
    # The wave travels along -x: at azimuth a it has turned by 180 degrees less a.
    in_plane, across = mie.bistatic(2 * np.pi, 0.5, np.radians(180 - AROUND))
    assert np.abs(decibel(found[0] / across)).mean() < bound
    assert np.abs(decibel(found[1] / in_plane)).mean() < bound
    assert np.abs(found[0] - across).max() < 0.02 * np.abs(across).max()
    assert np.abs(found[2:]).max() < 0.02 * np.abs(found[0]).max()


@pytest.fixture(scope="module")
def ellipsoid():
    vertices, triangles = octasphere(5, [0.4, 0.25, 0.3])
    return vertices, triangles


PLACES = np.array([-30.0, 0.0, 50.0]), np.array([10.0, 200.0, 95.0])


@pytest.fixture(scope="module")
def field(ellipsoid):
    """(P, 3, 3) from each of PLACES to each."""
    moved = ellipsoid[0] + [0.2, 0.0, 0.1]
    return solve(moved, ellipsoid[1], [FREQUENCY], *PLACES, LETTERS, paired=True, receivers=PLACES).field[:, 0]


def test_transmitter_and_receiver_change_places(field):
    for way, turned in ((0, 0), (1, 1), (2, 3)):
        assert np.abs(field[way] - field[turned].T).max() < 1e-4 * np.abs(field).max()


def test_a_receiver_at_the_transmitter_receives_backscatter(ellipsoid, field):
    moved = ellipsoid[0] + [0.2, 0.0, 0.1]
    back = solve(moved, ellipsoid[1], [FREQUENCY], *PLACES, LETTERS, paired=True).field[:, 0]
    assert np.abs(np.diagonal(field, axis1=1, axis2=2) - back).max() < 1e-4 * np.abs(field).max()


def test_mirror_planes_change_nothing(ellipsoid):
    how = {"polarizations": LETTERS, "paired": True, "receivers": PLACES}
    plain, mirrored = (
        solve(*ellipsoid, [FREQUENCY], *PLACES, symmetry=planes, **how).field for planes in ([], ["xz", "xy"])
    )
    assert np.abs(plain - mirrored).max() < 1e-4 * np.abs(plain).max()


def test_the_store_and_the_table_hold_the_receivers(ellipsoid, tmp_path):
    write_ply(tmp_path / "a.ply", *ellipsoid)
    receivers = np.array([0.0, 10.0]), np.array([20.0, 40.0])
    asked = Sweep(np.array([FREQUENCY]), np.array([0.0, 30.0]), np.array([5.0]), ["VV"], False, receivers)
    scattering = METHOD | {"bistatic": {"receivers": [[0, 20], [10, 40]]}}
    solve_band(tmp_path / "a.ply", tmp_path / "a.zarr", asked, scattering, [], 1, "a")
    dataset = open_store(tmp_path / "a.zarr")
    assert dataset.field.dims == ("polarization", "frequency", "elevation", "azimuth", "receiver")
    table = as_table(dataset)
    assert list(table.columns) == [*COLUMNS[:3], *RECEIVER.values(), *COLUMNS[3:]]
    np.testing.assert_allclose(table["rcs_dbsm"], rcs_dbsm(dataset.field.values.ravel()))
    assert table["receiver_azimuth_deg"].tolist() == [20, 40, 20, 40]
    parts = by_transmitter("a", dataset, 5)
    assert [title for title, _ in parts] == ["a_from_0_5", "a_from_30_5"]
    *_, (curve,) = cut(parts[1][1], None, 5)
    np.testing.assert_allclose(curve.levels, table["rcs_dbsm"][2:])
