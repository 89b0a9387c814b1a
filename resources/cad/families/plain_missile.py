"""Rockets without wings: a body and three to six fins at the tail; some have small fins behind the nose."""

from _wings import fins

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import body


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.3, "maximum": 1.0, "unit": "m", "description": "of the body"},
        "slenderness": {"minimum": 8, "maximum": 14, "unit": "", "description": "length over diameter"},
        "nose": {"minimum": 0.12, "maximum": 0.35, "unit": "", "description": "share of the length"},
        "bluntness": {
            "minimum": 0.5,
            "maximum": 0.85,
            "unit": "",
            "description": "of the nose: 0.5 an ellipse, 1 nearly a cone",
        },
        "tail": {"minimum": 0.05, "maximum": 0.2, "unit": "", "description": "share of the length that narrows"},
        "tail_radius": {"minimum": 0.6, "maximum": 0.95, "unit": "", "description": "of the body's, at the end"},
        "fins": {"minimum": 3, "maximum": 6, "whole": True, "unit": "", "description": "number of tail fins"},
        "rolled": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: no fin points upwards"},
        "fin_span": {
            "minimum": 2.2,
            "maximum": 3.4,
            "unit": "",
            "description": "from the axis to a fin's tip, in radii of the body",
        },
        "fin_root": {"minimum": 0.09, "maximum": 0.15, "unit": "", "description": "chord over length"},
        "fin_taper": {"minimum": 0.45, "maximum": 0.9, "unit": "", "description": "tip chord over root chord"},
        "fin_sweep": {"minimum": 10, "maximum": 40, "unit": "degrees", "description": "of the leading edge"},
        "canards": {
            "minimum": 0,
            "maximum": 1,
            "whole": True,
            "unit": "",
            "description": "1: four small fins behind the nose",
        },
    }

    def parts(self, values, pose=0.0):
        length = values["length"]
        radius = length / values["slenderness"] / 2
        parts = {
            "body": body(length, radius, values["nose"], values["tail"], values["tail_radius"], values["bluntness"])
        }
        root, sweep = max(values["fin_root"] * length, 0.05), values["fin_sweep"]
        tip, height = values["fin_taper"] * root, max(values["fin_span"] * radius, radius + 0.03)

        parts |= fins("fin", values["fins"], values["rolled"], root, tip, height, sweep, 0.007, 0.6 * root - length / 2)
        if values["canards"]:
            at = length / 2 - (values["nose"] + 0.06) * length
            parts |= fins("canard", 4, 1, 0.05, 0.03, radius + 0.035, 20, 0.007, at)
        return parts
