"""The electric field integral equation (EFIE): for open and closed surfaces.

Its matrix is z of `assembly`, its right side V_m = int f_m . E dS. Field and sources use the same functions, so
z is symmetric. Between near triangles 1 / R is integrated in closed form over the source triangle and with seven points
over the field triangle; the smooth remainder (exp(-j k R) - 1) / R with seven points over both.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from isarflow.scattering.mom.green import cosine, green, inverse, sine
from isarflow.scattering.mom.nearfield import (
    FINE_POINTS,
    area_of,
    by_chunks,
    near_pairs,
    of_images,
    smooth_minus_coarse,
)
from isarflow.scattering.mom.quadrature import dot, points_of, static_potentials, weighted_sum

ALPHA = 1  # the EFIE alone: see `cfie`
SYMMETRIC = True


@dataclass(frozen=True)
class Near:
    """Near pairs of a Surface and their moments valid at every frequency, lists over the reflections of the sources."""

    pairs: list  # (P, 2) triangle numbers, field and source, in both orders
    orders: list  # numbers of those whose field triangle is not after the source, and of the same in the other order
    static: list  # moments of 1 / R (see `_moments`) of those whose field triangle is not after the source
    magnetic: list = ()  # of grad (1 / R), where `cfie` needs them


def near_terms(surface):
    """Terms of the near pairs of a Surface that are computed once for all frequencies."""
    pairs = [near_pairs(surface.vertices, surface.vertices * signs) for signs in surface.reflections]
    orders, static = [], []
    of_both = of_images(_static_moments, surface, pairs)
    for of_image, moments, signs in zip(pairs, of_both, surface.reflections, strict=True):
        once = np.flatnonzero(of_image[:, 0] <= of_image[:, 1])
        turned = np.lexsort((of_image[:, 0], of_image[:, 1]))[once]
        orders.append((once, turned))
        # The closed form is over the source triangle; each of a pair is the source once: keep the mean.
        whole, by_field, by_source, product = np.split(moments[turned], [1, 4, 7], axis=1)
        turned_back = [whole, by_source * signs, by_field * signs, product]
        static.append((moments[once] + np.concatenate(turned_back, 1)) / 2)
    return Near(pairs, orders, static)


def corrections(near, surface, wavenumber, real, threads=1, kernels=None):
    """Near minus three-point integral between half functions, without their l / 6: (P, 3, 3) for each reflection.

    kernels: of a complex wavenumber, the smooth part of Green's function and the whole.
    """
    result, terms = [], zip(near.pairs, near.orders, near.static, surface.reflections, strict=True)
    kernels, scale = (kernels, wavenumber) if kernels else ((_smooth, green), real(wavenumber))
    for pairs, (once, turned), static, signs in terms:
        change = partial(smooth_minus_coarse, _over_source, *kernels, scale)
        smooth = by_chunks(change, pairs[once], surface.vertices, surface.vertices * signs, real, threads)
        z = np.empty((len(pairs), 3, 3), np.result_type(real, np.complex64))
        z[once] = integrals = _from_moments(static + smooth, wavenumber, pairs[once], surface, signs)
        z[turned] = integrals.transpose(0, 2, 1)
        result.append(z)
    return result


def _moments(count, rho, scalar, vector):
    """Compute the eight numbers of a pair from which its nine half-function integrals follow.

    rho: (3, count, P) field points about the centroid; scalar: (count, P) mean of G over the source triangle; vector:
    (3, count, P) mean of (r' - its centroid) G. Returns (8, P): <G>, <rho G>, <rho' G>, <rho . rho' G>.
    """
    return weighted_sum(count, jnp.concatenate([scalar[None], rho * scalar, vector, dot(rho, vector)[None]]))


def _static_moments(field, source):
    # In two pieces of compiled code: in one it rounds otherwise.
    points = points_of(FINE_POINTS, field)
    return _of_potentials(points, field, source, *_potentials(points, source))


@jax.jit
def _potentials(points, source):
    return static_potentials(points, source[:, :, None])


@jax.jit
def _of_potentials(points, field, source, scalar, vector):
    area = area_of(source)
    scalar, vector = scalar / area, vector / area
    vector = vector + (points - source.mean(0)[:, None]) * scalar
    return _moments(FINE_POINTS, points - field.mean(0)[:, None], scalar, vector)


@jax.jit
def _smooth(k, distance):
    """(exp(-j k R) - 1) / R = -j k exp(-j k R / 2) sinc(k R / 2), both parts: no cancellation at R = 0."""
    half = k * distance / 2
    real = -2 * sine(half) ** 2 * inverse(distance)
    return real, jnp.where(half > 0, -2 * sine(half) * cosine(half) * inverse(distance), -k)


@partial(jax.jit, static_argnums=0)
def _over_source(count, p, q, field, source, green):
    rho, rho_source = p - field.mean(0)[:, None], q - source.mean(0)[:, None]
    vector = jnp.stack([weighted_sum(count, green * rho_source[x]) for x in range(3)])
    return _moments(count, rho, weighted_sum(count, green), vector)


def _from_moments(moments, k, pairs, surface, signs):
    """(P, 3, 3) integrals between half functions, without their l / 6, from a pair's moments."""
    nu = surface.vertices - surface.vertices.mean(1, keepdims=True)
    field, source = nu[pairs[:, 0]], nu[pairs[:, 1]] * signs
    z = (
        moments[:, 7, None, None]
        - np.einsum("pix,px->pi", field, moments[:, 4:7])[:, :, None]
        - np.einsum("pjx,px->pj", source, moments[:, 1:4])[:, None, :]
        + (np.einsum("pix,pjx->pij", field, source) - 4 / k**2) * moments[:, 0, None, None]
    )
    return 9 * z
