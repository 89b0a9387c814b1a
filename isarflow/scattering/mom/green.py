"""Green's function exp(-j k R) / R in real arithmetic: sine and cosine by short polynomials, 1 / R without its pole.

For the fine integrals of near triangles. The sums of all others have their own in `tiles`; `reference` has the plain
one.
"""

import jax
import jax.numpy as jnp
import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

TINY_METRES = 1e-10  # the distance of a point and itself


def _fit(function, degree):
    """Polynomial in x = t^2, 0 <= x <= 1/4, of a function of t."""
    x = (np.cos(np.pi * (np.arange(200) + 0.5) / 200) + 1) / 8
    return Chebyshev.fit(x, function(np.sqrt(x)), degree, domain=[0, 0.25]).convert(kind=Polynomial).coef


# For full turns t. The libraries' own functions reduce any argument exactly, which is not needed here and is slower.
COS = {4: _fit(lambda t: np.cos(2 * np.pi * t), 6), 8: _fit(lambda t: np.cos(2 * np.pi * t), 11)}
SIN = {4: _fit(lambda t: np.sin(2 * np.pi * t) / t, 6), 8: _fit(lambda t: np.sin(2 * np.pi * t) / t, 11)}


def _horner(coefficients, x):
    y = jnp.full_like(x, coefficients[-1])
    for c in coefficients[-2::-1]:
        y = y * x + x.dtype.type(c)
    return y


def _turns(x):
    t = x * x.dtype.type(1 / (2 * np.pi))
    return t - jnp.round(t)


def cosine(x):
    """cos(x), to the rounding of x."""
    t = _turns(x)
    return _horner(COS[x.dtype.itemsize], t * t)


def sine(x):
    """sin(x), to the rounding of x."""
    t = _turns(x)
    return t * _horner(SIN[x.dtype.itemsize], t * t)


def inverse(r):
    """1 / R, and 0 where R = 0."""
    return jnp.where(r > TINY_METRES, 1 / jnp.maximum(r, r.dtype.type(TINY_METRES)), 0)


@jax.jit
def distances(p, q):
    """R between two sets of points, (3, P, ...) and (3, Q, ...): (P, Q, ...)."""
    return jnp.sqrt(sum((p[x][:, None] - q[x][None]) ** 2 for x in range(3)))


@jax.jit
def green(k, r):
    """Real and imaginary part of exp(-j k R) / R; 0, not -j k, where R = 0: `nearfield` corrects both parts alike."""
    return cosine(k * r) * inverse(r), -sine(k * r) * inverse(r)
