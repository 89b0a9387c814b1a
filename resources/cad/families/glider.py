"""Gliders: a slim body, a long narrow wing, and a T or a low tail."""

from _wings import tail, wing

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import body


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.35, "maximum": 0.6, "unit": "m", "description": "of the body"},
        "radius": {"minimum": 0.026, "maximum": 0.038, "unit": "m", "description": "of the body"},
        "span": {"minimum": 0.7, "maximum": 1.0, "unit": "m", "description": "of the wing"},
        "root": {"minimum": 0.055, "maximum": 0.085, "unit": "m", "description": "chord of the wing in the middle"},
        "taper": {"minimum": 0.55, "maximum": 0.9, "unit": "", "description": "of the wing's chords"},
        "sweep": {"minimum": -3, "maximum": 6, "unit": "degrees", "description": "of the wing's leading edge"},
        "rise": {"minimum": 1, "maximum": 7, "unit": "degrees", "description": "dihedral of the wing"},
        "wing_at": {
            "minimum": 0.08,
            "maximum": 0.2,
            "unit": "",
            "description": "place of the wing before the middle, in lengths",
        },
        "tail": {"minimum": 0, "maximum": 2, "whole": True, "unit": "", "description": "0: low, 1: T, 2: V"},
        "tail_span": {"minimum": 0.16, "maximum": 0.24, "unit": "m", "description": "of the tailplane"},
        "tail_sweep": {"minimum": 0, "maximum": 15, "unit": "degrees", "description": "of tailplane and fin"},
        "fin": {"minimum": 0.07, "maximum": 0.11, "unit": "m", "description": "height of the fin from the axis"},
    }

    def parts(self, values, pose=0.0):
        length, root = values["length"], values["root"]
        parts = {"body": body(length, values["radius"], 0.3, 0.55, 0.42)}
        at = values["wing_at"] * length, 0, 0.4 * values["radius"]
        parts |= wing(
            "wing", root, max(values["taper"] * root, 0.034), values["span"], values["sweep"], 0.009, values["rise"], at
        )
        return parts | tail(values["tail"], values, -0.5 * length + 0.04, 0.065, values["fin"])
