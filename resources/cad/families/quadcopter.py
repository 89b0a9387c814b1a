"""Drones with four rotors."""

from _multirotor import multirotor

from isarflow.mesh.families import Generator


class Family(Generator):
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
        "rise": {
            "minimum": -0.01,
            "maximum": 0.03,
            "unit": "m",
            "description": "of the motors above the body's middle",
        },
        "arm": {"minimum": 0.018, "maximum": 0.028, "unit": "m", "description": "width of an arm"},
        "body_length": {"minimum": 0.12, "maximum": 0.2, "unit": "m", "description": "of the body"},
        "body_width": {"minimum": 0.08, "maximum": 0.14, "unit": "m", "description": "of the body"},
        "body_height": {"minimum": 0.04, "maximum": 0.07, "unit": "m", "description": "of the body"},
        "load": {"minimum": 0.015, "maximum": 0.05, "unit": "m", "description": "height of a battery or camera"},
        "load_above": {"minimum": 0, "maximum": 1, "whole": True, "unit": "", "description": "1: above the body"},
        "stand": {"minimum": 0, "maximum": 2, "whole": True, "unit": "", "description": "0: none, 1: skids, 2: legs"},
        "stand_height": {"minimum": 0.05, "maximum": 0.12, "unit": "m", "description": "below the body"},
    }

    def parts(self, values, pose=0.0):
        front = values["front"]
        return multirotor([front, 180 - front], values, pose)
