"""The text of STEP and IGES files: what the CAD kernel stumbles over is mended, what it would leave out is found."""

import itertools
import re

from isarflow.core.errors import InputError
from isarflow.core.text import BOM

SECTIONS = b"SGDPT"  # of an IGES file: the letter in column 73
LAST = re.compile(rb"S *\d+G *\d+D *\d+P *\d+")  # the line of section T counts the others' lines
# Fortran's 1.0D-03, and 1.0-103 where the exponent has three digits. In IGES files, whose columns are fixed, the kernel
# reads the first, and the second is zero in any unit of length.
DOUBLE = re.compile(rb"(?<=[\s(,])([+-]?\d+\.\d*)(?:[Dd]|(?=[+-]\d{3}[\s,)]))([+-]?\d+)(?=[\s,)])")
ZERO = re.compile(rb"[+-]?\d+\.\d*-\d{3}(?=[\s,;])")
INSTANCE = re.compile(rb"(?:^|;)\s*#\d+\s*=\s*\(?\s*(\w+)", re.MULTILINE)  # of a STEP file: its first or only type
# IGES entities of surfaces, and of solids; 108 is a plane, unbounded in form 0.
IGES_SURFACES = {108, 114, 118, 120, 122, 128, 136, 140, 143, 144, 186, 190, 192, 194, 196, 198, 510, 514}
IGES_SURFACES |= {150, 152, 154, 156, 158, 160, 162, 164, 168, 180, 182, 184, 430}
IGES_BORDERS = {141, 142}  # without them a surface is larger than it should be
# Types in STEP files by the kernel's names: faces, what consists of faces, surfaces and solids of any kind, the others.
STEP_FACES = "StepShape_AdvancedFace", "StepShape_FaceSurface"
STEP_SHELLS = "StepShape_ClosedShell", "StepShape_OpenShell", "StepShape_ConnectedFaceSet"
STEP_SHAPES = re.compile(
    "Solid|Brep|Shell|Face|SurfaceModel|SurfaceSet|TessellatedGeometricSet|Block|Sphere|Torus|RightCirc|RightAng|Boolean"
)
STEP_UNKNOWN = "StepData_UndefinedEntity"


def mended(path, data):
    """A STEP or IGES file's bytes as the kernel reads them. Raises InputError for one that is cut short, or for two."""
    data = data.removeprefix(BOM)
    return _iges(path, data) if is_iges(path) else _step(path, data)


def is_iges(path):
    return path.suffix.lower() in (".iges", ".igs")


def _step(path, data):
    end = re.search(rb"END-ISO-10303-21\s*;", data)
    another = end and re.compile(rb"ISO-10303-21\s*;").search(data, end.end())
    if another:
        raise _another(path, data.count(b"\n", 0, another.start()) + 1)
    return DOUBLE.sub(rb"\1E\2", data)


def _iges(path, data):
    lines = data.splitlines(keepends=True)
    if len(lines) == 1:  # records of 80 bytes without line ends
        lines = [data[k : k + 80] for k in range(0, len(data), 80)]
    last = next((k for k, line in enumerate(lines) if line[72:73] == b"T" and LAST.match(line)), None)
    if last is None:  # the kernel reads the rest
        raise InputError(f"{path} does not end as an IGES file does, with its section T; it may have been cut short.")
    for number, line in enumerate(lines[last + 1 :], last + 2):
        if line[72:73] in SECTIONS and line[73:80].strip().isdigit():
            raise _another(path, number)
    parameters = (ZERO.sub(_zero, line) if line[72:73] == b"P" else line for line in lines[: last + 1])
    return b"".join(parameters)


def _zero(number):
    return b"0." + b"0" * (len(number[0]) - 2)


def _another(path, line):
    return InputError(f"{path}: another file begins in line {line}, and one alone is read. Keep them apart.")


def left_out_of_step(reader, data):
    """Texts that name what a reader of a STEP file made no shape of, though it is, or may be, a surface."""
    from OCP.STEPConstruct import STEPConstruct_ExternRefs

    elsewhere = STEPConstruct_ExternRefs(reader.WS())
    elsewhere.LoadExternRefs()
    if elsewhere.NbExternRefs():
        return [f"the file {elsewhere.FileName(number + 1)}" for number in range(elsewhere.NbExternRefs())]
    entities, made = _transferred(reader)
    parts = [list(_parts(entity)) for entity in entities]
    shapes = {id(part) for part in itertools.chain(*parts) if STEP_SHAPES.search(type(part).__name__)}
    unknown = None in itertools.chain(*parts)  # a part of a type that the kernel does not know is None

    def lost(entity, its_parts):
        kind, result = type(entity).__name__, made.get(id(entity))
        if kind in STEP_FACES:
            return result is None or not result.HasResult()
        if kind == STEP_UNKNOWN:
            return unknown and STEP_SHAPES.search(entity.StepType().title().replace("_", ""))
        return (id(entity) in shapes and result is None) or (kind in STEP_SHELLS and None in its_parts)

    missing = [number for number, pair in enumerate(zip(entities, parts, strict=True)) if lost(*pair)]
    names = list(INSTANCE.finditer(data)) if missing else []
    at = [(names[number][1].decode(), data.count(b"\n", 0, names[number].start(1)) + 1) for number in missing]
    return [f"{name} in line {line}" for name, line in at]


def left_out_of_iges(reader):
    """Texts that name what a reader of an IGES file made no shape of, though it is, or may be, a surface."""
    entities, made = _transferred(reader)
    missing = []
    for number, entity in enumerate(entities):
        kind, result = entity.TypeNumber(), made.get(id(entity))
        surface = kind in IGES_SURFACES and (kind, entity.FormNumber()) != (108, 0)
        alone = entity.SubordinateStatus() in (0, 2)  # of another entity, which has it as a part, it is no surface
        failed = result is not None and result.Check().NbFails() > 0 and kind in IGES_SURFACES | IGES_BORDERS
        if failed or kind == 416 or (surface and alone and result is None):
            missing.append(f"the entity of type {kind} in line {2 * number + 1} of section D")
    return missing


def _transferred(reader):
    """The entities of a reader's file, and by their ids the results of those that its transfer met."""
    model, process = reader.WS().Model(), reader.WS().TransferReader().TransientProcess()
    entities = [model.Value(number + 1) for number in range(model.NbEntities())]
    mapped = ((process.Mapped(number + 1), process.MapItem(number + 1)) for number in range(process.NbMapped()))
    return entities, {id(entity): result for entity, result in mapped}


def _parts(entity):
    """What a shape or a shell in a STEP file consists of."""
    kind = type(entity).__name__
    if kind in STEP_SHELLS:
        yield from (entity.CfsFacesValue(number + 1) for number in range(entity.NbCfsFaces()))
    elif "ShapeRepresentation" in kind and hasattr(entity, "NbItems"):
        yield from (entity.ItemsValue(number + 1) for number in range(entity.NbItems()))
