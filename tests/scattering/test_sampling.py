"""Sweeps that follow from fewer directions than they have."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from test_magnetic import outward
from test_solve import octasphere, sheet

from isarflow.scattering import directions
from isarflow.scattering.mom.assembly import Entries
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.mom.farfield import Excitation
from isarflow.scattering.mom.operators import efie
from isarflow.scattering.solve import _System, solve
from isarflow.scattering.threads import Pool

K = 2 * np.pi  # wavelength 1 m
ELEVATION, AZIMUTH = np.array([-30.0, 0.0, 25.0, 90.0]), np.arange(0.0, 360.0, 2.0)
PLANES = [[], ["xz"], ["yz"], ["xz", "yz"]]


@pytest.fixture(scope="module")
def ellipsoid():
    return outward(*octasphere(9, [0.7, 0.35, 0.4]))


@pytest.mark.parametrize("symmetry", PLANES)
@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_excitation_follows_from_the_samples(ellipsoid, symmetry, dtype):
    surface = fundamental_domain(*ellipsoid, symmetry)
    bases = [rwg(surface, parity) for parity in surface.parities]
    samples = directions.sample(surface, K, ELEVATION, AZIMUTH, dtype)
    assert len(samples.u) < 0.5 * len(ELEVATION) * len(AZIMUTH) / 2 ** len(symmetry)
    u, *waves = (x.reshape(-1, 3) for x in directions.directions(ELEVATION, AZIMUTH))
    for letter, wave in zip("VH", waves, strict=True):
        excitation = Excitation(surface, bases, dtype)
        few, whole = excitation(K, samples.u, samples.polarizations[letter]), excitation(K, u, wave)
        for parity, (a, b) in enumerate(zip(few, whole, strict=True)):
            rings = zip(samples.rings, samples.weights, strict=True)
            follows = np.concatenate([a[:, ring] @ weights[letter][parity].T for ring, weights in rings], 1)
            # The excitation itself is that of seven points a triangle, good to 1e-5 at ten edges a wavelength.
            assert np.abs(follows - b).max() < 1e-5 * np.abs(whole[0]).max()


@pytest.mark.parametrize("symmetry", PLANES)
def test_an_excitation_follows_from_its_skeletons(ellipsoid, symmetry):
    """V and H of each ring from fewer columns, in every parity; a parity that nothing excites needs none."""
    surface = fundamental_domain(*ellipsoid, symmetry)
    bases = [rwg(surface, parity) for parity in surface.parities]
    samples = directions.sample(surface, K, ELEVATION, AZIMUTH, np.complex64)
    (part,) = samples.parts("HV")
    _, u, polarization, groups = part
    with Pool(2) as pool:
        excitations = Excitation(surface, bases, np.complex64)(K, u, polarization)
        found = directions.skeletons(excitations, groups, pool)
        for excitation, (kept, few, weights) in zip(excitations, found, strict=True):
            assert kept.shape[1] == few[-1].stop < 0.95 * len(u)
            for group, own, weight in zip(groups, few, weights, strict=True):
                assert np.abs(kept[:, own] @ weight - excitation[:, group]).max() < 1e-5 * np.abs(excitation).max()
            ((nothing, few, weights),) = directions.skeletons([0 * excitation], groups, pool)
            assert nothing.shape == (len(excitation), 0) and [len(w) for w in weights] == [0] * len(few)


@pytest.mark.parametrize(("length", "across"), [(34, 5), (60, 45)])
def test_a_skeleton_knows_all_edges_of_a_regular_mesh(length, across):
    """A plate on edge, seen face on and obliquely: edges of one direction are excited by one polarization alone."""
    vertices, triangles = sheet([length / 10, 0, 0], [0, across / 10, 0], length, across)
    surface = fundamental_domain(vertices[:, [2, 0, 1]], triangles, [])
    excitation = Excitation(surface, [rwg(surface, surface.parities[0])], np.complex64)
    u, *waves = (x.reshape(-1, 3) for x in directions.directions([0.0], np.linspace(0, 30, 2 if across < 9 else 40)))
    (right,) = excitation(K, np.concatenate([u, u]), np.concatenate(waves))
    numbers, weights = directions.skeleton(right)
    assert np.abs(right[:, numbers] @ weights - right).max() < 1e-4 * np.abs(right).max()


def test_a_skeleton_of_rare_rows_and_of_what_is_not_finite():
    """What a few of 20,000 rows alone have is found; an excitation that is not a number is kept whole."""
    right = np.zeros((20_000, 6), np.complex64)
    right[:, :3] = np.random.default_rng(1).standard_normal((20_000, 3))
    right[::100, 3:] = np.random.default_rng(2).standard_normal((200, 3))
    numbers, weights = directions.skeleton(right)
    assert np.abs(right[:, numbers] @ weights - right).max() < 1e-4
    right[7, 2] = np.nan
    assert len(directions.skeleton(np.repeat(right[7:8], 9, axis=0))[0]) == 6


def test_skeletons_change_no_field(ellipsoid):
    """The quadratic forms between all excitations, from those of a few of them and without."""
    surface = fundamental_domain(*ellipsoid, ["xz"])
    bases = [rwg(surface, parity) for parity in surface.parities]
    system = _System(partial(Entries, efie, surface, bases, K, efie.near_terms(surface)), np.complex64, None, 2)
    system.assemble(lambda done: None)
    system.factorize(lambda done: None)
    samples = directions.sample(surface, K, ELEVATION, AZIMUTH, np.complex64)
    ((_, u, polarization, groups),) = samples.parts("HV")
    right = Excitation(surface, bases, np.complex64)(K, u, polarization)
    system.probe(right)
    few, whole = system.between(right, right, groups), system.between(right, list(right), groups)
    for of_parity in zip(few, whole, strict=True):
        for a, b in zip(*of_parity, strict=True):
            assert np.abs(a - b).max() < 2e-5 * np.abs(b).max()


@pytest.mark.parametrize(("count", "bound"), [(10, 1e-6), (40, 1e-13)])
def test_samples_hold_a_plane_wave(count, bound):
    """Of a point at radius rho, whose excitation has a closed form, in both precisions."""
    rho, phi = count / (2 * np.pi), 0.3
    number = directions.samples_of_ring(K * rho, bound)

    def wave(azimuth):
        az = np.radians(azimuth)
        return np.cos(az) * np.exp(1j * K * rho * np.cos(az - phi))

    follows = directions._periodic(AZIMUTH, number) @ wave(np.arange(number) * 360 / number)
    assert np.abs(follows - wave(AZIMUTH)).max() < 10 * bound
    fewer = 2 * count
    follows = directions._periodic(AZIMUTH, fewer) @ wave(np.arange(fewer) * 360 / fewer)
    assert np.abs(follows - wave(AZIMUTH)).max() > 1e-2


@pytest.mark.parametrize("symmetry", PLANES)
def test_sampled_sweep_equals_the_direct_one(ellipsoid, symmetry, monkeypatch):
    letters = ["VV", "HH", "HV", "VH"]
    sampled = solve(*ellipsoid, [299792458.0], ELEVATION, AZIMUTH, letters, symmetry).field
    monkeypatch.setattr(directions, "samples_of_ring", lambda x, tolerance: 1000)
    direct = solve(*ellipsoid, [299792458.0], ELEVATION, AZIMUTH, letters, symmetry).field
    assert np.abs(sampled - direct).max() < 1e-5 * np.abs(direct).max()
    assert np.abs(direct[2]).max() > 0.01 * np.abs(direct).max()


def test_sampled_sweep_of_the_combined_equation_equals_the_direct_one(ellipsoid, monkeypatch):
    settings = {"symmetry": ["xz"], "formulation": "cfie", "polarizations": ["VV", "HV"]}
    sampled = solve(*ellipsoid, [299792458.0], ELEVATION, AZIMUTH, **settings).field
    monkeypatch.setattr(directions, "samples_of_ring", lambda x, tolerance: 1000)
    direct = solve(*ellipsoid, [299792458.0], ELEVATION, AZIMUTH, **settings).field
    assert np.abs(sampled - direct).max() < 1e-5 * np.abs(direct).max()


def test_a_target_far_from_the_origin_needs_no_more_samples(ellipsoid):
    counts = []
    for shift in ([0.0, 0.0, 0.0], [20.0, 0.0, 5.0]):
        surface = fundamental_domain(ellipsoid[0] + shift, ellipsoid[1], ["xz"])
        middle = directions.middle_of(surface)
        assert np.allclose(middle, [shift[0], 0, shift[2]])
        counts.append(
            len(
                directions.sample(
                    replace(surface, vertices=surface.vertices - middle), K, [0.0], AZIMUTH, np.complex64
                ).u
            )
        )
    assert counts[0] == counts[1] < 40


@pytest.mark.parametrize("symmetry", PLANES)
def test_few_azimuths_are_taken_as_they_are(ellipsoid, symmetry):
    surface = fundamental_domain(*ellipsoid, symmetry)
    samples = directions.sample(surface, K, [10.0], [0.0, 60.0, 300.0, 120.0, 360.0], np.complex64)
    assert len(samples.u) == {(): 4, ("xz",): 3, ("yz",): 3, ("xz", "yz"): 2}[tuple(symmetry)]
    assert set(np.unique(samples.weights[0]["H"])) <= {-1.0, 0.0, 1.0}
