"""Flat plates, level or pitched: four to eight corners, some narrower behind."""

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import blade, place


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.25, "maximum": 0.7, "unit": "m", "description": "along x"},
        "width": {"minimum": 0.15, "maximum": 0.5, "unit": "m", "description": "along y, in front"},
        "taper": {"minimum": 0.4, "maximum": 1, "unit": "", "description": "width behind over width in front"},
        "cut": {
            "minimum": 0,
            "maximum": 0.3,
            "unit": "",
            "description": "share of the width that is cut off the front corners",
        },
        "thickness": {"minimum": 0.01, "maximum": 0.02, "unit": "m", "description": "of the plate"},
        "pitch": {"minimum": -60, "maximum": 60, "unit": "degrees", "description": "of its nose"},
    }

    def parts(self, values, pose=0.0):
        x, y = values["length"] / 2, values["width"] / 2
        behind, cut = y * values["taper"], (0.02 + values["cut"]) * y
        left = [(x, y - cut), (x - cut, y), (-x, behind)]
        outline = left + [(x, -y) for x, y in left[::-1]]
        return {"plate": place(blade(outline, values["thickness"], 0.012), rotate=(0, -values["pitch"], 0))}
