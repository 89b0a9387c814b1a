"""Draw the targets in pictures, docs/img/targets.png and benchmark.png: python resources/cad/picture.py"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import make
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

ROLES = {"known": "#4477aa", "unknown": "#cc6677", "other": "#999933"}
# The pictures, and whose targets they show, each with its role: five in a row.
PICTURES = {
    "targets": {"drone": "known", "missile": "known", "aircraft": "unknown", "ufo": "unknown", "trihedral": "other"},
    "benchmark": {
        **dict.fromkeys(("drone_hexa", "drone_guarded", "missile_plain", "missile_cruciform"), "known"),
        **dict.fromkeys(("twin_boom", "delta_wing", "helicopter", "bird", "balloon", "satellite"), "unknown"),
    },
}
ROW = 5
LIGHT = np.array([0.45, -0.35, 0.82])
FILLED = {"drone": 0.48, "missile": 0.66, "aircraft": 0.72, "ufo": 0.4, "trihedral": 0.74}  # m shown around the middle
FILLED |= {"drone_hexa": 0.44, "drone_guarded": 0.52, "missile_plain": 0.62, "missile_cruciform": 0.64}
FILLED |= {"twin_boom": 0.68, "delta_wing": 0.6, "helicopter": 0.56, "bird": 0.62, "balloon": 0.48, "satellite": 0.5}


def draw(axes, mesh, color, span):
    """Shade a mesh (vertices, triangles) on 3-D axes, `span` metres wide, seen from the front left."""
    # The painter's algorithm sorts whole triangles, so they must be small.
    corners = mesh[0][mesh[1]]
    for _ in range(16):
        side = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        large = side.max(axis=1) > span / 25
        if not large.any():
            break
        k = side[large].argmax(axis=1)
        order = ((k[:, None] + np.arange(3)) % 3)[:, :, None]
        a, b, c = np.take_along_axis(corners[large], order, axis=1).transpose(1, 0, 2)
        halves = [np.stack([a, (a + b) / 2, c], axis=1), np.stack([(a + b) / 2, b, c], axis=1)]
        corners = np.concatenate([corners[~large], *halves])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    shade = 0.62 + 0.38 * (normal @ LIGHT)
    colors = np.clip(shade[:, None] * (0.25 + 0.75 * np.array(to_rgb(color))) + 0.08, 0, 1)
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors=colors, linewidths=0.2))
    middle = (mesh[0].min(axis=0) + mesh[0].max(axis=0)) / 2
    axes.set(**{f"{name}lim": (m - span / 2, m + span / 2) for name, m in zip("xyz", middle, strict=True)})
    axes.set_box_aspect((1, 1, 1), zoom=1.3)
    axes.set_proj_type("ortho")
    axes.view_init(24, 38)
    axes.set_axis_off()


def paint(picture, targets):
    """Draw targets, a mapping of names to roles, into docs/img/<picture>.png."""
    rows = -(-len(targets) // ROW)
    figure = plt.figure(figsize=(12, 2.9 * rows))
    for place, (name, role) in enumerate(targets.items()):
        left, low = place % ROW / ROW, 1 - (place // ROW + 1) / rows
        axes = figure.add_axes((left, low + 0.08 / rows, 1 / ROW, 0.92 / rows), projection="3d")
        mesh = getattr(make, name)()
        draw(axes, mesh, ROLES[role], FILLED[name])
        size = " x ".join(f"{length:.2f}" for length in np.ptp(mesh[0], axis=0))
        middle = left + 0.5 / ROW
        figure.text(middle, low + 0.1 / rows, f"{name} ({role})", ha="center", fontsize=12, color=ROLES[role])
        figure.text(middle, low + 0.02 / rows, f"{size} m", ha="center", fontsize=9, color="0.4")
    target = Path(__file__).resolve().parents[2] / "docs" / "img" / f"{picture}.png"
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target, dpi=150, metadata={"Software": None})


if __name__ == "__main__":
    for name, targets in PICTURES.items():
        paint(name, targets)
