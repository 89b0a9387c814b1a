"""A fitted model's folder, models/<run>/<model>/: what the model is, how its azimuths were divided, what it learned."""

import json
from pathlib import Path

from isarflow.learning.classifier import build
from isarflow.learning.split import Division

CONFIG, SPLIT = "config.json", "split.json"


def config_of(folder):
    """What config.json says: run (as of `experiments.runs`), model (its name in the config), kind, settings ..."""
    return json.loads((Path(folder) / CONFIG).read_text())


def division_of(folder):
    """How the model's azimuths were divided: a `Division`."""
    return Division(**json.loads((Path(folder) / SPLIT).read_text())["division"])


def load(folder):
    """The fitted model."""
    config = config_of(folder)
    return build(config["kind"], config["settings"], config["seed"]).load(Path(folder))


def write_json(path, content):
    """Write CONFIG or SPLIT."""
    path.write_text(json.dumps(content, indent=1) + "\n")
