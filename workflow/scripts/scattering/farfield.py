"""Plane-wave excitation of the RWG functions and the scattered far field.

Time convention exp(+j omega t), phase referred to the origin. The radar stands in direction

    u = (cos el cos az, cos el sin az, sin el),   V = du/del,   H = (-sin az, cos az, 0).

A unit plane wave from there is E = p exp(+j k u . r). With V_m = int f_m . E dS and the matrix z of `assembly`, the
scattering amplitude for receiving p and transmitting q is (reciprocity; Harrington 1968, sec. 7-3)

    f_pq = -V_p^T z^-1 V_q   (m),   E_s = f exp(-j k r) / r,   RCS = 4 pi |f|^2.
"""

import jax
import jax.numpy as jnp
import numpy as np

from scattering.quadrature import RULES

RULE = RULES[6]
CHUNK = 128  # directions at once: bounds the memory of the phases


def directions(elevation, azimuth):
    """Unit vectors towards the radar and its polarizations on a grid of angles in degrees.

    elevation: (E,), azimuth: (A,). Returns u, V, H, each (E, A, 3).
    """
    el, az = np.deg2rad(elevation)[:, None], np.deg2rad(azimuth)[None, :]
    zero = np.zeros(np.broadcast_shapes(el.shape, az.shape))
    u = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el) + zero], -1)
    v = np.stack([-np.sin(el) * np.cos(az), -np.sin(el) * np.sin(az), np.cos(el) + zero], -1)
    h = np.stack([-np.sin(az) + zero, np.cos(az) + zero, zero], -1)
    return u, v, h


def excitation(surface, bases, wavenumber, u, polarization, dtype):
    """int F . p exp(+j k u . r) dS for every function and direction, in m^2.

    u, polarization: (D, 3). Returns for each parity (N, D) of `dtype`; F is the sum over the mirror images.
    """
    result = [np.empty((len(basis), len(u)), dtype) for basis in bases]
    vertices, lengths = jnp.asarray(surface.vertices), jnp.asarray(surface.lengths)
    for begin in range(0, len(u), CHUNK):
        part = slice(begin, begin + CHUNK)
        images = [
            _half_functions(wavenumber, vertices * signs, lengths, u[part], polarization[part])
            for signs in surface.reflections
        ]
        for basis, parity, column in zip(bases, surface.parities, result, strict=True):
            halves = np.asarray(sum(character * image for character, image in zip(parity, images, strict=True)))
            column[:, part] = (
                halves[basis.halves[:, 0]] * basis.signs[:, :1] + halves[basis.halves[:, 1]] * basis.signs[:, 1:]
            )
    return result


@jax.jit
def _half_functions(k, triangles, lengths, u, p):
    """(3 T, D): int h . p exp(+j k u . r) dS over half functions."""
    center = triangles.mean(1)
    nu = triangles - center[:, None]
    rho = jnp.einsum("qc,tcx->tqx", jnp.asarray(RULE[0]), nu)
    local = jnp.exp(1j * (k * jnp.einsum("tqx,dx->tqd", rho, u)).astype(jnp.float32))
    weighted = local * jnp.asarray(RULE[1], jnp.float32)[None, :, None]
    along = jnp.einsum("tqx,dx->tqd", rho, p).astype(jnp.float32)
    first = jnp.sum(weighted * along, 1)
    corner = jnp.einsum("tix,dx->tid", nu, p).astype(jnp.float32)
    shift = jnp.exp(1j * (k * (center @ u.T))).astype(jnp.complex64)
    value = (first[:, None] - corner * jnp.sum(weighted, 1)[:, None]) * shift[:, None]
    return (value * (lengths / 2).astype(jnp.float32)[:, :, None]).reshape(-1, u.shape[0])


def distinct_directions(u, axes):
    """Directions that are not mirror images of each other.

    u: (D, 3); axes: coordinates that the symmetry changes. Returns (K,) numbers of the distinct ones, all with
    non-negative coordinates where one of a pair has them, (D,) the place of each direction among them and (D,) the
    sign that a cross-polar amplitude takes on the way: a reflection turns H, and keeps V, for the planes xz and yz.
    """
    folded = u.copy()
    flips = np.zeros(len(u), int)
    for axis in axes:
        negative = folded[:, axis] < -1e-9
        flips += negative
        folded[:, axis] = np.abs(folded[:, axis])
    _, first, place = np.unique(np.round(folded, 9), axis=0, return_index=True, return_inverse=True)
    place = place.reshape(-1)
    sign = (-1.0) ** (flips - flips[first][place])
    return first, place, sign
