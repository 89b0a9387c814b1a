"""Physical optics against closed forms: plates, spheres, shadows; and as a solver of the workflow."""

import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, Sweep, unit_vectors
from isarflow.scattering.optics.physical import Surface, _difference
from isarflow.scattering.solver import build_solver
from isarflow.scattering.sphere import backscatter, icosphere

K = 2 * np.pi  # the wavelength is 1 m


def plate(width, height, pieces=1, x=0.0):
    """A plate across x, of pieces x pieces squares of two triangles."""
    steps = np.linspace(-0.5, 0.5, pieces + 1)
    y, z = np.meshgrid(steps * width, steps * height, indexing="ij")
    vertices = np.stack([np.full(y.size, x), y.ravel(), z.ravel()], axis=1)
    corner = (np.arange(pieces)[:, None] * (pieces + 1) + np.arange(pieces)).ravel()
    a, b, c, d = corner, corner + pieces + 1, corner + pieces + 2, corner + 1
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def of_plate(width, height, elevation, azimuth, x=0.0):
    """Physical optics of the plate in closed form: -j k A / (2 pi) cos exp(2 j k u_x x) sinc sinc."""
    (u,) = unit_vectors(np.array([elevation]), np.array([azimuth]))[0]
    across = np.sinc(2 * width * u[1]) * np.sinc(2 * height * u[2])  # of k / pi times 2 m: k = 2 pi
    return -1j * width * height * abs(u[0]) * across * np.exp(2j * K * u[0] * x)


@pytest.mark.parametrize("pieces", [1, 2, 30])
def test_a_plate_is_exact_at_any_angle_and_with_any_triangles(pieces):
    angles = np.array([(0, 0), (0, 180), (0, 20), (30, 0), (17, 33), (-5, 80), (0.001, 0.001), (45, 45)], float)
    found = Surface(*plate(3.0, 2.0, pieces, x=0.4)).backscatter([K], *angles.T)[0, :, 0]
    expected = [of_plate(3.0, 2.0, *of, x=0.4) for of in angles]
    np.testing.assert_allclose(found, expected, atol=1e-9 * 6)


def test_frequencies_share_one_surface():
    surface = Surface(*plate(3.0, 2.0, 5))
    every = surface.backscatter([0.5 * K, K, 1.7 * K], [10, 0], [20, 3])
    for n, k in enumerate((0.5 * K, K, 1.7 * K)):
        np.testing.assert_allclose(every[0, :, n], surface.backscatter([k], [10, 0], [20, 3])[0, :, 0], rtol=1e-9)


@pytest.mark.parametrize("size", [0, 1e-5, 1e-3, 0.02, 0.3, 4.0])
def test_divided_differences_are_means_of_the_second_derivative(size):
    """Hermite and Genocchi: over the triangle of weights; here by Gauss's rule."""
    corners = 2.0 + size * np.array([0.3, -1.0, 0.9])
    points, weights = np.polynomial.legendre.leggauss(40)
    s, w = (points + 1) / 2, weights / 2
    inner = s[:, None] * (1 - s)
    at = corners[0] + s * (corners[1] - corners[0]) + inner * (corners[2] - corners[0])
    expected = -(w[:, None] * w * (1 - s) * np.exp(1j * at)).sum()
    assert _difference(*corners) == pytest.approx(expected, abs=1e-11)
    assert _difference(*corners[[2, 0, 1]]) == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize(("radius", "edges", "tolerance"), [(1.0, 10, 0.01), (3.0, 10, 0.003), (3.0, 6, 0.006)])
def test_a_sphere_is_physical_optics_closed_form_and_nearly_mie(radius, edges, tolerance):
    found = Surface(*icosphere(radius, 1 / edges)).backscatter([K], [10, 0, -35], [20, 77, 200])[0, :, 0]
    # -j k a^2 int_0^1 c exp(2 j k a c) dc
    x = 2j * K * radius
    closed = -1j * K * radius**2 * (np.exp(x) * (x - 1) + 1) / x**2
    np.testing.assert_allclose(found / closed, 1, atol=tolerance)
    level = 20 * np.log10(np.abs(found / backscatter(K, radius)))
    assert np.abs(level).max() < 0.2


def test_what_stands_before_hides_what_is_behind():
    """A plate before another hides it from the front; from the side both are seen; each by its own closed form."""
    front, behind = plate(3.0, 3.0, 20, x=2.0), plate(2.0, 2.0, 20, x=-2.0)
    vertices = np.concatenate([front[0], behind[0]])
    both = Surface(vertices, np.concatenate([front[1], behind[1] + len(front[0])]))
    ahead, astern, aside = both.backscatter([K], [0, 0, 0], [0, 180, 70])[0, :, 0]
    assert ahead == pytest.approx(of_plate(3.0, 3.0, 0, 0, 2.0), abs=1e-6)
    # From behind the smaller plate is before the larger one, and hides a part of it as large as itself.
    hidden = of_plate(2.0, 2.0, 0, 180, -2.0) + of_plate(3.0, 3.0, 0, 180, 2.0) - of_plate(2.0, 2.0, 0, 180, 2.0)
    assert astern == pytest.approx(hidden, rel=0.06)
    assert aside == pytest.approx(of_plate(3.0, 3.0, 0, 70, 2.0) + of_plate(2.0, 2.0, 0, 70, -2.0), abs=1e-6)


def test_a_turned_target_has_the_field_of_turned_directions():
    vertices, triangles = icosphere(1.0, 0.15)
    vertices = vertices * [1.0, 0.6, 0.3]
    turned = vertices @ np.array([(0, 1, 0), (-1, 0, 0), (0, 0, 1)])  # by 90 degrees of azimuth
    first = Surface(vertices, triangles).backscatter([K], [20, -10], [30, 100])
    second = Surface(turned, triangles).backscatter([K], [20, -10], [120, 190])
    np.testing.assert_allclose(first, second, rtol=0.01)


def sweep(**more):
    asked = {"frequency": np.array([C0, 2 * C0]), "elevation": np.array([0.0, 20.0]), "azimuth": np.array([5.0, 40.0])}
    return Sweep(**asked | {"polarizations": ["VV", "HV", "HH"]} | more)


def test_the_solver_gives_every_polarization_and_direction():
    progress = []
    solver = build_solver({"solver": "po"})
    solution = solver.solve(*plate(3.0, 2.0, 4), sweep(), ["xz"], 2, lambda *of: progress.append(of))
    assert solution.field.shape == (3, 2, 2, 2) and solution.residual is None
    assert solution.field[0, 0, 1, 1] == pytest.approx(of_plate(3.0, 2.0, 20, 40), abs=1e-9)
    np.testing.assert_array_equal(solution.field[0], solution.field[2])
    assert not solution.field[1].any()
    assert progress[-1] == (0, "directions", 1.0, 2.0)
    paired = solver.solve(*plate(3.0, 2.0, 4), sweep(paired=True), [], 1, lambda *of: None).field
    np.testing.assert_array_equal(paired[:, :, 1], solution.field[:, :, 1, 1])


def test_the_solver_has_no_separate_receivers():
    receivers = np.array([0.0]), np.array([0.0])
    with pytest.raises(InputError, match="of backscatter alone"):
        build_solver({"solver": "po"}).solve(*plate(1.0, 1.0), sweep(receivers=receivers), [], 1, lambda *of: None)
