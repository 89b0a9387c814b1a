"""Draw a triangle mesh: orthographic, shaded, edges visible, drawn from the far triangles to the near ones."""

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.ticker import MaxNLocator

from isarflow.mesh import topology

OBLIQUE = (-32.0, 28.0)  # azimuth and elevation of the eye in degrees: ahead, to the right of the nose, above
TOP = (-90.0, 90.0)
SIDE = (-90.0, 0.0)
SURFACE = np.array([0.62, 0.74, 0.86])  # light steel blue
EDGE = "#1d3446"
LIGHT = np.array([-0.35, 0.6, 0.72])  # from the eye's upper left: right, up, towards the eye


def project(points, azimuth, elevation):
    """Return right, up and depth, (...,) each, of points (..., 3) seen from afar. azimuth, elevation: degrees."""
    az, el = np.radians([azimuth, elevation])
    right = np.array([-np.sin(az), np.cos(az), 0.0])
    towards = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    up = np.cross(towards, right)
    return points @ right, points @ up, points @ towards


def draw(axes, vertices, triangles, view, edges=True, colors=SURFACE):
    """Draw a mesh into axes with equal scales. colors: before shading, red, green and blue, or (triangles, 3)."""
    right, up, depth = project(vertices, *view)
    corners = np.stack([right, up], axis=-1)[triangles]
    order = np.argsort(depth[triangles].mean(axis=1), kind="stable")
    lit = np.stack(project(topology.shape(vertices[triangles])[0], *view), axis=1)
    lit *= np.where(lit[:, 2:] < 0, -1, 1)  # the side that faces the eye is the one that is lit
    colors = np.clip(colors * (0.45 + 0.65 * np.clip(lit @ LIGHT, 0, 1)[:, None]), 0, 1)[order]
    # Scales are equal, so one of the two directions says how large a metre is drawn.
    size, paper = axes.get_position().size, axes.figure.get_size_inches()
    points = 72 * min(size * paper / [np.ptp(right), np.ptp(up)])
    # Fine meshes get thin edges, or the picture would be black.
    side = points * np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1).mean()
    faces = PolyCollection(
        corners[order],
        facecolors=colors,
        edgecolors=EDGE if edges else colors,
        linewidths=float(np.clip(0.05 * side, 0.05, 0.5)) if edges else 0.3,
        rasterized=True,  # tens of thousands of triangles: as vectors the page would be too large
    )
    axes.add_collection(faces)
    margin = 0.03 * max(np.ptp(right), np.ptp(up))
    axes.set(xlim=(right.min() - margin, right.max() + margin), ylim=(up.min() - margin, up.max() + margin))
    axes.set_aspect("equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))  # as many as there is room for
        axis.set_major_formatter("{x:g}")
    axes.grid(False)
