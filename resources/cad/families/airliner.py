"""Jet aeroplanes: a round body, a low swept wing with two or four engines below, a low tail or a T."""

import numpy as np
from _wings import tail, wing

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import body, box, pair, place, revolve


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.55, "maximum": 1.0, "unit": "m", "description": "of the body"},
        "slenderness": {"minimum": 8, "maximum": 12, "unit": "", "description": "length over diameter"},
        "nose": {"minimum": 0.1, "maximum": 0.2, "unit": "", "description": "share of the length"},
        "span": {"minimum": 0.75, "maximum": 1.0, "unit": "", "description": "of the wing, over the length"},
        "root": {
            "minimum": 0.16,
            "maximum": 0.24,
            "unit": "",
            "description": "chord of the wing in the middle, over the length",
        },
        "taper": {"minimum": 0.3, "maximum": 0.5, "unit": "", "description": "of the wing's chords"},
        "sweep": {"minimum": 15, "maximum": 36, "unit": "degrees", "description": "of the wing's leading edge"},
        "rise": {"minimum": 2, "maximum": 8, "unit": "degrees", "description": "dihedral of the wing"},
        "engines": {
            "minimum": 1,
            "maximum": 2,
            "whole": True,
            "unit": "",
            "description": "below each half of the wing",
        },
        "engine": {"minimum": 0.02, "maximum": 0.028, "unit": "m", "description": "radius of an engine"},
        "tail": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "0: low, 1: T"},
        "tail_span": {"minimum": 0.22, "maximum": 0.34, "unit": "m", "description": "of the tailplane"},
        "tail_sweep": {"minimum": 15, "maximum": 35, "unit": "degrees", "description": "of tailplane and fin"},
        "fin": {"minimum": 0.1, "maximum": 0.16, "unit": "m", "description": "height of the fin from the axis"},
    }

    def parts(self, values, pose=0.0):
        length = values["length"]
        radius, root = length / values["slenderness"] / 2, values["root"] * length
        parts = {"body": body(length, radius, values["nose"], 0.3, 0.45)}
        tip, span, at = max(values["taper"] * root, 0.035), values["span"] * length, (0.06 * length, 0, -0.45 * radius)
        parts |= wing("wing", root, tip, span, values["sweep"], 0.012, values["rise"], at)
        parts |= tail(values["tail"], values, -0.5 * length + 0.06, 0.09, values["fin"])
        for number in range(values["engines"]):
            # Before and below the wing, on a pylon that ends in the middle of the wing.
            y = (0.16, 0.3)[number] * span
            edge = at[0] + root / 2 - y * np.tan(np.radians(values["sweep"]))
            z, middle = at[2] + y * np.tan(np.radians(values["rise"])), values["engine"]
            place_of = (edge - 0.01, y, z - 1.5 * middle)
            nacelle = [(-0.05, 0.6 * middle), (-0.02, middle), (0.035, middle), (0.045, 0.8 * middle)]
            parts |= pair(f"engine_{number}", place(revolve(nacelle, 24), move=place_of))
            parts |= pair(
                f"pylon_{number}", box((edge - 0.045, y - 0.006, z - 1.5 * middle), (edge - 0.012, y + 0.006, z))
            )
        return parts
