"""A CAD file's triangles in metres, or the reason why it is no use, with the place."""

import contextlib
import re
from pathlib import Path

import numpy as np
import pymeshlab

from common.errors import InputError
from mesh import cad_kernel

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}  # metres
# A target is plausible between these many wavelengths at the centre frequency. Longer ones are beyond a dense method
# of moments, shorter ones have no shape for the radar: a unit mistaken is a factor of 10, 25.4 or 1000.
SMALLEST, LARGEST = 1 / 50, 100
USUAL, AROUND = 4, 10  # wavelengths, and the factor around it within which a target's size is likely
LENGTH_TOLERANCE = 0.02  # of a target's `length`
NOT_FINITE = re.compile(rb"[-+]?(nan|inf)(inity)?\b", re.IGNORECASE)
PLY_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"float": "f4", "double": "f8", "uint8": "u1", "int32": "i4", "float32": "f4", "float64": "f8"},
}


def read_cad(path):
    """Vertices (V, 3) float64 and triangles (T, 3) as they stand in an STL, OBJ, PLY or OFF file.

    Those of a STEP or IGES file are made, in metres. Raises InputError for a file that holds no usable triangles.
    """
    path = Path(path)
    if path.stat().st_size == 0:
        raise InputError(f"{path} is empty.")
    if states_unit(path):
        return cad_kernel.read_surfaces(path)
    _check_stl_length(path)
    _check_corners(path)
    meshes = pymeshlab.MeshSet()
    try:
        with contextlib.chdir("."):  # some readers change the working folder and leave it so
            meshes.load_new_mesh(str(path.resolve()))
        mesh = meshes.current_mesh()
        vertices, triangles = mesh.vertex_matrix(), mesh.face_matrix()
    except pymeshlab.PyMeshLabException as error:
        # The library says twice that this file failed before it says why.
        reason = " ".join(str(error).split("Error details:")[-1].split())
        raise InputError(f"{path} is not a readable {path.suffix[1:].upper()} mesh: {reason}.") from None
    data = path.read_bytes()
    kind, announced = _announced(path.suffix.lower(), data)
    missing = announced - {"vertices": len(vertices), "triangles": len(triangles)}[kind]
    if missing > 0:
        raise InputError(
            f"{path}: {missing} of its {announced} {kind} are not finite numbers (NaN or infinite), or are not there"
            f"{_first_not_finite(path.suffix.lower(), data)}. Export the file anew."
        )
    if len(triangles) == 0:
        raise InputError(f"{path} holds no triangles; a surface mesh is needed.")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InputError(f"{path}: triangle {(triangles >= len(vertices)).any(axis=1).argmax()} uses a missing vertex.")
    if not np.isfinite(vertices).all():
        number = int((~np.isfinite(vertices)).any(axis=1).argmax())
        raise InputError(f"{path}: vertex {number} is at {vertices[number]}, not at finite numbers (NaN or infinite).")
    return vertices, triangles


def states_unit(path):
    """True if the format of this file states its own unit of length, which the reader then converts to metres."""
    return Path(path).suffix.lower() in cad_kernel.FORMATS


def in_metres(vertices, target):
    """Vertices scaled by the target's `unit` and turned by its `rotate` (degrees about x, then y, then z)."""
    vertices = vertices * UNITS[target.get("unit", "m")]
    for axis, angle in enumerate(np.radians(target.get("rotate", [0, 0, 0]))):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[[j, j, k, k], [j, k, j, k]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
        vertices = vertices @ turn.T
    return vertices


def check_size(vertices, target, wavelength, name):
    """Refuse a target (vertices in metres) whose size says that its unit is mistaken.

    Without a `unit` the size must be plausible at the centre `wavelength` (metres), with one it must not be far too
    small, unless there is a `length`, which must be right. For files
    that state their unit (STEP, IGES) the `length` stands for the `unit`.
    """
    size = float(np.ptp(vertices, axis=0).max())
    text = f"{size:.4g} m ({size / wavelength:.4g} wavelengths at the centre frequency)"
    fixed = states_unit(name)
    if "length" in target and abs(size - target["length"]) > LENGTH_TOLERANCE * target["length"]:
        likely = "" if fixed else _likely_unit(size, target, target["length"], 1 + LENGTH_TOLERANCE)
        raise InputError(
            f"{name} is {text} long, but its 'length' says {target['length']:g} m. Its unit is "
            f"{'stated in the file' if fixed else target.get('unit', 'm')}{likely or '.'}"
        )
    if not fixed and "unit" in target and "length" not in target and size / wavelength < SMALLEST / 3:
        likely = _likely_unit(size, target, USUAL * wavelength, AROUND)
        raise InputError(
            f"{name} is {text} long by its 'unit: {target['unit']}'{likely or '; it may be mistaken.'} "
            "If it is right, state the target's 'length' (m) too."
        )
    meant = "length" if fixed else "unit"
    if meant not in target and not SMALLEST <= size / wavelength <= LARGEST:
        likely = "" if fixed else _likely_unit(size, target, USUAL * wavelength, AROUND)
        mend = (
            "If it is right, state the target's 'length' (m)"
            if fixed
            else "State the target's 'unit' (m, cm, mm or in)"
        )
        raise InputError(
            f"{name} would be {text} long, which is too {'long' if size > wavelength else 'short'} to be meant"
            f"{likely or '; its unit may be mistaken.'} {mend}."
        )


def _likely_unit(size, target, expected, factor):
    """The units that would bring the size to within `factor` of the expected one (metres), as a question."""
    sizes = {unit: size * metres / UNITS[target.get("unit", "m")] for unit, metres in UNITS.items()}
    likely = [unit for unit in sizes if expected / factor <= sizes[unit] <= expected * factor]
    likely.sort(key=lambda unit: abs(np.log(sizes[unit] / expected)))
    options = " or ".join(f"'unit: {unit}' ({sizes[unit]:.4g} m)" for unit in likely)
    return f"; did you mean {options}?" if likely else ""


def _announced(form, data):
    """What a file says that it holds, ("vertices" or "triangles", number): the reader drops what is not finite."""
    if form == ".stl":
        ascii_facets = (
            len(re.findall(rb"^\s*facet\b", data, re.MULTILINE | re.IGNORECASE)) if _is_ascii_stl(data) else None
        )
        return "triangles", int.from_bytes(data[80:84], "little") if ascii_facets is None else ascii_facets
    if form == ".obj":
        return "vertices", len(re.findall(rb"^\s*v\s", data, re.MULTILINE))
    pattern = rb"element\s+vertex\s+(\d+)" if form == ".ply" else rb"(?m)^(?:[A-Z]*OFF\s)?\s*(\d+)\s+\d+"
    found = re.search(pattern, data)
    return "vertices", int(found[1]) if found else 0


def _first_not_finite(form, data):
    """Where the first number that is not finite stands, as text that follows on; empty if it cannot be told."""
    if form == ".stl" and not _is_ascii_stl(data):
        facets = _stl_corners(data)
        bad = np.flatnonzero(~np.isfinite(facets).all(axis=(1, 2)))
        return f"; the first is in triangle {bad[0]}, with corners {facets[bad[0]].tolist()}" if len(bad) else ""
    head = data[: data.find(b"end_header") + 11]
    if form == ".ply" and b"binary_little_endian" in head:
        lines = head.decode("latin-1").split("element vertex")[1].split("element")[0].splitlines()[1:]
        fields = [line.split()[1:] for line in lines if line.startswith("property")]
        if not all(kind in PLY_TYPES for kind, *_ in fields):
            return ""
        record = [(name, "<" + PLY_TYPES[kind]) for kind, name in fields]
        points = np.frombuffer(data, record, _announced(form, data)[1], len(head))
        points = np.stack([points[axis] for axis in "xyz"], axis=1)
        bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
        return f"; the first is vertex {bad[0]}, at {points[bad[0]].tolist()}" if len(bad) else ""
    found = NOT_FINITE.search(data)
    if not found:
        return ""
    line = data.count(b"\n", 0, found.start())
    return f"; the first stands in line {line + 1}: {data.splitlines()[line].decode('latin-1').strip()!r}"


def _stl_corners(data):
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return np.frombuffer(data, record, offset=84)["corners"]


def _is_ascii_stl(data):
    return data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:4096].lower()


def _check_stl_length(path):
    """A binary STL that is cut short would otherwise be read up to where it ends, or as rubbish."""
    if path.suffix.lower() != ".stl":
        return
    size = path.stat().st_size
    with open(path, "rb") as file:
        head = file.read(4096)
    if _is_ascii_stl(head):
        if b"endsolid" not in path.read_bytes()[-4096:].lower():
            raise InputError(f"{path} does not end with 'endsolid', as a text STL does; it may have been cut short.")
        return
    head = head[:84]
    expected = 84 + 50 * int.from_bytes(head[80:84], "little") if len(head) == 84 else None
    if size != expected:
        short = expected and size < expected
        raise InputError(
            f"{path} is not an STL file: it has {size} bytes"
            + (f", its header announces {expected}" if expected else "")
            + ("; it may have been cut short." if short else ".")
        )


def _check_corners(path):
    """Refuse a text file whose faces use vertices that are not there: its reader would write beyond its memory."""
    form = path.suffix.lower()
    if form not in (".off", ".obj"):
        return
    lines = [words for line in path.read_bytes().splitlines() if (words := line.split(b"#")[0].split())]
    try:
        if form == ".obj":
            many = sum(words[0] == b"v" for words in lines)
            corners = [int(word.split(b"/")[0]) for words in lines if words[0] == b"f" for word in words[1:]]
            wrong = [corner for corner in corners if not (0 < corner <= many or -many <= corner < 0)]
        else:
            if lines and lines[0][0][-3:] == b"OFF":
                lines[0] = lines[0][1:]
                lines = lines if lines[0] else lines[1:]
            many, faces = int(lines[0][0]), int(lines[0][1])
            rows = lines[1 + many : 1 + many + faces]
            corners = [int(word) for words in rows for word in words[1 : 1 + int(words[0])]]
            wrong = [corner for corner in corners if not 0 <= corner < many]
    except (ValueError, IndexError):
        return  # not laid out so; the reader says what it cannot read
    if wrong:
        raise InputError(f"{path}: a face uses vertex {wrong[0]}, but there are {many} vertices. Export the file anew.")
