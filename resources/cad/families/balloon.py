"""Balloons: a ball, round or long, that narrows below, and a box that hangs under it on a rod."""

import numpy as np

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import box, place, revolve


class Family(Generator):
    PARAMETERS = {
        "radius": {"minimum": 0.09, "maximum": 0.15, "unit": "m", "description": "of the ball"},
        "height": {"minimum": 0.85, "maximum": 1.3, "unit": "", "description": "of the ball, over its width"},
        "neck": {"minimum": 0.02, "maximum": 0.06, "unit": "m", "description": "height of the neck"},
        "rod": {"minimum": 0.03, "maximum": 0.1, "unit": "m", "description": "length of the rod"},
        "load_length": {"minimum": 0.05, "maximum": 0.12, "unit": "m", "description": "of the box"},
        "load_width": {"minimum": 0.04, "maximum": 0.1, "unit": "m", "description": "of the box"},
        "load_height": {"minimum": 0.04, "maximum": 0.09, "unit": "m", "description": "of the box"},
    }
    SYMMETRY = ("xz", "yz")
    MOVED = ("xz", "yz")

    def parts(self, values, pose=0.0):
        radius, tall = values["radius"], values["radius"] * values["height"]
        up = np.sin(np.linspace(-0.75, np.pi / 2, 17))
        bottom = tall * up[0] - values["neck"]
        profile = [(bottom, 0.02), *[(tall * s, radius * np.sqrt(1 - s * s)) for s in up[:-1]], (tall, 0.0)]
        hangs = bottom - values["rod"]
        shift = -(tall + hangs - values["load_height"]) / 2  # the whole about the origin
        length, width = values["load_length"] / 2, values["load_width"] / 2
        parts = {
            "ball": revolve(profile, 48),
            "rod": box((hangs - 0.01, -0.009, -0.009), (bottom + 0.05, 0.009, 0.009)),
            "load": box((hangs - values["load_height"], -width, -length), (hangs, width, length)),
        }
        return {name: place(part, rotate=(0, -90, 0), move=(0, 0, shift)) for name, part in parts.items()}
