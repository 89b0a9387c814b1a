"""The combined field integral equation (CFIE): for closed surfaces, without interior resonances.

The EFIE and the magnetic field integral equation (MFIE) of a closed conductor each fail at the resonances of the
cavity that its surface bounds; a combination of both has one solution at every frequency (Mautz, Harrington, AEU 32,
1978). Scaled as the EFIE matrix z of `assembly`, with n the outward normal and G = exp(-j k R) / R,

    alpha z_mn + (1 - alpha) m_mn,
    m_mn = 2 pi / (j k) int f_m . f_n dS + (j / k) int f_m . n x PV int grad G x f_n' dS' dS

acts on the same unknowns; the right side is alpha E + (1 - alpha) eta n x H of the incident wave, tested with f_m:
eta H = -u x E, so eta n x H = (n . u) E - u (n . E). The normal belongs to the field's side, and n x H is a polar
vector like the current: sources at mirror images enter as for the EFIE. The matrix is not symmetric. Near thin edges
and skins the CFIE errs more than the EFIE (see ALPHA): it is for closed bodies that are thick against the wavelength,
which are also those that resonate.

With f' proportional to r' - v', grad G x (r' - v') = grad G x (r - v'), so the inner integral is of grad G alone.
Between near triangles grad (1 / R) is integrated in closed form, the rest of grad G by quadrature.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from isarflow.scattering.mom.basis import gram
from isarflow.scattering.mom.green import cosine, inverse, sine
from isarflow.scattering.mom.nearfield import FINE_POINTS, area_of, by_chunks, of_images, smooth_minus_coarse
from isarflow.scattering.mom.operators import efie
from isarflow.scattering.mom.quadrature import cross, dot, points_of, static_gradient, weighted_sum

# Weight of the EFIE; high, because the MFIE with RWG functions has the larger error of the mesh, most of all at sharp
# edges. With ten edges a wavelength, weights 0.5, 0.8, 0.9 and the EFIE alone (1.0) err by:
#   sphere of ka = 1.57                  0.17, 0.05, 0.04, 0.05 dB
#   cube of one wavelength               3.3, 1.4, 0.9, 0.8 % of the peak
#   box 0.8 x 0.4 x 0.02 wavelengths     18, 10, 7, 1.5 % of the peak
# The condition number does not matter to the direct solver: at a resonance of a sphere it is 21 for 0.8, 38 for 0.9 and
# 1.8 million for the EFIE. Finer quadrature of near pairs changes these errors by a sixth at most.
# At the resonances of spheres (ka = 2.744 and 4.493) both err as beside them, 0.1 and 0.04 dB: the cavity's mode does
# not radiate. But in single precision the EFIE's residual, else 3e-6, reaches 4e-4 there, or 1e-3 before a refinement.
ALPHA = 0.9

SYMMETRIC = False


def near_terms(surface):
    """`efie.near_terms`, and moments of the static part of grad G for each reflection, a list of (P, 8)."""
    electric = efie.near_terms(surface)
    return replace(electric, magnetic=of_images(_static_moments, surface, electric.pairs))


def corrections(near, surface, wavenumber, real, threads=1):
    """Corrections of near pairs as `efie.corrections`, the term of f_m . f_n included."""
    result = []
    z = efie.corrections(near, surface, wavenumber, real, threads)
    for g, (pairs, signs) in enumerate(zip(near.pairs, surface.reflections, strict=True)):
        change = partial(smooth_minus_coarse, _over_source, _smooth, _whole, real(wavenumber))
        moments = near.magnetic[g] + by_chunks(change, pairs, surface.vertices, surface.vertices * signs, real, threads)
        m = _from_moments(moments, pairs, surface, signs)
        result.append(ALPHA * z[g] + (1 - ALPHA) * 1j / wavenumber * m)
    same_triangle = near.pairs[0][:, 0] == near.pairs[0][:, 1]
    result[0][same_triangle] += (1 - ALPHA) * 2 * np.pi / (1j * wavenumber) * gram(surface)
    return result


def _moments(count, rho, normal, gradient):
    """Compute the eight numbers of a pair from which its nine half-function integrals follow.

    rho: (3, count, P) field points about the centroid; normal: (3, P) of the field triangle; gradient: (3, count, P)
    mean of grad G over the source triangle. Returns (8, P): <g>, <rho . g>, <rho n . g>, <rho^2 n . g>.
    """
    along = dot(normal, gradient)
    return weighted_sum(
        count, jnp.concatenate([gradient, dot(rho, gradient)[None], along * rho, (along * dot(rho, rho))[None]])
    )


def _normal(triangle):
    normal = jnp.stack(cross(triangle[1] - triangle[0], triangle[2] - triangle[0]))
    return normal / jnp.sqrt(dot(normal, normal))


@jax.jit
def _static_moments(field, source):
    points = points_of(FINE_POINTS, field)
    gradient = static_gradient(points, source[:, :, None]) / area_of(source)
    return _moments(FINE_POINTS, points - field.mean(0)[:, None], _normal(field), gradient)


@partial(jax.jit, static_argnums=0)
def _over_source(count, p, q, field, _, g):
    gradient = jnp.stack([weighted_sum(count, g * (p[x][:, None] - q[x])) for x in range(3)])
    return _moments(count, p - field.mean(0)[:, None], _normal(field), gradient)


@jax.jit
def _whole(k, distance):
    """-(1 + j x) exp(-j x) / R^3 with x = k R, real and imaginary part."""
    x = k * distance
    cos, sin, cube = cosine(x), sine(x), inverse(distance) ** 3
    return -(cos + x * sin) * cube, -(x * cos - sin) * cube


@jax.jit
def _smooth(k, distance):
    """[1 - (1 + j x) exp(-j x)] / R^3 with x = k R, by its series where the difference would cancel; both parts."""
    x = k * distance
    small = x < 0.5
    safe = jnp.where(small, 1, x)
    y = jnp.where(small, x * x, 0)
    # (1 + j x) exp(-j x) = sum over n of (1 - n) (-j x)^n / n!
    real = -1 / 2 + y * (1 / 8 - y * (1 / 144 - y * (1 / 5760 - y / 403200)))
    imag = 1 / 3 - y * (1 / 30 - y * (1 / 840 - y * (1 / 45360 - y / 3991680)))
    cube = safe**3
    real = jnp.where(small, real / jnp.where(x > 0, x, 1), (1 - cosine(safe) - safe * sine(safe)) / cube)
    imag = jnp.where(small, imag, (sine(safe) - safe * cosine(safe)) / cube)
    return k**3 * real, k**3 * imag


def _from_moments(moments, pairs, surface, signs):
    """(P, 3, 3) integrals of f . n x (grad G x f') between half functions, as `efie._from_moments`."""
    center = surface.vertices.mean(1)
    nu = (surface.vertices - center[:, None])[pairs[:, 0]]
    apart = center[pairs[:, 0]][:, None] - (surface.vertices * signs)[pairs[:, 1]]
    normal = surface.normals[pairs[:, 0]]
    height = -np.einsum("px,pjx->pj", normal, apart)
    tangential = moments[:, 3, None] - np.einsum("pix,px->pi", nu, moments[:, :3])
    along = np.einsum("px,px->p", normal, moments[:, :3])
    lifted = (
        moments[:, 7, None, None]
        + np.einsum("pjx,px->pj", apart, moments[:, 4:7])[:, None, :]
        - np.einsum("pix,px->pi", nu, moments[:, 4:7])[:, :, None]
        - np.einsum("pix,pjx->pij", nu, apart) * along[:, None, None]
    )
    value = -lifted - tangential[:, :, None] * height[:, None, :]
    return 9 * value
