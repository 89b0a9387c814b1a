"""Birds of flesh and feathers, as large as geese and swans: body and head are opaque, wings and tail are thin sheets.

The flesh of smaller ones is not opaque at 2 GHz, where a wave falls to 1 / e in 27 mm of muscle.
"""

import numpy as np

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import ellipse, pair, place, revolve, sheet


class Family(Generator):
    PARTS = {
        "flesh": {"material": {"permittivity": 52, "loss_tangent": 0.25, "surface": "leontovich"}},  # muscle at 3 GHz
        "feathers": {"material": {"name": "feather", "thickness": 0.002}},
    }
    PARAMETERS = {
        "length": {"minimum": 0.34, "maximum": 0.5, "unit": "m", "description": "of the body"},
        "radius": {"minimum": 0.068, "maximum": 0.092, "unit": "m", "description": "of the body"},
        "head": {"minimum": 0.6, "maximum": 0.72, "unit": "", "description": "radius of the head over the body's"},
        "span": {"minimum": 0.7, "maximum": 1.1, "unit": "m", "description": "of the wings, when they are level"},
        "root": {"minimum": 0.15, "maximum": 0.24, "unit": "m", "description": "chord of the wing at the body"},
        "tip": {"minimum": 0.4, "maximum": 0.65, "unit": "", "description": "chord of the tip over that of the root"},
        "sweep": {"minimum": 5, "maximum": 30, "unit": "degrees", "description": "of the outer part"},
        "rise": {"minimum": -5, "maximum": 25, "unit": "degrees", "description": "of the inner part, at rest"},
        "droop": {"minimum": 0, "maximum": 30, "unit": "degrees", "description": "of the outer part below the inner"},
        "tail": {"minimum": 0.08, "maximum": 0.16, "unit": "m", "description": "length of the tail"},
        "fan": {"minimum": 0.1, "maximum": 0.2, "unit": "m", "description": "width of the tail's end"},
        "beat": {"minimum": 15, "maximum": 35, "unit": "degrees", "description": "by which the wings rise and fall"},
    }

    def parts(self, values, pose=0.0):
        length, radius, root = values["length"], values["radius"], values["root"]
        rear = [(-x, r) for x, r in ellipse(0.0, 0.58 * length, radius, 9)][::-1]
        parts = {"flesh/body": revolve(rear + ellipse(0.08 * length, 0.42 * length, radius, 9), 32)}
        size = values["head"] * radius
        head = [(-x, r) for x, r in ellipse(0.0, size, size, 7)][::-1] + ellipse(0.0, 1.5 * size, size, 7)[1:]
        parts["flesh/head"] = place(revolve(head, 24), move=(0.4 * length, 0, 0.4 * radius))
        near, far = -0.42 * length, -0.45 * length - values["tail"]
        wide = 0.5 * values["fan"]
        parts["feathers/tail"] = sheet([(near, -0.02), (near, 0.02), (far, wide), (far, -wide)][::-1])
        beat = np.sin(2 * np.pi * pose) * values["beat"]
        rise, half = values["rise"] + beat, values["span"] / 4
        joint, tip = 0.9 * root, values["tip"] * root
        # From inside of the body to the wrist, and from there to the tip, about a hinge along x.
        inner = sheet([(0.05 * root, 0.01), (0.05 * root - root, 0.01), (-joint, half), (0, half)][::-1])
        back = -half * np.tan(np.radians(values["sweep"]))
        outer = sheet([(0, 0), (-joint, 0), (back - tip, half), (back, half)][::-1])
        angle, shoulder = np.radians(rise), 0.55 * root
        parts |= pair("feathers/wing", place(inner, rotate=(rise, 0, 0), move=(shoulder, 0, 0.2 * radius)))
        wrist = shoulder, half * np.cos(angle), half * np.sin(angle) + 0.2 * radius
        return parts | pair(
            "feathers/hand", place(outer, rotate=(rise - values["droop"] + 0.3 * beat, 0, 0), move=wrist)
        )
