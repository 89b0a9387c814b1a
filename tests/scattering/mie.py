"""Scattering by a perfectly conducting sphere in closed form, the truth for the solver's tests.

Bohren, Huffman, Absorption and Scattering of Light by Small Particles, ch. 4, in the limit of perfect conduction,
with exp(+j omega t) and the amplitude E_s = f exp(-j k r) / r.
"""

import numpy as np
from scipy.spatial import ConvexHull
from scipy.special import spherical_jn, spherical_yn


def backscatter(wavenumber, radius):
    """Amplitude f towards the source, m (complex), phase referred to the centre."""
    n, a, b = _coefficients(wavenumber * radius)
    return np.sum((-1.0) ** n * (2 * n + 1) * (a - b)) * (1j / (2 * wavenumber))


def bistatic(wavenumber, radius, angle):
    """Amplitudes (f_theta, f_phi), m, at `angle` (rad) from the direction in which the incident wave travels.

    angle: (D,). The incident field has unit strength along theta (in the plane of scattering) or phi (across it); the
    unit vectors are those of spherical coordinates about the direction of travel. Sec. 4.4.4: S_2 and S_1, with
    f = S / (j k).
    """
    n, a, b = _coefficients(wavenumber * radius)
    cosine, pi, tau = np.cos(angle), [np.zeros(len(angle)), np.ones(len(angle))], [np.zeros(len(angle))]
    for m in n:
        tau.append(m * cosine * pi[m] - (m + 1) * pi[m - 1])
        pi.append(((2 * m + 1) * cosine * pi[m] - (m + 1) * pi[m - 1]) / m)
    pi, tau = np.array(pi[1 : len(n) + 1]).T, np.array(tau[1:]).T
    weight = (2 * n + 1) / (n * (n + 1))
    along, across = tau @ (weight * a) + pi @ (weight * b), pi @ (weight * a) + tau @ (weight * b)
    return along / (1j * wavenumber), across / (1j * wavenumber)


def _coefficients(x):
    """Orders n and coefficients a_n (electric) and b_n (magnetic) of a sphere of size x = k radius."""
    n = np.arange(1, int(x + 4 * x ** (1 / 3) + 10) + 1)
    j, y = spherical_jn(n, x), spherical_yn(n, x)
    h = j - 1j * y  # outgoing wave for exp(+j omega t)
    dj, dh = spherical_jn(n, x, True), spherical_jn(n, x, True) - 1j * spherical_yn(n, x, True)
    return n, (j + x * dj) / (h + x * dh), j / h


def icosphere(radius, edge):
    """Faceted sphere of the sphere's own volume, as the mean edge length comes nearest to `edge`, in m.

    Returns vertices (V, 3) and triangles (T, 3), outward. Caspar, Klug, Cold Spring Harbor Symp. 27, 1962: a step of
    (b, c) in a triangular lattice takes an icosahedron's edge, so that there are 20 (b^2 + b c + c^2) triangles.
    """
    wanted = (1.2035 * radius / edge) ** 2
    steps = [(b, c) for b in range(1, int(wanted**0.5) + 3) for c in range(b + 1)]
    b, c = min(steps, key=lambda step: (abs(step[0] ** 2 + step[0] * step[1] + step[1] ** 2 - wanted), step))
    i, j = (x.reshape(-1) for x in np.mgrid[-c : b + 1, 0 : b + c + 1])
    s, t = i * (b + c) + j * c, j * b - i * c
    inside = (s >= 0) & (t >= 0) & (s + t <= b * b + b * c + c * c)
    weights = np.stack([b * b + b * c + c * c - s - t, s, t], 1)[inside]

    phi = (1 + 5**0.5) / 2
    corners = np.array([[s * a, t * b, 0] for s in (-1, 1) for t in (-1, 1) for a, b in ((1, phi),)])
    corners = np.concatenate([np.roll(corners, k, 1) for k in range(3)])
    points = np.concatenate([weights @ corners[face] for face in _hull(corners)])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[np.unique(np.round(points, 9), axis=0, return_index=True)[1]]
    triangles = _hull(points)
    volume = np.linalg.det(points[triangles]).sum() / 6
    return points * radius * (4 / 3 * np.pi / volume) ** (1 / 3), triangles


def _hull(points):
    """Outward triangles of the convex hull of points about the origin."""
    triangles = ConvexHull(points).simplices
    inward = np.linalg.det(points[triangles]) < 0
    return np.where(inward[:, None], triangles[:, ::-1], triangles)
