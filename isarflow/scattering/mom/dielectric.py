"""Closed homogeneous dielectric bodies: the equations of Poggio, Miller, Chang, Harrington, Wu and Tsai (PMCHWT).

On the surface of a body, of permittivity eps relative to the medium outside, electric and magnetic currents J = n x H
and M = E x n make the scattered field outside, and with opposite signs the field inside (Harrington, J. Electromagn.
Waves Appl. 3, 1989, sec. 4). E and H are continuous: with z of `assembly` in both media, of wavenumbers k and
k sqrt(eps), and

    kappa_mn = int f_m . PV int grad G x f_n' dS' dS    (of both media, m^2),

both conditions, tested with f_m, are in the scale of `assembly`

    [ z_1 + z_2            -(j / k) (kappa_1 + kappa_2) ] [ J       ]   [ E                       ]
    [ -(j / k) (kappa_1 + kappa_2)   -(z_1 + eps z_2)   ] [ M / eta ] = [ -eta H, that is u x E   ]

of the incident wave from u. What +-n x M / 2 adds on one side of the surface it takes on the other. The matrix is
complex symmetric, as kappa is, and the right side is what an amplitude is received by, so that the far field is that
of `farfield`. A mirror image turns M, an axial vector, round: M has the characters of J times the reflection's
determinant. There are no interior resonances.

f . grad G x f' takes only the sums over grad G, and over grad G x (r - c) about the field triangle's centroid c, as
r' - v' differs from r - v' by what is parallel to grad G. On one triangle it is 0.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from isarflow.scattering.mom import assembly, farfield
from isarflow.scattering.mom.basis import Basis, rwg
from isarflow.scattering.mom.green import cosine, inverse, sine
from isarflow.scattering.mom.nearfield import area_of, by_chunks, of_images, smooth_minus_coarse
from isarflow.scattering.mom.normal import loops
from isarflow.scattering.mom.operators import efie
from isarflow.scattering.mom.quadrature import cross, points_of, static_gradient, weighted_sum
from isarflow.scattering.mom.tiles import tile_of_body

ALPHA = 1  # as of `efie`
SYMMETRIC = True
TERMS = 14  # of the series of `_smooth_gradient`
# Of the rule for the static part of kappa over the field triangle: at a common edge it is singular as a logarithm. With
# seven points an ellipsoid of eps = 1 scattered 0.3 % of one of 2, and with these 0.01 %.
EDGE_POINTS = 27


def bases(surface, chosen=None, layered=None):
    """Return a Basis for each of a Surface's parities: half functions 6 t + i of J, and 6 t + 3 + i of M.

    chosen: True for the triangles that have M, (T,), or None for all; layered: for those whose M is of loops, or None
    (see `normal`).
    """
    of_parities, result = [], []
    for electric, magnetic in _characters(surface).swapaxes(0, 1):
        kinds = [rwg(surface, electric), rwg(surface, magnetic, chosen)]
        of_parities.append(kinds if layered is None else [*kinds, loops(surface, magnetic, layered)])
    most = max(kind.halves.shape[1] for kinds in of_parities for kind in kinds)
    for kinds in of_parities:
        # Further halves have no weight.
        more = [(0, 0), (0, most - 2)], [(0, 0), (0, most - kinds[-1].halves.shape[1])]
        padded = [np.pad(kind.halves, more[n > 1], "edge") for n, kind in enumerate(kinds)]
        halves = np.concatenate([of // 3 * 6 + of % 3 + 3 * (n > 0) for n, of in enumerate(padded)])
        signs = np.concatenate([np.pad(kind.signs, more[n > 1]) for n, kind in enumerate(kinds)])
        order = np.argsort(halves.min(1), kind="stable")
        vertices = np.concatenate(
            [np.full(len(kind), -1) if kind.vertices is None else kind.vertices for kind in kinds]
        )
        result.append(Basis(halves[order], signs[order], 6, vertices[order]))
    return result


def _characters(surface):
    """(2, G, G) of J and of M."""
    return np.stack([surface.parities, surface.parities * np.prod(surface.reflections, 1)])


def near_terms(surface):
    """`efie.near_terms`, and kappa of 1 / R in place of G, (P, 3, 3) for each reflection, of the pairs once."""
    electric = efie.near_terms(surface)
    moments, static = of_images(_static_moments, surface, electric.pairs, 6), []
    terms = zip(moments, electric.pairs, electric.orders, surface.reflections, strict=True)
    for of_image, pairs, (once, turned), signs in terms:
        # The closed form is over the source triangle; each of a pair is the source once: keep the mean.
        kappa = _from_moments(of_image, pairs, surface, signs)
        static.append((kappa[once] + np.prod(signs) * kappa[turned].transpose(0, 2, 1)) / 2)
    return replace(electric, magnetic=static)


class Entries(assembly.Entries):
    """`assembly.Entries` of a dielectric body; material: its complex permittivity relative to the medium outside."""

    def __init__(self, operator, surface, bases, wavenumber, near, dtype, threads=1, material=1.0):
        self.of_media = self._media(wavenumber, material)
        super().__init__(operator, surface, bases, wavenumber, near, dtype, threads, material)
        media = [(k.real / (2 * np.pi), k.real, -k.imag, *_parts(4 / k**2), *_parts(eps)) for k, eps in self.of_media]
        self.media, self.characters = np.array(media, self.real), _characters(surface).astype(self.real)
        outside = assembly.TINY_METRES**2, 1 / 2, 1, 4 / wavenumber**2, 1 / wavenumber
        self.constants = np.array(outside, self.real)

    def _media(self, wavenumber, material):
        """Wavenumber and relative permittivity of each medium."""
        return (complex(wavenumber), 1.0), (wavenumber * np.sqrt(complex(material)), complex(material))

    def _near(self, threads):
        scalar = np.result_type(self.real, np.complex64).type
        electric, magnetic, kappa = 0, 0, 0
        for k, eps in self.of_media:
            z = efie.corrections(self.near, self.surface, scalar(k), self.real, threads, (_smooth, _whole))
            electric = _sum(electric, z, 1)
            magnetic = _sum(magnetic, z, -eps)
            kappa = _sum(kappa, _turned(self.near, self.surface, scalar(k), self.real, threads), -1j / self.wavenumber)
        return [electric, magnetic, kappa]

    def _fill(self, out, row, col):
        tile_of_body(out, row.rows, col.cols, self.corrections, self.characters, self.media, self.constants)


def _sum(total, values, weight):
    """The sums of lists of arrays; total: 0 for none yet."""
    values = [weight * value for value in values]
    return [a + b for a, b in zip(total, values, strict=True)] if total else values


def _parts(number):
    return complex(number).real, complex(number).imag


class Excitation:
    """As `farfield.Excitation`: int F . E dS for J and int F . (u x E) dS for M, the two kinds in one array."""

    def __init__(self, surface, bases, dtype):
        self.kinds = []
        for kind, characters in enumerate(_characters(surface)):
            alone = [
                Basis(basis.halves // 6 * 3 + basis.halves % 3, basis.signs * (basis.halves % 6 // 3 == kind))
                for basis in bases
            ]
            self.kinds.append(farfield.Excitation(surface, alone, dtype, characters))

    def __call__(self, wavenumber, u, polarization, alpha=1.0, threads=1):
        """Compute (N, D) for each parity; arguments as of `farfield.Excitation`."""
        waves = polarization, np.cross(u, polarization)
        both = [kind(wavenumber, u, wave, threads=threads) for kind, wave in zip(self.kinds, waves, strict=True)]
        for total, more in zip(*both, strict=True):
            total += more
        return both[0]


def _turned(near, surface, wavenumber, real, threads):
    """Corrections of kappa in a medium, (P, 3, 3) for each reflection, as `efie.corrections`."""
    result, terms = [], zip(near.pairs, near.orders, near.magnetic, surface.reflections, strict=True)
    change = partial(smooth_minus_coarse, _over_source, _smooth_gradient, _whole_gradient, wavenumber)
    for pairs, (once, turned), static, signs in terms:
        moments = by_chunks(change, pairs[once], surface.vertices, surface.vertices * signs, real, threads, 6)
        kappa = np.empty((len(pairs), 3, 3), np.result_type(real, np.complex64))
        kappa[once] = values = static + _from_moments(moments, pairs[once], surface, signs)
        kappa[turned] = np.prod(signs) * values.transpose(0, 2, 1)
        result.append(kappa)
    return result


def _moments(count, rho, gradient):
    """The means <grad G> and <grad G x rho> of a pair, (6, P); arguments as of `cfie._moments`."""
    return weighted_sum(count, jnp.concatenate([gradient, jnp.stack(cross(gradient, rho))]))


@jax.jit
def _static_moments(field, source):
    points = points_of(EDGE_POINTS, field)
    gradient = static_gradient(points, source[:, :, None]) / area_of(source)
    return _moments(EDGE_POINTS, points - field.mean(0)[:, None], gradient)


@partial(jax.jit, static_argnums=0)
def _over_source(count, p, q, field, _, g):
    gradient = jnp.stack([weighted_sum(count, g * (p[x][:, None] - q[x])) for x in range(3)])
    return _moments(count, p - field.mean(0)[:, None], gradient)


@jax.jit
def _smooth(k, distance):
    """(exp(-j k R) - 1) / R, both parts, without cancellation; -j k where R = 0."""
    x, loss, there = k.real * distance, -k.imag * distance, distance > 0
    real = jnp.expm1(-loss) * cosine(x) - 2 * sine(x / 2) ** 2
    over = inverse(distance)
    return jnp.where(there, real * over, k.imag), jnp.where(there, -jnp.exp(-loss) * sine(x) * over, -k.real)


@jax.jit
def _whole(k, distance):
    """exp(-j k R) / R, both parts; 0 where R = 0."""
    x, amplitude = k.real * distance, jnp.exp(k.imag * distance) * inverse(distance)
    return cosine(x) * amplitude, -sine(x) * amplitude


@jax.jit
def _whole_gradient(k, distance):
    """-(1 + j k R) exp(-j k R) / R^3, both parts."""
    real, imag = _whole(k, distance)
    g = -(1 + 1j * k * distance) * (real + 1j * imag) * inverse(distance) ** 2
    return g.real, g.imag


@jax.jit
def _smooth_gradient(k, distance):
    """[1 - (1 + j k R) exp(-j k R)] / R^3, both parts, by its series where the difference would cancel."""
    y = -1j * k * distance
    small = jnp.abs(y) < 1
    # 1 - (1 - y) exp(y) is the sum over n from 2 of (n - 1) y^n / n!.
    series = jnp.zeros_like(y)
    for n in range(TERMS, 1, -1):
        series = series * y + (n - 1) / float(np.prod(np.arange(1.0, n + 1)))
    safe = jnp.where(small, 1, y)
    g = -(k**2) * inverse(distance) * jnp.where(small, series, (1 - (1 - safe) * jnp.exp(safe)) / safe**2)
    return g.real, g.imag


def _from_moments(moments, pairs, surface, signs):
    """(P, 3, 3) integrals of f . grad G x f' between half functions, as `efie._from_moments`; see `tiles`."""
    center = surface.vertices.mean(1)
    nu = (surface.vertices - center[:, None])[pairs[:, 0]]
    apart = center[pairs[:, 0]][:, None] - (surface.vertices * signs)[pairs[:, 1]]
    gradient, turned = moments[:, :3], moments[:, 3:]
    lever = turned[:, None] + np.cross(nu, gradient[:, None])
    return -9 * (np.einsum("pix,pjx->pij", lever, apart) + np.einsum("pix,px->pi", nu, turned)[:, :, None])
