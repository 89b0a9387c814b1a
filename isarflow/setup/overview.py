"""State in numbers, before anything runs, what a config will make."""

import json
import re

import numpy as np

from isarflow.core.errors import InputError, refusal
from isarflow.core.folders import of_fields
from isarflow.core.sweep import images_are_made, why_no_images
from isarflow.imaging.geometry import describe, planned
from isarflow.learning.caveats import LEARNING, warnings
from isarflow.learning.experiments import imaged
from isarflow.mesh import families, measures, symmetry, topology
from isarflow.mesh.ground import from_mirror_image
from isarflow.mesh.read import halves
from isarflow.mesh.read.target import cad_of, check_size, files_of, in_metres, in_plane, read_target, states_unit
from isarflow.mesh.resolution import check_resolution
from isarflow.scattering import needs
from isarflow.scattering.fields import field_files
from isarflow.scattering.materials import equation
from isarflow.setup.config import BASE, read_yaml
from isarflow.setup.disk import shortage

NAMED = 5  # targets in a line about many
LOOKED_AT = 200_000  # triangles: a target of more is left to its jobs, as its repair may take minutes


def overview(config, results, refuse=False, seeds=1):
    """Lines of text: the needs of solves, the resolution and size of images, and warnings of what may surprise.

    results: the folder of the run's results. With `refuse` a target that this machine has no memory for, or whose solve
    is beyond its precision, raises InputError; else that is a warning, as another machine may solve it, or the run may
    want other targets. seeds: how many there are.
    """
    fields, sizes, lines = of_fields(results, config), {}, []
    if "from" in config:
        lines.append(_taken(config["targets"], fields))
    for name, target in config["targets"].items():
        try:
            sizes[name] = _size(config, name, fields / "mesh" / f"{name}.json")
            lines += [f"Warning: {name}: {sentence}" for sentence in (sizes[name] or {}).get("halves", ())]
            if field_files.is_store(target.get("field")):
                from isarflow.scattering.fields.given_store import check_polarizations  # xarray takes a second

                check_polarizations(target["field"], config["radar"]["polarizations"])
        except InputError as error:
            if refuse:
                key = next(key for key in ("mesh", "parts", "field", "family") if key in target)
                raise InputError(f"config key 'targets.{name}.{key}': {error}") from None
            sizes[name] = None
            lines.append(f"Warning: {name}: {error}")
    lines += _solves(config, sizes, fields, refuse)
    if images_are_made(config):
        lines += _images(config, results, seeds)
        reaches = {name: size and size["reach"] for name, size in sizes.items()}
        unknown = [name for name, reach in reaches.items() if reach is None]
        if unknown:
            named = ", ".join(unknown[:NAMED]) + (f" and {len(unknown) - NAMED} more" if len(unknown) > NAMED else "")
            lines.append(f"  whether targets fit the unambiguous extent is not known yet of {named}.")
        for name, text in warnings(config, reaches):
            lines.append(f"Warning: {text if name == LEARNING else f'{name}: {text}'}")
        lines += _untrained(config["learning"])
    else:
        lines.append(f"No images, scattering alone: {why_no_images(config)}")
    return lines


def _taken(targets, fields):
    """Name the meshes and fields that are taken from another run."""
    there = [name for name in targets if (fields / "scattering" / f"{name}.zarr").exists()]
    missing = [name for name in targets if name not in there]
    made = f" Not there yet, and made there: {', '.join(missing)}." if missing else ""
    anew = "One that was made with other settings or files than this config's is made anew there, too."
    return f"Meshes and fields are those of {fields}: {', '.join(there) or 'none so far'}.{made} {anew}"


def _solves(config, sizes, fields, refuse):
    planned, warned = {}, []  # by the name of a target, with its poses, or that of a family
    moving = {pose: name for name, target in config["targets"].items() for pose in target.get("poses", ())}
    for name, target in config["targets"].items():
        if "field" in target:
            continue
        row = moving.get(name, name)
        of_row = planned.setdefault(re.sub(r"_\d+$", "", row) if "family" in target else row, [])
        if sizes[name] is None:
            continue
        of_row.append(needs.expected(config, name, sizes[name]))
        if (fields / "scattering" / f"{name}.zarr").exists():
            continue
        label = f"config key 'targets.{name}': {cad_of(target)}"
        sizing = sizes[name]["box"], needs.mesh_of(config, name), config["radar"], label, needs.precision(config)
        faults = [refusal(needs.check_fit, config, name, sizes[name]), refusal(check_resolution, *sizing)]
        if any(faults) and refuse:
            raise InputError(" ".join(filter(None, faults)))
        warned += [f"Warning: {fault}" for fault in faults if fault]
    head = "Solves, by estimate from the surfaces' areas, on two cores:"
    what = "models and poses" if moving else "models"
    lines = [_row(name, solves, what) for name, solves in planned.items()]
    seconds = sum(band["seconds"] for solves in planned.values() for bands in solves for band in bands)
    return [head, *lines, f"  in all: {_span(seconds)}", *warned] if lines else []


def _row(name, solves, what):
    """A line on the planned solves of a target, in all poses, or of all models of a family: each a list of bands."""
    if not solves:
        return f"  {name}: not known yet."
    most = max((bands[-1] for bands in solves), key=lambda band: band["megabytes"])
    models = f" ({len(solves)} {what})" if len(solves) > 1 else ""
    time = _span(sum(band["seconds"] for bands in solves for band in bands))
    return f"  {name}{models}: up to {most['unknowns']:,.0f} unknowns, {most['megabytes'] / 1000:.1f} GB, {time}"


def _span(seconds):
    """A solve's planned time as text: right within 1.5 times if nothing else runs."""
    unit, text = next((unit for unit in ((3600, "h"), (60, "min")) if seconds >= 2 * unit[0]), (1, "s"))
    return f"{seconds / 1.5 / unit:,.0f} to {1.5 * seconds / unit:,.0f} {text}"


def _images(config, results, seeds):
    plan, noise = planned(config), config["noise"]
    clean, noisy = plan["bytes"], noise["realizations"] * plan["bytes"]
    most = len(imaged(config)) * (clean + noisy * len(noise["snr_db"]) * seeds)
    return [
        "Images of every target:",
        *(f"  {line}" for line in describe(plan)),
        f"  stores: {clean / 1e6:.3g} MB without noise, {noisy / 1e6:.3g} MB at each SNR; "
        f"at most {most / 1e9:.3g} GB in all; exported they take {2 * most / 1e9:.3g} GB more",
        *shortage(results, most),
    ]


def _untrained(learning):
    """Models of one's own that no experiment names: lines of text."""
    named = {model for experiment in learning["experiments"].values() for model in experiment["models"]}
    kinds = {learning["models"][model].get("kind", model) for model in named}
    defaults = read_yaml(BASE)["learning"]["models"].keys()
    for name in sorted(learning["models"].keys() - defaults - named - kinds) if named else ():
        yield f"Warning: the model '{name}' of 'learning.models' is named in no experiment: it is not trained."


def _size(config, name, mesh_json):
    """Area in m^2, box and reach from the origin in m of a target's CAD file, and sentences on it as `halves`, or None.

    mesh_json: the mesh job's file. Raises InputError for a file that cannot be read, or that is of another size,
    less symmetric than it says, or open and to be solved as a closed one.
    """
    target, mesh = config["targets"][name], needs.mesh_of(config, name)
    if "field" in target:
        return None
    if "family" in target:
        return _size_of_model(config, target, mesh, mesh_json)
    if any(map(states_unit, files_of(target))):  # they take long to read
        return json.loads(mesh_json.read_text())["source"] if mesh_json.exists() else None
    label = cad_of(target)
    vertices, triangles, completed = read_target(label, target, mesh, config["radar"])
    vertices, triangles = topology.compact(vertices, triangles)
    check_size(vertices, target, mesh, config["radar"], label, needs.precision(config))
    if len(triangles) <= LOOKED_AT and _is_doubtful(config, name, vertices, triangles):
        from isarflow.mesh.build import load_source  # with MeshLab, which takes long to load
        from isarflow.setup.checkup import check_formulation

        check_formulation(config, name, load_source(label, target, mesh, config["radar"]))
    near, planes = in_plane(vertices, triangles, mesh, config["radar"]), target.get("symmetry", [])
    halved = [*halves.sentences(vertices, triangles, completed, planes, near)]
    return measures.size(vertices, triangles) | {"halves": halved}


def _size_of_model(config, target, mesh, mesh_json):
    """`_size` of a family's model: of its mesh, or of its parts, whose area counts where they cross, too."""
    made = json.loads(mesh_json.read_text()) if mesh_json.exists() else {}
    if made.get("family") == target["family"]:
        return made["source"]
    vertices, triangles = families.joined(target["family"])
    vertices = in_metres(vertices, target)
    check_size(vertices, target, mesh, config["radar"], cad_of(target), needs.precision(config))
    return measures.size(vertices, triangles)


def _is_doubtful(config, name, vertices, triangles):
    """Tell whether a CAD file, before repairs, is open but must be closed, or differs from its mirror image.

    After the repairs of its mesh job it may still be good.
    """
    if equation(needs.method(config, name)) in topology.CLOSED and not topology.is_watertight(triangles):
        return True
    planes = symmetry.axes(config["targets"][name].get("symmetry", []))
    apart = [from_mirror_image(vertices, triangles, np.inf, axis)[0] for axis in planes]
    return not all(metres <= symmetry.allowed(config["radar"]) for metres in apart)  # nor where it is NaN
