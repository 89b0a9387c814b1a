"""Draw a triangle mesh: orthographic, shaded, edges visible, drawn from the far triangles to the near ones."""

import matplotlib.ticker
import numpy as np
from matplotlib.collections import PolyCollection

OBLIQUE = (-32.0, 28.0)  # azimuth and elevation of the eye in degrees: ahead, to the right of the nose, above
TOP = (-90.0, 90.0)
SIDE = (-90.0, 0.0)
SURFACE = np.array([0.62, 0.74, 0.86])  # light steel blue
EDGE = "#1d3446"


def project(points, azimuth, elevation):
    """Points (..., 3) seen from afar: right, up and depth towards the eye, each shape (...).

    Azimuth and elevation in degrees are the direction of the eye, as for the radar.
    """
    az, el = np.radians([azimuth, elevation])
    right = np.array([-np.sin(az), np.cos(az), 0.0])
    towards = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    up = np.cross(towards, right)
    return points @ right, points @ up, points @ towards


def draw(axes, vertices, triangles, view, edges=True, colors=None):
    """Draw a mesh into axes with equal scales. Vertices (vertices, 3) in m, triangles (triangles, 3) indices.

    colors: (triangles, 3) red, green, blue of each triangle before it is shaded; one blue if None
    """
    right, up, depth = project(vertices, *view)
    corners = np.stack([right, up], axis=-1)[triangles]
    order = np.argsort(depth[triangles].mean(axis=1), kind="stable")
    colors = _shades(vertices, triangles, view, SURFACE if colors is None else colors)[order]
    # Scales are equal, so one of the two directions says how large a metre is drawn.
    box, paper = axes.get_position(), axes.figure.get_size_inches()
    inches = min(box.width * paper[0] / np.ptp(right), box.height * paper[1] / np.ptp(up))
    # Fine meshes get thin edges, or the picture would be black.
    side = 72 * inches * np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1).mean()
    faces = PolyCollection(
        corners[order],
        facecolors=colors,
        edgecolors=EDGE if edges else colors,
        linewidths=float(np.clip(0.05 * side, 0.05, 0.5)) if edges else 0.3,
        rasterized=True,  # tens of thousands of triangles: as vectors the page would be too large
    )
    axes.add_collection(faces)
    margin = 0.03 * max(np.ptp(right), np.ptp(up))
    axes.set_xlim(right.min() - margin, right.max() + margin)
    axes.set_ylim(up.min() - margin, up.max() + margin)
    axes.set_aspect("equal")
    for axis, length, room in ((axes.xaxis, np.ptp(right), 0.45), (axes.yaxis, np.ptp(up), 0.25)):
        count = int(np.clip(inches * length / room, 2, 5))
        axis.set_major_locator(matplotlib.ticker.MaxNLocator(count, steps=[1, 2, 5, 10]))
        axis.set_major_formatter(lambda metres, _: f"{metres:g}".replace("-", "−"))
    axes.grid(False)


def room_below(axes, share=0.27):
    """Leave room for the triad and the scale bar under the drawing."""
    low, high = axes.get_ylim()
    axes.set_ylim(low - share * (high - low), high)


def _shades(vertices, triangles, view, colors):
    """Colour of each triangle, shape (triangles, 3): lit from the eye's upper left, both sides alike."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    right, up, towards = project(normals, *view)
    # The side that faces the eye is the one that is lit.
    facing = np.where(towards < 0, -1.0, 1.0)
    light = np.array([-0.35, 0.6, 0.72])
    lit = np.clip(facing * (light[0] * right + light[1] * up + light[2] * towards), 0, 1)
    return np.clip(colors * (0.45 + 0.65 * lit[:, None]), 0, 1)


def triad(axes, view, vertices):
    """Draw the x, y, z directions in the lower left corner of the axes, and a scale bar in the lower right."""
    arrows = np.stack(project(np.eye(3), *view), axis=-1)[:, :2]
    box = axes.get_window_extent()
    length = 0.11
    origin = np.array([0.15 * box.height / box.width, 0.10])
    for name, arrow in zip("xyz", arrows, strict=True):
        tip = origin + length * arrow * np.array([box.height / box.width, 1.0])
        axes.annotate(
            "",
            xy=tip,
            xytext=origin,
            xycoords="axes fraction",
            arrowprops={"arrowstyle": "->", "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
        )
        label = origin + 1.35 * length * arrow * np.array([box.height / box.width, 1.0])
        axes.text(*label, name, transform=axes.transAxes, ha="center", va="center", fontsize=8)
    bar = _round_length(0.3 * np.ptp(vertices, axis=0).max())
    low, high = axes.get_xlim()
    end = high - 0.03 * (high - low)
    bottom, top = axes.get_ylim()
    y = bottom + 0.04 * (top - bottom)
    axes.plot([end - bar, end], [y, y], color="black", lw=2, solid_capstyle="butt")
    axes.text(end - bar / 2, y + 0.02 * (top - bottom), f"{bar:g} m", ha="center", va="bottom", fontsize=8)


def _round_length(length):
    """The largest of 1, 2, 5 times a power of ten that is no longer than `length`."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(step * power for step in (1, 2, 5) if step * power <= length * (1 + 1e-9)))
