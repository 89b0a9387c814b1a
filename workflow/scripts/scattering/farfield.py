"""Plane-wave excitation of the RWG functions and the scattered far field.

Time convention exp(+j omega t), phase referred to the origin. The radar stands in direction u, its polarizations are
V and H (see `sampling`). A unit plane wave from there is E = p exp(+j k u . r). With V_m = int f_m . E dS and the
matrix z of `assembly`, the scattering amplitude for receiving p and transmitting q is (reciprocity; Harrington 1968,
sec. 7-3)

    f_pq = -V_p^T z^-1 V_q   (m),   E_s = f exp(-j k r) / r,   RCS = 4 pi |f|^2.

For an operator other than the EFIE z is its matrix and V_q, not V_p, its right side.
"""

from math import factorial

import jax
import jax.numpy as jnp
import numpy as np

from scattering.kernel import cosine, sine
from scattering.quadrature import RULES

CHUNK = 256  # directions at once: bounds the memory of the phases
# Powers of x, y and z in the series of exp(j k u . rho) over a triangle, to fourth order: with the linear functions
# that is what the seven-point rule integrates exactly. At ten edges a wavelength the rest is below 1e-5.
ORDER = 4
POWERS = np.array([p for p in np.ndindex(*3 * [ORDER + 1]) if sum(p) <= ORDER])


def excitation(surface, bases, wavenumber, u, polarization, dtype, wave=None):
    """int F . E dS of E = p exp(+j k u . r), for functions and directions, in m^2.

    u, polarization: (D, 3); wave: what of E is tested with half functions, as `electric` (which it is by default),
    an operator's `excited`. Returns for each parity (N, D) of `dtype`; F is the sum over the mirror images.
    """
    result = [np.empty((len(basis), len(u)), dtype) for basis in bases]
    vertices, lengths = jnp.asarray(surface.vertices), jnp.asarray(surface.lengths)
    for begin in range(0, len(u), CHUNK):
        part = slice(begin, min(begin + CHUNK, len(u)))
        count = part.stop - begin
        # Filled up to a power of two, so that a few compilations serve all.
        waves = [np.pad(x[part], ((0, (1 << (count - 1).bit_length()) - count), (0, 0))) for x in (u, polarization)]
        images = [
            (wave or electric)(wavenumber, vertices * signs, lengths, surface.normals * signs, *waves)
            for signs in surface.reflections
        ]
        for basis, parity, column in zip(bases, surface.parities, result, strict=True):
            ends = basis.halves, basis.signs.astype(np.float32)
            column[:, part] = _complex(*(_gather(parity, *ends, of) for of in zip(*images, strict=True)))[:, :count]
    return result


# Real and imaginary part apart, as in `assembly`.


def electric(k, triangles, lengths, normals, u, p):
    """(3 T, D): int h . p exp(+j k u . r) dS over half functions, its real and its imaginary part; (real, imag).

    About the centroid the phase is a short power series: its moments over the triangles times powers of u are two real
    products, one for the even orders and one for the odd, instead of an exponential for every point and direction.
    """
    even, odd = _series(k, triangles, lengths, u, p)
    turn = _turn(k, triangles, u)
    return _turned_real(even, odd, turn), _turned_imag(even, odd, turn)


@jax.jit
def _series(k, triangles, lengths, u, p):
    nu = triangles - triangles.mean(1, keepdims=True)
    rho = jnp.einsum("qc,tcx->tqx", jnp.asarray(RULES[7][0]), nu)
    order = POWERS.sum(1)
    scale = jnp.asarray(k) ** order / np.array([np.prod([factorial(n) for n in power]) for power in POWERS])
    powers = jnp.prod(rho[:, :, None] ** POWERS, -1) * scale * RULES[7][1][:, None]  # (T, Q, M)
    moments = jnp.einsum("tqm,tqx->tmx", powers, rho)[:, None] - nu[:, :, None] * powers.sum(1)[:, None, :, None]
    moments = (moments * lengths[:, :, None, None] / 2).reshape(-1, len(POWERS), 3)
    features = jnp.prod(u[:, None] ** POWERS, -1)[:, :, None] * p[:, None]  # (D, M, 3)

    def series(orders):
        chosen = np.isin(order, orders)
        sign = np.where(order[chosen] % 4 < 2, 1.0, -1.0)[:, None]
        return _product((moments[:, chosen] * sign).astype(jnp.float32), features[:, chosen].astype(jnp.float32))

    return series([0, 2, 4]), series([1, 3])


@jax.jit
def _turn(k, triangles, u):
    """Phase of the centroids, (T, 1, D), reduced to one turn before it loses digits."""
    center = triangles.mean(1).T
    turns = k / (2 * jnp.pi) * sum(center[x][:, None] * u[:, x] for x in range(3))
    return (2 * jnp.pi * (turns - jnp.round(turns))).astype(jnp.float32)[:, None]


@jax.jit
def _turned_real(even, odd, turn):
    shape = turn.shape[0], 3, turn.shape[2]
    return (even.reshape(shape) * cosine(turn) - odd.reshape(shape) * sine(turn)).reshape(even.shape)


@jax.jit
def _turned_imag(even, odd, turn):
    shape = turn.shape[0], 3, turn.shape[2]
    return (even.reshape(shape) * sine(turn) + odd.reshape(shape) * cosine(turn)).reshape(even.shape)


@jax.jit
def _gather(parity, halves, signs, images):
    """Functions of one parity from the half functions' images."""
    total = sum(parity[g].astype(jnp.float32) * image for g, image in enumerate(images))
    return total[halves[:, 0]] * signs[:, :1] + total[halves[:, 1]] * signs[:, 1:]


@jax.jit
def _complex(real, imag):
    return jax.lax.complex(real, imag)


def _product(a, b):
    return a.reshape(a.shape[0], -1) @ b.reshape(b.shape[0], -1).T
