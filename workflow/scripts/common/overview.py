"""What a config will make, in figures, said before anything runs."""

import json
from pathlib import Path

import numpy as np

from common.config import BASE, read_yaml
from common.errors import InputError
from common.room import shortage
from imaging.geometry import describe, planned, warnings
from mesh import cad_kernel
from mesh.read import in_metres, read_cad


def overview(config, results):
    """Lines of text: what images of the config's sweep resolve and take, and warnings of what may surprise.

    results: the folder of the run's results.
    """
    imaging, targets = config["imaging"], config["targets"]
    figures = planned(config)
    copies = config["noise"]["realizations"]
    most = figures["bytes"] * len(targets) * (1 + copies * len(config["noise"]["snr_db"]))
    found = [
        "Images of every target:",
        *(f"  {line}" for line in describe(figures)),
        f"  stores: {figures['bytes'] / 1e6:.3g} MB without noise, {copies * figures['bytes'] / 1e6:.3g} MB at each"
        f" SNR; at most {most / 1e9:.3g} GB in all",
        *shortage(results, most),
    ]
    for name, target in targets.items():
        reach = _reach(target, Path(results, "mesh", f"{name}.json"))
        if reach is None:
            found.append(f"  {name}: whether it fits the unambiguous extent is not known yet.")
        found += [f"Warning: {name}: {text}" for text in warnings(figures, imaging, reach or 0.0)]
    return found + [f"Warning: {text}" for text in _unused(config)]


def _unused(config):
    """What of the learning stage a config asks for and does not get, or has and does not use: lines of text."""
    learning, experiments = config["learning"], config["learning"]["experiments"]
    for name, reason in learning.get("left_out", {}).items():
        yield f"the default experiment '{name}' is left out. {reason}"
    with_role = {
        role: [name for name, target in config["targets"].items() if target["role"] == role]
        for role in ("unknown", "other")
    }
    opened = [name for name, experiment in experiments.items() if experiment.get("open", False)]
    for name in () if with_role["unknown"] else opened:
        yield f"experiment '{name}' is open, but no target has role unknown: it is a closed one."
    if not experiments:
        return
    named = {model for experiment in experiments.values() for model in experiment["models"]}
    learners = sorted(model for model in named if learning["models"][model].get("other", False))
    if with_role["unknown"] and not opened:
        names = ", ".join(with_role["unknown"])
        yield f"no experiment has 'open: true': nothing is tested on the targets of role unknown ({names})."
    if with_role["other"] and not learners and not (opened and with_role["unknown"]):
        names = ", ".join(with_role["other"])
        yield f"no experiment is open and none of their models has 'other: true': role other ({names}) is not used."
    if learners and not with_role["other"]:
        yield f"no target has role other: {', '.join(learners)} learns the class 'other' from pure noise alone."
    kinds = {learning["models"][model].get("kind", model) for model in named}
    for name in sorted(learning["models"].keys() - read_yaml(BASE)["learning"]["models"].keys() - named - kinds):
        yield f"the model '{name}' of 'learning.models' is named in no experiment: it is not trained."


def _reach(target, figures):
    """The largest distance of a point of the target from the origin in m; None where nothing says it yet."""
    if "field" in target:
        return None
    if Path(target["mesh"]).suffix.lower() in cad_kernel.FORMATS:  # they take long to read
        return json.loads(figures.read_text())["source"]["reach"] if figures.exists() else None
    try:
        vertices, triangles = read_cad(target["mesh"])
    except InputError:  # its own job says so
        return None
    return float(np.linalg.norm(in_metres(vertices[np.unique(triangles)], target), axis=1).max())
