"""Flying saucers: two shallow bowls with a sharp rim, a dome, and some with legs."""

import numpy as np

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import bar, pair, place, revolve


class Family(Generator):
    PARAMETERS = {
        "radius": {"minimum": 0.14, "maximum": 0.26, "unit": "m", "description": "of the rim"},
        "above": {"minimum": 0.03, "maximum": 0.06, "unit": "m", "description": "height of the upper bowl"},
        "below": {"minimum": 0.03, "maximum": 0.06, "unit": "m", "description": "depth of the lower bowl"},
        "round": {"minimum": 1.6, "maximum": 2.6, "unit": "", "description": "exponent of the bowls: 1 is a cone"},
        "dome": {
            "minimum": 0.35,
            "maximum": 0.55,
            "unit": "",
            "description": "radius of the dome over that of the rim",
        },
        "dome_height": {"minimum": 0.5, "maximum": 1.0, "unit": "", "description": "of the dome, over its radius"},
        "legs": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: on four legs"},
        "leg": {"minimum": 0.05, "maximum": 0.1, "unit": "m", "description": "height of the legs below the lower bowl"},
    }
    SYMMETRY = ("xz", "yz")
    MOVED = ("xz", "yz")

    def parts(self, values, pose=0.0):
        radius, dome = values["radius"], values["dome"] * values["radius"]
        low, high, power = values["below"], values["above"], values["round"]
        share = np.linspace(0, 1, 9)[1:-1]
        flat = 0.25 * radius
        profile = [(-low, flat), *[(-low * (1 - t**power), flat + (radius - flat) * t) for t in share], (0.0, radius)]
        profile += [(high * (1 - t**power), dome + (radius - dome) * t) for t in share[::-1]]
        tall = values["dome_height"] * dome
        angles = np.linspace(0, np.pi / 2, 9)[:-1]
        profile += [(high + tall * np.sin(a), dome * np.cos(a)) for a in angles] + [(high + tall, 0.0)]
        parts = {"hull": place(revolve(profile, 64), rotate=(0, -90, 0))}
        if values["legs"]:
            for name, side in (("front", 1), ("rear", -1)):
                # Steep, so that they do not graze the bowl.
                start, stop = 0.4 * radius, 0.55 * radius
                leg = bar((side * start, start, 0), (side * stop, stop, -low - values["leg"]), 0.017, 0.017)
                parts |= pair(f"leg_{name}", leg)
        return parts
