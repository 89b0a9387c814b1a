"""Missiles with four long strakes or wings amidships and four fins at the tail, in a plus or an X."""

import numpy as np
from _wings import fins

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import body


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.4, "maximum": 1.0, "unit": "m", "description": "of the body"},
        "slenderness": {"minimum": 8, "maximum": 14, "unit": "", "description": "length over diameter"},
        "nose": {"minimum": 0.12, "maximum": 0.35, "unit": "", "description": "share of the length"},
        "bluntness": {
            "minimum": 0.5,
            "maximum": 0.85,
            "unit": "",
            "description": "of the nose: 0.5 an ellipse, 1 nearly a cone",
        },
        "tail": {"minimum": 0.05, "maximum": 0.2, "unit": "", "description": "share of the length that narrows"},
        "tail_radius": {"minimum": 0.6, "maximum": 0.95, "unit": "", "description": "of the body's, at the end"},
        "strake": {"minimum": 0.12, "maximum": 0.4, "unit": "", "description": "chord of a strake over length"},
        "strake_span": {
            "minimum": 1.9,
            "maximum": 3.2,
            "unit": "",
            "description": "from the axis to a strake's tip, in radii of the body",
        },
        "strake_taper": {"minimum": 0.4, "maximum": 0.9, "unit": "", "description": "tip chord over root chord"},
        "strake_sweep": {"minimum": 15, "maximum": 55, "unit": "degrees", "description": "of the leading edge"},
        "strake_at": {
            "minimum": -0.02,
            "maximum": 0.15,
            "unit": "",
            "description": "place of the strakes before the middle, in lengths",
        },
        "rolled": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: no fin points upwards"},
        "fin_span": {
            "minimum": 2.2,
            "maximum": 3.4,
            "unit": "",
            "description": "from the axis to a fin's tip, in radii of the body",
        },
        "fin_root": {"minimum": 0.09, "maximum": 0.15, "unit": "", "description": "chord over length"},
        "fin_taper": {"minimum": 0.45, "maximum": 0.9, "unit": "", "description": "tip chord over root chord"},
        "fin_sweep": {"minimum": 10, "maximum": 40, "unit": "degrees", "description": "of the leading edge"},
        "crossed": {
            "minimum": 0,
            "maximum": 1,
            "whole": True,
            "unit": "",
            "description": "1: the strakes are between the fins",
        },
    }

    def parts(self, values, pose=0.0):
        length = values["length"]
        radius = length / values["slenderness"] / 2
        parts = {
            "body": body(length, radius, values["nose"], values["tail"], values["tail_radius"], values["bluntness"])
        }
        root, sweep = max(values["fin_root"] * length, 0.05), values["fin_sweep"]
        tip, height = values["fin_taper"] * root, max(values["fin_span"] * radius, radius + 0.03)

        chord, reach = max(values["strake"] * length, 0.06), max(values["strake_span"] * radius, radius + 0.02)
        # At a large sweep the tip would end behind the root.
        lean = min(values["strake_sweep"], np.degrees(np.arctan(0.6 * chord / reach)))
        turned = (values["rolled"] + values["crossed"]) % 2
        parts |= fins(
            "strake",
            4,
            turned,
            chord,
            max(values["strake_taper"] * chord, 0.03),
            reach,
            lean,
            0.007,
            values["strake_at"] * length,
        )
        return parts | fins("fin", 4, values["rolled"], root, tip, height, sweep, 0.007, 0.6 * root - length / 2)
