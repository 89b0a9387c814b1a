"""STEP and IGES files through Open CASCADE, an extra: what it writes itself comes back in metres."""

import importlib.util
from types import SimpleNamespace

import numpy as np
import pytest
from shapes_made import check_solid

from isarflow.core.errors import InputError
from isarflow.mesh import cad_kernel, topology
from isarflow.mesh.build import build
from isarflow.mesh.build import load as load_source
from isarflow.setup.config import load

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
    vertices, triangles = cad_kernel.read_surfaces(path, 0.0)
    assert np.ptp(vertices, axis=0) == pytest.approx(box, rel=1e-3)
    assert topology.areas(vertices, triangles).sum() == pytest.approx(area, rel=1e-3)
    assert topology.tetrahedra(vertices, triangles).sum() == pytest.approx(volume, rel=1e-3)  # so they face outwards
    (mesh,), measures = build(path, {}, MESH, RADAR)
    check_solid(EDGE, mesh, volume, area)
    assert max(measures["bands"][0]["hausdorff"].values()) <= measures["bands"][0]["wavelength"] / 40


@needs_kernel
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_a_bolt_and_the_plate_around_it_are_one(tmp_path, gap):
    """A plate with a hole of 5 mm radius and a bolt that is `gap` mm narrower, turned, so that facets do not match."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopoDS import TopoDS_Compound

    def rod(low, radius, height, along=(1.0, 0.0, 0.0)):
        axes = gp_Ax2(gp_Pnt(-45.0, 0.0, low), gp_Dir(0.0, 0.0, 1.0), gp_Dir(*along))
        return BRepPrimAPI_MakeCylinder(axes, radius, height).Shape()

    plate = BRepPrimAPI_MakeBox(gp_Pnt(-60.0, -40.0, 0.0), 120.0, 80.0, 20.0).Shape()
    turned = (0.9, 0.436, 0.0)
    bolt = BRepAlgoAPI_Fuse(rod(-10.0, 5.0 - gap, 30.0, turned), rod(20.0, 8.0, 6.0, turned)).Shape()
    both, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(both)
    builder.Add(both, BRepAlgoAPI_Cut(plate, rod(-5.0, 5.0, 40.0)).Shape())
    builder.Add(both, bolt)
    source = load_source(write_shape(tmp_path / "bolt.step", both), {}, MESH, RADAR | {"center_frequency": 5e9})
    volume = 120 * 80 * 20 + np.pi * (10 * (5 - gap) ** 2 + 6 * 8**2)
    assert source.measures["volume"] == pytest.approx(1e-9 * volume, rel=1e-3)
    assert topology.components(source.triangles)[0] == 1
    assert (source.repairs["closed_slits"] > 0) == (gap > 0)


@needs_kernel
def test_chords_stay_close_to_a_ball(tmp_path, shapes):
    vertices, triangles = cad_kernel.read_surfaces(write_shape(tmp_path / "ball.step", shapes.ball), 0.0)
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
        vertices, triangles = cad_kernel.read_surfaces(write_shape(tmp_path / "tin.step", shape), 0.0)
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
        build(path, {}, MESH, RADAR)
    with pytest.raises(InputError, match=r"300 m .* its 'length' says 0\.3 m\. Its unit is stated in the file\."):
        build(path, {"length": 0.3}, MESH, RADAR)


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
        build(path, {}, MESH, RADAR)


@needs_kernel
@pytest.mark.parametrize("file", ["text.step", "text.igs"])
def test_other_content_is_refused(tmp_path, file):
    (tmp_path / file).write_text("This is a letter, not a target. " * 20)
    with pytest.raises(InputError, match=file):
        build(tmp_path / file, {}, MESH, RADAR)


@needs_kernel
@pytest.mark.parametrize("file", ["curve.step", "curve.igs"])
def test_a_curve_is_refused(tmp_path, file):
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.gp import gp_Pnt

    edge = BRepBuilderAPI_MakeEdge(gp_Pnt(0.0, 0.0, 0.0), gp_Pnt(100.0, 0.0, 0.0)).Edge()
    with pytest.raises(InputError, match=r"curve\..* holds no surfaces"):
        build(write_shape(tmp_path / file, edge, 0), {}, MESH, RADAR)


@needs_kernel
def test_a_unit_beside_the_files_own_is_refused(tmp_path):
    (tmp_path / "a.step").touch()
    with pytest.raises(InputError, match=r"'targets\.a\.unit': .*a\.step states its own unit"):
        load({"targets": {"a": {"mesh": str(tmp_path / "a.step"), "role": "known", "unit": "mm"}}})


def test_without_the_kernel_the_key_and_the_command_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    for file in ("a.step", "a.stp", "a.iges", "A.IGS"):
        (tmp_path / file).write_text("not empty")
        with pytest.raises(
            InputError, match=rf"'targets\.a\.mesh': .*{file}.*pip install.*envs/requirements-step\.lock"
        ):
            load({"targets": {"a": {"mesh": str(tmp_path / file), "role": "known"}}})
        with pytest.raises(InputError, match=rf"{file}.*pip install.*envs/requirements-step\.lock"):
            build(tmp_path / file, {}, MESH, RADAR)
