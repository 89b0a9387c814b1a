"""Find pairs of near triangles, which an operator integrates again, more finely, and evaluate their integrals.

Three points a triangle do not resolve exp(-j k R) / R between triangles that touch or nearly touch. Pairs are found by
distance against size, not by shared corners: the two skins of a thin wing are nearer than an edge without touching.
"""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree

from isarflow.scattering.mom.green import distances
from isarflow.scattering.mom.quadrature import cross, dot, points_of
from isarflow.scattering.threads import Pool

# A pair is near if the centroids are closer than this many times the sum of the triangles' radii.
NEAR_RADII = 2.0
CHUNK_PAIRS = 8192  # pairs at once: bounds the memory of temporaries and lets one compilation serve all
FINE_POINTS = 7  # of the rule for near pairs


def near_pairs(field, source):
    """(P, 2) numbers of near triangles, sorted."""
    centers = field.mean(1), source.mean(1)
    radii = np.linalg.norm(field - centers[0][:, None], axis=2).max(1)
    trees = cKDTree(centers[0]), cKDTree(centers[1])
    candidates = trees[0].sparse_distance_matrix(trees[1], 2 * NEAR_RADII * radii.max(), output_type="ndarray")
    near = candidates["v"] <= NEAR_RADII * (radii[candidates["i"]] + radii[candidates["j"]])
    pairs = np.stack([candidates["i"][near], candidates["j"][near]], 1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def by_chunks(moments, pairs, field, source, dtype, threads=1, count=8):
    """Evaluate `moments(field triangles, source triangles)` for all pairs, CHUNK_PAIRS at a time: (P, count).

    It gets triangles (3, 3, CHUNK_PAIRS), pairs last, which vectorizes. It returns (count, CHUNK_PAIRS), or both parts
    as a tuple.
    """

    def values(begin):
        chunk = pairs[begin : begin + CHUNK_PAIRS]
        filled = np.pad(chunk, ((0, CHUNK_PAIRS - len(chunk)), (0, 0)), mode="edge")
        ends = field[filled[:, 0]], source[filled[:, 1]]
        # About the pair itself, where single precision has the most digits.
        middle = ends[0].mean(1, keepdims=True)
        # Near pairs need double precision where `dtype` is, and JAX has it in this thread alone.
        with jax.enable_x64(True):
            value = moments(*((end - middle).transpose(1, 2, 0).astype(dtype) for end in ends))
        value = np.asarray(value[0]) + 1j * np.asarray(value[1]) if isinstance(value, tuple) else np.asarray(value)
        return value[:, : len(chunk)]

    with Pool(threads) as pool:
        parts = pool.map(values, range(0, len(pairs), CHUNK_PAIRS))
        return np.concatenate([np.zeros((count, 0)), *parts], 1).T


def of_images(moments, surface, pairs, count=8):
    """Moments in double precision of near `pairs` of a Surface, for each reflection of the sources: (P, count)."""
    images = zip(pairs, surface.reflections, strict=True)
    corners = surface.vertices
    return [by_chunks(moments, chosen, corners, corners * signs, np.float64, count=count) for chosen, signs in images]


def smooth_minus_coarse(over_source, smooth, whole, k, field, source):
    """Moments of a kernel's smooth part by the fine rule, minus moments of the whole kernel by the tiles' three points.

    smooth, whole: functions of k and R that give the real and the imaginary part; over_source: moments of a part from
    the rule, its points on both triangles, and the triangles.
    """
    fine, coarse = (by_rule(*rule, over_source, k, field, source) for rule in ((FINE_POINTS, smooth), (3, whole)))
    return tuple(a - b for a, b in zip(fine, coarse, strict=True))


def by_rule(count, kernel, over_source, k, field, source):
    """Moments of both parts of a kernel by RULES[count]; arguments as of `smooth_minus_coarse`."""
    p, q = points_of(count, field), points_of(count, source)
    return tuple(over_source(count, p, q, field, source, part) for part in kernel(k, distances(p, q)))


def area_of(triangles):
    """Areas (P,) of triangles (3, 3, P)."""
    normal = cross(triangles[1] - triangles[0], triangles[2] - triangles[0])
    return jnp.sqrt(dot(normal, normal)) / 2
