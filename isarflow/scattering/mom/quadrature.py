"""Quadrature over triangles: symmetric rules and the static potential and field of a triangle in closed form."""

from functools import partial
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np


def _orbit(a):
    return [[1 - 2 * a, a, a], [a, 1 - 2 * a, a], [a, a, 1 - 2 * a]]


def _graded(count):
    """A rule of 3 count^2 points, closer at the edges, for what is singular there as a logarithm.

    Gauss's points on the three triangles between an edge and the centroid: along the edge, and in the square root of
    the distance from it.
    """
    x, w = np.polynomial.legendre.leggauss(count)
    x, w = (x + 1) / 2, w / 2
    inward, along = (y.reshape(-1) for y in np.meshgrid(x**2, x, indexing="ij"))
    points = np.stack([inward / 3 + (1 - inward) * (1 - along), inward / 3 + (1 - inward) * along, inward / 3], 1)
    weights = (4 / 3 * w * x * (1 - x**2))[:, None] * w
    return np.concatenate([np.roll(points, k, 1) for k in range(3)]), np.tile(weights.reshape(-1), 3)


# Barycentric points and weights (sum 1). Dunavant, Int. J. Numer. Meth. Eng. 21, 1985: degrees 2 and 5.
RULES = {
    3: (np.array(_orbit(1 / 6)), np.full(3, 1 / 3)),
    7: (
        np.array([[1 / 3] * 3, *_orbit(0.470142064105115), *_orbit(0.101286507323456)]),
        np.array([0.225, *[0.132394152788506] * 3, *[0.125939180544827] * 3]),
    ),
    27: _graded(3),
}


@partial(jax.jit, static_argnums=0)
def points_of(count, triangles):
    """The points of RULES[count] on triangles (3, 3, P) m, coordinates x of the corners i at [i, x]: (3, count, P)."""
    kind = triangles.dtype.type
    return jnp.stack(
        [sum(kind(w) * corner for w, corner in zip(p, triangles, strict=True)) for p in RULES[count][0]], 1
    )


def weighted_sum(count, values):
    """Sum over the points of RULES[count] of values (..., count, P), with its weights: (..., P)."""
    # Written out: XLA's reductions along the points take ten times as long, and in jax 0.10 one of them was wrong.
    return sum(values.dtype.type(w) * values[..., q, :] for q, w in enumerate(RULES[count][1]))


def dot(a, b):
    """a . b of vectors (3, ...)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """a x b of vectors (3, ...), as a list."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def static_potentials(point, triangle):
    """Integrals of 1/R and (r' - point) / R over a triangle, seen from a point: m and m^2.

    point: (3, ...) m; triangle: (3, 3, ...) m, coordinates x of the corners i at [i, x]. Returns (...) and (3, ...).
    Wilton et al., IEEE Trans. AP-32, 1984, eqs. 5 and 6 (uniform and linear source on a polygon). Here the vector
    integral is referred to the point itself, so its part along the normal is -d times the scalar one.
    """
    edges = _edges(point, triangle)
    height = edges.height
    scalar = sum(edge.p * edge.log for edge in edges.all) - jnp.abs(height) * edges.solid_angle
    tangential = [
        sum((e.r0_squared * e.log + e.l_end * e.r_end - e.l_start * e.r_start) * e.outward[x] for e in edges.all) / 2
        for x in range(3)
    ]
    # The tangential part points from the point's projection; the rest of r' - point is -height along the normal.
    vector = jnp.stack([tangential[x] - height * scalar * edges.normal[x] for x in range(3)])
    return scalar, vector


def static_gradient(point, triangle):
    """Integral of grad (1/R) over a triangle, with respect to the point it is seen from: no unit.

    point: (3, ...) m; triangle: (3, 3, ...) m, as above. Returns (3, ...). On the triangle itself its part along the
    normal, the solid angle, is the principal value 0. Graglia, IEEE Trans. AP-41, 1993, eqs. 19 and 23 (uniform
    source).
    """
    edges = _edges(point, triangle)
    longest = jnp.maximum(*[e.l_end - e.l_start for e in edges.all[:2]])
    side = jnp.where(jnp.abs(edges.height) < 1e-7 * longest, 0.0, jnp.sign(edges.height))
    return jnp.stack(
        [-sum(e.log * e.outward[x] for e in edges.all) - side * edges.solid_angle * edges.normal[x] for x in range(3)]
    )


def _edges(point, triangle):
    """Edge quantities for the integrals over a triangle, seen from a point; names as in Wilton et al."""
    normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    double_area = jnp.sqrt(dot(normal, normal))
    normal = [x / double_area for x in normal]
    offset = [[triangle[i][x] - point[x] for x in range(3)] for i in range(3)]
    height = -dot(offset[0], normal)  # of the point above the triangle's plane
    r = [jnp.sqrt(dot(o, o)) for o in offset]
    # van Oosterom, Strackee, IEEE Trans. BME-30, 1983; without its sign.
    solid_angle = 2 * jnp.arctan2(
        double_area * jnp.abs(height),
        r[0] * r[1] * r[2]
        + dot(offset[0], offset[1]) * r[2]
        + dot(offset[1], offset[2]) * r[0]
        + dot(offset[2], offset[0]) * r[1],
    )
    edges = [_edge(triangle, offset, r, normal, height, i) for i in range(3)]
    return SimpleNamespace(normal=normal, height=height, solid_angle=solid_angle, all=edges)


def _edge(triangle, offset, r, normal, height, i):
    """Quantities of the edge from corner i to the next."""
    after = (i + 1) % 3
    along = [triangle[after][x] - triangle[i][x] for x in range(3)]
    length = jnp.sqrt(dot(along, along))
    along = [x / length for x in along]
    outward = cross(along, normal)
    l_start = dot(offset[i], along)
    l_end = l_start + length
    p = dot(offset[i], outward)  # signed distance of the edge's line in the plane
    r0_squared = p**2 + height**2
    # ln((R+ + l+) / (R- + l-)), in the one of its two equal forms that does not cancel; 0 where it is not needed.
    tiny = jnp.finfo(triangle.dtype).tiny
    forward = l_start + l_end >= 0
    numerator = jnp.where(forward, r[after] + l_end, r[i] - l_start)
    denominator = jnp.where(forward, r[i] + l_start, r[after] - l_end)
    on_edge = (r0_squared == 0) & (l_start * l_end <= 0)
    log = jnp.where(on_edge, 0.0, jnp.log(jnp.maximum(numerator, tiny) / jnp.maximum(denominator, tiny)))
    return SimpleNamespace(
        outward=outward, p=p, l_start=l_start, l_end=l_end, r0_squared=r0_squared, r_start=r[i], r_end=r[after], log=log
    )
