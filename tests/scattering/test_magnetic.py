"""The combined field integral equation against closed forms, plain quadrature and its own symmetries."""

import itertools

import jax.numpy as jnp
import mie
import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import dblquad
from stored import dense
from test_matrix import K
from test_solve import AZIMUTH, ELEVATION, FREQUENCY, decibel, octasphere, sheet

from isarflow.core.errors import InputError
from isarflow.scattering.mom import reference
from isarflow.scattering.mom.assembly import Entries, assemble
from isarflow.scattering.mom.basis import fundamental_domain, gram, rwg
from isarflow.scattering.mom.factorization import GeneralMatrix
from isarflow.scattering.mom.nearfield import near_pairs
from isarflow.scattering.mom.operators import cfie
from isarflow.scattering.mom.quadrature import RULES, static_gradient
from isarflow.scattering.solve import solve

RESONANCE = 2.744  # of a spherical cavity: the first zero of (x j_1)'


def outward(vertices, triangles):
    """A star-shaped mesh with the triangles turned so that their normals point outwards."""
    inward = np.linalg.det(vertices[triangles]) < 0
    return vertices, np.where(inward[:, None], triangles[:, ::-1], triangles)


def general(size, dtype, block, seed=0):
    random = np.random.default_rng(seed)
    a = random.normal(size=(size, size)) + 1j * random.normal(size=(size, size)) + 3 * np.sqrt(size) * np.eye(size)
    matrix = GeneralMatrix(size, dtype, block)
    edges = np.append(np.arange(0, size, 37), size)
    for i, j in np.ndindex(len(edges) - 1, len(edges) - 1):
        tile = a[edges[i] : edges[i + 1], edges[j] : edges[j + 1]].astype(dtype)
        matrix.put(edges[i], edges[j], tile)
    return a, matrix


@pytest.mark.parametrize(("dtype", "bound"), [(np.complex64, 1e-4), (np.complex128, 1e-12)])
@pytest.mark.parametrize("block", [50, 64, 500])
def test_factorization_solves(dtype, bound, block):
    a, matrix = general(201, dtype, block)
    left, right = np.random.default_rng(1).normal(size=(2, 201, 5)).astype(dtype)
    rows = np.array([5, 40, 200])
    assert np.allclose(dense(matrix)[rows], a[rows], rtol=1e-6)
    matrix.factorize()
    truth = np.linalg.solve(a, right)
    assert np.abs(matrix.solve(right) - truth).max() < bound * np.abs(truth).max()
    groups = [slice(0, 2), slice(2, 5)]
    for group, between in zip(groups, matrix.between(left, right, groups), strict=True):
        assert np.allclose(between, left[:, group].T @ truth[:, group], atol=bound)


def test_bits_do_not_depend_on_threads():
    right = np.random.default_rng(2).normal(size=(1300, 700)).astype(np.complex64)
    results = []
    for threads in (1, 2, 5):
        matrix = general(1300, np.complex64, 512)[1]
        matrix.factorize(threads)
        results.append(
            (*matrix.between(right, 2 * right, [slice(3, 600)], threads), matrix.solve(right[:, :3], threads))
        )
    for other in results[1:]:
        assert all(np.array_equal(x, y) for x, y in zip(results[0], other, strict=True))


@pytest.mark.usefixtures("double_precision")
def test_static_gradient_agrees_with_integration():
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.2]])
    edges = triangle[1] - triangle[0], triangle[2] - triangle[0]
    normal = np.cross(*edges)
    area = np.linalg.norm(normal)
    above = triangle.mean(0) + 0.05 * normal / area
    in_line = triangle[1] + 0.4 * edges[0]  # an edge's line runs through this point
    for point in np.array([[0.4, 0.3, 0.5], [2.0, -1.0, 0.3], above, 2 * triangle.mean(0) - above, in_line]):

        def integrate(component, point=point):
            def integrand(s, t):
                offset = triangle[0] + s * edges[0] + t * edges[1] - point
                return offset[component] / np.linalg.norm(offset) ** 3

            return area * dblquad(integrand, 0, 1, 0, lambda t: 1 - t, epsabs=1e-8)[0]

        gradient = static_gradient(jnp.array(point), jnp.array(triangle))
        assert np.allclose(gradient, [integrate(x) for x in range(3)], rtol=1e-5, atol=1e-6)


@pytest.mark.usefixtures("double_precision")
def test_static_gradient_on_the_triangle_is_the_principal_value():
    """The mean of both sides, whatever the rounding of the point's height."""
    triangle = jnp.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.2]])
    points = (jnp.asarray(RULES[7][0]) @ triangle).T
    normal = jnp.cross(triangle[1], triangle[2])
    normal = normal / jnp.linalg.norm(normal)
    on, above, below = (static_gradient((points.T + h * normal).T, triangle[:, :, None]) for h in (0.0, 1e-6, -1e-6))
    assert np.abs(on - (above + below) / 2).max() < 1e-5
    assert np.allclose(normal @ above, -2 * np.pi, atol=1e-4)


@pytest.mark.usefixtures("double_precision")
def test_smooth_remainder_is_continuous_across_its_series():
    distance = np.linspace(0.01, 0.5, 200)
    x = K * distance
    truth = (1 - (1 + 1j * x) * np.exp(-1j * x)) / distance**3
    for real, bound in ((np.float32, 1e-5), (np.float64, 1e-8)):
        parts = cfie._smooth(real(K), jnp.asarray(distance, real))
        smooth = parts[0] + 1j * parts[1]
        assert (np.abs(smooth - truth) < bound * np.abs(truth)).all()


def matrix_of(surface, monkeypatch, alpha):
    monkeypatch.setattr(cfie, "ALPHA", alpha)
    basis = rwg(surface, surface.parities[0])
    matrix = GeneralMatrix(len(basis), np.complex128)
    assemble(Entries(cfie, surface, [basis], K, cfie.near_terms(surface), np.complex128), [matrix])
    return basis, dense(matrix)


def test_far_entries_agree_with_direct_quadrature(monkeypatch):
    """The MFIE's entries by a fine rule, from n x (grad G x f') as it is written, and by the tiles' own rule."""
    surface = fundamental_domain(*outward(*octasphere(4, [0.5, 0.4, 0.45])), ())
    basis, z = matrix_of(surface, monkeypatch, 0.0)
    compared = 0
    scale = np.abs(z[~np.eye(len(z), dtype=bool)]).max()
    near = set(map(tuple, near_pairs(surface.vertices, surface.vertices).tolist()))
    for m, n in itertools.product(range(0, len(basis), 7), range(3, len(basis), 11)):
        if near & set(itertools.product((basis.halves[m] // 3).tolist(), (basis.halves[n] // 3).tolist())):
            continue
        # Of three points the same sum: 3e-16. Of seven, on edges of a fifth of a wavelength: 4e-4 of the largest.
        for count, relative, absolute in ((3, 0, 1e-14), (7, 0.02, 0.002)):
            field, source = (reference.sampled(surface, basis, function, count) for function in (m, n))
            direct = reference.magnetic(field, source, K)
            assert abs(z[m, n] - direct) < relative * abs(direct) + absolute * scale
            compared += 1
    assert compared > 500  # 558


def test_eigenvalues_of_a_small_sphere(monkeypatch):
    """On a sphere much smaller than a wavelength the MFIE multiplies grad Y_1 by 1/3 and n x grad Y_1 by 2/3.

    The second is known to everyone: a static field H gives the current (3/2) n x H. Near pairs make up all of it.
    """
    surface = fundamental_domain(*mie.icosphere(0.01, 0.0025), ())
    basis, z = matrix_of(surface, monkeypatch, 0.0)
    axis = np.array([0.3, -0.5, 0.8])
    tangential = axis - surface.normals * (surface.normals @ axis)[:, None]
    halves = np.zeros((3 * len(surface.vertices), len(basis)))
    np.add.at(halves, (basis.halves.reshape(-1), np.repeat(np.arange(len(basis)), 2)), basis.signs.reshape(-1))
    lengths = surface.lengths / 6
    own = sparse.block_diag(gram(surface) * lengths[:, :, None] * lengths[:, None])
    products = halves.T @ own @ halves
    nu = surface.vertices.mean(1)[:, None] - surface.vertices
    for current, truth in ((tangential, 1 / 3), (np.cross(surface.normals, axis), 2 / 3)):
        tested = np.einsum("tix,tx->ti", nu, current) * surface.lengths / 2
        x = np.linalg.solve(products, halves.T @ tested.reshape(-1))
        value = (x @ z @ x) / (x @ products @ x) * 1j * K / (4 * np.pi)
        assert abs(value - truth) < 0.02 * truth


def test_resonance_leaves_the_matrix_well_conditioned(monkeypatch):
    """Close to the frequency where the cavity of the faceted sphere itself resonates."""
    surface = fundamental_domain(*mie.icosphere(RESONANCE / K, 0.14), ())
    numbers = [np.linalg.cond(matrix_of(surface, monkeypatch, alpha)[1]) for alpha in (1.0, cfie.ALPHA)]
    assert numbers[0] > 1000
    assert numbers[1] < 20


@pytest.mark.parametrize(("electrical_radius", "edge"), [(1.57, 0.1), (np.pi, 0.1), (RESONANCE, 0.1), (4.493, 0.1)])
def test_sphere_agrees_with_mie(electrical_radius, edge):
    radius = electrical_radius / K
    mesh = mie.icosphere(radius, edge)
    directions = [0.0, 35.0], [0.0, 100.0, 200.0]
    solution = solve(*mesh, [FREQUENCY], *directions, ["VV", "HH", "HV"], formulation="cfie")
    ratio = solution.field[:2] / mie.backscatter(K, radius)
    assert np.abs(decibel(ratio)).max() < 0.1
    assert np.abs(np.degrees(np.angle(ratio))).max() < 2
    assert np.abs(solution.field[2]).max() < 0.01 * np.abs(solution.field[:2]).max()
    assert solution.residual.max() < 1e-5


@pytest.fixture(scope="module")
def ellipsoid():
    return outward(*octasphere(7, [0.5, 0.35, 0.4]))


@pytest.fixture(scope="module")
def plain(ellipsoid):
    waves = ["VV", "HH", "HV", "VH"]
    return solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, waves, precision="double", formulation="cfie")


@pytest.mark.parametrize("symmetry", [["xz"], ["yz"], ["xz", "yz"]])
def test_mirrored_solve_equals_plain_one(ellipsoid, plain, symmetry):
    waves = ["VV", "HH", "HV", "VH"]
    mirrored = solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, waves, symmetry, formulation="cfie")
    assert np.abs(mirrored.field - plain.field).max() < 1e-5 * np.abs(plain.field).max()


def test_both_formulations_agree(ellipsoid, plain):
    efie = solve(*ellipsoid, [FREQUENCY], ELEVATION, AZIMUTH, ["VV", "HH", "HV", "VH"])
    assert np.abs(efie.field - plain.field).max() < 0.01 * np.abs(plain.field).max()
    # Reciprocity holds to the error of the mesh only: the matrix is not symmetric.
    assert np.abs(plain.field[2] - plain.field[3]).max() < 0.001 * np.abs(plain.field).max()


def test_error_falls_under_refinement():
    errors = []
    for edge in (0.2, 0.1, 0.05):
        mesh = mie.icosphere(0.3, edge)
        field = solve(*mesh, [FREQUENCY], [0.0], AZIMUTH, precision="double", formulation="cfie").field
        errors.append(np.abs(field / mie.backscatter(K, 0.3) - 1).max())
    assert errors[1] < errors[0] / 2
    assert errors[2] < errors[1] / 2


def solve_cfie(vertices, triangles):
    return solve(vertices, triangles, [FREQUENCY], [0.0], [0.0], formulation="cfie")


def test_open_sheet_is_refused():
    with pytest.raises(InputError, match="open"):
        solve_cfie(*sheet([0.3, 0, 0], [0, 0.3, 0], 3, 3))


def test_inward_part_is_refused(ellipsoid):
    vertices, triangles = ellipsoid
    beside = np.concatenate([vertices, vertices + np.array([2.0, 0, 0])])
    with pytest.raises(InputError, match="inwards on 1 of 2"):
        solve_cfie(beside, np.concatenate([triangles, triangles[:, ::-1] + len(vertices)]))


def test_disagreeing_triangles_are_refused(ellipsoid):
    vertices, triangles = ellipsoid
    turned = triangles.copy()
    turned[5] = turned[5, ::-1]
    with pytest.raises(InputError, match="disagree at 3 of 588 edges"):
        solve_cfie(vertices, turned)
