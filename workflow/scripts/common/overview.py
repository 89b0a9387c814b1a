"""What a config will make, in figures, said before anything runs."""

import json
from pathlib import Path

import numpy as np

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
    learning, roles = config["learning"], {target["role"] for target in targets.values()}
    for name, reason in learning.get("left_out", {}).items():
        found.append(f"Warning: the default experiment '{name}' is left out. {reason}")
    for name, experiment in learning["experiments"].items():
        if experiment.get("open", False) and "unknown" not in roles:
            found.append(f"Warning: experiment '{name}' is open, but no target has role unknown: it is a closed one.")
    return found


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
