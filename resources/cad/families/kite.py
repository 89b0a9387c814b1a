"""Kites: a sail of four corners that is bent along the middle, spars, a keel, and some with a tail of bows."""

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import bar, blade, pair, place


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.35, "maximum": 0.75, "unit": "m", "description": "of the sail"},
        "span": {"minimum": 0.3, "maximum": 0.75, "unit": "m", "description": "of the sail"},
        "widest": {
            "minimum": 0.25,
            "maximum": 0.45,
            "unit": "",
            "description": "share of the length before the widest place",
        },
        "bend": {"minimum": 4, "maximum": 22, "unit": "degrees", "description": "of each half of the sail, upwards"},
        "pitch": {"minimum": 0, "maximum": 50, "unit": "degrees", "description": "of its nose, upwards"},
        "keel": {"minimum": 0.03, "maximum": 0.09, "unit": "m", "description": "depth of the keel"},
        "bows": {"minimum": 0, "maximum": 3, "whole": True, "unit": "", "description": "number of bows of the tail"},
        "bow": {"minimum": 0.06, "maximum": 0.1, "unit": "m", "description": "width of a bow"},
    }

    def parts(self, values, pose=0.0):
        x, y = values["length"] / 2, values["span"] / 2
        wide = x - values["widest"] * values["length"]
        # Each half reaches over the middle, where a spar covers both.
        outline = [(x, 0.012), (wide, y), (-x, 0.012), (-x, -0.008), (x, -0.008)]
        parts = pair("sail", place(blade(outline, 0.008, 0.006), rotate=(values["bend"], 0, 0)))
        parts["spar"] = bar((x + 0.02, 0, 0), (-x - 0.02, 0, 0), 0.024, 0.022)
        deep = -values["keel"]
        parts["keel"] = place(
            blade([(0.5 * x, 0.0), (0.2 * x, deep), (-0.2 * x, deep), (-0.4 * x, 0.0)], 0.009, 0.009), rotate=(90, 0, 0)
        )
        step = 0.055
        if values["bows"]:
            parts["line"] = bar((-x, 0, 0), (-x - 0.03 - step * values["bows"], 0, 0), 0.015, 0.014)
        for number in range(values["bows"]):
            at = -x - 0.03 - step * (number + 0.5)
            parts[f"bow_{number}"] = bar((at, -values["bow"] / 2, 0), (at, values["bow"] / 2, 0), 0.02, 0.018)
        return {name: place(part, rotate=(0, -values["pitch"], 0)) for name, part in parts.items()}
