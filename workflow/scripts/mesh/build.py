"""The mesh stage: a target's CAD file becomes one mesh for each frequency band."""

import json
from pathlib import Path

import numpy as np

from core import sweep
from core.errors import InputError
from mesh import symmetry, topology
from mesh.arrange import first_crossing
from mesh.distance import thickness
from mesh.figures import describe, size
from mesh.io import write_ply
from mesh.read import check_size, in_metres, read_cad
from mesh.remesh import remesh, restore_volume
from mesh.repair import CLOSE, repair, thin
from mesh.resolution import FINEST, check_resolution, wanted_edges
from mesh.tidy import split_long_edges

DEVIATION = 1 / 100  # wavelengths that a remeshing step may move the surface; the goal for the whole is 1/40
ASYMMETRY = 1 / 100  # wavelengths at the top frequency between a target and its mirror image
WRONG = 1 / 20  # wavelengths between mesh and source: more is another target
CHANGED = 0.05  # of its area or volume: likewise
GOAL = 1 / 40, 0.01  # wavelengths, and share of area or volume: what a mesh should keep to
THINNER = 1 / 2  # wanted edges: a source with much smaller triangles is thinned to these before it is remeshed


def load(path, target, mesh, radar, to_solve=False):
    """The target as a sound surface in metres for meshes of all bands.

    Returns vertices, triangles, repairs made, and their tolerances with the size of what was read, `raw`. `target` may
    hold unit, length, rotate and symmetry. Raises InputError if the file is no use, its size implausible, or less
    symmetric than it says; a target that is `to_solve` also if it has too few edges across it.
    """
    vertices, triangles = read_cad(path)
    vertices, edge = in_metres(vertices, target), wanted_edges(mesh, radar)[-1]
    used = vertices[np.unique(triangles)]
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
    return vertices, triangles, repairs, tolerances | {"raw": raw}


def band_mesh(vertices, triangles, edge, deviation, axes, name, thin_parts=False):
    """Vertices and triangles of about `edge` metres; exactly mirror-symmetric about the planes `axes`.

    A closed target keeps its volume. With `thin_parts` also parts thinner than an edge are kept.
    """
    source, closed = (vertices, triangles), topology.is_watertight(triangles)
    vertices, triangles = thin(vertices, triangles, THINNER * edge)
    close = CLOSE * np.linalg.norm(np.ptp(vertices, axis=0))
    for axis in axes:
        vertices, triangles = symmetry.positive_half(vertices, triangles, close, axis)
    # Mirror planes go through the origin: closing the part there would add no volume.
    volume = topology.tetrahedra(*source).sum() / 2 ** len(axes)
    vertices, triangles = remesh(vertices, triangles, edge, deviation, axes, source if thin_parts else None)
    if closed:
        vertices = restore_volume(vertices, triangles, source, volume, axes)
    for axis in axes:
        vertices, triangles = symmetry.with_mirror(vertices, triangles, axis)
    return vertices, triangles


def build(path, target, mesh, radar, to_solve=False):
    """Meshes [(vertices, triangles), ...], lowest band first, and figures as a mapping.

    `target`, `mesh` and `radar` are those parts of the config. A target that is `to_solve` is refused before remeshing
    if it has too few edges across it.
    """
    return remesh_bands(load(path, target, mesh, radar, to_solve), path, target, mesh, radar)


def remesh_bands(surface, path, target, mesh, radar):
    """`build` for a surface, with its repairs and tolerances, that `load` returned."""
    vertices, triangles, repairs, tolerances = surface
    bands, edges = sweep.bands(radar, mesh["bands"]), wanted_edges(mesh, radar)
    axes = symmetry.axes(target.get("symmetry", []))
    source = size(vertices, triangles) | {"vertices": len(vertices), "triangles": len(triangles)} | tolerances
    meshes, figures = [], []
    for band, edge in zip(bands, edges, strict=True):
        wavelength = sweep.C0 / band[-1]
        frequencies = {"first": float(band[0]), "last": float(band[-1]), "count": len(band)}
        made, described = _keeping_parts((vertices, triangles), edge, wavelength, axes, tolerances["thinned_by"], path)
        meshes.append(made)
        figures.append({"frequencies": frequencies} | described)
    symmetric = list(target.get("symmetry", []))
    return meshes, {"source": source, "symmetry": symmetric, "repairs": repairs, "bands": figures}


def _keeping_parts(surface, edge, wavelength, axes, thinned_by, name):
    """A band's mesh and its figures; made with care for thin parts where the usual way does not keep to the source."""
    made = band_mesh(*surface, edge, DEVIATION * wavelength, axes, name)
    figures = describe(made, surface, wavelength, edge, thinned_by, axes)
    if not _keeps(figures, *GOAL):
        careful = band_mesh(*surface, edge, DEVIATION * wavelength, axes, name, thin_parts=True)
        careful_figures = describe(careful, surface, wavelength, edge, thinned_by, axes)
        if _keeps(careful_figures, *GOAL) or not _keeps(figures, WRONG, CHANGED):
            made, figures = careful, careful_figures
    _check(made, figures, surface, edge, name)
    return made, figures


def _keeps(figures, apart, share):
    """True if a mesh is closed where its source is, at most `apart` wavelengths away, `share` of its size changed."""
    sizes = [figures["area"], figures["volume"]]
    if figures["volume"]["before"] is not None and not figures["watertight"]:
        return False
    changes = [abs(size["after"] / size["before"] - 1) for size in sizes if size["before"]]
    return max(figures["hausdorff"].values()) <= apart * figures["wavelength"] and max(changes) <= share


def _check(mesh, band, source, edge, name):
    """Refuse a mesh that is not the target, or that carries no current."""
    apart = max(band["hausdorff"].values())
    place = fault = None
    if apart > WRONG * band["wavelength"]:
        place = band["hausdorff_place"]
        fault = f"cannot follow its surface, which they miss by {apart * 1000:.3g} mm"
    elif not _keeps(band, WRONG, np.inf):
        torn = topology.edges(mesh[1])[0][topology.triangles_at_edges(mesh[1]) != 2]
        place = mesh[0][torn[0] if len(torn) else mesh[1][0]].mean(axis=0)
        fault = "tear it open"
    elif (crossed := first_crossing(*mesh)) is not None:
        place, fault = crossed, "make its surfaces cross"
    if fault:
        raise InputError(f"{name}: edges of {edge * 1000:.3g} mm {fault}{_advice(place, source, edge, band)}")
    for kind in ("area", "volume"):
        before, after = band[kind]["before"], band[kind]["after"]
        if before and after and abs(after / before - 1) > CHANGED:
            raise InputError(
                f"{name}: edges of {edge * 1000:.3g} mm change its {kind} by {100 * (after / before - 1):+.1f} %"
                f"{_advice(None, source, edge, band)}"
            )
    if band["unknowns"] == 0:
        raise InputError(f"{name}: its mesh has no inner edge, so it can carry no current; it is too small.")


def _advice(place, source, edge, band):
    """Where a mesh fails, how thick its source is there (at its thinnest if `place` is None), and what would help."""
    points, faces = split_long_edges(*source, edge / 2, edge / 2)
    depth = thickness(points, faces, source, edge)
    centres = points[faces].mean(axis=1)
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


def write(path, target, mesh, radar, figures_path, source_path, mesh_paths):
    """Build the meshes of a target and write them with their figures and the repaired source."""
    surface = load(path, target, mesh, radar, to_solve=True)
    write_ply(source_path, *surface[:2])
    meshes, figures = remesh_bands(surface, path, target, mesh, radar)
    done = [f"{count} {key.replace('_', ' ')}" for key, count in figures["repairs"].items() if count]
    print(f"repairs: {', '.join(done) or 'none'}")
    for made, mesh_path, band in zip(meshes, mesh_paths, figures["bands"], strict=True):
        write_ply(mesh_path, *made)
        print(
            f"{Path(mesh_path).name}: {band['triangles']} triangles, {band['unknowns']} unknowns, "
            f"mean edge {band['edge_wavelengths']['mean']:.3f} wavelengths at {band['frequencies']['last'] / 1e9:g} GHz"
        )
    Path(figures_path).write_text(json.dumps(figures, indent=1) + "\n")
