"""Smooth bodies with tips and sharp rims, exported with as many triangles as one likes: vertices (V, 3), triangles."""

import numpy as np
from shapes_made import lofted

LENGTH = 0.25  # m, along x; the middle is at the origin


def revolved(x, r, around):
    """A closed body of revolution through stations x ascending of radii r, whose ends on the axis are one vertex."""
    angle = 2 * np.pi * np.arange(around) / around
    rings = zip(x[1:-1], r[1:-1], strict=True)
    vertices, triangles = lofted([np.stack([0 * angle + a, b * np.cos(angle), b * np.sin(angle)], 1) for a, b in rings])
    vertices[-2:] = [[x[0], 0, 0], [x[-1], 0, 0]]
    return vertices, triangles


def karman(rings, around, radius=0.03):
    """A von Karman nose at the front, a flat base with a sharp rim at the back; about 2.3 rings * around triangles."""
    s = (1 - np.cos(np.pi * np.linspace(0, 1, rings + 1))) / 2
    turn = np.arccos(1 - 2 * s)
    nose = radius * np.sqrt(np.maximum(turn - np.sin(2 * turn) / 2, 0) / np.pi)
    base = radius * np.linspace(0, 1, max(rings // 6, 2) + 1)[:-1]
    x = np.concatenate([np.full(len(base), -LENGTH / 2), LENGTH * (0.5 - s[::-1])])
    return revolved(x, np.concatenate([base, nose[::-1]]), around)


def rimmed(rings, around, width=0.08, height=0.025):
    """A body pointed at both ends with a sharp rim all around in the plane z = 0; about 2 rings * around triangles."""
    y = np.linspace(-1, 1, around // 2 + 1)
    outline = np.concatenate([y, y[-2:0:-1]])
    bulge = np.concatenate([1 - y**2, y[-2:0:-1] ** 2 - 1])
    x = np.linspace(-1, 1, rings + 1)[1:-1]
    share = 1 - x**2
    vertices, triangles = lofted(
        [np.stack([0 * outline + a, f * width * outline, f * height * bulge], 1) for a, f in
         zip(LENGTH / 2 * x, share, strict=True)]
    )  # fmt: skip
    vertices[-2:] = [[-LENGTH / 2, 0, 0], [LENGTH / 2, 0, 0]]
    return vertices, triangles[:, ::-1]
