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

from scattering.quadrature import RULES, static_potentials

# A pair is near if the centroids are closer than this many times the sum of the triangles' radii.
NEAR = 2.0
CHUNK = 8192  # pairs at once: bounds the memory of temporaries and lets one compilation serve all
FINE = RULES[7]


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
    """Evaluate `moments(field triangles, source triangles)` for all pairs, CHUNK at a time."""
    parts = []
    for begin in range(0, len(pairs), CHUNK):
        chunk = pairs[begin : begin + CHUNK]
        filled = np.pad(chunk, ((0, CHUNK - len(chunk)), (0, 0)), mode="edge")
        parts.append(
            np.asarray(moments(field[filled[:, 0]].astype(dtype), source[filled[:, 1]].astype(dtype)))[: len(chunk)]
        )
    return np.concatenate(parts) if parts else np.zeros((0, 8))


def _moments(weights, rho, scalar, vector):
    """The eight numbers of a pair from which its nine half-function integrals follow.

    weights: (Q,); rho: (P, Q, 3) field points about the centroid; scalar: (P, Q) mean of G over the source triangle;
    vector: (P, Q, 3) mean of (r' - its centroid) G. Returns (P, 8): <G>, <rho G>, <rho' G>, <rho . rho' G>.
    """
    dot = jnp.sum(rho * vector, -1)
    return jnp.concatenate(
        [
            (scalar @ weights)[:, None],
            jnp.einsum("q,pqx,pq->px", weights, rho, scalar),
            jnp.einsum("q,pqx->px", weights, vector),
            (dot @ weights)[:, None],
        ],
        axis=1,
    )


def points_of(rule, triangles):
    return jnp.einsum("qc,pcx->pqx", jnp.asarray(rule[0], triangles.dtype), triangles)


@jax.jit
def _static_moments(field, source):
    center = field.mean(1, keepdims=True)
    points = points_of(FINE, field)
    scalar, vector = static_potentials(points, source[:, None])
    area = jnp.linalg.norm(jnp.cross(source[:, 1] - source[:, 0], source[:, 2] - source[:, 0]), axis=1) / 2
    scalar, vector = scalar / area[:, None], vector / area[:, None, None]
    vector = vector + (points - source.mean(1)[:, None]) * scalar[..., None]
    return _moments(jnp.asarray(FINE[1]), points - center, scalar, vector)


@jax.jit
def _smooth_minus_coarse(k, field, source):
    """Moments of (exp(-j k R) - 1) / R by the fine rule, minus what `assembly` put there by its three points."""
    return _by_rule(FINE, _smooth, k, field, source) - _by_rule(RULES[3], _whole, k, field, source)


def _smooth(k, distance):
    half = k * distance / 2
    # (exp(-j k R) - 1) / R = -j k exp(-j k R / 2) sinc(k R / 2): no cancellation at R = 0
    amplitude = -k * jnp.where(half > 0, jnp.sin(half) / jnp.where(half > 0, half, 1), 1)
    return jax.lax.complex(amplitude * jnp.sin(half), amplitude * jnp.cos(half))


def _whole(k, distance):
    apart = distance > 1e-10
    inverse = jnp.where(apart, 1 / jnp.where(apart, distance, 1), 0)
    return jax.lax.complex(jnp.cos(k * distance) * inverse, -jnp.sin(k * distance) * inverse)


def _by_rule(rule, kernel, k, field, source):
    p, q = points_of(rule, field), points_of(rule, source)
    green = kernel(k, jnp.linalg.norm(p[:, :, None] - q[:, None], axis=-1))
    weights = jnp.asarray(rule[1], field.dtype)
    weighted = green * weights
    vector = jnp.einsum("pab,pbx->pax", weighted, q - source.mean(1, keepdims=True))
    return _moments(weights, p - field.mean(1, keepdims=True), weighted.sum(-1), vector)


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
