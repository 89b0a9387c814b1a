"""Helicopters: a cabin, a tail boom with a fin, a rotor of two to five blades on a mast, skids or nothing below."""

from _wings import fin

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import bar, blade, ellipse, pair, place, revolve


class Family(Generator):
    PARAMETERS = {
        "cabin": {"minimum": 0.22, "maximum": 0.34, "unit": "m", "description": "length of the cabin"},
        "radius": {"minimum": 0.055, "maximum": 0.075, "unit": "m", "description": "of the cabin"},
        "boom": {
            "minimum": 0.22,
            "maximum": 0.4,
            "unit": "m",
            "description": "length of the tail boom behind the cabin's middle",
        },
        "boom_radius": {"minimum": 0.018, "maximum": 0.026, "unit": "m", "description": "of the tail boom, in front"},
        "fin": {"minimum": 0.07, "maximum": 0.12, "unit": "m", "description": "height of the fin"},
        "tailplane": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: with a tailplane"},
        "rotor": {"minimum": 0.2, "maximum": 0.38, "unit": "m", "description": "radius of the rotor"},
        "blades": {"minimum": 2, "maximum": 5, "whole": True, "unit": "", "description": "number of blades"},
        "chord": {"minimum": 0.026, "maximum": 0.036, "unit": "m", "description": "of a blade"},
        "mast": {"minimum": 0.03, "maximum": 0.06, "unit": "m", "description": "height of the rotor above the cabin"},
        "skids": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: on skids"},
        "skid_height": {"minimum": 0.045, "maximum": 0.075, "unit": "m", "description": "of the skids below the cabin"},
    }
    MOVED = ()
    REPEATS = "blades"

    def parts(self, values, pose=0.0):
        radius, half, back = values["radius"], values["cabin"] / 2, values["boom"]
        shift = (back - half) / 2  # the whole about the origin
        cabin = [(-x, r) for x, r in ellipse(0.0, half, radius, 9)][::-1] + ellipse(0.25 * half, half, radius, 9)
        parts = {"cabin": place(revolve(cabin, 40), move=(shift, 0, 0))}
        boom = [(-back, 0.6 * values["boom_radius"]), (0.0, values["boom_radius"])]
        parts["boom"] = place(revolve(boom, 16), move=(shift, 0, 0.2 * radius))
        parts["fin"] = fin(0.08, 0.05, values["fin"], 25, 0.008, (shift - back + 0.045, 0, 0.2 * radius), 0, 0.008)
        if values["tailplane"]:
            level = place(blade([(0.03, -0.08), (0.03, 0.08), (-0.03, 0.08), (-0.03, -0.08)], 0.008, 0.012))
            parts["tailplane"] = place(level, move=(shift - 0.72 * back, 0, 0.2 * radius))
        top = radius + values["mast"]
        parts["mast"] = place(revolve([(0.0, 0.015), (top + 0.016, 0.015)], 16), rotate=(0, -90, 0), move=(shift, 0, 0))
        chord, reach = values["chord"], values["rotor"]
        outline = [(-0.01, -chord / 2), (reach, -chord / 2), (reach, chord / 2), (-0.01, chord / 2)]
        for number in range(values["blades"]):
            turn = 180 + 360 * (number / values["blades"] + pose)
            parts[f"blade_{number}"] = place(blade(outline, 0.008, 0.009), rotate=(0, 0, turn), move=(shift, 0, top))
        if values["skids"]:
            y, z, x = 1.15 * radius, -radius - values["skid_height"], 0.45 * half
            parts |= pair("skid", bar((shift - 1.1 * half, y, z), (shift + 1.1 * half, y, z), 0.018, 0.018))
            for name, at in (("front", x), ("rear", -x)):
                parts |= pair(
                    f"leg_{name}", bar((shift + at, 0.3 * radius, -0.3 * radius), (shift + at, y, z), 0.015, 0.015)
                )
        return parts
