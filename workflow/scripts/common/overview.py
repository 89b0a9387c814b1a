"""What a config will make, in figures, said before anything runs."""

import json
from pathlib import Path

import numpy as np

from common.config import BASE, read_yaml
from common.errors import InputError
from common.room import shortage
from imaging.geometry import describe, planned
from mesh import cad_kernel
from mesh.read import in_metres, read_cad
from report.caveats import LEARNING, warnings


def overview(config, results):
    """Lines of text: what images of the config's sweep resolve and take, and warnings of what may surprise.

    results: the folder of the run's results.
    """
    targets = config["targets"]
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
    reaches = {name: _reach(target, Path(results, "mesh", f"{name}.json")) for name, target in targets.items()}
    for name, reach in reaches.items():
        if reach is None:
            found.append(f"  {name}: whether it fits the unambiguous extent is not known yet.")
    found += [f"Warning: {text if name == LEARNING else f'{name}: {text}'}" for name, text in warnings(config, reaches)]
    return found + [f"Warning: {text}" for text in _untrained(config["learning"])]


def _untrained(learning):
    """Models of one's own that no experiment names: lines of text."""
    named = {model for experiment in learning["experiments"].values() for model in experiment["models"]}
    kinds = {learning["models"][model].get("kind", model) for model in named}
    defaults = read_yaml(BASE)["learning"]["models"].keys()
    for name in sorted(learning["models"].keys() - defaults - named - kinds) if named else ():
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
