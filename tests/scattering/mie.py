"""Scattering by a perfectly conducting sphere in closed form, the truth for the solver's tests.

Bohren, Huffman, Absorption and Scattering of Light by Small Particles, ch. 4, in the limit of perfect conduction,
with exp(+j omega t) and the amplitude E_s = f exp(-j k r) / r.
"""

import numpy as np
from scipy.special import spherical_jn, spherical_yn


def backscatter(wavenumber, radius):
    """Amplitude f towards the source, m (complex), phase referred to the centre."""
    x = wavenumber * radius
    n = np.arange(1, int(x + 4 * x ** (1 / 3) + 10) + 1)
    j, y = spherical_jn(n, x), spherical_yn(n, x)
    h = j - 1j * y  # outgoing wave for exp(+j omega t)
    dj, dh = spherical_jn(n, x, True), spherical_jn(n, x, True) - 1j * spherical_yn(n, x, True)
    a = (j + x * dj) / (h + x * dh)  # electric
    b = j / h  # magnetic
    return np.sum((-1.0) ** n * (2 * n + 1) * (a - b)) * (1j / (2 * wavenumber))


def icosphere(radius, edge):
    """Faceted sphere of the sphere's own volume with edges of `edge` on average: vertices (V, 3), triangles (T, 3)."""
    phi = (1 + 5**0.5) / 2
    corners = np.array([[s * a, t * b, 0] for s in (-1, 1) for t in (-1, 1) for a, b in ((1, phi),)])
    corners = np.concatenate([np.roll(corners, k, 1) for k in range(3)])
    side = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    near = np.isclose(side, 2.0)
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    count = max(1, round(1.2 * radius / edge))
    points, triangles = [], []
    for face in faces:
        a, b, c = corners[list(face)]
        number = {}
        for i in range(count + 1):
            for j in range(count + 1 - i):
                number[i, j] = len(points)
                points.append(a + (b - a) * i / count + (c - a) * j / count)
        for i in range(count):
            for j in range(count - i):
                triangles.append((number[i, j], number[i + 1, j], number[i, j + 1]))
                if i + j < count - 1:
                    triangles.append((number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]))
    points, triangles = np.array(points), np.array(triangles)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    _, first, inverse = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    points, triangles = points[first], inverse.reshape(-1)[triangles]
    v = points[triangles]
    signed = np.einsum("ti,ti->t", v[:, 0], np.cross(v[:, 1], v[:, 2]))
    triangles[signed < 0] = triangles[signed < 0][:, ::-1]
    volume = np.abs(signed).sum() / 6
    return points * radius * (4 / 3 * np.pi / volume) ** (1 / 3), triangles
