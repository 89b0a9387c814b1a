"""Parts of aeroplanes and missiles: wings, tails, fins and propellers."""

import numpy as np

from isarflow.mesh.shapes import blade, hull, pair, panel, place


def wing(name, root, tip, span, sweep, thickness, rise=0.0, move=(0, 0, 0), **more):
    """A wing of two panels, each `span` / 2 long; rise: degrees of dihedral."""
    left = place(panel(root, tip, span / 2, sweep, thickness, **more), rotate=(rise, 0, 0), move=move)
    return pair(name, left)


def fin(root, tip, height, sweep, thickness, move=(0, 0, 0), cant=0.0, inside=0.015):
    """A fin upwards, in the plane y = 0 unless it is moved; cant: degrees to the left."""
    return place(panel(root, tip, height, sweep, thickness, inside), rotate=(90 - cant, 0, 0), move=move)


def fins(name, count, rolled, root, tip, height, sweep, thickness, at):
    """Fins around a body, one of them upwards, or none of them if rolled; at: the root's middle along x.

    Their roots are on the body's axis, so `height` counts from there.
    """
    parts = {}
    for number in range(count):
        roll = 90 + 360 * (number + rolled / 2) / count
        made = panel(root, tip, height, sweep, thickness, inside=0.0)
        parts[f"{name}_{number}"] = place(made, rotate=(roll, 0, 0), move=(at, 0, 0))
    return parts


def screw(radius, at, pose, blades=2):
    """A flat propeller about x, its first blade to the left at pose 0, turned by the pose; at: its middle along x."""
    parts = {}
    chord = max(0.25 * radius, 0.022)
    outline = np.array([(-0.5, -0.2), (0.5, -0.2), (0.5, 1), (-0.5, 1)]) * [chord, radius]
    for number in range(blades):
        made = place(blade(outline, 0.008, 0.3 * chord), rotate=(0, 90, 0))
        turn = 360 * (number / blades + pose)
        parts[f"blade_{'abcd'[number]}"] = place(made, rotate=(turn, 0, 0), move=(at, 0, 0))
    return parts


def tail(style, values, at, root, height, thickness=0.007):
    """A tail at x = `at`: 0 low tailplane and fin, 1 tailplane on top of the fin, 2 a V, 3 a V downwards."""
    span, sweep = values["tail_span"], values["tail_sweep"]
    tip = 0.65 * root
    if style >= 2:
        rise = 40 if style == 2 else -40
        return wing("tail", root, tip, 1.1 * span, sweep, thickness, rise, (at, 0, 0))
    upright = {"fin": fin(1.1 * root, 0.75 * root, height, sweep, thickness + 0.002, (at, 0, 0))}
    back = 0.92 * height * np.tan(np.radians(sweep))
    up = (at - back, 0, 0.92 * height) if style == 1 else (at, 0, 0)
    return upright | wing("tail", root, tip, span, sweep, thickness, 0, up)


def keel(length, height, width, at, z):
    """A slim body from eight corners, pointed in front and behind."""
    ends = [(at + length / 2, 0, z), (at - length / 2, 0, z)]
    ring = [(at + s * length / 4, y * width / 2, z + h * height / 2) for s in (-1, 1) for y in (-1, 1) for h in (-1, 1)]
    return hull(ends + ring)
