"""Solid dielectric bodies: exact series of spheres, energy, reciprocity, mirror planes, plain quadrature and plans.

The comments give what was measured when the bound was set. Lengths are in wavelengths: the wavelength is 1 m.
"""

from functools import partial

import mie
import numpy as np
import pytest
from test_magnetic import outward
from test_solve import AZIMUTH, ELEVATION, FREQUENCY, octasphere

from isarflow.core.errors import InputError
from isarflow.core.store import open_store
from isarflow.core.sweep import Sweep
from isarflow.mesh.io import write_ply
from isarflow.mesh.resolution import wanted_edges
from isarflow.scattering import needs
from isarflow.scattering.band import solve_band
from isarflow.scattering.costs import BASE_MEGABYTES, planned
from isarflow.scattering.mom import dielectric, reference
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.solve import solve
from isarflow.scattering.solver import build_solver

K = 2 * np.pi
LOSSY = 4 - 0.4j
PLANES = ["xz", "yz", "xy"]
METHOD = {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5}
AROUND = np.arange(0.0, 360.0, 15.0)
RADII = np.linspace(0.5, 2.0, 151)


def of_series(permittivity):
    return partial(mie.solid, permittivity=permittivity)


def backscatter(permittivity, radius):
    return mie.to_source(K, *mie.solid(K * radius, permittivity))


def sphere(radius, permittivity, density=10):
    """A sphere, symmetric about all planes, of the true one's volume, with so many edges in a wavelength inside."""
    edge = 1 / density / abs(permittivity) ** 0.5
    vertices, triangles = outward(*octasphere(round(1.84 * radius / edge), [radius] * 3))
    volume = np.linalg.det(vertices[triangles]).sum() / 6
    return vertices * (4 / 3 * np.pi * radius**3 / volume) ** (1 / 3), triangles


@pytest.fixture(scope="module")
def pebble():
    """A body without any symmetry to speak of."""
    vertices, triangles = outward(*octasphere(5, [0.2, 0.15, 0.1]))
    return vertices + 0.3 * vertices[:, [1, 2, 0]] * np.array([1, -0.5, 0.7]), triangles


@pytest.mark.parametrize("permittivity", [2.56, LOSSY])
def test_the_series_is_that_of_a_layer_without_a_hollow(permittivity):
    layer, solid = (
        np.array(one)[1:, :4] for one in (mie.layer(1.0, permittivity, 1.98), mie.solid(1.99, permittivity))
    )
    assert np.abs(layer - solid).max() < 1e-5  # measured: 5e-7 and 2e-6
    # Rayleigh's limit, and for a lossless body no absorption.
    _, a, _ = mie.solid(0.01, permittivity)
    assert a[0] == pytest.approx(2j / 3 * 0.01**3 * (permittivity - 1) / (permittivity + 2), rel=1e-3)
    _, *both = mie.solid(3.0, 2.56)
    assert np.abs(np.real(both) - np.abs(both) ** 2).max() < 1e-12


@pytest.fixture(scope="module")
def entries():
    """Whole matrices of all parities of an ellipsoid, without mirror planes and with all, in double precision."""
    mesh, result = outward(*octasphere(5, [0.5, 0.4, 0.3])), {}
    for planes in ((), tuple(PLANES)):
        surface = fundamental_domain(*mesh, planes)
        bases = dielectric.bases(surface)
        how = surface, bases, K, dielectric.near_terms(surface), np.complex128
        rows = dielectric.Entries(dielectric, *how, material=LOSSY)
        # A call takes functions on a tile's triangles at most.
        parts = [[np.arange(len(basis)) for basis in bases]]
        if not planes:
            parts = [[part] for part in np.array_split(np.arange(len(bases[0])), 4)]
        result[planes] = surface, [np.concatenate(of) for of in zip(*map(rows.rows, parts), strict=True)]
    return result


def test_entries_are_those_of_plain_quadrature(entries):
    surface, (matrix,) = entries[()]
    basis, (combined,) = rwg(surface, surface.parities[0]), dielectric.bases(surface)
    # Of which function of which current each unknown is.
    kinds, halves = combined.halves[:, 0] % 6 // 3, combined.halves // 6 * 3 + combined.halves % 3
    numbers = [np.flatnonzero((basis.halves == half).all(1)).item() for half in halves]
    places = [np.flatnonzero(kinds == kind)[np.argsort(np.array(numbers)[kinds == kind])] for kind in (0, 1)]
    centers = surface.vertices.mean(1)[basis.halves[:, 0] // 3]
    media = ((K, 1.0), (K * LOSSY**0.5, LOSSY))
    random, largest = np.random.default_rng(0), np.abs(matrix).max()
    for m in random.choice(len(basis), 6, replace=False):
        n = np.linalg.norm(centers - centers[m], axis=1).argmax()
        field, source = (reference.sampled(surface, basis, number, 3) for number in (m, n))
        z = [reference.electric(field, source, k) for k, _ in media]
        kappa = sum(reference.turned(field, source, k) for k, _ in media)
        both = -(z[0] + LOSSY * z[1])
        truth = np.array([[z[0] + z[1], -1j / K * kappa], [-1j / K * kappa, both]])
        found = matrix[np.ix_([places[0][m], places[1][m]], [places[0][n], places[1][n]])]
        # The same three points a triangle. Measured: 3e-15 of these entries.
        assert np.abs(found - truth).max() < 1e-9 * np.abs(truth).max()
        assert np.abs(truth).max() > 1e-6 * largest


def test_the_matrices_are_symmetric(entries):
    for _, matrices in entries.values():
        for matrix in matrices:
            # Measured: 4e-16.
            assert np.abs(matrix - matrix.T).max() < 1e-12 * np.abs(matrix).max()


@pytest.mark.parametrize(("permittivity", "radius"), [(2.56, 0.5), (LOSSY, 0.5), (70 - 20j, 0.1)])
def test_spheres_agree_with_their_series(permittivity, radius):
    receivers = np.zeros(len(AROUND)), AROUND
    how = {"symmetry": PLANES, "receivers": receivers, "permittivity": permittivity}
    field = solve(*sphere(radius, permittivity), [FREQUENCY], [0.0], [0.0], ["VV", "HH"], **how).field[:, 0, 0, 0]
    exact = backscatter(permittivity, radius)
    largest = max(abs(backscatter(permittivity, each)) for each in RADII)
    # Measured: 0.05, 0.13 and 0.001 %; of the field, 0.64, 0.22 and 0.007 %.
    assert np.abs(field[:, 0] - exact).max() < min(0.012 * largest, 0.015 * abs(exact))
    in_plane, across = mie.bistatic(K, radius, np.radians(180 - AROUND), of_series(permittivity))
    for found, truth in zip(field, (across, -in_plane), strict=True):
        # Measured: 0.12, 0.07 and 0.007 %.
        assert np.abs(found - truth).max() < 0.01 * np.abs(truth).max()


def test_mirror_planes_change_nothing(pebble):
    """A magnetic current is an axial vector, whose parities are turned."""
    mesh = outward(*octasphere(5, [0.2, 0.15, 0.1]))
    waves, how = ["VV", "HH", "HV"], {"permittivity": LOSSY}
    plain = solve(*mesh, [FREQUENCY], ELEVATION, AZIMUTH, waves, **how).field
    for planes in (["xy"], ["xz"], ["xz", "yz"], PLANES):
        mirrored = solve(*mesh, [FREQUENCY], ELEVATION, AZIMUTH, waves, planes, **how).field
        # Measured: 2e-6.
        assert np.abs(mirrored - plain).max() < 1e-5 * np.abs(plain).max()


def test_a_body_is_reciprocal(pebble):
    places = np.array([-30.0, 0.0, 50.0]), np.array([10.0, 200.0, 95.0])
    how = {"paired": True, "receivers": places, "permittivity": LOSSY}
    field = solve(*pebble, [FREQUENCY], *places, ["VV", "HV", "VH"], **how).field[:, 0]
    for way, turned in ((0, 0), (1, 2)):
        # Measured: 8e-7.
        assert np.abs(field[way] - field[turned].T).max() < 1e-5 * np.abs(field).max()
    assert np.abs(field[1]).max() > 0.01 * np.abs(field).max()


def test_a_body_of_nothing_is_transparent(pebble):
    """Its currents are the incident field, and what they radiate outwards is the difference of its two sides."""
    directions, media = ([20.0, -40.0], [10.0, 190.0], ["VV", "HV"]), [1.0, 1.1, 1.2, 2.0]
    field = solve(*pebble, [FREQUENCY] * 4, *directions, permittivity=media).field
    nothing, little, more, body = (np.abs(field[:, n]).max() for n in range(4))
    # Measured: 0.05 %; where common edges get seven points alone, 0.5 %.
    assert nothing < 1e-3 * body
    # A small body of a small contrast scatters as (eps - 1) / (eps + 2).
    assert more / little == pytest.approx(2 * 3.1 / 3.2, rel=0.03)


def test_power_is_absorbed_where_the_series_says():
    """Scattered power is summed all round; the field straight on says by the optical theorem what is taken."""
    points, weights = np.polynomial.legendre.leggauss(10)
    rings = np.degrees(np.arcsin(points)).repeat(len(AROUND)), np.tile(AROUND, len(points))
    receivers, radius = (np.append(rings[0], 0.0), np.append(rings[1], 180.0)), 0.25
    media = np.array([2.56, 2.56 - 0.1j, LOSSY])
    how = {"receivers": receivers, "permittivity": media, "symmetry": ["xz", "xy"]}
    patterns = solve(*sphere(radius, 4), [FREQUENCY] * len(media), [0.0], [0.0], ["VV", "HV"], **how).field[:, :, 0, 0]
    power = (np.abs(patterns[:, :, :-1]) ** 2).sum(0)
    scattered = power @ weights.repeat(len(AROUND)) * 2 * np.pi / len(AROUND)
    taken = -4 * np.pi / K * patterns[0, :, -1].imag
    for n, permittivity in enumerate(media):
        orders, a, b = mie.solid(K * radius, permittivity)
        parts = np.sum((2 * orders + 1) * ((a + b).real - np.abs(a) ** 2 - np.abs(b) ** 2))
        # Measured: 0.001, -0.004 and 2e-5 % of the power taken, of which 0, 15 and 20 % are absorbed.
        assert taken[n] - scattered[n] == pytest.approx(2 * np.pi / K**2 * parts, abs=1e-3 * taken[n])
    absorbed = (taken - scattered) / taken
    assert abs(absorbed[0]) < 1e-4
    assert absorbed[1:].min() > 0.1


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"permittivity": 4 + 0.1j}, "'permittivity' has a real part above 0"),
        ({"permittivity": [4, 4]}, "one for each of 1 frequencies"),
        ({"permittivity": 4, "impedance": 100}, "has no 'impedance'"),
        ({"permittivity": 4, "formulation": "cfie"}, "solved by its own equation"),
        ({"permittivity": 4, "tolerance": 1e-5, "precision": "double"}, "'tolerance': .* write None"),
        ({"permittivity": 1600}, "edges in a wavelength in it"),
    ],
)
def test_what_a_body_is_not_is_refused(how, said, pebble):
    with pytest.raises(InputError, match=said):
        solve(*pebble, [FREQUENCY], [0.0], [0.0], **how)


def test_an_open_body_is_refused_and_one_has_no_side(pebble):
    vertices, triangles = pebble
    with pytest.raises(InputError, match=r"is open .* A solid body needs"):
        solve(vertices, triangles[1:], [FREQUENCY], [0.0], [0.0], permittivity=4)
    one, other = (
        solve(vertices, of, [FREQUENCY], [0.0], [0.0], permittivity=4) for of in (triangles, triangles[:, ::-1])
    )
    assert np.abs(one.field - other.field).max() < 1e-4 * np.abs(one.field).max()


def test_a_hollow_body_agrees_with_its_series():
    """As thick as a quarter of the outer radius, whose full sphere scatters a third more."""
    (outer, triangles), (inner, within) = sphere(0.3, LOSSY), sphere(0.225, LOSSY)
    vertices, both = np.concatenate([outer, inner]), np.concatenate([triangles, within[:, ::-1] + len(outer)])
    how = {"symmetry": PLANES, "permittivity": LOSSY}
    found = solve(vertices, both, [FREQUENCY], [0.0], [0.0], **how).field.item()
    truth = mie.to_source(K, *mie.layer(K * 0.2625, LOSSY, K * 0.075))
    assert abs(found - truth) < 0.01 * abs(truth)
    assert abs(backscatter(LOSSY, 0.3) - truth) > 0.1 * abs(truth)


def test_a_solid_target_reaches_its_field_and_its_store(pebble, tmp_path):
    write_ply(tmp_path / "a.ply", *pebble)
    material = {"permittivity": 4.0, "loss_tangent": 0.1}
    asked = Sweep(np.array([FREQUENCY]), np.array([0.0]), np.array([0.0, 30.0]), ["VV"])
    solve_band(tmp_path / "a.ply", tmp_path / "a.zarr", asked, METHOD | {"material": material}, [], 1, "a")
    store, truth = open_store(tmp_path / "a.zarr"), solve(*pebble, [FREQUENCY], [0.0], [0.0, 30.0], permittivity=LOSSY)
    assert np.abs(store.field.values - truth.field).max() < 1e-5 * np.abs(truth.field).max()
    assert (store.attrs["formulation"], store.attrs["tolerance"]) == ("pmchwt", None)
    assert store.attrs["material"] == material
    assert store.attrs["unknowns"] == [truth.unknowns] == [2 * 3 * len(pebble[1]) // 2]


def test_a_solid_target_is_planned_with_both_currents_on_shorter_edges():
    material, box = {"permittivity": 4.0, "loss_tangent": 0.0}, [1.0, 0.5, 0.3]
    asked = Sweep(np.array([FREQUENCY]), np.array([0.0]), np.arange(0.0, 360.0, 3.0), ["VV"])
    measures = {"unknowns": 9000, "triangles": 6000, "box": box}
    found = build_solver(METHOD | {"material": material}).plan(measures, 0, asked)
    doubled = {**measures, "unknowns": 18000}
    assert found == planned(doubled, 0, asked, "pmchwt", "single", 1e-5)
    # Twice the unknowns, of which a whole matrix takes more memory and time.
    whole = planned(doubled, 0, asked, "pmchwt", "single", None)
    assert 4 * 18000**2 / 1e6 < whole[0] - BASE_MEGABYTES < 1.3 * 4 * 18000**2 / 1e6
    assert found[0] < whole[0] and found[1] < whole[1]
    radar = {"center_frequency": FREQUENCY, "bandwidth": 0.0, "frequencies": 1}
    mesh = {"edges_per_wavelength": 10, "bands": 1, "remesh": True}
    config = {"mesh": mesh, "targets": {"metal": {}, "wall": {"material": {**material, "thickness": 0.01}}}}
    config["targets"]["solid"] = {"material": material}
    edges = {name: wanted_edges(needs.mesh_of(config, name), radar, [5.0]) for name in config["targets"]}
    assert edges == {"metal": [pytest.approx(0.1)], "wall": [pytest.approx(0.1)], "solid": [pytest.approx(0.05)]}
