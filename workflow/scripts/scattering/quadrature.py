"""Quadrature over triangles: symmetric rules and the static potential and field of a triangle in closed form."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np

# Near pairs and phases need double precision; the tiles of the matrix ask for single explicitly.
jax.config.update("jax_enable_x64", True)

TINY = 1e-20  # (0.1 nm)^2: the squared distance of a point and itself

# Barycentric points and weights (sum 1). Dunavant, Int. J. Numer. Meth. Eng. 21, 1985: degrees 2, 4 and 5.
_A6, _B6 = 0.445948490915965, 0.091576213509771
_A7, _B7 = 0.470142064105115, 0.101286507323456


def _orbit(a):
    return [[1 - 2 * a, a, a], [a, 1 - 2 * a, a], [a, a, 1 - 2 * a]]


RULES = {
    3: (np.array(_orbit(1 / 6)), np.full(3, 1 / 3)),
    6: (np.array(_orbit(_A6) + _orbit(_B6)), np.repeat([0.223381589678011, 0.109951743655322], 3)),
    7: (
        np.array([[1 / 3] * 3, *_orbit(_A7), *_orbit(_B7)]),
        np.concatenate([[0.225], np.repeat([0.132394152788506, 0.125939180544827], 3)]),
    ),
}


def squared_distances(rows, cols):
    """R^2 between the three points of RULES[3] on two sets of triangles.

    rows, cols: (U, 3, 3) m. Returns (3 U, 3 U) m^2, point a of triangle t at a * U + t.
    """

    # The points lie half-way between centroid and corner, so they are known from both.
    def points(v):
        center = v.mean(1, keepdims=True)
        return (center + (v - center) / 2).transpose(2, 1, 0).reshape(3, -1)

    p, q = points(rows), points(cols)
    return sum((p[x][:, None] - q[x][None]) ** 2 for x in range(3))


def static_potentials(point, triangle):
    """Integrals of 1/R and (r' - point) / R over a triangle, seen from a point: m and m^2.

    point: (..., 3) m; triangle: (..., 3, 3) m. Returns (...) and (..., 3).
    Wilton et al., IEEE Trans. AP-32, 1984, eqs. 5 and 6 (uniform and linear source on a polygon). Here the vector
    integral is referred to the point itself, so its part along the normal is -d times the scalar one.
    """
    edges = _edges(point, triangle)
    height = edges.height
    scalar = jnp.sum(edges.p * edges.log - jnp.abs(height)[..., None] * edges.angle, -1)
    ends = edges.l_end * edges.r_end - edges.l_start * edges.r_start
    tangential = 0.5 * jnp.sum((edges.r0_squared * edges.log + ends)[..., None] * edges.outward, -2)
    # The tangential part points from the point's projection; the rest of r' - point is -height along the normal.
    return scalar, tangential - (height * scalar)[..., None] * edges.normal


def static_gradient(point, triangle):
    """Integral of grad (1/R) over a triangle, with respect to the point it is seen from: no unit.

    point: (..., 3) m; triangle: (..., 3, 3) m. Returns (..., 3). On the triangle itself its part along the normal, the
    solid angle, is the principal value 0. Graglia, IEEE Trans. AP-41, 1993, eqs. 19 and 23 (uniform source).
    """
    edges = _edges(point, triangle)
    flat = jnp.abs(edges.height) < 1e-7 * (edges.l_end - edges.l_start).max(-1)
    solid_angle = jnp.where(flat, 0.0, jnp.sign(edges.height)) * edges.angle.sum(-1)
    return -jnp.sum(edges.log[..., None] * edges.outward, -2) - solid_angle[..., None] * edges.normal


def _edges(point, triangle):
    """What the integrals over a triangle need of its edges, seen from a point; names as in Wilton et al."""
    start, end = triangle, jnp.roll(triangle, -1, -2)
    normal = jnp.cross(triangle[..., 1, :] - triangle[..., 0, :], triangle[..., 2, :] - triangle[..., 0, :])
    normal = normal / jnp.linalg.norm(normal, axis=-1, keepdims=True)
    height = jnp.sum((point - triangle[..., 0, :]) * normal, -1)  # of the point above the triangle's plane

    along = (end - start) / jnp.linalg.norm(end - start, axis=-1, keepdims=True)
    outward = jnp.cross(along, normal[..., None, :])
    offset = start - point[..., None, :]
    l_start = jnp.sum(offset * along, -1)
    l_end = jnp.sum((end - point[..., None, :]) * along, -1)
    p = jnp.sum(offset * outward, -1)  # signed distance of the edge's line in the plane
    r0_squared = p**2 + height[..., None] ** 2
    r_start = jnp.sqrt(r0_squared + l_start**2)
    r_end = jnp.sqrt(r0_squared + l_end**2)

    # ln((R+ + l+) / (R- + l-)), in the one of its two equal forms that does not cancel; 0 where it is not needed.
    tiny = jnp.finfo(triangle.dtype).tiny
    forward = l_start + l_end >= 0
    numerator = jnp.where(forward, r_end + l_end, r_start - l_start)
    denominator = jnp.where(forward, r_start + l_start, r_end - l_end)
    on_edge = (r0_squared == 0) & (l_start * l_end <= 0)
    log = jnp.where(on_edge, 0.0, jnp.log(jnp.maximum(numerator, tiny) / jnp.maximum(denominator, tiny)))

    h = jnp.abs(height)[..., None]
    safe = jnp.maximum(r0_squared, tiny)
    angle = jnp.arctan2(p * l_end, safe + h * r_end) - jnp.arctan2(p * l_start, safe + h * r_start)
    return SimpleNamespace(
        normal=normal,
        height=height,
        outward=outward,
        p=p,
        l_start=l_start,
        l_end=l_end,
        r0_squared=r0_squared,
        r_start=r_start,
        r_end=r_end,
        log=log,
        angle=angle,
    )
