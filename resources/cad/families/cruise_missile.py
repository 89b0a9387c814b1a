"""Missiles with a straight or swept wing of two panels, and fins at the tail; some have an inlet."""

from _wings import fins, wing

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import body, box


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.4, "maximum": 1.0, "unit": "m", "description": "of the body"},
        "slenderness": {"minimum": 7, "maximum": 12, "unit": "", "description": "length over diameter"},
        "nose": {"minimum": 0.12, "maximum": 0.35, "unit": "", "description": "share of the length"},
        "bluntness": {
            "minimum": 0.5,
            "maximum": 0.85,
            "unit": "",
            "description": "of the nose: 0.5 an ellipse, 1 nearly a cone",
        },
        "tail": {"minimum": 0.05, "maximum": 0.2, "unit": "", "description": "share of the length that narrows"},
        "tail_radius": {"minimum": 0.6, "maximum": 0.95, "unit": "", "description": "of the body's, at the end"},
        "span": {"minimum": 0.3, "maximum": 0.6, "unit": "", "description": "of the wing, over the length"},
        "root": {"minimum": 0.08, "maximum": 0.16, "unit": "", "description": "chord of the wing over length"},
        "taper": {"minimum": 0.5, "maximum": 1, "unit": "", "description": "of the wing's chords"},
        "sweep": {"minimum": 0, "maximum": 35, "unit": "degrees", "description": "of the wing's leading edge"},
        "wing_at": {
            "minimum": -0.08,
            "maximum": 0.08,
            "unit": "",
            "description": "place of the wing before the middle, in lengths",
        },
        "inlet": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: an inlet below the body"},
        "fins": {"minimum": 2, "maximum": 4, "whole": True, "unit": "", "description": "number of tail fins"},
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
    }

    def parts(self, values, pose=0.0):
        length = values["length"]
        radius = length / values["slenderness"] / 2
        parts = {
            "body": body(length, radius, values["nose"], values["tail"], values["tail_radius"], values["bluntness"])
        }
        root, sweep = max(values["fin_root"] * length, 0.05), values["fin_sweep"]
        tip, height = values["fin_taper"] * root, max(values["fin_span"] * radius, radius + 0.03)

        chord = max(values["root"] * length, 0.05)
        parts |= wing(
            "wing",
            chord,
            max(values["taper"] * chord, 0.035),
            values["span"] * length,
            values["sweep"],
            0.009,
            0,
            (values["wing_at"] * length, 0, 0),
        )
        parts |= fins(
            "fin",
            values["fins"],
            values["rolled"] or values["fins"] == 2,
            root,
            tip,
            height,
            sweep,
            0.007,
            0.6 * root - length / 2,
        )
        if values["inlet"]:
            parts["inlet"] = box(
                (-0.3 * length, -0.5 * radius, -1.45 * radius), (-0.08 * length, 0.5 * radius, -0.5 * radius)
            )
        return parts
