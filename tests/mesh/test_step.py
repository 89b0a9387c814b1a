"""STEP and IGES files through Open CASCADE, an extra: what it writes itself comes back in metres."""

import importlib.util
import re
from types import SimpleNamespace

import numpy as np
import pytest
from shapes_made import check_solid

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes, load_source
from isarflow.mesh.read import cad_kernel
from isarflow.mesh.read.target import read_surfaces
from isarflow.mesh.shapes import box, write_stl
from isarflow.setup.config import load_config

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
EDGE = 0.0299792458  # m
needs_kernel = pytest.mark.skipif(
    importlib.util.find_spec("OCP") is None, reason=f"Open CASCADE is not installed: {cad_kernel.INSTALL}"
)


def write_shape(path, shape, solid=None):
    """A shape of the kernel as a STEP file in millimetres, or an IGES file in inches: loose faces, or one solid."""
    if path.suffix.lower() in (".step", ".stp"):
        from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

        writer = STEPControl_Writer()
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    else:
        from OCP.IGESControl import IGESControl_Writer

        writer = IGESControl_Writer("INCH", solid)
        writer.AddShape(shape)
    assert writer.Write(str(path))
    return path


def compound(*shapes):
    """Several shapes of the kernel as one."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    both, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(both)
    for shape in shapes:
        builder.Add(both, shape)
    return both


@pytest.fixture
def shapes():
    """A box, a ball, a tin, and a tin that stands out of a ball, in millimetres."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere

    ball, tin = BRepPrimAPI_MakeSphere(150.0).Shape(), BRepPrimAPI_MakeCylinder(100.0, 300.0).Shape()
    return SimpleNamespace(
        box=BRepPrimAPI_MakeBox(100.0, 200.0, 300.0).Shape(),
        ball=ball,
        tin=tin,
        both=BRepAlgoAPI_Fuse(ball, tin).Shape(),
    )


# The cylinder x^2 + y^2 < 0.1^2, 0 < z < 0.3, leaves the ball of radius 0.15 at this height.
LEAVES = np.sqrt(0.15**2 - 0.1**2)
CAP = np.pi * (0.15 - LEAVES) ** 2 * (3 * 0.15 - (0.15 - LEAVES)) / 3
SIZES = {  # extents, volume and area in metres
    "box": ([0.1, 0.2, 0.3], 0.006, 0.22),
    "ball": ([0.3, 0.3, 0.3], 4 / 3 * np.pi * 0.15**3, 4 * np.pi * 0.15**2),
    "tin": ([0.2, 0.2, 0.3], np.pi * 0.1**2 * 0.3, 2 * np.pi * 0.1 * (0.1 + 0.3)),
    "both": (
        [0.3, 0.3, 0.45],
        4 / 3 * np.pi * 0.15**3 - CAP + np.pi * 0.1**2 * (0.3 - LEAVES),
        2 * np.pi * 0.15 * (0.15 + LEAVES) + 2 * np.pi * 0.1 * (0.3 - LEAVES) + np.pi * 0.1**2,
    ),
}


@needs_kernel
@pytest.mark.parametrize(
    ("name", "file", "solid"),
    [
        ("box", "box.step", None),
        ("box", "box.iges", 0),
        ("ball", "ball.STP", None),
        ("ball", "ball.igs", 1),
        ("tin", "tin.stp", None),
        ("tin", "tin.igs", 0),
        ("both", "both.IGS", 0),
    ],
)
def test_solid_comes_back_and_makes_a_good_mesh(tmp_path, shapes, name, file, solid):
    path = write_shape(tmp_path / file, getattr(shapes, name), solid)
    box, volume, area = SIZES[name]
    vertices, triangles, _ = cad_kernel.read_surfaces(path, 0.0)
    assert np.ptp(vertices, axis=0) == pytest.approx(box, rel=1e-3)
    assert topology.areas(vertices, triangles).sum() == pytest.approx(area, rel=1e-3)
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(volume, rel=1e-3)  # so they face outwards
    (mesh,), measures = build_meshes(path, {}, MESH, RADAR)
    check_solid(EDGE, mesh, volume, area)
    assert max(measures["bands"][0]["hausdorff"].values()) <= measures["bands"][0]["wavelength"] / 40


@needs_kernel
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_a_bolt_and_the_plate_around_it_are_one(tmp_path, gap):
    """A plate with a hole of 5 mm radius and a bolt that is `gap` mm narrower, turned, so that facets do not match."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    def rod(low, radius, height, along=(1.0, 0.0, 0.0)):
        axes = gp_Ax2(gp_Pnt(-45.0, 0.0, low), gp_Dir(0.0, 0.0, 1.0), gp_Dir(*along))
        return BRepPrimAPI_MakeCylinder(axes, radius, height).Shape()

    plate = BRepPrimAPI_MakeBox(gp_Pnt(-60.0, -40.0, 0.0), 120.0, 80.0, 20.0).Shape()
    turned = (0.9, 0.436, 0.0)
    bolt = BRepAlgoAPI_Fuse(rod(-10.0, 5.0 - gap, 30.0, turned), rod(20.0, 8.0, 6.0, turned)).Shape()
    both = compound(BRepAlgoAPI_Cut(plate, rod(-5.0, 5.0, 40.0)).Shape(), bolt)
    source = load_source(write_shape(tmp_path / "bolt.step", both), {}, MESH, RADAR | {"center_frequency": 5e9})
    volume = 120 * 80 * 20 + np.pi * (10 * (5 - gap) ** 2 + 6 * 8**2)
    assert source.measures["volume"] == pytest.approx(1e-9 * volume, rel=1e-3)
    assert topology.components(source.triangles)[0] == 1
    assert (source.repairs["closed_slits"] > 0) == (gap > 0)


@needs_kernel
def test_chords_stay_close_to_a_ball(tmp_path, shapes):
    vertices, triangles, _ = cad_kernel.read_surfaces(write_shape(tmp_path / "ball.step", shapes.ball), 0.0)
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.15, rel=1e-6)
    inside = 0.15 - np.linalg.norm(vertices[triangles].mean(axis=1), axis=1)
    assert 0 < inside.max() < 2 * cad_kernel.DEFLECTION[0] * 0.3 * np.sqrt(3)
    assert np.median(inside) < cad_kernel.DEFLECTION[0] * 0.3 * np.sqrt(3)


@needs_kernel
def test_triangles_are_as_fine_as_the_wavelength_asks(tmp_path, shapes):
    path = write_shape(tmp_path / "ball.step", shapes.ball)
    count = {chord: len(cad_kernel.read_surfaces(path, chord)[1]) for chord in (0.0, 1e-4, 2e-4, 1.0)}
    assert count[0.0] > 1.5 * count[1e-4] > 1.5 * count[2e-4] > count[1.0] > 0
    low, high = (load_source(path, {}, MESH, RADAR | {"center_frequency": hertz}).measures for hertz in (1e9, 1e10))
    assert high["raw"]["triangles"] > 2 * low["raw"]["triangles"]
    assert low["volume"] == pytest.approx(SIZES["ball"][1], rel=4e-3)


@needs_kernel
def test_placed_and_mirrored_parts(tmp_path, shapes):
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    shift, mirror = gp_Trsf(), gp_Trsf()
    shift.SetTranslation(gp_Vec(1000.0, 0.0, 0.0))
    mirror.SetMirror(gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(1.0, 0.0, 0.0)))
    placed = shapes.tin.Located(TopLoc_Location(shift))
    mirrored = BRepBuilderAPI_Transform(placed, mirror).Shape()
    for shape, middle in ((placed, 1.0), (mirrored, -1.0)):
        vertices, triangles, _ = cad_kernel.read_surfaces(write_shape(tmp_path / "tin.step", shape), 0.0)
        assert vertices[:, 0].min() + vertices[:, 0].max() == pytest.approx(2 * middle, abs=1e-4)
        assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(SIZES["tin"][1], rel=1e-3)


@needs_kernel
def test_the_files_own_unit_counts(tmp_path, shapes):
    path = write_shape(tmp_path / "box.step", shapes.box)
    text = path.read_text()
    assert text.count("SI_UNIT(.MILLI.,.METRE.)") == 1
    path.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"))
    assert np.ptp(cad_kernel.read_surfaces(path, 0.0)[0], axis=0) == pytest.approx([1, 2, 3])
    path.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    with pytest.raises(
        InputError, match=r"300 m .* too long .* mistaken\. If it is right, state the target's 'length'"
    ):
        build_meshes(path, {}, MESH, RADAR)
    with pytest.raises(InputError, match=r"300 m .* its 'length' says 0\.3 m\. Its unit is stated in the file\."):
        build_meshes(path, {"length": 0.3}, MESH, RADAR)


@needs_kernel
@pytest.mark.parametrize(
    ("file", "part", "message"),
    [
        ("cut.step", 0.6, "cannot be read as a STEP file"),
        ("cut.step", 0.0, "is empty"),
        ("cut.igs", 0.6, "cut short"),
        ("cut.igs", 0.97, "cut short"),
    ],
)
def test_a_file_cut_short_is_refused(tmp_path, shapes, file, part, message):
    path = write_shape(tmp_path / file, shapes.tin, 0)
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(InputError, match=rf"{file}.*{message}"):
        build_meshes(path, {}, MESH, RADAR)


@pytest.fixture
def option():
    """Set one of the kernel's options, option(name, value), until the test ends."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Writer

    STEPControl_Writer()  # which brings the options
    before = {}

    def put(name, value):
        before.setdefault(name, Interface_Static.CVal_s(name))
        assert Interface_Static.SetCVal_s(name, value)

    yield put
    for name, value in before.items():
        Interface_Static.SetCVal_s(name, value)


def triangles_alone(shape):
    """The same faces of a shape by their triangles, 1 mm from it or less, without any surface."""
    from OCP.BRep import BRep_Builder, BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shell

    BRepMesh_IncrementalMesh(shape, 1.0)
    explorer, builder, shell = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE), BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    while explorer.More():
        face, old = TopoDS_Face(), TopoDS.Face(explorer.Current())
        builder.MakeFace(face, BRep_Tool.Triangulation_s(old, TopLoc_Location()))
        builder.Add(shell, face.Oriented(old.Orientation()))
        explorer.Next()
    return shell


@needs_kernel
@pytest.mark.parametrize("name", ["box", "tin", "both"])
def test_a_body_of_triangles_alone_is_read(tmp_path, shapes, option, name):
    """As AP242 files have them. With chords of 1 mm the tin has 0.8 % less volume, both 0.6 %."""
    option("write.step.schema", "AP242DIS")
    option("write.step.tessellated", "On")
    path = write_shape(tmp_path / "t.step", triangles_alone(getattr(shapes, name)))
    assert "TRIANGULATED_FACE" in path.read_text() and "ADVANCED_FACE" not in path.read_text()
    box, volume, area = SIZES[name]
    vertices, triangles, _ = cad_kernel.read_surfaces(path, 0.0)
    assert np.ptp(vertices, axis=0) == pytest.approx(box, rel=5e-3)
    assert topology.areas(vertices, triangles).sum() == pytest.approx(area, rel=0.01)
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(volume, rel=0.01)
    source = load_source(path, {}, MESH, RADAR)
    assert topology.is_watertight(source.triangles)
    path.write_text(path.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"))
    assert np.ptp(cad_kernel.read_surfaces(path, 0.0)[0], axis=0) == pytest.approx(10 * np.array(box), rel=5e-3)


@needs_kernel
def test_a_unit_is_that_of_the_parts_that_state_none(tmp_path, shapes):
    """A tin in a STEP file, which states millimetres, beside a box of an STL file, which states nothing."""
    tin = write_shape(tmp_path / "tin.step", shapes.tin)
    block = box((100, 0, 0), (120, 20, 20))
    write_stl(tmp_path / "block.stl", block)
    parts = {"tin": {"mesh": str(tin)}, "block": {"mesh": str(tmp_path / "block.stl")}}
    load_config({"targets": {"t": {"parts": parts, "unit": "mm", "role": "other"}}})
    made = read_surfaces("t", {"parts": parts, "unit": "mm", "scale": 2.0})
    assert np.ptp(made["tin"][0], axis=0) == pytest.approx(2 * np.array(SIZES["tin"][0]), rel=5e-3)
    assert np.ptp(made["block"][0], axis=0) == pytest.approx([0.04] * 3, rel=1e-6)
    with pytest.raises(InputError, match=r"'targets\.t\.unit': .* states its own unit; leave 'unit' out"):
        load_config({"targets": {"t": {"parts": {"tin": parts["tin"]}, "unit": "mm", "role": "other"}}})


@needs_kernel
def test_parts_are_solids_by_their_names_or_numbers(tmp_path, shapes):
    path = write_shape(tmp_path / "two.step", compound(shapes.tin, shapes.box))
    text = path.read_text()
    assert text.count("MANIFOLD_SOLID_BREP(''") == 2
    first, second = text.replace("MANIFOLD_SOLID_BREP(''", "MANIFOLD_SOLID_BREP('Tin can'", 1), text
    for content, said in ((first, ["Tin_can", "solid_2"]), (second, ["solid_1", "solid_2"]), (first, ["Tin_can"])):
        path.write_text(content)
        found = read_surfaces(path, {"parts": {part: {} for part in said}, "scale": 2.0})
        surfaces = found[said[0]], found[said[-1] if len(said) == 2 else "rest"]
        for surface, name in zip(surfaces, ("tin", "box"), strict=True):
            assert topology.tetrahedra(*surface).sum() == pytest.approx(8 * SIZES[name][1], rel=2e-3)
    with pytest.raises(InputError, match=r"no part 'tin_can'; did you mean 'Tin_can'\? It has the solids Tin_can, sol"):
        read_surfaces(path, {"parts": {"tin_can": {}}})


@needs_kernel
def test_parts_are_products_of_an_assembly(tmp_path, shapes):
    """A box, and a tin at two places in a product of its own, which is no part where the tin in it has a name."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    made = {"shell": tool.AddShape(shapes.box, False), "motor": tool.AddShape(shapes.tin, False)}
    made |= {"motors": tool.NewShape(), "drone": tool.NewShape()}
    for name, label in made.items():
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    for metres in (1.0, 2.0):
        shift = gp_Trsf()
        shift.SetTranslation(gp_Vec(1000 * metres, 0.0, 0.0))
        tool.AddComponent(made["motors"], made["motor"], TopLoc_Location(shift))
    for name in ("shell", "motors"):
        tool.AddComponent(made["drone"], made[name], TopLoc_Location())
    tool.UpdateAssemblies()
    writer, path = STEPCAFControl_Writer(), tmp_path / "drone.step"
    assert writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    found = read_surfaces(path, {"parts": {"shell": {}, "motor": {}}})
    assert topology.tetrahedra(*found["shell"]).sum() == pytest.approx(SIZES["box"][1])
    assert topology.tetrahedra(*found["motor"]).sum() == pytest.approx(2 * SIZES["tin"][1], rel=2e-3)  # chords of 2 m
    assert found["motor"][0][:, 0].min() == pytest.approx(0.9, abs=1e-3)
    with pytest.raises(
        InputError, match=r"has no part 'drone'\. It has the solids solid_1, .*; products motor, shell\."
    ):
        read_surfaces(path, {"parts": {"drone": {}}})


@needs_kernel
def test_triangles_beside_the_surfaces_that_they_show_are_not_read(tmp_path, shapes, option):
    option("write.step.schema", "AP242DIS")
    option("write.step.tessellated", "On")
    plain = cad_kernel.read_surfaces(write_shape(tmp_path / "plain.step", shapes.tin), 0.0)
    triangles_alone(shapes.tin)  # gives the tin triangles, too
    path = write_shape(tmp_path / "both.step", shapes.tin)
    text = path.read_text()
    assert text.count("TRIANGULATED_FACE") == text.count("ADVANCED_FACE") == 3
    alone = re.sub(r"(TESSELLATED_SOLID\([^)]*\)),#\d+\)", r"\1,$)", text)  # the same without saying of which solid
    assert alone != text
    for content in (text, alone):
        path.write_text(content)
        assert np.array_equal(cad_kernel.read_surfaces(path, 0.0)[0], plain[0])


BOM = b"\xef\xbb\xbf"
HABITS = {  # what other programs do to a STEP and to an IGES file
    "bom.step": lambda text: BOM + text,
    "after.step": lambda text: text + b"\nwritten by hand\n\x1a\0\0",
    "fortran.step": lambda text: text.replace(b"100.,", b"1.0D+02,").replace(b"(0.,0.,300.)", b"(0.,1.0-103,3.0d2)"),
    "mac.step": lambda text: text.replace(b"\n", b"\r"),
    "bom.igs": lambda text: BOM + text,
    "after.igs": lambda text: text + b"written by hand\n" + b"-" * 100 + b"\n\x1a",
    "padded.igs": lambda text: text + b" " * 80 + b"\r\n" + b"\0" * 900,
    "fortran.igs": lambda text: text.replace(b"E", b"D"),
    "short_exponent.igs": lambda text: text.replace(b"110,0.,0.,1.,0.,0.,0.;     ", b"110,1.0-103,0.,1.,0.,0.,0.;"),
    "one_line.igs": lambda text: text.replace(b"\n", b""),
    "crlf.igs": lambda text: text.replace(b"\n", b"\r\n"),
}


@needs_kernel
@pytest.mark.parametrize("file", HABITS)
def test_a_text_with_the_habits_of_other_programs_is_read(tmp_path, shapes, file):
    path = write_shape(tmp_path / file, shapes.tin, 0)
    plain, text = cad_kernel.read_surfaces(path, 0.0)[0], path.read_bytes()
    path.write_bytes(HABITS[file](text))
    assert path.read_bytes() != text
    assert cad_kernel.read_surfaces(path, 0.0)[0] == pytest.approx(plain, abs=1e-12)


def with_more(text, item, entities):
    """A STEP file's text with one more item of its shape, and more entities."""
    text = re.sub(rb"(SHAPE_REPRESENTATION\('',\(#\d+)", rb"\1," + item, text, count=1)
    place = b"#901=AXIS2_PLACEMENT_3D('',#902,$,$);#902=CARTESIAN_POINT('',(0.,0.,0.));\n"
    return text.replace(b"ENDSEC;\nEND-ISO", place + entities + b"\nENDSEC;\nEND-ISO")


LOOSE = b"#900=FACE_SURFACE('',(),#903,.T.);#903=PLANE('',#901);"
LEFT_OUT = {
    "surface.step": (lambda text: text.replace(b"CYLINDRICAL_", b"FANCY_"), r"ADVANCED_FACE in line \d+"),
    "face.step": (lambda text: text.replace(b"ADVANCED_FACE", b"FANCY_FACE", 1), r"CLOSED_SHELL in .* and 1 more"),
    "block.step": (lambda text: with_more(text, b"#900", b"#900=BLOCK('',#901,1.,2.,3.);"), r"BLOCK in line \d+"),
    "unknown.step": (lambda text: with_more(text, b"#900", b"#900=FANCY_SOLID('',#901);"), "FANCY_SOLID in line .*"),
    "loose.step": (lambda text: with_more(text, b"#901", LOOSE), r"FACE_SURFACE in line \d+"),
    "twice.step": (lambda text: text + text, r"another file begins in line \d+"),
    "twice.igs": (lambda text: text + text, r"another file begins in line \d+"),
    "surface.igs": (
        lambda text: text.replace(b"     120   ", b"     190   ").replace(b"\n120,", b"\n190,"),
        "the entity of type 190 in line 5 of section D",
    ),
    "sphere.igs": (
        lambda text: text.replace(b"   402   ", b"   158   ").replace(b"\n402,3,3,35,45;   ", b"\n158,1.,0.,0.,0.;  "),
        "the entity of type 158 in line 1 of section D",
    ),
}


@needs_kernel
@pytest.mark.parametrize("file", LEFT_OUT)
def test_what_the_kernel_leaves_out_is_refused_with_its_place(tmp_path, shapes, file):
    path, (change, message) = write_shape(tmp_path / file, shapes.tin, 0), LEFT_OUT[file]
    text = path.read_bytes()
    path.write_bytes(change(text))
    assert path.read_bytes() != text
    with pytest.raises(InputError, match=rf"{file}: .*{message}"):
        cad_kernel.read_surfaces(path, 0.0)


@needs_kernel
def test_parts_in_other_files_are_refused(tmp_path, shapes, monkeypatch):
    """An assembly of a box and a tin, of which the writer makes three files."""
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFApp import XCAFApp_Application
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document, writer = TDocStd_Document(TCollection_ExtendedString("XmlXCAF")), STEPCAFControl_Writer()
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).AddShape(compound(shapes.box, shapes.tin), True)
    monkeypatch.chdir(tmp_path)
    assert writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs, "part_")
    writer.Write("all.step")
    assert len(list(tmp_path.iterdir())) == 3
    with pytest.raises(InputError, match=r"all\.step: .* does not read the file part_.*\.stp and 1 more, perhaps"):
        cad_kernel.read_surfaces("all.step", 0.0)


@needs_kernel
def test_an_error_of_the_kernel_is_a_sentence_with_the_file(tmp_path, shapes, monkeypatch):
    """A deflection that is no number makes the kernel raise an error of its own."""
    path = write_shape(tmp_path / "box.step", shapes.box)
    monkeypatch.setattr(cad_kernel, "DEFLECTION", (-1.0, -1.0))
    with pytest.raises(InputError, match=r"box\.step: Open CASCADE fails \(Standard_NumericError: .*\)\. Heal it"):
        cad_kernel.read_surfaces(path, 0.0)


@needs_kernel
@pytest.mark.parametrize("file", ["text.step", "text.igs"])
def test_other_content_is_refused(tmp_path, file):
    (tmp_path / file).write_text("This is a letter, not a target. " * 20)
    with pytest.raises(InputError, match=file):
        build_meshes(tmp_path / file, {}, MESH, RADAR)


@needs_kernel
@pytest.mark.parametrize("file", ["curve.step", "curve.igs"])
def test_a_curve_is_refused(tmp_path, file):
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.gp import gp_Pnt

    edge = BRepBuilderAPI_MakeEdge(gp_Pnt(0.0, 0.0, 0.0), gp_Pnt(100.0, 0.0, 0.0)).Edge()
    with pytest.raises(InputError, match=r"curve\..* holds no surfaces"):
        build_meshes(write_shape(tmp_path / file, edge, 0), {}, MESH, RADAR)


@needs_kernel
def test_a_unit_beside_the_files_own_is_refused(tmp_path):
    (tmp_path / "a.step").touch()
    with pytest.raises(InputError, match=r"'targets\.a\.unit': .*a\.step states its own unit"):
        load_config({"targets": {"a": {"mesh": str(tmp_path / "a.step"), "role": "known", "unit": "mm"}}})


def test_without_the_kernel_the_key_and_the_command_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    for file in ("a.step", "a.stp", "a.iges", "A.IGS"):
        (tmp_path / file).write_text("not empty")
        with pytest.raises(
            InputError, match=rf"'targets\.a\.mesh': .*{file}.*pip install.*envs/requirements-step\.lock"
        ):
            load_config({"targets": {"a": {"mesh": str(tmp_path / file), "role": "known"}}})
        with pytest.raises(InputError, match=rf"{file}.*pip install.*envs/requirements-step\.lock"):
            build_meshes(tmp_path / file, {}, MESH, RADAR)
