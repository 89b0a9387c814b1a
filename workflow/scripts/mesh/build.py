"""The mesh stage: a target's CAD file becomes one mesh for each frequency band."""

import json
from pathlib import Path

import numpy as np

from common import radar as sweep
from common.errors import InputError
from mesh import clean, symmetry, topology
from mesh.figures import describe, size
from mesh.io import write_ply
from mesh.remesh import remesh, restore_volume

DEVIATION = 1 / 100  # wavelengths that a remeshing step may move the surface; the goal for the whole is 1/40
ASYMMETRY = 1 / 100  # wavelengths at the top frequency between a target and its mirror image


def load(path, target, wavelength):
    """The target as a sound mesh in metres: vertices, triangles, repairs made.

    `target` may hold unit, rotate and symmetry. Raises InputError if the file is no use, or less symmetric than
    it says, measured against the shortest wavelength (metres).
    """
    vertices, triangles = clean.read_cad(path)
    vertices, triangles, repairs = clean.repair(clean.in_metres(vertices, target), triangles, path)
    if target.get("symmetry"):
        apart, limit = symmetry.deviation(vertices, triangles, wavelength / 10), ASYMMETRY * wavelength
        if apart > limit:
            raise InputError(
                f"{path} is not symmetric about y = 0: it differs from its mirror image by {apart * 1000:.3g} mm "
                f"(at most {limit * 1000:.3g} mm is allowed). Mend it, or leave out 'symmetry' for this target."
            )
    return vertices, triangles, repairs


def band_mesh(vertices, triangles, edge, deviation, mirrored, name):
    """Vertices and triangles of about `edge` metres; exactly mirror-symmetric about y = 0 if `mirrored`.

    A closed target keeps its volume.
    """
    source, closed = (vertices, triangles), topology.is_watertight(triangles)
    close = clean.CLOSE * np.linalg.norm(np.ptp(vertices, axis=0))
    if mirrored:
        vertices, triangles = symmetry.left_half(vertices, triangles, close, name)
    # The plane y = 0 goes through the origin: closing the half there would add no volume.
    volume = topology.tetrahedra(vertices, triangles).sum()
    vertices, triangles = remesh(vertices, triangles, edge, deviation, mirrored)
    if closed:
        vertices = restore_volume(vertices, triangles, source, volume)
    if mirrored:
        vertices, triangles = symmetry.with_mirror(vertices, triangles)
    if closed and not topology.is_watertight(triangles):
        raise InputError(
            f"{name}: parts thinner than the edges ({edge * 1000:.3g} mm) were torn open by remeshing. "
            "Raise 'mesh.edges_per_wavelength', or thicken those parts."
        )
    return vertices, triangles


def build(path, target, mesh, radar):
    """Meshes [(vertices, triangles), ...], lowest band first, and their figures as a mapping.

    `target`, `mesh` and `radar` are those parts of the config.
    """
    bands = sweep.bands(radar, mesh["bands"])
    vertices, triangles, repairs = load(path, target, sweep.C0 / bands[-1][-1])
    meshes, figures = [], []
    for band in bands:
        wavelength = sweep.C0 / band[-1]
        edge = wavelength / mesh["edges_per_wavelength"]
        made = band_mesh(vertices, triangles, edge, DEVIATION * wavelength, bool(target.get("symmetry")), path)
        meshes.append(made)
        frequencies = {"first": float(band[0]), "last": float(band[-1]), "count": len(band)}
        figures.append({"frequencies": frequencies} | describe(made, (vertices, triangles), wavelength, edge))
    source = size(vertices, triangles) | {
        "vertices": len(vertices),
        "triangles": len(triangles),
    }
    symmetric = list(target.get("symmetry", []))
    return meshes, {"source": source, "symmetry": symmetric, "repairs": repairs, "bands": figures}


def write(path, target, mesh, radar, figures_path, mesh_paths):
    """Build the meshes of a target and write them with their figures."""
    meshes, figures = build(path, target, mesh, radar)
    for made, mesh_path, band in zip(meshes, mesh_paths, figures["bands"], strict=True):
        write_ply(mesh_path, *made)
        print(
            f"{Path(mesh_path).name}: {band['triangles']} triangles, {band['unknowns']} unknowns, "
            f"mean edge {band['edge_wavelengths']['mean']:.3f} wavelengths at {band['frequencies']['last'] / 1e9:g} GHz"
        )
    Path(figures_path).write_text(json.dumps(figures, indent=1) + "\n")
