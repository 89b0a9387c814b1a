"""Aeroplanes with a pod, two booms that hold the tail, and a propeller behind the pod."""

import numpy as np
from _wings import fin, screw, wing

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import bar, body, pair, place


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.45, "maximum": 0.85, "unit": "m", "description": "from the pod's nose to the tail"},
        "pod": {"minimum": 0.4, "maximum": 0.55, "unit": "", "description": "length of the pod over the length"},
        "radius": {"minimum": 0.036, "maximum": 0.055, "unit": "m", "description": "of the pod"},
        "span": {"minimum": 0.5, "maximum": 1.0, "unit": "m", "description": "of the wing"},
        "root": {"minimum": 0.09, "maximum": 0.14, "unit": "m", "description": "chord of the wing in the middle"},
        "taper": {"minimum": 0.5, "maximum": 0.95, "unit": "", "description": "of the wing's chords"},
        "sweep": {"minimum": -2, "maximum": 12, "unit": "degrees", "description": "of the wing's leading edge"},
        "booms": {"minimum": 0.1, "maximum": 0.15, "unit": "m", "description": "from the middle to a boom"},
        "boom": {"minimum": 0.02, "maximum": 0.026, "unit": "m", "description": "width of a boom"},
        "fin": {"minimum": 0.08, "maximum": 0.13, "unit": "m", "description": "height of the fins"},
        "raised": {
            "minimum": 0,
            "maximum": 1,
            "whole": True,
            "unit": "",
            "description": "1: the tailplane on top of the fins",
        },
        "propeller": {"minimum": 0.07, "maximum": 0.085, "unit": "m", "description": "radius of the propeller"},
    }
    MOVED = ()

    def parts(self, values, pose=0.0):
        length, y, root = values["length"], values["booms"], values["root"]
        pod = values["pod"] * length
        middle = length / 2 - pod / 2
        vertices, triangles = body(pod, values["radius"], 0.4, 0.25, 0.5)
        parts = {"pod": place((vertices, triangles), move=(middle, 0, 0))}
        at = middle - 0.05 * pod
        parts |= wing("wing", root, values["taper"] * root, values["span"], values["sweep"], 0.011, 0, (at, 0, 0.01))
        parts |= pair("boom", bar((at + 0.2 * root, y, 0.01), (-length / 2, y, 0.01), values["boom"], values["boom"]))
        aft = -length / 2 + 0.045
        parts |= pair("fin", fin(0.08, 0.055, values["fin"], 15, 0.008, (aft, y, 0.01), 0, 0.0))
        up = 0.01 + (0.85 * values["fin"] if values["raised"] else 0.0)
        back = aft - (up - 0.01) * np.tan(np.radians(15))
        parts |= wing("tail", 0.055, 0.055, 2 * y, 0, 0.007, 0, (back, 0, up))
        return parts | screw(values["propeller"], length / 2 - pod + 0.004, pose)
