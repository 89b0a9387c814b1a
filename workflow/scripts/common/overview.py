"""What a config will make, in figures, said before anything runs."""

import json
from pathlib import Path

import numpy as np

from common import radar as sweep
from common.errors import InputError
from imaging.geometry import describe, geometry, warnings
from mesh import cad_kernel
from mesh.read import in_metres, read_cad


def overview(config, results):
    """Lines of text: what images of the config's sweep resolve and take, and warnings for targets that are too long.

    results: the folder of the run's results.
    """
    imaging, targets = config["imaging"], config["targets"]
    figures = geometry(
        sweep.frequencies(config["radar"]),
        sweep.elevations(config["aspect"]),
        sweep.azimuths(config["aspect"]),
        imaging,
    )
    copies = config["noise"]["realizations"]
    stores = 1 + copies * len(config["noise"]["snr_db"])
    found = [
        "Images of every target:",
        *(f"  {line}" for line in describe(figures)),
        f"  stores: {figures['bytes'] / 1e6:.3g} MB without noise, {copies * figures['bytes'] / 1e6:.3g} MB at each"
        f" SNR; at most {len(targets) * stores * figures['bytes'] / 1e9:.3g} GB in all",
    ]
    for name, target in targets.items():
        length = _length(target, Path(results, "mesh", f"{name}.json"))
        found += [f"Warning: {name}: {text}" for text in warnings(figures, imaging, length)]
    return found


def _length(target, figures):
    """The target's largest dimension in m, 0 where it is not known before its mesh is made."""
    if figures.exists():
        return max(json.loads(figures.read_text())["source"]["box"])
    if "field" in target or Path(target["mesh"]).suffix.lower() in cad_kernel.FORMATS:  # the latter takes long to read
        return 0.0
    try:
        vertices, triangles = read_cad(target["mesh"])
    except InputError:  # its own job says so
        return 0.0
    return float(np.ptp(in_metres(vertices[np.unique(triangles)], target), axis=0).max())
