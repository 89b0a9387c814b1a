"""Surfaces as exporters write them that go patch by patch: each patch samples the lines that it shares by itself.

All are triangle soups, corners (T, 3, 3) in metres.
"""

import numpy as np
from shapes_made import soup


def patch(corners, along, across):
    """A flat or twisted patch between four corners, in `along` by `across` parts of two triangles."""
    a, b, c, d = np.asarray(corners, float)
    u, w = np.linspace(0, 1, along + 1)[:, None, None], np.linspace(0, 1, across + 1)[:, None]
    return grid((1 - u) * (1 - w) * a + u * (1 - w) * b + u * w * c + (1 - u) * w * d)


def grid(points):
    """The triangles of points (N, M, 3) in rows."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)]).reshape(-1, 3, 3)


WEDGE = 0.2, 0.3  # m, chord and span


def wedge(trailing, divisions=((1, 2), (1, 2), (2, 3)), caps=(1, 1)):
    """A wing of wedge section in five patches that meet exactly, its trailing edge `trailing` metres high.

    divisions: of the upper side, lower side and trailing edge, (chordwise or up, spanwise); caps: of the ends' edges.
    """
    upper, lower = np.array([[-WEDGE[0] / 2, y, trailing / 2] for y in (0, WEDGE[1])]) * [[[1, 1, 1]], [[1, 1, -1]]]
    front = np.array([[WEDGE[0] / 2, y, 0] for y in (0, WEDGE[1])])
    outlines = ((front[0], upper[0], upper[1], front[1]), (lower[0], front[0], front[1], lower[1]),
                (upper[0], lower[0], lower[1], upper[1]))  # fmt: skip
    parts = [patch(outline, *parts) for outline, parts in zip(outlines, divisions, strict=True)]
    for (tip, first, last), count in zip(((front[0], lower[0], upper[0]), (front[1], upper[1], lower[1])), caps,
                                         strict=True):  # fmt: skip
        edge = np.linspace(first, last, count + 1)
        parts.append(np.stack([0 * edge[1:] + tip, edge[:-1], edge[1:]], axis=1))
    return parts


def octant(parts, signs, radius):
    """An octant of a sphere, its rims in `parts` equal angles: (T, 3, 3)."""
    i, j = (index.ravel() for index in np.meshgrid(*[np.arange(parts + 1)] * 2, indexing="ij"))
    points = np.sin(np.stack([i, j, parts - i - j], axis=1) / parts * np.pi / 2)
    points = (radius * points / np.linalg.norm(points, axis=1)[:, None] * signs).reshape(parts + 1, parts + 1, 3)
    i, j = i[i + j < parts], j[i + j < parts]
    first = np.stack([points[i, j], points[i + 1, j], points[i, j + 1]], axis=1)
    i, j = i[i + j < parts - 1], j[i + j < parts - 1]
    second = np.stack([points[i + 1, j], points[i + 1, j + 1], points[i, j + 1]], axis=1)
    return np.concatenate([first, second])[:, :: int(np.prod(signs))]


SIGNS = [np.array([a, b, c]) for a in (1, -1) for b in (1, -1) for c in (1, -1)]


def octants(counts, radius=0.15, gap=0.0):
    """A sphere of eight octants with their counts of parts along a rim, each `gap` / 2 metres from the planes."""
    return [octant(count, signs, radius) + gap / 2 * signs for count, signs in zip(counts, SIGNS, strict=True)]


def skins(trailing, counts=((22, 30), (17, 23)), chord=0.2, span=0.6, thick=0.12):
    """The upper and the lower side of a wing, `trailing` metres apart at nose and trailing edge, open at its tips."""
    parts = []
    for sign, (along, across) in zip((1, -1), counts, strict=True):
        x = (1 - np.cos(np.linspace(0, np.pi, along + 1))) / 2
        half = 5 * thick * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
        points = np.empty((along + 1, across + 1, 3))
        points[..., 0], points[..., 2] = chord * (0.5 - x)[:, None], sign * (chord * half + trailing / 2)[:, None]
        points[..., 1] = np.linspace(-span / 2, span / 2, across + 1)
        parts.append(grid(points)[:, ::-sign])
    return parts


def slotted(width, counts, side=0.3, length=0.15):
    """A square sheet across x with a slot along y, whose lower and upper rim have counts[0] and counts[1] edges."""
    half, ends = side / 2, length / 2
    rims = [np.stack([np.full(n + 1, s), np.linspace(-ends, ends, n + 1), np.full(n + 1, s * width / 2)], 1) * [0, 1, 1]
            for n, s in zip(counts, (-1, 1), strict=True)]  # fmt: skip
    parts = [np.stack([rim * [1, 1, side / width], rim], axis=1) for rim in rims]
    for y in (-1, 1):
        z = np.array([-half, -width / 2, width / 2, half])
        parts.append(np.stack([[[0, y * at, up] for up in z] for at in (ends, half)], axis=1))
    return np.concatenate([grid(part) for part in parts])


def turned(parts, seed):
    """Corners of patches turned at random."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return [part @ turn.T for part in parts]


def surface(parts):
    """Vertices and triangles, each with corners of its own, of patches."""
    corners = np.concatenate(parts)
    return soup(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
