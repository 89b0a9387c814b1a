"""The mesh stage: make one mesh for each frequency band from a target's CAD file."""

import json
from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import NamedTuple

import numpy as np

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.core.words import check_word, check_words, counted
from isarflow.mesh import families, gaps, symmetry, topology
from isarflow.mesh.ground import Ground, from_mirror_image, samples
from isarflow.mesh.io import write_ply
from isarflow.mesh.measures import describe, size, warnings
from isarflow.mesh.parts import Parts, alternating, carried, hollows
from isarflow.mesh.progress import begin, say
from isarflow.mesh.read import halves
from isarflow.mesh.read.target import UNITS, check_size, joined, read_surfaces
from isarflow.mesh.remesh.isotropic import P99, P99_LIMIT, Size, fitting, remesh, restore_chords, restore_volume, split
from isarflow.mesh.remesh.misses import GOAL, Followed
from isarflow.mesh.repair.arrange import first_crossing
from isarflow.mesh.repair.surface import CLOSE, WELD, repair
from isarflow.mesh.resolution import OF_PIECE, check_resolution, wanted_edges, wavelengths
from isarflow.mesh.symmetry import PLANES

WRONG = 1 / 20  # wavelengths between mesh and source: more is another target
CHANGED = 0.05  # of its area or volume: more is another target
MOST, CHEAP = 1.4, 1000  # times the triangles of the first mesh, or so many: the most that are spent on its area alone
FINER = 1.5, 2, 3  # times as many edges: a refused mesh is tried with these, to name a density that works
WASTE = 6  # times the triangles of the first mesh: if shorter edges do not help up to here, they will not
TRIES = 8  # meshes of a band, each finer where the last one is off
CHORD = 1 / 40  # wanted edges between a CAD kernel's surface and its triangles: a tenth of a mesh's tolerance


class Source(NamedTuple):
    """A target as a sound surface, from which the meshes of all bands are made."""

    vertices: np.ndarray  # (V, 3) in metres
    triangles: np.ndarray  # (T, 3)
    repairs: dict  # number of each repair
    measures: dict  # its size, the file's size as `raw`, and the tolerances of the repairs
    part: np.ndarray | None = None  # (T,) of a target of several parts, as numbers of `names`
    names: Sequence[str] = ()  # of its parts: the keys of its `parts`, and REST if one file holds more


def mesh_file(
    path: str | Path,
    frequency: float,
    edges_per_wavelength: float = 10,
    symmetry: Sequence[str] = (),
    unit: str | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Mesh a CAD file for the method of moments at one frequency, as the workflow does.

    Parameters:
        path: of an STL, OBJ, PLY or OFF file, or of STEP or IGES with the extra package for these
        frequency: Hz
        edges_per_wavelength: the mesh's mean edge is a wavelength divided by it
        symmetry: mirror planes of the target, of xz, yz and xy
        unit: of the file, m, cm, mm or in; None for m, of a plausible size

    Returns:
        Vertices (V, 3) in m and triangles (T, 3), for `isarflow.solve`.

    Raises:
        InputError: for a file that cannot be read or repaired, of an unlikely size or unlike its mirror image, with the
            place and what to do.

    >>> vertices, triangles = mesh_file("resources/cad/drone.stl", 0.9e9, symmetry=["xz"])
    >>> vertices.shape[1], triangles.shape[1]
    (3, 3)
    """
    check_words("symmetry", symmetry, PLANES)
    if unit is not None:
        check_word("unit", unit, UNITS)
    target = {"symmetry": list(symmetry)} | ({"unit": unit} if unit else {})
    radar = {"center_frequency": frequency, "bandwidth": 0.0, "frequencies": 1}
    (made,), _ = build_meshes(path, target, {"edges_per_wavelength": edges_per_wavelength, "bands": 1}, radar)
    return made


def load_source(path, target, mesh, radar, precision="double"):
    """The Source of a target. `target`, `mesh` and `radar` are those parts of the config.

    Raises InputError for an unusable file, an implausible size, too little symmetry, or one too small for `precision`.
    """
    waves = wavelengths(mesh, radar)
    edge = waves[-1] / mesh["edges_per_wavelength"]  # of a target of any size
    surfaces = read_surfaces(path, target, CHORD * edge)
    vertices, triangles, completed = joined(surfaces, target, mesh, radar)
    used = vertices[topology.used(triangles)]
    edges = wanted_edges(mesh, radar, np.ptp(used, axis=0))
    edge = edges[-1]
    check_size(used, target, mesh, radar, path, precision)
    check_resolution(np.ptp(used, axis=0), mesh, radar, path, precision)
    raw = {"triangles": len(triangles)} | size(*topology.compact(vertices, triangles))
    parts = Parts(target["parts"], surfaces, completed, WELD * edge) if "parts" in target else None
    passed = parts.passed if parts and parts.sheets.any() else None
    united = repair(vertices, triangles, edge, path, passed)
    vertices, triangles, repairs, tolerances = _with_hollows(vertices, triangles, edge, path, united, mesh)
    if passed:
        triangles = alternating(vertices, triangles)
    planes, near = target.get("symmetry", []), halves.IN_PLANE * edge
    tolerances["warnings"] += halves.sentences(vertices, triangles, completed, planes, near)
    if mesh.get("remesh", True):
        tolerances["warnings"] += gaps.sentences(vertices, triangles, edges, waves)
    for axis in symmetry.axes(planes):
        limit = symmetry.allowed(radar)
        apart, place = from_mirror_image(vertices, triangles, edge, axis)
        if apart - 2 * tolerances["thinned_by"] > limit:  # the file itself is off by this much
            off = f"it is off its mirror image by {apart * 1000:.3g} mm (at most {limit * 1000:.3g} mm)"
            where = f"about {'xyz'[axis]} = 0: near {topology.place(place)} {off}"
            advice = halves.advice(vertices, triangles, axis, near)
            raise InputError(f"{path} is not symmetric {where}; {advice}.")
    measures = size(vertices, triangles) | {"vertices": len(vertices), "triangles": len(triangles)} | tolerances
    for kind in ("area", "volume"):  # meshes are held to the CAD surface
        if measures[kind] is not None:
            measures[kind] += tolerances[f"thinned_{kind}"]
    measures |= {"raw": raw} | ({"completed": completed} if completed else {})
    of_parts = (parts.of(vertices, triangles, path), parts.names) if parts else ()
    return Source(vertices, triangles, repairs, measures, *of_parts)


def _with_hollows(vertices, triangles, edge, path, united, mesh):
    """What `repair` made of a surface, `united`; of a solid body that has hollows, with their walls turned inwards."""
    if "index" not in mesh or not united[2]["hidden_triangles"]:
        return united
    made = repair(vertices, triangles, edge, path, lambda _, corners: np.ones(len(corners), bool))
    inner, places = hollows(*made[:2], united[:2], edge)
    if not inner.any():
        return united  # solids that overlap
    if (topology.edges(made[1]).count > 2).any():
        place = topology.place(places[inner][0])
        raise InputError(
            f"{path}: a closed surface near {place} lies in a body of solids that overlap: unite these in the CAD "
            "program, so that it is clear what is hollow."
        )
    return made[0], alternating(*made[:2]), *made[2:]


def _whole(half, source, edge, axes):
    """The mesh of a Source from that of its half, exactly symmetric, its chords not all inside round walls."""
    (vertices, triangles), surface, volume = half, source[:2], source.measures["volume"]
    if volume is not None:
        volume /= 2 ** len(axes)  # mirror planes contain the origin: closing the part there would add no volume
        restored = restore_volume(vertices, triangles, surface, volume, edge, axes)
        longest = np.percentile(topology.edge_lengths(restored, triangles), 99) / edge
        if longest > P99_LIMIT:  # restoring the volume also makes edges longer
            vertices, triangles = fitting(vertices, triangles, Size(edge), None, axes, P99 * P99 / longest)
            restored = restore_volume(vertices, triangles, surface, volume, edge, axes)
        vertices = restored
    else:
        vertices = restore_chords(vertices, triangles, surface, edge, axes)
    for axis in axes:
        vertices, triangles = symmetry.with_mirror(vertices, triangles, axis)
    return vertices, triangles


def build_meshes(path, target, mesh, radar):
    """Meshes [(vertices, triangles), ...], lowest band first, and their measures. Arguments: see `load_source`."""
    return build_bands(load_source(path, target, mesh, radar), path, target, mesh, radar)


def build_bands(source, path, target, mesh, radar):
    """`build_meshes` from a target's Source."""
    symmetric = list(target.get("symmetry", []))
    meshes, measures, edges = [], [], wanted_edges(mesh, radar, source.measures["box"])
    bands = sweep.bands(radar, mesh["bands"])
    for band, edge, wave in zip(bands, edges, wavelengths(mesh, radar), strict=True):
        frequencies = {"first": float(band[0]), "last": float(band[-1]), "count": len(band)}
        make = _followed if mesh.get("remesh", True) else _as_drawn
        made, measured = make(source, edge, wave, symmetry.axes(symmetric), path)
        meshes.append(made)
        measures.append({"frequencies": frequencies} | measured | {"missed": missed(measured)})
    return meshes, {"source": source.measures, "symmetry": symmetric, "repairs": source.repairs, "bands": measures}


def _followed(source, edge, wavelength, axes, name):
    """A band's mesh and its measures; else InputError, with a density that was tried and works, if one does."""
    made, measures = _shortened(source, edge, wavelength, axes)
    fault = _fault(made, measures)
    if fault is None and measures["unknowns"] == 0:
        raise InputError(f"{name}: its mesh has no inner edge, so it can carry no current; it is too small.")
    if fault is None:
        return made, measures
    fault = f"{name}: edges of {edge * 1000:.3g} mm {fault[1]}{_diagnosis(fault[0], source, edge)}"
    for factor in FINER:
        if _fault(*_shortened(source, edge / factor, wavelength, axes)) is None:
            density = ceil(factor * wavelength / edge)
            raise InputError(f"{fault} 'mesh.edges_per_wavelength: {density}' was tried and does.")
    finest = f"{edge / FINER[-1] * 1000:.2g} mm"
    raise InputError(f"{fault} Edges of {finest} do not either: change the part there in the CAD program.")


def _as_drawn(source, edge, wavelength, axes, name):
    """A band's mesh of the source's own triangles, divided until no edge is longer than `edge`; its measures."""
    made = split(source.vertices, source.triangles, Size(edge), 1.0)
    nowhere = [(0.0, made[0][0])] * 2
    return made, describe(made, source.measures, nowhere, wavelength, edge, axes)


def _shortened(source, edge, wavelength, axes):
    """A band's mesh and its measures: edges are shortened where it is off the source, until it is off nowhere."""
    surface, reach = source[:2], min(wavelength, max(source.measures["box"]))  # a small target is held to its own size
    size, followed = _by_piece(surface, Size(edge)), Followed(*surface, edge)
    half, close = surface, CLOSE * np.linalg.norm(np.ptp(source.vertices, axis=0))
    for axis in axes:
        half = symmetry.positive_half(*half, close, axis)
    best = fewest = None
    least = np.inf  # of the best, the error of its area
    for number in range(TRIES):
        say(f"remesh to {edge * 1000:.3g} mm" + (f", shorter where mesh {number} missed" if number else ""))
        made = _whole(remesh(*half, size, surface, axes, source.part is not None), source, edge, axes)
        apart = followed.apart(made)
        fewest = fewest or len(made[1])
        costly = len(made[1]) > max(MOST * fewest, CHEAP)
        places = followed.strays(made, apart, reach)
        if len(places[0]) == 0:
            off = abs((topology.areas(*made).sum() - apart[-1]) / source.measures["area"] - 1)
            if off < least and (least > CHANGED or not costly):
                best, least = (made, apart), off
            places = followed.lost(made, apart, source.measures["area"])
        if len(places[0]) == 0 or (costly and least <= CHANGED) or len(made[1]) > WASTE * max(fewest, CHEAP):
            break
        size = size.shortened(*places)
    made, apart = best or (made, apart)
    farthest = [(float(metres.max()), points[metres.argmax()]) for points, metres in apart[:2]]
    return made, describe(made, source.measures, farthest, wavelength, edge, axes, apart[-1])


def _by_piece(surface, size):
    """The Size with enough edges across each piece of a surface (vertices, triangles), however small."""
    vertices, triangles = surface
    count, piece = topology.components(triangles)
    for number in range(count) if count > 1 else ():
        mine = triangles[piece == number]
        wanted = np.ptp(vertices[np.unique(mine)], axis=0).max() / OF_PIECE
        if wanted < size.edge:
            points = samples(vertices, mine, wanted)[0]
            size = size.shortened(points, wanted / size(points))
    return size


def _changes(band):
    """Relative changes of a mesh with the measures `band`: of its source's area, without rods, and of its volume."""
    area, volume = band["area"], band["volume"]
    changes = {"area": (area["after"] - area["of_rods"]) / area["before"] - 1}
    if volume["before"] and volume["after"]:
        changes["volume"] = volume["after"] / volume["before"] - 1
    return changes


def missed(band):
    """Say which of its goals a mesh with the measures `band` misses, or None, and what would do."""
    apart = max(band["hausdorff"].values()) / band["wavelength"]
    found = [(apart / GOAL[0], f"is {apart:.3f} wavelengths from its source (goal {GOAL[0]:g})")]
    for kind, change in _changes(band).items():
        text = f"changes its {kind} by {100 * change:+.1f} % (goal {100 * GOAL[1]:.0f} %)"
        found.append((abs(change) / GOAL[1], text))
    found = [pair for pair in found if pair[0] > 1]
    if not found:
        return None
    density = max(excess for excess, _ in found) ** 0.5 * band["wavelength"] / band["wanted_edge"]
    texts = " and ".join(text for _, text in found)
    return f"{texts}; 'mesh.edges_per_wavelength: {ceil(1.05 * density)}' is estimated to keep to it (not tried)."


def _fault(mesh, band):
    """Fault of a mesh with the measures `band`: a place or None, and what its edges do; None if it is the target."""
    vertices, triangles = mesh
    apart = max(band["hausdorff"].values())
    if apart > WRONG * band["wavelength"]:
        return band["hausdorff_place"], f"cannot follow its surface, which they miss by {apart * 1000:.3g} mm"
    if band["volume"]["before"] is not None and not band["watertight"]:
        torn = topology.rims(triangles)[0]
        return vertices[torn[0] if len(torn) else triangles[0]].mean(axis=0), "tear it open"
    crossed = first_crossing(*mesh)
    if crossed is not None:
        return crossed, "make its surfaces cross"
    for kind, change in _changes(band).items():
        if abs(change) > CHANGED:
            return None, f"change its {kind} by {100 * change:+.1f} %"
    return None


def _diagnosis(place, source, edge):
    """Name the place where a mesh fails, or the source's thinnest if `place` is None, and how near the walls are."""
    points = samples(*source[:2], edge / 2)[0]
    if place is not None:
        apart = np.linalg.norm(points - place, axis=1)
        points = points[apart <= apart.min() + edge / 2]
    metal, air = Ground(*source[:2]).clearance(points)
    thin = np.minimum(metal, air)
    at = thin.argmin()
    where, width = topology.place(points[at] if place is None else place), f"about {thin[at] * 1000:.2g} mm"
    what = f"the metal is {width} thick" if metal[at] <= air[at] else f"two walls are {width} of air apart"
    return f" near {where}, where {what}." if thin[at] < edge else f" near {where}."


def write(path, settings, measures_path, source_path, mesh_paths):
    """Write the meshes of a CAD file's target, their measures, and the source. settings: those of `load_source`."""
    begin(path)
    say("read and repair the CAD file")
    source = load_source(path, **settings)
    names = source.names
    write_ply(source_path, source.vertices, source.triangles, source.part, names)
    meshes, measures = build_bands(source, path, **settings)
    print(f"repairs: {counted(measures['repairs']) or 'none'}")
    for made, mesh_path, band in zip(meshes, mesh_paths, measures["bands"], strict=True):
        part = carried(source, made, measures["symmetry"], path) if names else None
        write_ply(mesh_path, *made, part, names)
        if names:
            band["parts"] = dict(zip(names, np.bincount(part, minlength=len(names)).tolist(), strict=True))
        edge = f"{band['edge_wavelengths']['mean']:.3f} wavelengths at {band['frequencies']['last'] / 1e9:g} GHz"
        counts = f"{band['triangles']} triangles, {band['unknowns']} unknowns"
        print(f"{Path(mesh_path).name}: {counts}, mean edge {edge}")
    for sentence in warnings(measures):
        print(f"Warning: {sentence}")
    if family := settings["target"].get("family"):
        measures |= {"family": family, "parameters": families.stated_values(family)}
    Path(measures_path).write_text(json.dumps(measures, indent=1) + "\n")
