"""Delta wings: a body that rises in the middle of a swept wing, and one fin or two."""

import numpy as np
from _wings import fin, keel, wing

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import pair


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.35, "maximum": 0.8, "unit": "m", "description": "of the body"},
        "width": {"minimum": 0.1, "maximum": 0.16, "unit": "m", "description": "of the body"},
        "height": {"minimum": 0.05, "maximum": 0.09, "unit": "m", "description": "of the body"},
        "span": {"minimum": 0.35, "maximum": 0.75, "unit": "m", "description": "of the wing"},
        "root": {"minimum": 0.6, "maximum": 0.85, "unit": "", "description": "chord in the middle, over the length"},
        "taper": {"minimum": 0.12, "maximum": 0.35, "unit": "", "description": "of the wing's chords"},
        "rise": {"minimum": -3, "maximum": 3, "unit": "degrees", "description": "dihedral"},
        "fins": {"minimum": 1, "maximum": 2, "whole": True, "unit": "", "description": "number of fins"},
        "fin": {"minimum": 0.08, "maximum": 0.14, "unit": "m", "description": "height of a fin"},
        "cant": {"minimum": 0, "maximum": 25, "unit": "degrees", "description": "of two fins, outwards"},
    }

    def parts(self, values, pose=0.0):
        length, root, half = values["length"], values["root"] * values["length"], values["span"] / 2
        tip = max(values["taper"] * root, 0.045)
        # The trailing edge is straight across.
        sweep = np.degrees(np.arctan((root - tip) / half))
        parts = {"body": keel(length, values["height"], values["width"], 0, 0.1 * values["height"])}
        behind = (root - length) / 2 + 0.08 * length
        parts |= wing("wing", root, tip, 2 * half, sweep, 0.012, values["rise"], (behind, 0, 0))
        at = behind - root / 2 + 0.09
        if values["fins"] == 1:
            return parts | {"fin": fin(0.11, 0.06, values["fin"], 35, 0.009, (at, 0, 0))}
        return parts | pair("fin", fin(0.1, 0.055, values["fin"], 35, 0.008, (at, 0.3 * half, 0), values["cant"], 0.0))
