"""Airships: a long round body, three or four fins at its tail, and a gondola below."""

from _wings import fins

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import ellipse, hull, revolve


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.45, "maximum": 0.9, "unit": "m", "description": "of the body"},
        "slenderness": {"minimum": 3.2, "maximum": 5.5, "unit": "", "description": "length over diameter"},
        "front": {
            "minimum": 0.35,
            "maximum": 0.5,
            "unit": "",
            "description": "share of the length before the thickest place",
        },
        "fins": {"minimum": 3, "maximum": 4, "whole": True, "unit": "", "description": "number of fins"},
        "rolled": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: no fin points upwards"},
        "fin": {
            "minimum": 0.9,
            "maximum": 1.3,
            "unit": "",
            "description": "from the axis to a fin's tip, in radii of the body",
        },
        "fin_root": {"minimum": 0.14, "maximum": 0.22, "unit": "", "description": "chord over length"},
        "gondola": {
            "minimum": 0.12,
            "maximum": 0.25,
            "unit": "",
            "description": "length of the gondola over the length",
        },
        "gondola_at": {
            "minimum": -0.05,
            "maximum": 0.15,
            "unit": "",
            "description": "place of the gondola before the middle, in lengths",
        },
        "gondola_height": {
            "minimum": 0.02,
            "maximum": 0.04,
            "unit": "m",
            "description": "of the gondola below the body",
        },
    }

    def parts(self, values, pose=0.0):
        length = values["length"]
        radius, front = length / values["slenderness"] / 2, values["front"] * length
        thick = length / 2 - front  # where the body is thickest
        back = [(2 * thick - x, r) for x, r in ellipse(thick, thick + length - front, radius, 14, 0.65)][::-1]
        parts = {"body": revolve(back[:-1] + ellipse(thick, length / 2, radius, 14, 0.5), 48)}
        root = values["fin_root"] * length
        tip, at = 0.65 * root, -length / 2 + 0.62 * root
        parts |= fins("fin", values["fins"], values["rolled"], root, tip, values["fin"] * radius, 25, 0.009, at)
        half, middle = values["gondola"] * length / 2, values["gondola_at"] * length
        deep, wide = -radius - values["gondola_height"], 0.022
        low = [(middle + x * half, y * wide, deep) for x in (-0.7, 0.7) for y in (-0.8, 0.8)]
        high = [(middle + x * half, y * wide, -0.55 * radius) for x in (-1, 1) for y in (-1, 1)]
        return parts | {"gondola": hull(low + high)}
