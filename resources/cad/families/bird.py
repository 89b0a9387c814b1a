"""Birds: a body with a head, wings of an inner and an outer part, and a fanned tail."""

import numpy as np

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import blade, ellipse, pair, panel, place, revolve


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.2, "maximum": 0.36, "unit": "m", "description": "of the body"},
        "radius": {"minimum": 0.034, "maximum": 0.05, "unit": "m", "description": "of the body"},
        "span": {"minimum": 0.35, "maximum": 0.95, "unit": "m", "description": "of the wings, when they are level"},
        "root": {"minimum": 0.09, "maximum": 0.16, "unit": "m", "description": "chord of the wing at the body"},
        "tip": {"minimum": 0.4, "maximum": 0.65, "unit": "", "description": "chord of the tip over that of the root"},
        "sweep": {"minimum": 5, "maximum": 30, "unit": "degrees", "description": "of the outer part"},
        "rise": {"minimum": -5, "maximum": 30, "unit": "degrees", "description": "of the inner part, at rest"},
        "droop": {
            "minimum": 0,
            "maximum": 30,
            "unit": "degrees",
            "description": "of the outer part below the inner one",
        },
        "tail": {"minimum": 0.1, "maximum": 0.18, "unit": "m", "description": "length of the tail"},
        "fan": {"minimum": 0.06, "maximum": 0.14, "unit": "m", "description": "width of the tail's end"},
        "beat": {"minimum": 15, "maximum": 35, "unit": "degrees", "description": "by which the wings rise and fall"},
    }

    def parts(self, values, pose=0.0):
        length, radius, root = values["length"], values["radius"], values["root"]
        back = [(-x, r) for x, r in ellipse(0.0, 0.58 * length, radius, 9, 0.8)][::-1]
        parts = {"body": revolve(back + ellipse(0.08 * length, 0.42 * length, radius, 9), 32)}
        size = 0.6 * radius
        head = (
            [(-x, r) for x, r in ellipse(0.0, size, size, 7)][::-1]
            + ellipse(0.0, size, size, 7)[:-1]
            + [(2.4 * size, 0)]
        )
        parts["head"] = place(revolve(head, 24), move=(0.4 * length, 0, 0.4 * radius))
        near, far = -0.3 * length, -0.3 * length - values["tail"]
        wide = 0.5 * values["fan"]
        parts["tail"] = blade([(near, -0.025), (near, 0.025), (far, wide), (far, -wide)], 0.009, 0.012)
        beat = np.sin(2 * np.pi * pose) * values["beat"]
        rise, half = values["rise"] + beat, values["span"] / 4
        joint = 0.9 * root
        inner = place(panel(root, joint, half + 0.01, 2, 0.012), rotate=(rise, 0, 0), move=(0.05 * length, 0, 0))
        outer = panel(joint, max(values["tip"] * root, 0.04), half, values["sweep"], 0.011, 0.012)
        angle = np.radians(rise)
        middle = (root - joint) / 2 - half * np.tan(np.radians(2))
        end = 0.05 * length + middle, half * np.cos(angle), half * np.sin(angle)
        outer = place(outer, rotate=(rise - values["droop"] + 0.3 * beat, 0, 0), move=end)
        return parts | pair("wing", inner) | pair("hand", outer)
