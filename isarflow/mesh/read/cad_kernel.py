"""Surfaces of STEP and IGES files as triangles, by Open CASCADE: an extra package, imported only to read one."""

import importlib.util
import tempfile
from pathlib import Path

import numpy as np

from isarflow.core.errors import InputError
from isarflow.mesh.read.exchange import is_iges, left_out_of_iges, left_out_of_step, mended

FORMATS = (".step", ".stp", ".iges", ".igs")
INSTALL = ".venv/bin/pip install --require-hashes -r envs/requirements-step.lock"
UNNAMED = "", "NONE"  # what programs write of a solid without a name
MILLIMETRE = 1e-3  # metres; the kernel converts every file's own unit to millimetres
# The least and largest allowed distance of chords from the surface, as a fraction of the target's diagonal; near poles
# of a sphere the kernel takes up to twice that, still 1/50 wavelength for a diagonal of 100. From one chord to the
# next they turn by at most `TURN` radians, which keeps small round parts round.
DEFLECTION, TURN = (1e-4, 6e-4), 0.3


def check_installed(key):
    """Raise InputError, naming `key`, if the kernel is not installed."""
    if importlib.util.find_spec("OCP") is None:
        raise InputError(f"{key}: install Open CASCADE with '{INSTALL}', or export it as STL, OBJ, PLY or OFF.")


def read_surfaces(path, chord):
    """Vertices (V, 3) float64 in metres, triangles (T, 3) and names (`read_cad`) of all faces of a STEP or IGES file.

    Chords are at most about `chord` metres from the surfaces, within the bounds of DEFLECTION. Vertices of neighbours
    coincide along their common edge. Raises InputError for a file that cannot be read, or only in part.
    """
    check_installed(path)
    try:
        from OCP.Message import Message, Message_Gravity
    except ImportError as error:  # a library of the system is missing
        raise InputError(f"{path}: Open CASCADE is installed but cannot be loaded: {error}.") from None
    for printer in Message.DefaultMessenger_s().Printers():  # otherwise statistics fill the terminal instead of the log
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    try:
        shape, reader = _shape(Path(path))
        faces, names = _faces(shape, chord / MILLIMETRE), _names(shape, reader)
    except InputError:
        raise
    except Exception as error:  # the kernel's own, of many kinds
        reason = f"{type(error).__name__}: {error}".rstrip(": .")
        raise InputError(f"{path}: Open CASCADE fails ({reason}). Heal it in the CAD program, or use STL.") from error
    if not faces:
        raise InputError(f"{path} holds no surfaces; curves and points alone reflect nothing.")
    missing = [number for number, face in enumerate(faces) if face is None]
    if missing:
        some = f"{len(missing)} of its {len(faces)} faces cannot be triangulated, the first is number {missing[0] + 1}"
        raise InputError(f"{path}: {some}. Heal the shape in the CAD program, or export it as STL.")
    first = np.cumsum([0] + [len(points) for points, _ in faces[:-1]])
    triangles = [corners + start for (_, corners), start in zip(faces, first, strict=True)]
    face = np.repeat(np.arange(len(faces)), [len(corners) for _, corners in faces])
    names = {kind: (of_faces, face) for kind, of_faces in names.items()}
    return np.concatenate([points for points, _ in faces]) * MILLIMETRE, np.concatenate(triangles), names


def _shape(path):
    """All shapes of a file as one, in millimetres, and the kernel's reader of it."""
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.IGESControl import IGESControl_Reader
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Reader

    data = path.read_bytes()
    text, iges = mended(path, data), is_iges(path)
    reader = IGESControl_Reader() if iges else STEPControl_Reader()
    # A part's triangles stand for it where its surfaces are not in the file; beside these they would be it twice.
    Interface_Static.SetCVal_s("read.step.tessellated", "OnNoBRep")
    with tempfile.TemporaryDirectory() as folder:
        given = path
        if text != data:
            given = Path(folder, f"mended{path.suffix}")
            given.write_bytes(text)
        state = reader.ReadFile(str(given))
    if state != IFSelect_ReturnStatus.IFSelect_RetDone:  # going on would crash the kernel
        raise InputError(f"{path} cannot be read as {'an IGES' if iges else 'a STEP'} file. Export it anew.")
    parts = reader.NbRootsForTransfer()
    lost = parts - reader.TransferRoots()
    if lost:
        raise InputError(f"{path}: {lost} of its {parts} parts cannot be translated. Export it anew, or as STL.")
    left = left_out_of_iges(reader) if iges else left_out_of_step(reader, text)
    if left:
        rest = f" and {len(left) - 1} more" if len(left) > 1 else ""
        raise InputError(f"{path}: Open CASCADE does not read {left[0]}{rest}, perhaps surfaces. Export STL, or anew.")
    return reader.OneShape(), reader


def _names(shape, reader):
    """Names of faces by kind, in the order of `_faces`: of solids, or solid_1, ..., and of the innermost products."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS_Iterator

    transfer, numbers, names = reader.WS().TransferReader(), {}, []

    def walk(shape, solid, product):
        if shape.ShapeType() == TopAbs_ShapeEnum.TopAbs_FACE:
            names.append((solid, product))
            return
        placed = transfer.EntityFromShapeResult(shape, -1)
        if type(placed).__name__ == "StepRepr_NextAssemblyUsageOccurrence":
            product = placed.RelatedProductDefinition().Formation().OfProduct().Name().ToCString()
        if shape.ShapeType() == TopAbs_ShapeEnum.TopAbs_SOLID:  # in all places of it the same one
            number = numbers.setdefault(shape.TShape(), len(numbers) + 1)
            entity = transfer.EntityFromShapeResult(shape.Located(TopLoc_Location()), -1)
            said = entity.Name() if hasattr(entity, "Name") else None
            solid = said.ToCString() if said and said.ToCString() not in UNNAMED else f"solid_{number}"
        inner = TopoDS_Iterator(shape, False, False)
        while inner.More():
            walk(inner.Value(), solid, product)
            inner.Next()

    walk(shape, "", "")
    return dict(zip(("solids", "products"), zip(*names, strict=True), strict=False))


def _faces(shape, chord):
    """Points (P, 3) and triangles (N, 3), outwards, of every face, or None if it has none; all is in millimetres."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Tool
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    if not explorer.More():
        return []
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if not box.IsVoid():  # else all faces are triangles already
        least, most = (share * box.SquareExtent() ** 0.5 for share in DEFLECTION)
        BRepMesh_IncrementalMesh(shape, min(max(chord, least), most), False, TURN)
    faces = []
    while explorer.More():
        face, place = TopoDS.Face(explorer.Current()), TopLoc_Location()
        made = BRep_Tool.Triangulation_s(face, place)
        if made is None:
            faces.append(None)
        else:
            turn = place.Transformation()
            points = [made.Node(n + 1).Transformed(turn) for n in range(made.NbNodes())]
            corners = np.array([made.Triangle(n + 1).Get() for n in range(made.NbTriangles())]) - 1
            inwards = (face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED) != turn.IsNegative()
            faces.append(([(p.X(), p.Y(), p.Z()) for p in points], corners[:, ::-1] if inwards else corners))
        explorer.Next()
    return faces
