"""The parts of the solver against plain, slow versions of themselves."""

from functools import partial
from math import factorial

import jax.numpy as jnp
import mie
import numpy as np
import pytest
from scipy.integrate import dblquad
from stored import dense
from test_solve import octasphere

from isarflow.scattering.mom import nearfield, reference
from isarflow.scattering.mom.assembly import Entries, assemble, blocks_of
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.mom.factorization import GeneralMatrix, SymmetricMatrix
from isarflow.scattering.mom.green import green
from isarflow.scattering.mom.operators import cfie, efie
from isarflow.scattering.mom.quadrature import RULES, static_potentials
from isarflow.scattering.mom.tiles import TILE_TRIANGLES

K = 2 * np.pi


def symmetric(size, seed=0):
    random = np.random.default_rng(seed)
    a = random.normal(size=(size, size)) + 1j * random.normal(size=(size, size))
    return a + a.T + 3 * np.sqrt(size) * np.eye(size)


def filled(a, dtype, block):
    """The matrix put in tile by tile, as assembly does it."""
    matrix = SymmetricMatrix(len(a), dtype, block)
    edges = np.append(np.arange(0, len(a), 37), len(a))
    for i in range(len(edges) - 1):
        for j in range(i + 1):
            matrix.put(edges[i], edges[j], a[edges[i] : edges[i + 1], edges[j] : edges[j + 1]].astype(dtype))
    return matrix


@pytest.mark.parametrize(("dtype", "bound"), [(np.complex64, 1e-4), (np.complex128, 1e-12)])
@pytest.mark.parametrize("block", [50, 64, 500])
def test_factorization_solves(dtype, bound, block):
    a = symmetric(201)
    right = np.random.default_rng(1).normal(size=(201, 5)).astype(dtype)
    matrix = filled(a, dtype, block)
    numbers = np.array([0, 49, 50, 130, 200])
    assert np.array_equal(dense(matrix)[numbers], a[numbers].astype(dtype))
    matrix.factorize()
    truth = np.linalg.solve(a, right)
    assert np.abs(matrix.solve(right) - truth).max() < bound * np.abs(truth).max()
    left = right[:, ::-1].copy()
    groups = [slice(0, 2), slice(2, 5)]
    for group, between in zip(groups, matrix.between(left, right, groups), strict=True):
        assert np.allclose(between, left[:, group].T @ truth[:, group], atol=bound)
    assert np.allclose(matrix.between(right, right, [slice(0, 5)])[0], right.T @ truth, atol=bound)


def test_bits_do_not_depend_on_threads():
    a, right = symmetric(1700), np.random.default_rng(2).normal(size=(1700, 700)).astype(np.complex64)
    results = []
    for threads in (1, 2, 5):
        matrix = filled(a, np.complex64, 512)
        matrix.factorize(threads)
        results.append((*matrix.between(right, right, [slice(3, 600)], threads), matrix.solve(right[:, :3], threads)))
    for other in results[1:]:
        assert all(np.array_equal(x, y) for x, y in zip(results[0], other, strict=True))


@pytest.mark.usefixtures("double_precision")
def test_static_potentials_agree_with_integration():
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.2]])
    edges = triangle[1] - triangle[0], triangle[2] - triangle[0]
    area = np.linalg.norm(np.cross(*edges))
    near = triangle.mean(0) + np.array([0, 0, 0.05])
    for point in np.array([[0.4, 0.3, 0.5], [2.0, -1.0, 0.3], near, [2.0, 0.4, 0.2]]):
        scalar, vector = static_potentials(jnp.array(point), jnp.array(triangle))

        def integrate(component, point=point):
            def integrand(s, t):
                offset = triangle[0] + s * edges[0] + t * edges[1] - point
                return (1.0 if component is None else offset[component]) / np.linalg.norm(offset)

            return area * dblquad(integrand, 0, 1, 0, lambda t: 1 - t, epsabs=1e-8)[0]

        assert np.isclose(scalar, integrate(None), rtol=1e-5)
        assert np.allclose(vector, [integrate(x) for x in range(3)], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("count", "degree"), [(3, 2), (7, 5)])
def test_quadrature_is_exact_to_its_degree(count, degree):
    points, weights = RULES[count]
    for a in range(degree + 1):
        for b in range(degree + 1 - a):
            # mean of s^a t^b over the triangle: 2 a! b! / (a + b + 2)!
            exact = 2 * factorial(a) * factorial(b) / factorial(a + b + 2)
            assert np.isclose((weights * points[:, 1] ** a * points[:, 2] ** b).sum(), exact, rtol=1e-12)


def test_tiles_do_not_depend_on_threads_and_hold_what_rows_do():
    """Rows are put together of other blocks: of chosen functions, on any triangles."""
    surface = fundamental_domain(*octasphere(9, [0.6, 0.5, 0.4]), ["xz", "yz"])
    bases = [rwg(surface, parity) for parity in surface.parities]
    for operator, kind in ((efie, SymmetricMatrix), (cfie, GeneralMatrix)):
        entries = Entries(operator, surface, bases, K, operator.near_terms(surface), np.complex64)
        found = []
        for threads in (1, 3):
            matrices = [kind(len(basis), np.complex64) for basis in bases]
            assemble(entries, matrices, threads)
            found.append([dense(matrix) for matrix in matrices])
        numbers = [np.arange(0, len(basis), 7) for basis in bases]
        for one, other, rows, own in zip(*found, entries.rows(numbers), numbers, strict=True):
            assert np.array_equal(one, other)
            assert np.abs(rows - one[own]).max() < 1e-6 * np.abs(one).max()


def test_blocks_hold_every_function_once():
    surface = fundamental_domain(*octasphere(14, [1.0, 0.8, 0.9]), ["xz"])
    bases = [rwg(surface, parity) for parity in surface.parities]
    blocks = blocks_of(bases, surface.patches)
    assert len(blocks) > 1
    for p, basis in enumerate(bases):
        assert [b.spans[p].start for b in blocks[1:]] == [b.spans[p].stop for b in blocks[:-1]]
        assert (blocks[0].spans[p].start, blocks[-1].spans[p].stop) == (0, len(basis))
    for block in blocks:
        assert len(block.triangles) <= TILE_TRIANGLES
        assert [len(halves) for halves in block.halves] == [span.stop - span.start for span in block.spans]


def test_blocks_are_compact_patches_or_parts_of_them(monkeypatch):
    monkeypatch.setattr(
        "isarflow.scattering.mom.basis.PATCH_TRIANGLES", 400
    )  # so that some touch more triangles than a tile holds
    surface = fundamental_domain(*octasphere(14, [1.0, 0.8, 0.9]), [])
    bases = [rwg(surface, surface.parities[0])]
    blocks = blocks_of(bases, surface.patches)
    assert len(blocks) > len(surface.patches) - 1
    first = bases[0].halves.min(1) // 3
    for block in blocks:
        own = np.searchsorted(surface.patches, first[block.spans[0]], side="right")
        assert (own == own[0]).all()


def test_matrix_agrees_with_direct_quadrature():
    """Far entries by a fine rule applied to the RWG functions as they are defined."""
    surface = fundamental_domain(*octasphere(3, [0.5, 0.5, 0.5]), ())
    basis = rwg(surface, surface.parities[0])
    matrix = SymmetricMatrix(len(basis), np.complex128)
    assemble(Entries(efie, surface, [basis], K, efie.near_terms(surface), np.complex128), [matrix])
    z = dense(matrix)
    assert np.abs(z - z.T).max() < 1e-12 * np.abs(z).max()

    for m, n in ((0, len(basis) - 1), (3, len(basis) - 5), (10, len(basis) - 2)):
        for count, bound in ((3, 1e-13), (7, 0.03)):  # the same sum, 1.4e-15; three points against seven, 0.006
            field, source = (reference.sampled(surface, basis, function, count) for function in (m, n))
            assert np.linalg.norm(field.points[:, None] - source.points, axis=2).min() > 0.4
            direct = reference.electric(field, source, K)
            assert abs(z[m, n] - direct) < bound * abs(direct)


@pytest.mark.parametrize("count", [3, 7])
@pytest.mark.parametrize(
    ("module", "kernel"),
    [
        (efie, green),
        (efie, efie._smooth),
        (cfie, cfie._whole),
        (cfie, cfie._smooth),
    ],
)
def test_near_moments_agree_in_both_precisions(count, module, kernel):
    """A whole chunk of pairs: what is compiled for it is not what is compiled for a few."""
    edge = 0.1
    vertices = fundamental_domain(*mie.icosphere(0.5, edge), ()).vertices
    pairs = nearfield.near_pairs(vertices, vertices)[: nearfield.CHUNK_PAIRS]
    assert len(pairs) == nearfield.CHUNK_PAIRS
    single, double = (
        nearfield.by_chunks(
            partial(nearfield.by_rule, count, kernel, module._over_source, real(K)), pairs, vertices, vertices, real
        )
        for real in (np.float32, np.float64)
    )
    # Moments of zeroth, first and second order in the distance from the centroids.
    order = np.array([0, 1, 1, 1, 1, 1, 1, 2] if module is efie else [0, 0, 0, 1, 1, 1, 1, 2])
    scale = np.abs(double[:, order == 0]).max() * (edge / 2) ** order
    assert (np.abs(single - double).max(0) < 2e-6 * scale).all()
