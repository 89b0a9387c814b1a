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

With f' proportional to r' - v', grad G x (r' - v') = grad G x (r - v'), so the inner integral is that of grad G alone.
Between near triangles grad (1 / R) is integrated in closed form, what remains of grad G by quadrature.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy import sparse

from scattering.closed import check_closed
from scattering.farfield import electric
from scattering.kernel import by_points, cosine, distances, inverse, sine
from scattering.nearfield import FINE, area_of, by_chunks
from scattering.operators import efie
from scattering.quadrature import cross, dot, points_of, static_gradient, weighted_sum

# Weight of the EFIE, high because the MFIE with RWG functions has the larger error of the mesh, most of all at sharp
# edges. With ten edges a wavelength, weights 0.5, 0.8, 0.9 and the EFIE alone (1.0) err by:
#   sphere of ka = 1.57                  0.17, 0.05, 0.04, 0.05 dB
#   cube of one wavelength               3.3, 1.4, 0.9, 0.8 % of the peak
#   box 0.8 x 0.4 x 0.02 wavelengths     18, 10, 7, 1.5 % of the peak
# The direct solver does not mind the condition number: at a resonance of a sphere it is 21 for 0.8, 38 for 0.9 and
# 1.8 million for the EFIE. Finer quadrature of near pairs changes these errors by a sixth at most.
# At the resonances of spheres (ka = 2.744 and 4.493, 10.06 edges a wavelength) the CFIE's backscatter errs by 0.098 and
# 0.040 dB, the EFIE's by 0.106 and 0.039 dB, as beside them: the cavity's mode does not radiate. But the EFIE's
# condition number is 800,000 and 450,000 there, and in single precision its residual, else 3e-6, reaches 4e-4 and,
# before the refinement, more than 1e-3.
ALPHA = 0.9

SYMMETRIC = False
FILLING = 3  # two kernels in all tiles, and waves of E and of n x H
NEAR_BYTES = 26_000

check_mesh = check_closed


@jax.jit
def _gradient_real(real, imag, r, k):
    """Real part of g = -(1 + j k R) exp(-j k R) / R^3, so that grad G = g (r - r'), from Green's function."""
    return (k * r * imag - real) * inverse(r) ** 2


@jax.jit
def _gradient_imag(real, imag, r, k):
    """Its imaginary part."""
    return -(imag + k * r * real) * inverse(r) ** 2


@jax.jit
def _half_functions(part, center, nu, normals, row_lengths, cols, col_lengths):
    """Double integrals of f . n x (grad G x f') between half functions by three points a triangle, as in `assembly`.

    part: the real or the imaginary part of g. With zeta'_j the height of corner v'_j above the field triangle and
    D = r - r', the integrand is g (r - v_i) . [(r - v'_j) (n . (r' - c)) - D zeta'_j].
    """
    # heights of the source's corners and nu_i . (c - v'_j), (U, U) each
    apart = [[center[x][:, None] - cols[j, x][None] for x in range(3)] for j in range(3)]
    height = [-sum(normals[x][:, None] * apart[j][x] for x in range(3)) for j in range(3)]
    across = [[sum(nu[i, x][:, None] * apart[j][x] for x in range(3)) for j in range(3)] for i in range(3)]

    def at_points(corners):
        total = sum(corners) / 6
        return [total + corner / 2 for corner in corners]

    height_at = at_points(height)
    across_at = [at_points(of_corner) for of_corner in across]
    # (rho_a - nu_i) . rho_a with rho_a = nu_a / 2
    own = [[(nu[a] * (nu[a] / 4 - nu[i] / 2)).sum(0)[:, None] for i in range(3)] for a in range(3)]
    g = by_points(part)
    by_row = [sum(g[a]) for a in range(3)]
    by_col = [g[0][b] + g[1][b] + g[2][b] for b in range(3)]
    weighted = sum(g[a][b] * across_at[a][b] for a in range(3) for b in range(3)) / 2
    lifted = [sum(g[a][b] * height_at[b] for b in range(3)) for a in range(3)]
    all_lifted = sum(lifted)
    result = []
    for i in range(3):
        tangential = (
            weighted + sum(by_row[a] * own[a][i] for a in range(3)) - sum(by_col[b] * across_at[i][b] for b in range(3))
        )
        normal = sum(lifted[a] * own[a][i] for a in range(3))
        result.append(
            [
                (
                    normal
                    + sum(lifted[a] * across[a][j] for a in range(3)) / 2
                    - all_lifted * across[i][j]
                    - height[j] * tangential
                )
                * (row_lengths[i][:, None] * col_lengths[j][None] / 36)
                for j in range(3)
            ]
        )
    return result


@jax.jit
def _weighted(electric, magnetic, alpha, weight):
    """Parts of z and m added with real weights, entry by entry."""
    return jax.tree.map(lambda z, m: alpha * z + weight * m, electric, magnetic)


def half_functions(k, green, r, row, source, col):
    """Half functions of a tile, as `efie.half_functions`."""
    field, z = row.images[0], efie.half_functions(k, green, r, row, source, col)
    ends = field.center, field.nu, row.normals, row.lengths, source.nu + source.center, col.lengths
    real, imag = (_half_functions(of(*green, r, k), *ends) for of in (_gradient_real, _gradient_imag))
    alpha, weight = k.dtype.type(ALPHA), k.dtype.type((1 - ALPHA) / k)
    # (j / k) (real + j imag)
    return _weighted(z[0], imag, alpha, -weight), _weighted(z[1], real, alpha, weight)


def excited(k, triangles, lengths, normals, u, p):
    """int h . [alpha E + (1 - alpha) eta n x H] dS over half functions, as `farfield.electric`."""
    normals = np.repeat(normals, 3, 0)
    image, along = (electric(k, triangles, lengths, normals, u, x) for x in (p, u))
    normal_u, normal_p = (np.float32(normals @ x.T) for x in (u, p))
    return [_wave(np.float32(ALPHA), normal_u, normal_p, *pair) for pair in zip(image, along, strict=True)]


@jax.jit
def _wave(alpha, normal_u, normal_p, image, along):
    return (alpha + (1 - alpha) * normal_u) * image - (1 - alpha) * normal_p * along


def near_terms(surface):
    """Those of the EFIE, and moments of the static part of grad G for each reflection, a list of (P, 8)."""
    electric = efie.near_terms(surface)
    return electric, [
        by_chunks(_static_moments, pair, surface.vertices, surface.vertices * signs, np.float64)
        for pair, signs in zip(electric.pairs, surface.reflections, strict=True)
    ]


def corrections(near, surface, wavenumber, real):
    """Corrections of near pairs as `efie.corrections`, the term of f_m . f_n included."""
    electric, static = near
    count = 3 * len(surface.vertices)
    result = []
    z = efie.corrections(electric, surface, wavenumber, real)
    for g, (pairs, signs) in enumerate(zip(electric.pairs, surface.reflections, strict=True)):
        change = partial(_smooth_minus_coarse, real(wavenumber))
        moments = static[g] + by_chunks(change, pairs, surface.vertices, surface.vertices * signs, real)
        values = _from_moments(moments, pairs, surface, signs)
        rows = np.repeat(3 * pairs[:, :1] + np.arange(3), 3, axis=1)
        cols = np.tile(3 * pairs[:, 1:] + np.arange(3), (1, 3))
        m = sparse.csr_array((values.reshape(-1), (rows.reshape(-1), cols.reshape(-1))), (count, count))
        result.append(ALPHA * z[g] + (1 - ALPHA) * 1j / wavenumber * m)
    result[0] = result[0] + (1 - ALPHA) * 2 * np.pi / (1j * wavenumber) * _gram(surface)
    return result


def _gram(surface):
    """int h . h' dS between the half functions of each triangle, (3 T, 3 T)."""
    nu = surface.vertices - surface.vertices.mean(1, keepdims=True)
    area = np.linalg.norm(np.cross(nu[:, 1] - nu[:, 0], nu[:, 2] - nu[:, 0]), axis=1) / 2
    mean_square = (nu**2).sum((1, 2)) / 12
    value = mean_square[:, None, None] + np.einsum("tix,tjx->tij", nu, nu)
    value = value * surface.lengths[:, :, None] * surface.lengths[:, None] / (4 * area)[:, None, None]
    return sparse.block_diag(value, format="csr")


def _moments(count, rho, normal, gradient):
    """The eight numbers of a pair from which its nine half-function integrals follow.

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
    points = points_of(FINE, field)
    gradient = static_gradient(points, source[:, :, None]) / area_of(source)
    return _moments(FINE, points - field.mean(0)[:, None], _normal(field), gradient)


def _smooth_minus_coarse(k, field, source):
    """Moments of grad (G - 1 / R) by the fine rule, minus those of grad G by the three points of the tiles."""
    fine, coarse = _by_rule(FINE, _smooth, k, field, source), _by_rule(3, _whole, k, field, source)
    return tuple(a - b for a, b in zip(fine, coarse, strict=True))


def _by_rule(count, kernel, k, field, source):
    p, q = points_of(count, field), points_of(count, source)
    return tuple(_over_source(count, p, q, field, part) for part in kernel(k, distances(p, q)))


@partial(jax.jit, static_argnums=0)
def _over_source(count, p, q, field, g):
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
    """(P, 3, 3) double integrals of f . n x (grad G x f') between half functions from a pair's moments."""
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
    return value * surface.lengths[pairs[:, 0]][:, :, None] * surface.lengths[pairs[:, 1]][:, None, :] / 4
