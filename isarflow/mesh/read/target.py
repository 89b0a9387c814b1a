"""Read a CAD file's triangles in metres, or say why it is unusable, with the place."""

import re
from pathlib import Path

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.core.words import near
from isarflow.mesh import families, shapes, topology
from isarflow.mesh.read import cad_kernel, halves
from isarflow.mesh.read.formats import NO_CAD, beginning, read_obj, read_off, read_stl, triangulated
from isarflow.mesh.read.ply import read_ply
from isarflow.mesh.resolution import too_fine, wanted_edges

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}  # metres
# A target is plausible between these numbers of wavelengths at the centre frequency. Longer ones are beyond a dense
# method of moments, shorter ones have no shape for the radar: a wrong unit is a factor of 10, 25.4 or 1000.
SMALLEST, LARGEST = 1 / 50, 100
USUAL, AROUND = 4, 10  # wavelengths, and the factor around it within which a target's size is likely
FARTHEST = 1e4  # of its size, from the origin: farther away, volumes lose their digits
LARGEST_NUMBER = 1e12  # of a coordinate, in any unit
LENGTH_TOLERANCE = 0.02  # of a target's `length`
REST = "rest"  # the part of what a file has besides those that its target names
LISTED = 500  # characters of a file's names in a message
READERS = {".stl": read_stl, ".obj": read_obj, ".ply": read_ply, ".off": read_off}


def read_cad(path, chord=0.0):
    """Read vertices (V, 3) float64, unchanged, and triangles (T, 3) that faces are cut into, of a CAD file.

    Third are the names that the file gives its parts, by their kinds: {kind: (names, number of each triangle's (T,))}.
    For a STEP or IGES file triangles are computed, in metres, at most `chord` metres from its surfaces, or as little as
    is useful. Raises InputError for a file that holds no usable triangles.
    """
    path = Path(path)
    if path.stat().st_size == 0:
        raise InputError(f"{path} is empty.")
    if states_unit(path):
        return cad_kernel.read_surfaces(path, chord)
    data = path.read_bytes()
    try:
        if other := beginning(data, NO_CAD):
            raise InputError(f"it is no CAD file, but {other}.")
        surface = READERS[path.suffix.lower()](data)
    except InputError as error:
        text = str(error)
        raise InputError(f"{path} {text[3:] if text.startswith('it ') else f'cannot be read: {text}'}") from None
    _check_numbers(surface, path)
    vertices, sizes, corners, *_, names = surface
    vertices = np.where(np.isfinite(vertices), vertices, 0.0)  # no face uses these; later steps drop and count them
    triangles = triangulated(vertices, sizes, corners.astype(np.int64))
    if len(triangles) == 0:
        raise InputError(f"{path} holds no triangles; a surface mesh is needed.")
    used = vertices[topology.used(triangles)]
    if np.abs(used).max() > LARGEST_NUMBER:
        raise InputError(f"{path} has coordinates of {np.abs(used).max():.3g}, which are none in any unit of length.")
    if np.ptp(used, axis=0).max() == 0:
        raise InputError(f"{path}: all corners of its triangles are at one place.")
    face = np.repeat(np.arange(len(sizes)), sizes - 2)
    return vertices, triangles, {kind: (said, number[face]) for kind, (said, number) in (names or {}).items()}


def cad_of(target):
    """Return the path of a target's CAD file, or what messages call a family's model, or parts, which have none."""
    if "family" in target:
        pose = f" at {target['family']['pose']:.3g} of a turn" if "pose" in target["family"] else ""
        return "{kind}, model {number} of seed {seed}".format(**target["family"]) + pose
    return target["mesh"] if "mesh" in target else f"parts {', '.join(sorted(target['parts']))}"


def files_of(target):
    """Return the paths of a target's CAD files, its own, or one for each of its parts; of a family's model none."""
    parts = {"": target} if "mesh" in target else target.get("parts", {})
    return [part["mesh"] for _, part in sorted(parts.items()) if "mesh" in part]


def is_metal(part):
    """Tell whether a part of a target, or a target, is a perfect conductor."""
    return part.get("material", {"resistance": 0}).get("resistance") == 0


def hides(part):
    """Tell whether a part of a target hides what lies in it: metal, also with a coating, and opaque bodies."""
    return is_metal(part) or not {"surface", "backing"}.isdisjoint(part["material"])


def meshed(parts):
    """The `parts` of a target without what a mesh does not depend on: numbers of materials, not which are sheets."""
    return {
        name: {key: part[key] for key in ("mesh",) if key in part} | ({} if hides(part) else {"material": {}})
        for name, part in parts.items()
    }


def read_target(path, target, mesh, radar, chord=0.0):
    """Read a target's surface: vertices (V, 3) in metres, triangles (T, 3), and planes at which a half was completed.

    path: of its CAD file, as `cad_of`; a family's model is made from its parameters. `target`, `mesh` and `radar` are
    those parts of the config, `chord` in metres is that of `read_cad`.
    """
    return joined(read_surfaces(path, target, chord), target, mesh, radar)


def read_surfaces(path, target, chord=0.0):
    """The surfaces of a target's parts by name, or its only one, (vertices, triangles) in metres; see `read_target`."""
    chord /= target.get("scale", 1.0)
    if "family" in target:
        family, pose = target["family"], target["family"].get("pose", 0.0)
        made = families.surfaces(family, pose) if "parts" in target else {"": families.solid(family, pose)}
    elif all("mesh" in part for part in target.get("parts", {}).values()):
        files = target.get("parts", {"": {"mesh": path}})
        made = {name: _in_unit(part["mesh"], target, chord)[:2] for name, part in sorted(files.items())}
    else:
        made = _by_name(path, *_in_unit(path, target, chord), target["parts"])
    return {name: (in_metres(vertices, target), triangles) for name, (vertices, triangles) in made.items()}


def _by_name(path, vertices, triangles, names, said):
    """The surfaces of a file's parts that `said` names, all by one kind of `names`, and of REST if there is more."""
    plain = {kind: [_plain(name) for name in own] for kind, (own, _) in names.items()}
    there = {kind: sorted({plain[kind][k] for k in np.unique(number)} - {""}) for kind, (_, number) in names.items()}
    there = {kind: own for kind, own in there.items() if own}
    if not there:
        why = "has no named groups, objects, materials (OBJ) or solids (STEP), which 'parts' could be"
        raise InputError(f"{path} {why}: name them in the CAD program, or give each part a 'mesh', a file of its own.")
    kind = min(there, key=lambda kind: len(said.keys() - {REST, *there[kind]}))
    for name in sorted(said.keys() - {REST, *there[kind]}):
        listed = "; ".join(f"{kind} {', '.join(own)}" for kind, own in there.items())
        listed = listed if len(listed) <= LISTED else f"{listed[:LISTED]}..."
        raise InputError(f"{path} has no part '{name}'{near(name, there[kind])} It has the {listed}.")
    part = np.array([name if name in said else REST for name in plain[kind]])[names[kind][1]]
    return {str(name): topology.compact(vertices, triangles[part == name]) for name in np.unique(part)}


def _plain(name):
    """A name as a config may have it: what is no letter, digit, dot or hyphen is an underscore."""
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("_.-")
    return f"part_{name}" if name[:1].isdigit() else name


def _in_unit(path, target, chord):
    """The result of `read_cad` in metres: by the file itself, or by the target's `unit`."""
    vertices, *rest = read_cad(path, chord)
    return vertices * (1.0 if states_unit(path) else UNITS[target.get("unit", "m")]), *rest


def joined(surfaces, target, mesh, radar):
    """The result of `read_target` from that of `read_surfaces`."""
    vertices, triangles = shapes.joined(list(surfaces.values()))
    return halves.completed(vertices, triangles, target.get("symmetry", []), in_plane(vertices, triangles, mesh, radar))


def in_plane(vertices, triangles, mesh, radar):
    """Metres from a mirror plane within which parts of a surface lie in it."""
    box = np.ptp(vertices[topology.used(triangles)], axis=0)
    return halves.IN_PLANE * wanted_edges(mesh, radar, box)[-1]


def _check_numbers(surface, path):
    """Refuse faces of two corners, or with vertices that do not exist or are not finite."""
    vertices, sizes, corners, lines, face_lines, _ = surface
    owner = np.repeat(np.arange(len(sizes)), sizes)
    wrong = ~((corners >= 0) & (corners < len(vertices)) & (corners == np.floor(corners)))
    if wrong.any() or (sizes < 3).any():
        face = int(owner[wrong.argmax()] if wrong.any() else (sizes < 3).argmax())
        place = f"face {face}" if face_lines is None else f"line {face_lines[face]}"
        counted = f"{len(sizes)} faces and {len(vertices)} vertices are announced"
        reason = f"has three corners or more, this one {sizes[face]} ({counted})"
        if wrong.any():
            number = corners[wrong.argmax()] + (path.suffix.lower() == ".obj")  # OBJ counts from 1
            reason = f"uses vertex {number:.10g}, but there are {len(vertices)} vertices"
        raise InputError(f"{path}: {place}: a face {reason}. Export the file anew.")
    corners = corners.astype(np.int64)
    bad = ~np.isfinite(vertices).all(axis=1)[corners]
    if not bad.any():
        return
    face, number = owner[bad.argmax()], corners[bad].min()
    if path.suffix.lower() == ".stl":
        where = f"triangle {face}, with corners {vertices[corners[owner == face]].tolist()}"
    else:
        where = f"vertex {number + (lines is not None)}, at {vertices[number].tolist()}"
        where += f", in line {lines[number]}" if lines is not None else ""
    some = f"{len(np.unique(owner[bad]))} of its {len(sizes)} faces have corners that are not finite (NaN or infinite)"
    raise InputError(f"{path}: {some}; the first is {where}. Export the file anew.")


def states_unit(path):
    """True if the format of this file states its own unit of length, which the reader then converts to metres."""
    return Path(path).suffix.lower() in cad_kernel.FORMATS


def in_metres(vertices, target):
    """Vertices in metres scaled by a target's `scale`, turned by `rotate` (degrees), and moved by `translate` (m)."""
    vertices = vertices * target.get("scale", 1.0)
    for axis, angle in enumerate(np.radians(target.get("rotate", [0, 0, 0]))):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[[j, j, k, k], [j, k, j, k]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
        vertices = vertices @ turn.T
    return vertices + np.array(target.get("translate", [0, 0, 0]), float)


def check_size(vertices, target, mesh, radar, name, precision="double"):
    """Refuse a target (vertices in metres) whose size shows that its unit is wrong.

    A `length` must be right, and confirms the size. Without one the size must be plausible at the centre frequency, or
    not far too small if there is a `unit`, or a family, in metres. The message also says what such a target needs,
    solved in this `precision`.
    """
    size, far = float(np.ptp(vertices, axis=0).max()), float(np.abs(vertices).max())
    if far > FARTHEST * size > 0:
        where = f"{far:.4g} m from the origin, which its phase refers to and its numbers are too short for"
        raise InputError(f"{name} is {size:.4g} m long but {where}. Move it there.")
    hertz, length = radar["center_frequency"], target.get("length")
    stated = all(map(states_unit, files_of(target) or [name]))
    wavelength = C0 / hertz
    text = f"{size:.4g} m ({size / wavelength:.4g} wavelengths at the centre frequency, {hertz / 1e9:.4g} GHz)"
    box = np.ptp(vertices, axis=0) * (1 if length is None else length / size)
    reason = too_fine(box, mesh, radar, precision)
    also = f" For that length, {reason}." if reason else ""
    if length is not None and abs(size - length) > LENGTH_TOLERANCE * length:
        unit = target.get("unit", "m") + (_likely_unit(size, target, length, 1 + LENGTH_TOLERANCE) or ".")
        unit = "stated in the file." if stated else unit
        raise InputError(f"{name} is {text} long, but its 'length' says {length:g} m. Its unit is {unit}{also}")
    least, most = (SMALLEST / 3, np.inf) if target.keys() & {"unit", "family"} else (SMALLEST, LARGEST)
    if length is None and not least <= size / wavelength <= most:
        likely = "" if stated else _likely_unit(size, target, USUAL * wavelength, AROUND)
        why = f"too {'long' if size > wavelength else 'short'} to be meant{likely or '; its unit may be mistaken.'}"
        right = f"If it is right, state the target's 'length' (length: {size:.4g}).{also}"
        raise InputError(f"{name} would be {text} long, which is {why} {right}")


def _likely_unit(size, target, expected, factor):
    """The units that would bring the size to within `factor` of the expected one (metres), as a question."""
    sizes = {unit: size * metres / UNITS[target.get("unit", "m")] for unit, metres in UNITS.items()}
    likely = [unit for unit in sizes if expected / factor <= sizes[unit] <= expected * factor]
    likely.sort(key=lambda unit: abs(np.log(sizes[unit] / expected)))
    options = " or ".join(f"'unit: {unit}' ({sizes[unit]:.4g} m)" for unit in likely)
    return f"; did you mean {options}?" if likely else ""
