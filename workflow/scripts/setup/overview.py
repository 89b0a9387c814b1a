"""What a config will make, in figures, said before anything runs."""

import json
from pathlib import Path

import numpy as np

from core.errors import InputError
from core.folders import of_fields
from core.sweep import C0, images_are_made
from imaging.geometry import describe, planned
from mesh import cad_kernel, topology
from mesh.read import check_size, in_metres, read_cad
from mesh.resolution import check_resolution
from report.caveats import LEARNING, warnings
from scattering import needs
from setup.config import BASE, read_yaml
from setup.disk import shortage


def overview(config, results, refuse=False):
    """Lines of text: what solves will need, what images resolve and take, and warnings of what may surprise.

    results: the folder of the run's results. With `refuse` a target that this machine has no memory for raises
    InputError; else it is one of the warnings, for another machine may solve it.
    """
    fields, sizes = of_fields(results, config), {}
    found = _taken(config, fields)
    wavelength = C0 / config["radar"]["center_frequency"]
    for name, target in config["targets"].items():
        try:
            sizes[name] = _size(target, fields / "mesh" / f"{name}.json", wavelength)
        except InputError as error:
            if refuse:
                raise InputError(f"config key 'targets.{name}.mesh': {error}") from None
            sizes[name] = None
            found.append(f"Warning: {name}: {error}")
    found += _solves(config, sizes, fields, refuse)
    return found + (_images(config, sizes, results) if images_are_made(config) else [])


def _taken(config, fields):
    """Which meshes and fields are another run's: lines of text."""
    if "from" not in config:
        return []
    there = [name for name in config["targets"] if (fields / "scattering" / f"{name}.zarr").exists()]
    missing = [name for name in config["targets"] if name not in there]
    made = f" Not there yet, and made there: {', '.join(missing)}." if missing else ""
    return [
        f"Meshes and fields are those of {fields}: {', '.join(there) or 'none so far'}.{made} "
        "One that was made with other settings or files than this config's is made anew there, too."
    ]


def _solves(config, sizes, fields, refuse):
    found, seconds = [], 0.0
    for name, target in config["targets"].items():
        if "field" in target:
            continue
        if sizes[name] is None:
            found.append(f"  {name}: not known yet.")
            continue
        bands = needs.expected(config, name, sizes[name])
        time = sum(band["seconds"] for band in bands)
        seconds += time
        most = bands[-1]
        found.append(
            f"  {name}: up to {most['unknowns']:,.0f} unknowns, {most['megabytes'] / 1000:.1f} GB, {_span(time)}"
        )
        if (fields / "scattering" / f"{name}.zarr").exists():
            continue
        try:
            needs.check_fit(config, name, sizes[name])
        except InputError as error:
            if refuse:
                raise
            found.append(f"Warning: {error}")
        try:
            label = f"config key 'targets.{name}': {target['mesh']}"
            check_resolution(sizes[name]["box"], config["mesh"], config["radar"], label)
        except InputError as error:  # its mesh job refuses it; the run may want others
            found.append(f"Warning: {error}")
    if not found:
        return []
    return ["Solves, by estimate from the CAD files' areas, on two cores:", *found, f"  in all: {_span(seconds)}"]


def _span(seconds):
    """A solve's planned time as text: machines were seen to take up to 2.5 times the plan."""
    unit, text = next((u for u in ((3600, "h"), (60, "min")) if seconds >= 2 * u[0]), (1, "s"))
    return f"{seconds / unit:,.0f} to {2.5 * seconds / unit:,.0f} {text}"


def _images(config, sizes, results):
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
    reaches = {name: size and size["reach"] for name, size in sizes.items()}
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


def _size(target, figures, wavelength):
    """Area in m^2, box and reach from the origin in m of a target's CAD file; None where nothing says them yet.

    wavelength: at the centre frequency in m. Raises InputError for a file that cannot be read, or of another size.
    """
    if "field" in target:
        return None
    if Path(target["mesh"]).suffix.lower() in cad_kernel.FORMATS:  # they take long to read
        return json.loads(figures.read_text())["source"] if figures.exists() else None
    vertices, triangles = read_cad(target["mesh"])
    vertices = in_metres(vertices, target)
    used = vertices[np.unique(triangles)]
    check_size(used, target, wavelength, target["mesh"])
    return {
        "area": float(topology.areas(vertices, triangles).sum()),
        "box": np.ptp(used, axis=0).tolist(),
        "reach": float(np.linalg.norm(used, axis=1).max()),
    }
