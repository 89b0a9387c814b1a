"""Quadrature over triangles: symmetric rules and the static potential of a triangle in closed form."""

import jax
import jax.numpy as jnp
import numpy as np

# Near pairs and phases need double precision; the tiles of the matrix ask for single explicitly.
jax.config.update("jax_enable_x64", True)

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


def static_potentials(point, triangle):
    """Integrals of 1/R and (r' - point) / R over a triangle, seen from a point: m and m^2.

    point: (..., 3) m; triangle: (..., 3, 3) m. Returns (...) and (..., 3).
    Wilton et al., IEEE Trans. AP-32, 1984, eqs. 5 and 6 (uniform and linear source on a polygon). Here the vector
    integral is referred to the point itself, so its part along the normal is -d times the scalar one.
    """
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

    # ln((R+ + l+) / (R- + l-)), in the one of its two equal forms that does not cancel.
    tiny = jnp.finfo(triangle.dtype).tiny
    forward = l_start + l_end >= 0
    numerator = jnp.where(forward, r_end + l_end, r_start - l_start)
    denominator = jnp.where(forward, r_start + l_start, r_end - l_end)
    log = jnp.where(r0_squared > 0, jnp.log(jnp.maximum(numerator, tiny) / jnp.maximum(denominator, tiny)), 0.0)

    h = jnp.abs(height)[..., None]
    safe = jnp.maximum(r0_squared, tiny)
    angle = jnp.arctan2(p * l_end, safe + h * r_end) - jnp.arctan2(p * l_start, safe + h * r_start)
    scalar = jnp.sum(p * log - h * angle, -1)
    tangential = 0.5 * jnp.sum((r0_squared * log + l_end * r_end - l_start * r_start)[..., None] * outward, -2)
    # The tangential part points from the point's projection; the rest of r' - point is -height along the normal.
    return scalar, tangential - (height * scalar)[..., None] * normal
