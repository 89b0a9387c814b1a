"""Bombs: a thick body with a round nose, fins at its narrow tail, and a ring around some of them."""

import numpy as np
from _wings import fins

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import body, place, ring


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.3, "maximum": 0.75, "unit": "m", "description": "of the body"},
        "slenderness": {"minimum": 4.5, "maximum": 8, "unit": "", "description": "length over diameter"},
        "nose": {"minimum": 0.2, "maximum": 0.4, "unit": "", "description": "share of the length"},
        "bluntness": {
            "minimum": 0.5,
            "maximum": 0.8,
            "unit": "",
            "description": "of the nose: 0.5 an ellipse, 1 nearly a cone",
        },
        "tail": {"minimum": 0.3, "maximum": 0.45, "unit": "", "description": "share of the length that narrows"},
        "tail_radius": {"minimum": 0.35, "maximum": 0.6, "unit": "", "description": "of the body's, at the end"},
        "fins": {"minimum": 3, "maximum": 4, "whole": True, "unit": "", "description": "number of tail fins"},
        "rolled": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: no fin points upwards"},
        "fin_span": {
            "minimum": 1.0,
            "maximum": 1.7,
            "unit": "",
            "description": "from the axis to a fin's tip, in radii of the body",
        },
        "fin_root": {"minimum": 0.14, "maximum": 0.22, "unit": "", "description": "chord over length"},
        "fin_taper": {"minimum": 0.45, "maximum": 0.9, "unit": "", "description": "tip chord over root chord"},
        "fin_sweep": {"minimum": 10, "maximum": 30, "unit": "degrees", "description": "of the leading edge"},
        "ring": {
            "minimum": 0,
            "maximum": 1,
            "whole": True,
            "unit": "",
            "description": "1: a ring around the fins' tips",
        },
    }

    def parts(self, values, pose=0.0):
        length = values["length"]
        radius = length / values["slenderness"] / 2
        parts = {
            "body": body(length, radius, values["nose"], values["tail"], values["tail_radius"], values["bluntness"])
        }
        root, sweep = max(values["fin_root"] * length, 0.06), values["fin_sweep"]
        tip, height = max(values["fin_taper"] * root, 0.036), max(values["fin_span"] * radius, 0.05)
        at = 0.55 * root - length / 2
        parts |= fins("fin", values["fins"], values["rolled"], root, tip, height, sweep, 0.008, at)
        if values["ring"]:
            # The tips end in the middle of its wall, along its whole length and beyond.
            middle = at + root / 2 - height * np.tan(np.radians(sweep)) - tip / 2
            section = [
                (height - 0.006, -0.013),
                (height + 0.006, -0.013),
                (height + 0.006, 0.013),
                (height - 0.006, 0.013),
            ]
            parts["ring"] = place(ring(section), rotate=(0, 90, 0), move=(middle, 0, 0))
        return parts
