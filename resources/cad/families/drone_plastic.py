"""Drones with four rotors and a hollow shell of plastic: its walls and blades are sheets, what lies in it is metal."""

import numpy as np
from _multirotor import deck, stand

from isarflow.mesh.families import Generator
from isarflow.mesh.shapes import bar, box, pair, place, revolve, sheet

UP = np.array([0.0, 0.0, 1.0])


class Family(Generator):
    PARTS = {
        "shell": {"material": {"name": "abs", "thickness": 0.0015}},
        "blades": {"material": {"name": "polyamide", "thickness": 0.002}},
        "metal": {},
    }
    REPEATS = "blades"
    PARAMETERS = {
        "reach": {"minimum": 0.15, "maximum": 0.28, "unit": "m", "description": "from the middle to a motor"},
        "front": {"minimum": 36, "maximum": 54, "unit": "degrees", "description": "of the first motor, from the nose"},
        "rotor": {
            "minimum": 0.6,
            "maximum": 0.92,
            "unit": "",
            "description": "a propeller's radius over half of the least way between motors",
        },
        "blades": {"minimum": 2, "maximum": 3, "whole": True, "unit": "", "description": "of a propeller"},
        "twist": {"minimum": 8, "maximum": 20, "unit": "degrees", "description": "of a blade"},
        "turn": {"minimum": 0, "maximum": 180, "unit": "degrees", "description": "of the first propeller"},
        "rise": {"minimum": -0.01, "maximum": 0.03, "unit": "m", "description": "of motors above the body's middle"},
        "arm": {"minimum": 0.02, "maximum": 0.028, "unit": "m", "description": "width of an arm, a tube"},
        "body_length": {"minimum": 0.14, "maximum": 0.22, "unit": "m", "description": "of the body"},
        "body_width": {"minimum": 0.1, "maximum": 0.15, "unit": "m", "description": "of the body"},
        "body_height": {"minimum": 0.05, "maximum": 0.08, "unit": "m", "description": "of the body"},
        "battery": {"minimum": 0.45, "maximum": 0.6, "unit": "", "description": "its extents over the body's"},
        "camera": {"minimum": 0.02, "maximum": 0.04, "unit": "m", "description": "edge of the camera below the nose"},
        "wire": {"minimum": 0.004, "maximum": 0.006, "unit": "m", "description": "width of the wires in an arm"},
        "stand": {"minimum": 0, "maximum": 2, "whole": True, "unit": "", "description": "0: none, 1: skids, 2: legs"},
        "stand_height": {"minimum": 0.05, "maximum": 0.12, "unit": "m", "description": "below the body"},
    }

    def parts(self, values, pose=0.0):
        length, width, height = (values[f"body_{name}"] for name in ("length", "width", "height"))
        parts = {"shell/body": deck(length, width, height)}
        half = 0.5 * values["battery"] * np.array([length, width, height])
        parts["metal/battery"] = box(-half, half)
        edge, nose = values["camera"], 0.3 * length
        parts["metal/camera"] = box(
            (nose - edge / 2, -edge / 2, -0.4 * height - edge), (nose + edge / 2, edge / 2, -0.4 * height)
        )
        for number, angle in enumerate(np.radians([values["front"], 180 - values["front"]])):
            middle = np.array([np.cos(angle) * values["reach"], np.sin(angle) * values["reach"], values["rise"]])
            start = middle * [1, 1, 0] * 0.8 * half.min() / values["reach"]  # in the battery
            parts |= pair(f"shell/arm_{number}", bar(start, middle, values["arm"], 0.8 * values["arm"]))
            parts |= pair(f"metal/wire_{number}", _strip(start, middle, values["wire"]))
            parts |= self._rotor(number, angle, middle, values, pose)
        return parts | {f"shell/{name}": part for name, part in stand(values, length, width, height).items()}

    def _rotor(self, number, angle, middle, values, pose):
        """A motor that stands on the arm's end, and its blades."""
        apart = min(np.sin(np.radians(values["front"])), np.cos(np.radians(values["front"]))) * values["reach"]
        radius = values["rotor"] * apart
        hub, level = max(0.13 * radius, 0.014), 0.022
        motor = place(revolve([(-0.014, hub), (level + 0.008, hub)], 16), rotate=(0, -90, 0), move=middle)
        made = pair(f"metal/motor_{number}", motor)
        chord = max(0.3 * radius, 0.022)
        outline = np.array([(0, -0.36), (0.33, -0.54), (0.76, -0.5), (1, -0.3), (1, 0.3), (0.33, 0.46), (0, 0.36)])
        for blade in range(int(values["blades"])):
            turn = values["turn"] + 137.5 * number + 360 * (pose + blade / values["blades"])
            flat = sheet(outline * [radius, chord])
            turned = place(flat, rotate=(values["twist"], 0, turn), move=middle + level * UP)
            made |= pair(f"blades/{'abc'[blade]}_{number}", turned)
        return made


def _strip(start, stop, width):
    """A flat strip, horizontally across, from start to stop."""
    across = np.cross(UP, stop - start)
    across *= width / 2 / np.linalg.norm(across)
    return np.array([start - across, stop - across, stop + across, start + across]), np.array([(0, 1, 2), (0, 2, 3)])
