"""Entries of the matrices between RWG functions, by quadrature of the equations as they are written.

`tiles` computes the same sums, expanded so that few numbers pass through memory; the docstrings there begin with the
terms here. Valid between functions whose triangles are far from each other: nothing is done about the pole of Green's
function. exp(+j omega t), G = exp(-j k R) / R.
"""

from typing import NamedTuple

import numpy as np

from isarflow.mesh import topology
from isarflow.scattering.mom.basis import Basis, Surface
from isarflow.scattering.mom.quadrature import RULES


class Samples(NamedTuple):
    """An RWG function f at the points of a rule, on both its triangles."""

    points: np.ndarray  # (Q, 3) m
    values: np.ndarray  # (Q, 3) m^2: f times the point's area
    charges: np.ndarray  # (Q,) m: div f times the point's area
    normals: np.ndarray  # (Q, 3) of the triangle


def sampled(surface: Surface, basis: Basis, function: int, count: int = 7) -> Samples:
    """Return an RWG function at the points of RULES[count].

    Half a function is h = l / (2 A) (r - v), div h = l / A, and a point has the area w A. surface: without mirror
    planes; function: its number in the basis.
    """
    barycentric, weights = RULES[count]
    parts = []
    for half, sign in zip(basis.halves[function], basis.signs[function], strict=True):
        triangle, corner = divmod(int(half), 3)
        corners, length = surface.vertices[triangle], surface.lengths[triangle, corner]
        points = barycentric @ corners
        values = sign * length / 2 * weights[:, None] * (points - corners[corner])
        normals = np.tile(topology.unit(topology.normals(corners[None])), (count, 1))
        parts.append((points, values, sign * length * weights, normals))
    return Samples(*map(np.concatenate, zip(*parts, strict=True)))


def electric(field: Samples, source: Samples, wavenumber: complex) -> complex:
    """Return z_mn = int int [f_m . f_n' - div f_m div f_n' / k^2] G dS dS' in m^3 (see `assembly`).

    wavenumber: rad/m.
    """
    distance = np.linalg.norm(field.points[:, None] - source.points, axis=2)
    green = np.exp(-1j * wavenumber * distance) / distance
    currents = field.values @ source.values.T
    return np.sum(green * (currents - np.outer(field.charges, source.charges) / wavenumber**2))


def magnetic(field: Samples, source: Samples, wavenumber: float) -> complex:
    """Return m_mn = (j / k) int f_m . n x int grad G x f_n' dS' dS in m^3 (see `operators.cfie`), m and n apart.

    grad G = g (r - r') with g = -(1 + j k R) exp(-j k R) / R^3. wavenumber: rad/m.
    """
    across = np.cross(field.normals[:, None], _gradient_cross(field, source, wavenumber))
    return 1j / wavenumber * np.einsum("ax,abx->", field.values, across)


def turned(field: Samples, source: Samples, wavenumber: complex) -> complex:
    """Return kappa_mn = int f_m . int grad G x f_n' dS' dS in m^2 (see `dielectric`); arguments as of `magnetic`."""
    return np.einsum("ax,abx->", field.values, _gradient_cross(field, source, wavenumber))


def _gradient_cross(field: Samples, source: Samples, wavenumber: complex) -> np.ndarray:
    """grad G x f' between points, (Q, Q, 3)."""
    difference = field.points[:, None] - source.points
    distance = np.linalg.norm(difference, axis=2)
    phase = 1j * wavenumber * distance
    gradient = (-(1 + phase) * np.exp(-phase) / distance**3)[..., None] * difference
    return np.cross(gradient, source.values)
