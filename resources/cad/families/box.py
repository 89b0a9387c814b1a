"""Boxes of three sides, some with a lid that stands out."""

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import box


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.25, "maximum": 0.45, "unit": "m", "description": "along x"},
        "width": {"minimum": 0.12, "maximum": 0.3, "unit": "m", "description": "along y"},
        "height": {"minimum": 0.08, "maximum": 0.26, "unit": "m", "description": "along z"},
        "lid": {
            "minimum": 0,
            "maximum": 1,
            "whole": True,
            "unit": "",
            "description": "1: with a lid that stands out all round",
        },
        "lid_height": {"minimum": 0.02, "maximum": 0.04, "unit": "m", "description": "of the lid"},
        "lid_over": {"minimum": 0.01, "maximum": 0.03, "unit": "m", "description": "by which the lid stands out"},
    }
    SYMMETRY = ("xz", "yz")
    MOVED = ("xz", "yz")

    def parts(self, values, pose=0.0):
        x, y, z = values["length"] / 2, values["width"] / 2, values["height"] / 2
        parts = {"box": box((-x, -y, -z), (x, y, z))}
        if values["lid"]:
            over, thick = values["lid_over"], values["lid_height"]
            parts["lid"] = box((-x - over, -y - over, z - 0.005), (x + over, y + over, z - 0.005 + thick))
        return parts
