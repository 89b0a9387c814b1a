"""Pairs of near triangles: the singular part of Green's function in closed form, the rest by finer quadrature.

Three points a triangle do not resolve exp(-j k R) / R between triangles that touch or nearly touch. For these pairs
1 / R is integrated in closed form over the source triangle and with seven points over the field triangle; the smooth
remainder (exp(-j k R) - 1) / R with seven points over both. Pairs are found by distance against size, not by shared
corners: the two skins of a thin wing are nearer than an edge without touching.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from scattering.kernel import cosine, distances, green_imag, green_real, inverse, sine
from scattering.quadrature import cross, dot, points_of, static_potentials, weighted_sum

# A pair is near if the centroids are closer than this many times the sum of the triangles' radii.
NEAR = 2.0
CHUNK = 8192  # pairs at once: bounds the memory of temporaries and lets one compilation serve all
FINE = 7  # points


@dataclass(frozen=True)
class Near:
    """Near pairs of a Surface for each reflection of the sources, and their static moments.

    pairs: a list over the group's elements of (P, 2) triangle numbers, field and source, both orders contained
    static: a list of (P, 8) moments of 1 / R (see `_moments`), independent of frequency
    """

    pairs: list
    static: list


def find(surface):
    """Near pairs of triangles of a Surface and the moments that hold for every frequency."""
    pairs = [_pairs(surface.vertices, surface.vertices * signs) for signs in surface.reflections]
    static = [
        by_chunks(_static_moments, pair, surface.vertices, surface.vertices * signs, np.float64)
        for pair, signs in zip(pairs, surface.reflections, strict=True)
    ]
    return Near(pairs, static)


def corrections(near, surface, wavenumber, real):
    """Near minus three-point integral between half functions: a symmetric sparse (3 T, 3 T) for each reflection."""
    count = 3 * len(surface.vertices)
    result = []
    for pairs, static, signs in zip(near.pairs, near.static, surface.reflections, strict=True):
        # What is integrated in the same way over both triangles is the same for both orders of a pair.
        once = pairs[:, 0] <= pairs[:, 1]
        change = partial(_smooth_minus_coarse, real(wavenumber))
        smooth = by_chunks(change, pairs[once], surface.vertices, surface.vertices * signs, real)
        moments = static.astype(np.complex128)
        moments[once] += np.where(pairs[once, 0] < pairs[once, 1], 2, 1)[:, None] * smooth
        values = _half_functions(moments, wavenumber, pairs, surface, signs)
        rows = np.repeat(3 * pairs[:, :1] + np.arange(3), 3, axis=1)
        cols = np.tile(3 * pairs[:, 1:] + np.arange(3), (1, 3))
        z = sparse.csr_array((values.reshape(-1), (rows.reshape(-1), cols.reshape(-1))), (count, count))
        # The closed form serves the source triangle; either of a pair is the source once: keep the mean.
        result.append((z + z.T) / 2)
    return result


def between_functions(corrections, parity, basis):
    """Rows, columns and values of the corrections between RWG functions of one parity."""
    count = corrections[0].shape[0]
    total = sum(character * z for character, z in zip(parity, corrections, strict=True))
    numbers = np.repeat(np.arange(len(basis)), 2)
    halves = sparse.csr_array((basis.signs.reshape(-1), (basis.halves.reshape(-1), numbers)), (count, len(basis)))
    z = (halves.T @ total @ halves).tocoo()
    return z.row, z.col, z.data


def _pairs(field, source):
    """(P, 2) numbers of near triangles, sorted."""
    centers = field.mean(1), source.mean(1)
    radii = np.linalg.norm(field - centers[0][:, None], axis=2).max(1)
    trees = cKDTree(centers[0]), cKDTree(centers[1])
    found = trees[0].sparse_distance_matrix(trees[1], 2 * NEAR * radii.max(), output_type="ndarray")
    near = found["v"] <= NEAR * (radii[found["i"]] + radii[found["j"]])
    pairs = np.stack([found["i"][near], found["j"][near]], 1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def by_chunks(moments, pairs, field, source, dtype):
    """Evaluate `moments(field triangles, source triangles)` for all pairs, CHUNK at a time: (P, 8).

    Triangles are given to it as (3, 3, CHUNK), pairs last, which vectorizes; it returns (8, CHUNK), or a tuple of the
    real and the imaginary part.
    """
    parts = [np.zeros((8, 0))]
    for begin in range(0, len(pairs), CHUNK):
        chunk = pairs[begin : begin + CHUNK]
        filled = np.pad(chunk, ((0, CHUNK - len(chunk)), (0, 0)), mode="edge")
        ends = field[filled[:, 0]], source[filled[:, 1]]
        # About the pair itself, where single precision has the most digits.
        middle = ends[0].mean(1, keepdims=True)
        found = moments(*((end - middle).transpose(1, 2, 0).astype(dtype) for end in ends))
        value = np.asarray(found[0]) + 1j * np.asarray(found[1]) if isinstance(found, tuple) else np.asarray(found)
        parts.append(value[:, : len(chunk)])
    return np.concatenate(parts, 1).T


def _moments(count, rho, scalar, vector):
    """The eight numbers of a pair from which its nine half-function integrals follow.

    rho: (3, count, P) field points about the centroid; scalar: (count, P) mean of G over the source triangle; vector:
    (3, count, P) mean of (r' - its centroid) G. Returns (8, P): <G>, <rho G>, <rho' G>, <rho . rho' G>.
    """
    return weighted_sum(count, jnp.concatenate([scalar[None], rho * scalar, vector, dot(rho, vector)[None]]))


def _static_moments(field, source):
    points = points_of(FINE, field)
    return _of_potentials(points, field, source, *_potentials(points, source))


@jax.jit
def _potentials(points, source):
    return static_potentials(points, source[:, :, None])


@jax.jit
def _of_potentials(points, field, source, scalar, vector):
    area = area_of(source)
    scalar, vector = scalar / area, vector / area
    vector = vector + (points - source.mean(0)[:, None]) * scalar
    return _moments(FINE, points - field.mean(0)[:, None], scalar, vector)


def area_of(triangles):
    """Areas (P,) of triangles (3, 3, P)."""
    normal = cross(triangles[1] - triangles[0], triangles[2] - triangles[0])
    return jnp.sqrt(dot(normal, normal)) / 2


def _smooth_minus_coarse(k, field, source):
    """Moments of (exp(-j k R) - 1) / R by the fine rule, minus what `assembly` put there by its three points."""
    fine = _by_rule(FINE, (_smooth_real, _smooth_imag), k, field, source)
    coarse = _by_rule(3, (green_real, green_imag), k, field, source)
    return tuple(a - b for a, b in zip(fine, coarse, strict=True))


# (exp(-j k R) - 1) / R = -j k exp(-j k R / 2) sinc(k R / 2): no cancellation at R = 0


@jax.jit
def _smooth_real(k, distance):
    return -2 * sine(k * distance / 2) ** 2 * inverse(distance)


@jax.jit
def _smooth_imag(k, distance):
    half = k * distance / 2
    return jnp.where(half > 0, -2 * sine(half) * cosine(half) * inverse(distance), -k)


def _by_rule(count, parts, k, field, source):
    p, q = points_of(count, field), points_of(count, source)
    r = distances(p, q)
    return tuple(_over_source(count, p, q, field, source, part(k, r)) for part in parts)


@partial(jax.jit, static_argnums=0)
def _over_source(count, p, q, field, source, green):
    rho, rho_source = p - field.mean(0)[:, None], q - source.mean(0)[:, None]
    vector = jnp.stack([weighted_sum(count, green * rho_source[x]) for x in range(3)])
    return _moments(count, rho, weighted_sum(count, green), vector)


def _half_functions(moments, k, pairs, surface, signs):
    """(P, 3, 3) integrals between half functions from a pair's moments."""
    lengths = surface.lengths
    nu = surface.vertices - surface.vertices.mean(1, keepdims=True)
    field, source = nu[pairs[:, 0]], nu[pairs[:, 1]] * signs
    z = (
        moments[:, 7, None, None]
        - np.einsum("pix,px->pi", field, moments[:, 4:7])[:, :, None]
        - np.einsum("pjx,px->pj", source, moments[:, 1:4])[:, None, :]
        + (np.einsum("pix,pjx->pij", field, source) - 4 / k**2) * moments[:, 0, None, None]
    )
    return z * lengths[pairs[:, 0]][:, :, None] * lengths[pairs[:, 1]][:, None, :] / 4
