"""A fitted model's folder, models/<run>/<model>/: its description, the sides of its views, its arrays."""

import json
from pathlib import Path

from isarflow.learning.classifier import build

CONFIG, SPLIT = "config.json", "split.json"


def config_of(folder):
    """Read config.json: run (as of `experiments.runs`), model (its name in the config), kind, settings ..."""
    return json.loads((Path(folder) / CONFIG).read_text())


def load(folder):
    """Load the fitted model."""
    config = config_of(folder)
    return build(config["kind"], config["settings"], config["seed"]).load(Path(folder))


def write_json(path, content):
    """Write CONFIG or SPLIT."""
    path.write_text(json.dumps(content, indent=1) + "\n")
