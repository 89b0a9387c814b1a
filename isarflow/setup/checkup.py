"""Describe a config's CAD files, and what would become of them, in seconds and before anything is made of them."""

import numpy as np

from isarflow.core.errors import InputError, refusal
from isarflow.core.sweep import bands, frequencies
from isarflow.core.words import counted
from isarflow.mesh import symmetry, topology
from isarflow.mesh.build import load_source
from isarflow.mesh.ground import Ground, from_mirror_image
from isarflow.mesh.read.target import UNITS, cad_of, files_of, read_target, states_unit
from isarflow.mesh.resolution import wanted_edges
from isarflow.scattering import materials, needs
from isarflow.scattering.checks import check_bodies

SAMPLED = 2000  # triangles at which the thickness and the gaps between walls are measured
GIGA = 1000  # MB
REFUSED, WARNING = "  refused:", "  warning:"


def checkup(config, name):
    """Lines on a target of a config that is a mesh: its size, symmetry, thickness, repairs, and what a solve takes.

    Lines that begin with REFUSED say what would stop a run.
    """
    target, mesh, radar, lines = config["targets"][name], needs.mesh_of(config, name), config["radar"], []
    try:
        vertices, triangles = topology.compact(*read_target(cad_of(target), target, mesh, radar)[:2])
        lines += [*_sizes(vertices, triangles, target), _symmetry(vertices, triangles, target, radar)]
        source = load_source(cad_of(target), target, mesh, radar, needs.precision(config))
    except InputError as error:
        return [*lines, f"{REFUSED} {error}"]
    lines += [f"  repairs: {counted(source.repairs) or 'none needed'}", _closed(source)]
    lines += [f"{WARNING} {sentence}" for sentence in source.measures["warnings"]]
    lines += _thinnest(source, wanted_edges(mesh, radar, source.measures["box"])[-1])
    for solve, band in zip(needs.expected(config, name, source.measures), bands(radar, mesh["bands"]), strict=True):
        cost = f"{solve['megabytes'] / GIGA:.1f} GB, {solve['seconds']:,.0f} s on two cores"
        lines.append(f"  up to {band[-1] / 1e9:g} GHz: about {solve['unknowns']:,.0f} unknowns, {cost}")
    refused = refusal(check_formulation, config, name, source), refusal(needs.check_fit, config, name, source.measures)
    return lines + [f"{REFUSED} {why}" for why in refused if why]


def brief(name, lines):
    """The lines of a further model of a family: its size and its finest solve in one, warnings, and what refuses it."""
    bare = [line.strip() for line in lines if not line.startswith((REFUSED, WARNING))]
    summary = "; ".join(bare[:1] + [line for line in bare[1:] if line.startswith("up to")][-1:])
    return [f"{name}: {summary}", *(line for line in lines if line.startswith((REFUSED, WARNING)))]


def check_formulation(config, name, source):
    """Raise InputError if a target's Source does not suit the equation that it is to be solved with."""
    scattering = needs.method(config, name)
    surface, equation = (source.vertices, source.triangles), materials.equation(scattering)
    if equation == "ibc":  # of several parts some may be sheets
        part = np.zeros(len(surface[1]), int) if source.part is None else source.part
        made_of = materials.of_parts(scattering)
        made_of = {name: made_of[name] for name in source.names or made_of}
        check_bodies(*surface, part, made_of, frequencies(config["radar"])[0])
    elif equation in topology.CLOSED:
        topology.check_closed(*surface, equation)


def swept(config):
    """Return in a line what a config (or the defaults) asks of all targets: frequencies and edges."""
    frequency, edges = frequencies(config["radar"]) / 1e9, config["mesh"]["edges_per_wavelength"]
    span = f"{frequency[0]:g} to {frequency[-1]:g} GHz" if len(frequency) > 1 else f"{frequency[0]:g} GHz"
    wanted = f"{edges:g} edges a wavelength at each band's top" if config["mesh"]["remesh"] else "as drawn"
    return f"by 'radar' {span}, by 'mesh' {wanted}"


def _sizes(vertices, triangles, target):
    """The box of a target in metres, and its size if the file were in other units."""
    box = np.ptp(vertices, axis=0)
    lines = [f"  size {_box(box)} m, {len(triangles):,} triangles"]
    if not all(map(states_unit, files_of(target))) and "unit" not in target and "length" not in target:
        others = [f"{_box(box * metres)} m if its numbers are {unit}" for unit, metres in UNITS.items() if unit != "m"]
        lines.append(f"  taken as m; {'; '.join(others)}")
    return lines


def _box(lengths):
    return " x ".join(f"{length:.4g}" for length in lengths)


def _symmetry(vertices, triangles, target, radar):
    """Mirror planes that a target has, as exactly as a run asks for, compared with those that the config names."""
    spacing, found = float(np.ptp(vertices, axis=0).max()) / 100, []
    for plane, axis in symmetry.AXES.items():
        if from_mirror_image(vertices, triangles, spacing, axis)[0] <= symmetry.allowed(radar):
            found.append(plane)
    more = set(found) - set(target.get("symmetry", []))
    advice = f"; 'symmetry: [{', '.join(found)}]' would spare work" if more else ""
    return f"  mirror planes: {', '.join(found) or 'none'}{advice}"


def _closed(source):
    """Tell whether a surface is closed, and its number of pieces; of an open one also the length of its rim."""
    pieces = topology.components(source.triangles)[0]
    rims = topology.rims(source.triangles)[0]
    length = topology.lengths(source.vertices, rims).sum()
    state = "closed" if topology.is_watertight(source.triangles) else f"open, with {length:.3g} m of rim"
    return f"  surface: {state}, {pieces} piece{'s' if pieces != 1 else ''}"


def _thinnest(source, edge):
    """The thinnest part of a closed target and its narrowest gap, if less than the edges of its finest mesh."""
    if not topology.is_watertight(source.triangles):
        return []
    chosen = source.triangles[:: max(1, len(source.triangles) // SAMPLED)]
    centres = source.vertices[chosen].mean(axis=1)
    metal, air = Ground(source.vertices, source.triangles).clearance(centres)
    lines = []
    if metal.min() >= edge:
        lines.append(f"  thinnest part: {edge * 1000:.3g} mm, the mesh's edge, or more")
    for what, depth in (("thinnest part", metal), ("narrowest gap", air)):
        at = int(depth.argmin())
        if depth[at] < edge:
            place = topology.place(centres[at])
            lines.append(f"  {what}: at most {depth[at] * 1000:.2g} mm, near {place}; edges are {edge * 1000:.3g} mm")
    return lines
