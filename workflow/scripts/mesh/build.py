"""The mesh stage: a target's CAD file becomes one mesh for each frequency band."""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

from core import sweep
from core.errors import InputError
from mesh import symmetry, topology
from mesh.arrange import first_crossing
from mesh.distance import thickness
from mesh.io import write_ply
from mesh.measures import describe, size
from mesh.read import check_size, in_metres, read_cad
from mesh.remesh import Wanted, remesh, restore_volume
from mesh.repair import CLOSE, repair, thin
from mesh.resolution import FINEST, check_resolution, wanted_edges
from mesh.tidy import split_long_edges

DEVIATION = 1 / 100  # wavelengths that a remeshing step may move the surface; the goal for the whole is 1/40
ASYMMETRY = 1 / 100  # wavelengths at the top frequency between a target and its mirror image
WRONG = 1 / 20  # wavelengths between mesh and source: more is another target
CHANGED = 0.05  # of its area or volume: likewise
GOAL = 1 / 40, 0.01  # wavelengths, and share of area or volume: what a mesh should keep to
THINNER = 1 / 2  # wanted edges: a source with much smaller triangles is thinned to these before it is remeshed


class Source(NamedTuple):
    """A target as a sound surface, from which the meshes of all bands are made."""

    vertices: np.ndarray  # (V, 3) in metres
    triangles: np.ndarray  # (T, 3)
    repairs: dict  # how many of each were made
    measures: dict  # its size, that of what was read as `raw`, and the tolerances of the repairs


def load(path, target, mesh, radar, to_solve=False):
    """The Source of a target. `target`, `mesh` and `radar` are those parts of the config.

    Raises InputError if the file is no use, its size implausible, or less symmetric than it says; for a target that is
    `to_solve` also if it has too few edges across it.
    """
    vertices, triangles = read_cad(path)
    vertices, edge = in_metres(vertices, target), wanted_edges(mesh, radar)[-1]
    used = vertices[topology.used(triangles)]
    check_size(used, target, sweep.C0 / radar["center_frequency"], path)
    if to_solve:
        check_resolution(np.ptp(used, axis=0), mesh, radar, path)
    raw = {"triangles": len(triangles)} | size(*topology.compact(vertices, triangles))
    vertices, triangles, repairs, tolerances = repair(vertices, triangles, edge, path)
    for axis in symmetry.axes(target.get("symmetry", [])):
        limit = ASYMMETRY * sweep.C0 / sweep.frequencies(radar)[-1]
        apart, place = symmetry.deviation(vertices, triangles, edge, axis)
        if apart > limit:
            raise InputError(
                f"{path} is not symmetric about {'xyz'[axis]} = 0: near {topology.place(place)} it differs from its "
                f"mirror image by {apart * 1000:.3g} mm (at most {limit * 1000:.3g} mm is allowed). Mend it, or leave "
                "this plane out of the target's 'symmetry'."
            )
    counts = {"vertices": len(vertices), "triangles": len(triangles)}
    return Source(vertices, triangles, repairs, size(vertices, triangles) | counts | tolerances | {"raw": raw})


def band_mesh(surface, wanted, thin_parts=False):
    """The Wanted mesh of a surface, both (vertices, triangles), exactly symmetric about its mirror planes.

    A closed target keeps its volume. With `thin_parts` also parts thinner than an edge are kept.
    """
    vertices, triangles = thin(*surface, THINNER * wanted.edge)
    close = CLOSE * np.linalg.norm(np.ptp(vertices, axis=0))
    for axis in wanted.axes:
        vertices, triangles = symmetry.positive_half(vertices, triangles, close, axis)
    vertices, triangles = remesh(vertices, triangles, wanted, surface if thin_parts else None)
    if topology.is_watertight(surface[1]):
        # Mirror planes go through the origin: closing the part there would add no volume.
        volume = topology.tetrahedra(*surface).sum() / 2 ** len(wanted.axes)
        vertices = restore_volume(vertices, triangles, surface, volume, wanted.axes)
    for axis in wanted.axes:
        vertices, triangles = symmetry.with_mirror(vertices, triangles, axis)
    return vertices, triangles


def build(path, target, mesh, radar, to_solve=False):
    """Meshes [(vertices, triangles), ...], lowest band first, and their measures as a mapping.

    The arguments, and what is raised, are those of `load`; a mesh that is not the target raises InputError too.
    """
    return build_bands(load(path, target, mesh, radar, to_solve), path, target, mesh, radar)


def build_bands(source, path, target, mesh, radar):
    """`build` from a target's Source."""
    axes = symmetry.axes(target.get("symmetry", []))
    meshes, measures = [], []
    for band, edge in zip(sweep.bands(radar, mesh["bands"]), wanted_edges(mesh, radar), strict=True):
        frequencies = {"first": float(band[0]), "last": float(band[-1]), "count": len(band)}
        made, measured = _keeping_parts(source, edge, sweep.C0 / band[-1], axes, path)
        meshes.append(made)
        measures.append({"frequencies": frequencies} | measured)
    symmetric = list(target.get("symmetry", []))
    return meshes, {"source": source.measures, "symmetry": symmetric, "repairs": source.repairs, "bands": measures}


def _keeping_parts(source, edge, wavelength, axes, name):
    """A band's mesh and its measures; made with care for thin parts where the usual way does not keep to the source."""
    surface, wanted = source[:2], Wanted(edge, DEVIATION * wavelength, axes)

    def attempt(thin_parts):
        made = band_mesh(surface, wanted, thin_parts)
        return made, describe(made, surface, wavelength, edge, source.measures["thinned_by"], axes)

    made, measures = attempt(thin_parts=False)
    if not _keeps(measures, *GOAL):
        careful = attempt(thin_parts=True)
        if _keeps(careful[1], *GOAL) or not _keeps(measures, WRONG, CHANGED):
            made, measures = careful
    _check(made, measures, surface, name)
    return made, measures


def _keeps(band, apart, share):
    """True if a mesh is closed where its source is, at most `apart` wavelengths away, `share` of its size changed.

    `band` is the mesh's measures.
    """
    if band["volume"]["before"] is not None and not band["watertight"]:
        return False
    changes = [abs(size["after"] / size["before"] - 1) for size in (band["area"], band["volume"]) if size["before"]]
    return max(band["hausdorff"].values()) <= apart * band["wavelength"] and max(changes) <= share


def _check(mesh, band, source, name):
    """Refuse a mesh that is not the target, or that carries no current."""
    vertices, triangles = mesh
    apart = max(band["hausdorff"].values())
    place = fault = None
    if apart > WRONG * band["wavelength"]:
        place = band["hausdorff_place"]
        fault = f"cannot follow its surface, which they miss by {apart * 1000:.3g} mm"
    elif not _keeps(band, WRONG, np.inf):
        ends, _, count = topology.edges(triangles)
        torn = ends[count != 2]
        place = vertices[torn[0] if len(torn) else triangles[0]].mean(axis=0)
        fault = "tear it open"
    elif (crossed := first_crossing(*mesh)) is not None:
        place, fault = crossed, "make its surfaces cross"
    else:
        for kind in ("area", "volume"):
            before, after = band[kind]["before"], band[kind]["after"]
            if before and after and abs(after / before - 1) > CHANGED:
                fault = f"change its {kind} by {100 * (after / before - 1):+.1f} %"
                break
    if fault:
        edge = band["wanted_edge"]
        raise InputError(f"{name}: edges of {edge * 1000:.3g} mm {fault}{_advice(place, source, edge, band)}")
    if band["unknowns"] == 0:
        raise InputError(f"{name}: its mesh has no inner edge, so it can carry no current; it is too small.")


def _advice(place, source, edge, band):
    """Where a mesh fails, how thick its source is there (at its thinnest if `place` is None), and what would help."""
    vertices, triangles = split_long_edges(*source, edge / 2, edge / 2)
    depth = thickness(vertices, triangles, source, edge)
    centres = vertices[triangles].mean(axis=1)
    if place is None:
        at = depth.argmin()
    else:
        near = np.linalg.norm(centres - place, axis=1)
        at = np.where(near <= near.min() + edge / 2, depth, np.inf).argmin()
    if depth[at] >= edge:
        return f" near {topology.place(centres[at])}. Raise 'mesh.edges_per_wavelength'."
    density = band["wavelength"] / (2 * depth[at])
    finer = (
        f"Raise 'mesh.edges_per_wavelength' ({density:.0f} makes edges of twice that thickness), thicken"
        if density <= FINEST
        else "A higher 'mesh.edges_per_wavelength' may do; else thicken"
    )
    return (
        f" near {topology.place(centres[at])}, where it is about {depth[at] * 1000:.2g} mm thick. {finer} that part, "
        "or draw it as a sheet without thickness."
    )


def write(path, settings, measures_path, source_path, mesh_paths):
    """Build the meshes of the target in a CAD file and write them with their measures and the repaired source.

    `settings` has the arguments of `build`: `target`, `mesh` and `radar`.
    """
    source = load(path, **settings, to_solve=True)
    write_ply(source_path, source.vertices, source.triangles)
    meshes, measures = build_bands(source, path, **settings)
    repairs = [f"{count} {key.replace('_', ' ')}" for key, count in measures["repairs"].items() if count]
    print(f"repairs: {', '.join(repairs) or 'none'}")
    for made, mesh_path, band in zip(meshes, mesh_paths, measures["bands"], strict=True):
        write_ply(mesh_path, *made)
        print(
            f"{Path(mesh_path).name}: {band['triangles']} triangles, {band['unknowns']} unknowns, "
            f"mean edge {band['edge_wavelengths']['mean']:.3f} wavelengths at {band['frequencies']['last'] / 1e9:g} GHz"
        )
    Path(measures_path).write_text(json.dumps(measures, indent=1) + "\n")
