"""Drones with several rotors: body, arms, motors with propellers, and what they stand on."""

import numpy as np

from isarflow.mesh.shapes import bar, blade, box, hull, pair, place, revolve

SKIDS, LEGS = 1, 2  # `stand`; 0 is none
GOLDEN = 137.5  # degrees between the turns of neighbouring propellers, so that no two stand alike


def multirotor(angles, values, pose):
    """Parts of a drone with a motor at each of the angles, degrees from the nose, on the left and on the right.

    values: those of a generator, see quadcopter.py; pose: turns of the propellers.
    """
    reach, z = values["reach"], values["rise"]
    sides = np.radians([angles[0] * 2, *np.diff(angles), 2 * (180 - angles[-1])])
    radius = values["rotor"] * reach * np.sin(sides.min() / 2)  # at most half of the way to the nearest motor
    length, width, height = (values[f"body_{name}"] for name in ("length", "width", "height"))
    parts = {"body": deck(length, width, height)}
    low, high = (0.4 * height, 0.5 * height + values["load"]), (-0.5 * height - values["load"], -0.4 * height)
    low, high = low if values["load_above"] else high
    parts["load"] = box((-0.3 * length, -0.28 * width, low), (0.26 * length, 0.28 * width, high))
    for number, angle in enumerate(np.radians(angles)):
        x, y = reach * np.cos(angle), reach * np.sin(angle)
        root = 0.25 * min(length, width) / reach
        parts |= pair(f"arm_{number}", bar((root * x, root * y, 0), (x, y, z), values["arm"], 0.8 * values["arm"]))
        turn = values["turn"] + GOLDEN * number + 360 * pose
        made = propeller(radius, int(values["blades"]), values["twist"], turn)
        for name, part in made.items():
            parts |= pair(f"{name}_{number}", place(part, move=(x, y, z)))
    return parts | stand(values, length, width, height)


def deck(length, width, height):
    """A body with eight sides that narrows towards its roof and its floor."""
    outline = np.array([(0.5, 0.3), (0.32, 0.5), (-0.34, 0.5), (-0.5, 0.32)])
    outline = np.concatenate([outline, outline * [1, -1]]) * [length, width]
    levels = (-0.5, 0.8), (-0.2, 1.0), (0.5, 0.72)
    return hull([(x * scale, y * scale, height * up) for up, scale in levels for x, y in outline])


def propeller(radius, blades, twist, turn):
    """A motor about z, 0.012 m below its arm's middle to above the blades, and its blades, turned by degrees."""
    hub, chord, thickness = max(0.19 * radius, 0.013), max(0.32 * radius, 0.022), max(0.067 * radius, 0.0055)
    level = max(0.38 * radius, 0.027)  # of the blades, above the arm
    parts = {"motor": place(revolve([(-0.012, hub), (level + 0.6 * hub, hub)], 16), rotate=(0, -90, 0))}
    outline = [(0, -0.36), (0.33, -0.54), (0.76, -0.51), (1, -0.36), (1, 0.36), (0.33, 0.46), (0, 0.36)]
    outline = np.array(outline) * [radius, chord]
    for number in range(blades):
        wing = blade(outline, thickness, 0.26 * chord)
        parts[f"blade_{'abcd'[number]}"] = place(
            wing, rotate=(twist, 0, turn + 360 * number / blades), move=(0, 0, level)
        )
    return parts


def stand(values, length, width, height):
    """Two skids on four legs, or four straight legs, or nothing."""
    parts, bottom = {}, -height / 2 - values["stand_height"]
    if values["stand"] == SKIDS:
        y, x = 0.5 * width + 0.3 * values["stand_height"], 0.3 * length
        parts = pair("skid", bar((-0.55 * length, y, bottom), (0.55 * length, y, bottom), 0.02, 0.018))
        for name, at in (("front", x), ("rear", -x)):
            parts |= pair(f"leg_{name}", bar((at, 0.12 * width, 0), (at, y, bottom), 0.016, 0.015))
    elif values["stand"] == LEGS:
        y, x = 0.32 * width, 0.28 * length
        for name, at in (("front", x), ("rear", -x)):
            parts |= pair(f"leg_{name}", box((at - 0.009, y - 0.009, bottom), (at + 0.009, y + 0.009, 0)))
    return parts
