"""Shooting and bouncing rays against closed forms of what reflects once, twice and three times."""

import numpy as np
import pytest

pytest.importorskip("embreex", reason="Embree is an extra package: envs/requirements-rays.lock")

from isarflow.core.sweep import C0, Sweep
from isarflow.scattering.optics.physical import Surface
from isarflow.scattering.optics.rays import Scene
from isarflow.scattering.solver import build_solver
from isarflow.scattering.sphere import icosphere

K = 2 * np.pi  # the wavelength is 1 m


def joined(*corners):
    """Triangles and quadrangles of these corners as one mesh."""
    vertices, triangles = [], []
    for face in corners:
        first = sum(map(len, vertices))
        triangles += [(first, first + n, first + n + 1) for n in range(1, len(face) - 1)]
        vertices.append(np.array(face, float))
    return np.concatenate(vertices), np.array(triangles)


def dbsm(field):
    return 20 * np.log10(np.abs(field)) + 10 * np.log10(4 * np.pi)


def dihedral(a=5.0, b=6.0, turn=0.0):
    """Two plates of a x b at right angles, their seam turned by degrees about x from z, open towards x."""
    r = a / np.sqrt(2)
    vertices, triangles = joined(
        [(0, 0, -b / 2), (r, r, -b / 2), (r, r, b / 2), (0, 0, b / 2)],
        [(0, 0, -b / 2), (r, -r, -b / 2), (r, -r, b / 2), (0, 0, b / 2)],
    )
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    return vertices @ np.array([(1, 0, 0), (0, c, s), (0, -s, c)]), triangles


def test_what_reflects_once_is_physical_optics():
    mesh = icosphere(2.0, 0.1)
    angles = [0, 20, -40], [10, 130, 300]
    found, optics = Scene(*mesh).backscatter([K], *angles), Surface(*mesh).backscatter([K], *angles)
    np.testing.assert_array_equal(found[[0, 3]], optics)  # a convex body reflects no ray twice
    assert not found[1:3].any()


def test_a_dihedral_reflects_twice():
    """8 pi a^2 b^2 / lambda^2 (Knott, Shaeffer, Tuley, Radar Cross Section, table 6.1); V and H of opposite sign."""
    vv, vh, hv, hh = Scene(*dihedral()).backscatter([K], [0], [0])[:, 0, 0]
    for field in (vv, hh):
        assert dbsm(field) == pytest.approx(10 * np.log10(8 * np.pi * 25 * 36), abs=0.3)
    assert np.degrees(np.angle(vv / hh)) % 360 == pytest.approx(180, abs=2)
    assert max(abs(vh), abs(hv)) < 1e-6 * abs(vv)
    # Turned by 45 degrees it turns V into H.
    turned = Scene(*dihedral(turn=45)).backscatter([K], [0], [0])[:, 0, 0]
    assert dbsm(turned[1]) == pytest.approx(dbsm(vv), abs=0.4) and turned[1] == pytest.approx(turned[2], rel=1e-3)
    assert abs(turned[0]) < 0.05 * abs(turned[1])


def test_a_trihedral_reflects_three_times():
    """4 pi a^4 / (3 lambda^2) on its axis (the same table), and nearly so beside it."""
    a = 12.0
    x, y, z = np.eye(3) * a
    scene = Scene(*joined([(0, 0, 0), x, y], [(0, 0, 0), y, z], [(0, 0, 0), z, x]))
    vv, vh, _, hh = scene.backscatter([K], [35.264, 30], [45, 50])[:, :, 0]
    for field in (vv, hh):
        assert dbsm(field[0]) == pytest.approx(10 * np.log10(4 * np.pi * a**4 / 3), abs=0.3)
        assert abs(dbsm(field[1]) - dbsm(field[0])) < 2
    assert np.abs(vh).max() < 0.15 * np.abs(vv).max()


def test_the_solver_gives_every_polarization():
    asked = {"frequency": np.array([C0, 1.5 * C0]), "elevation": np.array([0.0, 10.0]), "azimuth": np.array([0.0])}
    solver, sweep = build_solver({"solver": "sbr"}), Sweep(**asked, polarizations=["HH", "HV", "VV"])
    solution = solver.solve(*dihedral(), sweep, [], 2, lambda *of: None)
    assert solution.field.shape == (3, 2, 2, 1)
    expected = Scene(*dihedral()).backscatter(2 * np.pi * asked["frequency"] / C0, [0, 10], [0, 0])
    np.testing.assert_allclose(solution.field[..., 0], expected[[3, 2, 0]].transpose(0, 2, 1), rtol=1e-12)
    megabytes, seconds = solver.plan({"box": np.array([3.5, 7.0, 6.0])}, 0, sweep)
    assert 700 < megabytes < 2000 and 0 < seconds < 60
