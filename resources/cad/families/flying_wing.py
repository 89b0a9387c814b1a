"""Flying wings without a body or a tail: two swept panels, a flat hump in the middle, some with tips turned up."""

import numpy as np
from _wings import keel, wing

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import pair, panel, place


class Family(Generator):
    PARAMETERS = {
        "span": {"minimum": 0.5, "maximum": 1.0, "unit": "m", "description": "of the wing"},
        "root": {"minimum": 0.16, "maximum": 0.28, "unit": "m", "description": "chord in the middle"},
        "taper": {"minimum": 0.25, "maximum": 0.5, "unit": "", "description": "of the chords"},
        "sweep": {"minimum": 15, "maximum": 38, "unit": "degrees", "description": "of the leading edge"},
        "rise": {"minimum": 0, "maximum": 3, "unit": "degrees", "description": "dihedral"},
        "thickness": {"minimum": 0.014, "maximum": 0.024, "unit": "m", "description": "of the wing"},
        "hump": {"minimum": 0.04, "maximum": 0.08, "unit": "m", "description": "height of the hump"},
        "hump_width": {"minimum": 0.1, "maximum": 0.2, "unit": "m", "description": "of the hump"},
        "tips": {
            "minimum": 0,
            "maximum": 1,
            "whole": True,
            "unit": "",
            "description": "1: with tips that are turned up",
        },
        "tip_height": {"minimum": 0.05, "maximum": 0.1, "unit": "m", "description": "of turned up tips"},
    }

    def parts(self, values, pose=0.0):
        root = values["root"]
        tip, half, sweep, rise = max(values["taper"] * root, 0.05), values["span"] / 2, values["sweep"], values["rise"]
        parts = wing("wing", root, tip, 2 * half, sweep, values["thickness"], rise)
        parts["hump"] = keel(1.15 * root, values["hump"], values["hump_width"], -0.05 * root, 0.1 * values["hump"])
        if values["tips"]:
            back, angle = root / 2 - half * np.tan(np.radians(sweep)) - tip / 2, np.radians(rise)
            end = back, (half - 0.012) * np.cos(angle), (half - 0.012) * np.sin(angle)
            upright = panel(0.95 * tip, 0.7 * tip, values["tip_height"], 20, 0.008, inside=0.012)
            parts |= pair("winglet", place(upright, rotate=(85, 0, 0), move=end))
        return parts
