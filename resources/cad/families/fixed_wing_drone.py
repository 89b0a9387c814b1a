"""Drones with a wing and a propeller on the nose or behind."""

from _wings import screw, tail, wing

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import body, place, revolve


class Family(Generator):
    PARAMETERS = {
        "length": {"minimum": 0.3, "maximum": 0.8, "unit": "m", "description": "of the body"},
        "radius": {"minimum": 0.028, "maximum": 0.05, "unit": "m", "description": "of the body"},
        "nose": {"minimum": 0.15, "maximum": 0.35, "unit": "", "description": "share of the body's length"},
        "span": {"minimum": 0.4, "maximum": 1.0, "unit": "m", "description": "of the wing"},
        "root": {"minimum": 0.08, "maximum": 0.15, "unit": "m", "description": "chord of the wing in the middle"},
        "taper": {"minimum": 0.5, "maximum": 1, "unit": "", "description": "of the wing's chords"},
        "sweep": {"minimum": -2, "maximum": 14, "unit": "degrees", "description": "of the wing's leading edge"},
        "rise": {"minimum": 0, "maximum": 6, "unit": "degrees", "description": "dihedral of the wing"},
        "wing_at": {
            "minimum": 0.0,
            "maximum": 0.14,
            "unit": "",
            "description": "place of the wing before the middle, in lengths",
        },
        "high": {"minimum": 0, "maximum": 1, "unit": "", "description": "1: the wing on the back, 0: in the middle"},
        "tail": {
            "minimum": 0,
            "maximum": 3,
            "whole": True,
            "unit": "",
            "description": "0: low, 1: T, 2: V, 3: V downwards",
        },
        "tail_span": {"minimum": 0.16, "maximum": 0.34, "unit": "m", "description": "of the tailplane"},
        "tail_sweep": {"minimum": 0, "maximum": 25, "unit": "degrees", "description": "of tailplane and fin"},
        "fin": {"minimum": 0.07, "maximum": 0.14, "unit": "m", "description": "height of the fin"},
        "propeller": {"minimum": 0.07, "maximum": 0.12, "unit": "m", "description": "radius of the propeller"},
        "pusher": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: the propeller is behind"},
    }
    MOVED = ()

    def parts(self, values, pose=0.0):
        length, radius, root = values["length"], values["radius"], values["root"]
        parts = {"body": body(length, radius, values["nose"], 0.35, 0.5)}
        up = 0.6 * radius * values["high"]
        at = values["wing_at"] * length, 0, up
        parts |= wing("wing", root, values["taper"] * root, values["span"], values["sweep"], 0.011, values["rise"], at)
        parts |= tail(values["tail"], values, -0.5 * length + 0.045, 0.075, values["fin"])
        # The hub reaches into the body, which ends with half its radius behind and in a point in front.
        end = -length / 2 - 0.018 if values["pusher"] else length / 2 - 0.01
        hub = place(revolve([(-0.02, 0.014), (0.02, 0.014)], 16), move=(end, 0, 0))
        return parts | {"hub": hub} | screw(values["propeller"], end, pose)
