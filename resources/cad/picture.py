"""Draw the targets in pictures, docs/img/targets.png, benchmark.png, families.png: python resources/cad/picture.py"""

import matplotlib

matplotlib.use("Agg")
import make
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from PIL import Image

from isarflow.core.folders import ROOT
from isarflow.mesh.families import solid
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

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
FAMILIES = "config/families.yaml"  # of which the first model of each family is drawn
SMALL = 6  # of these in a row
COLORS = {"drone": "#4477aa", "missile": "#228833", "other": "#999933"}
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
    figure.savefig(ROOT / "docs" / "img" / f"{picture}.png", dpi=150, metadata={"Software": None})


def paint_families():
    """Draw a model of each kind into docs/img/families.png."""
    targets = load_config(read_yaml(ROOT / FAMILIES))["targets"]
    models = [target for target in targets.values() if target["family"]["number"] == 1]
    rows = -(-len(models) // SMALL)
    figure = plt.figure(figsize=(12, 2.1 * rows))
    for place, target in enumerate(models):
        left, low = place % SMALL / SMALL, 1 - (place // SMALL + 1) / rows
        axes = figure.add_axes((left, low + 0.06 / rows, 1 / SMALL, 0.94 / rows), projection="3d")
        mesh, color = solid(target["family"]), COLORS[target.get("class", "other")]
        box = np.ptp(mesh[0], axis=0)
        draw(axes, mesh, color, 0.72 * np.linalg.norm(box))
        label = f"{target['kind']}, {box.max():.2f} m"
        figure.text(left + 0.5 / SMALL, low + 0.03 / rows, label, ha="center", fontsize=10, color=color)
    path = ROOT / "docs" / "img" / "families.png"
    figure.savefig(path, dpi=110, metadata={"Software": None})
    Image.open(path).quantize(64).save(path, optimize=True)


if __name__ == "__main__":
    for name, targets in PICTURES.items():
        paint(name, targets)
    paint_families()
