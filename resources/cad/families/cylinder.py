"""Cylinders and drums, lying or standing, with flat, conical or round ends."""

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import ellipse, place, revolve


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.25, "maximum": 0.6, "unit": "m", "description": "of the cylinder, without its ends"},
        "radius": {"minimum": 0.04, "maximum": 0.1, "unit": "m", "description": "of the cylinder"},
        "ends": {"minimum": 0, "maximum": 2, "whole": True, "unit": "", "description": "0: flat, 1: cones, 2: round"},
        "end": {"minimum": 0.3, "maximum": 1, "unit": "", "description": "height of an end over the radius"},
        "taper": {"minimum": 0.75, "maximum": 1, "unit": "", "description": "radius at one end over the other"},
        "pitch": {"minimum": 0, "maximum": 90, "unit": "degrees", "description": "of its axis: 90 stands"},
    }

    def parts(self, values, pose=0.0):
        half, radius, tall = values["length"] / 2, values["radius"], values["end"] * values["radius"]
        less = radius * values["taper"]
        profile = [(-half, radius), (half, less)]
        if values["ends"] == 1:
            profile = [(-half - tall, 0.0), *profile, (half + tall, 0.0)]
        elif values["ends"] == 2:
            back = [(-x, r) for x, r in ellipse(half, half + tall, radius, 10)][::-1]
            profile = back + ellipse(half, half + tall * values["taper"], less, 10)
        return {"cylinder": place(revolve(profile, 48), rotate=(0, -values["pitch"], 0))}
