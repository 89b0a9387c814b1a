"""Satellites: a box with a panel on each side, turned about its arm, some with a dish or a mast on top."""

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import bar, blade, box, pair, place, revolve


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.1, "maximum": 0.22, "unit": "m", "description": "of the box, along x"},
        "width": {"minimum": 0.1, "maximum": 0.2, "unit": "m", "description": "of the box, along y"},
        "height": {"minimum": 0.1, "maximum": 0.24, "unit": "m", "description": "of the box"},
        "panel": {"minimum": 0.12, "maximum": 0.3, "unit": "m", "description": "length of a panel, along y"},
        "panel_width": {"minimum": 0.1, "maximum": 0.2, "unit": "m", "description": "of a panel"},
        "tilt": {"minimum": -60, "maximum": 60, "unit": "degrees", "description": "of the panels"},
        "gap": {"minimum": 0.025, "maximum": 0.06, "unit": "m", "description": "between the box and a panel"},
        "top": {
            "minimum": 0,
            "maximum": 2,
            "whole": True,
            "unit": "",
            "description": "0: nothing, 1: a dish, 2: a mast on the box",
        },
        "dish": {"minimum": 0.05, "maximum": 0.09, "unit": "m", "description": "radius of the dish"},
        "mast": {"minimum": 0.06, "maximum": 0.15, "unit": "m", "description": "length of the mast"},
    }

    def parts(self, values, pose=0.0):
        x, y, z = values["length"] / 2, values["width"] / 2, values["height"] / 2
        wide, start = values["panel_width"] / 2, y + values["gap"]
        outline = [(wide, 0), (wide, values["panel"]), (-wide, values["panel"]), (-wide, 0)]
        panel = place(blade(outline, 0.01, 0.013), rotate=(0, values["tilt"] + 360 * pose, 0), move=(0, start, 0))
        parts = {"box": box((-x, -y, -z), (x, y, z))} | pair("panel", panel)
        parts |= pair("arm", bar((0, 0.5 * y, 0), (0, start + 0.03, 0), 0.026, 0.016))
        if values["top"] == 1:
            radius = min(values["dish"], 1.2 * y)
            bowl = [(0.0, 0.02), (0.02, 0.02), (0.045, radius), (0.056, radius)]
            parts["dish"] = place(revolve([(-0.03, 0.02), *bowl[1:]], 36), rotate=(0, -90, 0), move=(0, 0, z))
        elif values["top"] == 2:
            parts["mast"] = box((-0.009, -0.009, 0), (0.009, 0.009, z + values["mast"]))
        return parts
