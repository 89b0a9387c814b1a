"""Half models: what a file has on one side of a mirror plane alone is completed, or warned of."""

import numpy as np
import pytest
from shapes_made import cube, soup, sphere, together

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.build import build_meshes, load_source
from isarflow.mesh.io import write_ply
from isarflow.mesh.symmetry import positive_half
from isarflow.scattering.solve import solve

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.0, "frequencies": 1, "polarizations": ["VV"]}
MESH = {"edges_per_wavelength": 10, "bands": 1}
NEAR = 0.0299792458 / 40  # m, within which parts lie in a plane


def half(surface, *axes):
    """The part of a surface at positive coordinates, open where it is cut."""
    for axis in axes:
        surface = positive_half(*surface, 1e-9, axis)
    return surface


def moved(surface, *shift):
    return surface[0] + shift, surface[1]


def without(surface, axis, end):
    """A surface without its faces at this coordinate."""
    vertices, triangles = surface
    return vertices, triangles[~(np.abs(vertices[triangles][:, :, axis] - end) < 1e-9).all(axis=1)]


def plate(*corners):
    return np.array(corners, float), np.array([[0, 1, 2], [0, 2, 3]])


def rough(surface):
    """A surface whose rims at y = 0 are up to half as far from it as still lies in the plane."""
    vertices, at_plane = surface[0].copy(), surface[0][:, 1] == 0
    vertices[at_plane, 1] = NEAR / 2 * np.sin(np.arange(at_plane.sum()))
    return vertices, surface[1]


BALL, BOX = sphere(0.1, 3), moved(cube(0.2), 0, 0.1, 0)
WHOLE = topology.areas(*BALL).sum(), topology.tetrahedra(*BALL).sum()
OPEN = without(BOX, 1, 0.0)
STANDING = plate([-0.1, 0, 0], [0.1, 0, 0], [0.1, 0, 0.2], [-0.1, 0, 0.2])
FIN = plate([0.1, 0, -0.1], [0.3, 0, -0.1], [0.3, 0, 0.1], [0.1, 0, 0.1])
# Each with the target's keys, and the area and volume of the whole.
HALVES = {
    "half": (half(BALL, 1), {"symmetry": ["xz"]}, *WHOLE),
    "other_side": ((half(BALL, 1)[0] * [1, -1, 1], half(BALL, 1)[1][:, ::-1]), {"symmetry": ["xz"]}, *WHOLE),
    "with_a_plane_of_its_own": (half(BALL, 1), {"symmetry": ["xz", "xy"]}, *WHOLE),
    "quarter": (half(BALL, 0, 1), {"symmetry": ["xz", "yz"]}, *WHOLE),
    "eighth": (half(BALL, 0, 1, 2), {"symmetry": ["xz", "yz", "xy"]}, *WHOLE),
    "rough": (rough(half(BALL, 1)), {"symmetry": ["xz"]}, *WHOLE),
    "loose_triangles": (soup(*half(BALL, 1)), {"symmetry": ["xz"]}, *WHOLE),
    "turned": (half(BALL, 1), {"symmetry": ["yz"], "rotate": [0, 0, 90]}, *WHOLE),
    "moved": (moved(half(BALL, 1), 0, 0, 0.3), {"symmetry": ["xz", "xy"], "translate": [0, 0, -0.3]}, *WHOLE),
    "with_a_face_in_the_plane": (BOX, {"symmetry": ["xz"]}, 0.4, 0.016),
    "quarter_with_faces": (moved(BOX, 0.1, 0, 0), {"symmetry": ["xz", "yz"]}, 0.64, 0.032),
    "with_a_face_and_open_beyond": (without(BOX, 1, 0.2), {"symmetry": ["xz"]}, 0.36, None),
    # The fin stands on an edge of the box's face in the plane, or goes on beyond another one.
    "with_a_face_and_a_fin_on_it": (together(BOX, moved(STANDING, 0, 0, 0.1)), {"symmetry": ["xz"]}, 0.44, None),
    "with_a_face_and_a_fin_beyond": (together(BOX, FIN), {"symmetry": ["xz"]}, 0.44, None),
    "sheet": (STANDING, {"symmetry": ["xy"]}, 0.08, None),
    "with_a_plate_in_the_plane": (together(OPEN, moved(STANDING, 0, 0, 0.1)), {"symmetry": ["xz"]}, 0.44, None),
}  # fmt: skip


def loaded(tmp_path, surface, target):
    path = tmp_path / "a.ply"
    write_ply(path, np.asarray(surface[0], float), np.asarray(surface[1], np.int32))
    return load_source(path, target, MESH, RADAR)


@pytest.mark.parametrize("name", HALVES)
def test_a_half_model_is_completed_where_its_plane_is_named(tmp_path, name):
    surface, target, area, volume = HALVES[name]
    source = loaded(tmp_path, surface, target)
    assert source.measures["area"] == pytest.approx(area, rel=1e-3 if name == "rough" else 1e-6)
    assert source.measures["volume"] == (volume and pytest.approx(volume, rel=5e-3 if name == "rough" else 1e-6))
    assert any(sentence.startswith("The file has ") for sentence in source.measures["warnings"])


def test_a_completed_half_has_the_mesh_and_the_field_of_the_whole(tmp_path):
    bands, fields = [], []
    for name, surface in (("half", half(BALL, 1)), ("whole", BALL)):
        (tmp_path / name).mkdir()
        loaded(tmp_path / name, surface, {"symmetry": ["xz"]})
        (mesh,), measures = build_meshes(tmp_path / name / "a.ply", {"symmetry": ["xz"]}, MESH, RADAR)
        (band,) = measures["bands"]
        assert band["missed"] is None and band["watertight"] and band["components"] == 1 and band["mirror_error"] == 0
        assert measures["source"].get("completed") == (["xz"] if name == "half" else None)
        bands.append(band)
        fields.append(solve(*mesh, [1.0e9], [0.0, 40.0], [0.0, 30.0, 90.0], ["VV", "HH"], ["xz"]).field)
    completed, whole = bands
    assert completed["unknowns"] == pytest.approx(whole["unknowns"], rel=0.05)  # 501 and 495
    assert completed["area"]["after"] == pytest.approx(whole["area"]["after"], rel=1e-3)
    assert completed["volume"]["after"] == pytest.approx(whole["volume"]["after"], rel=1e-6)
    assert fields[0] == pytest.approx(fields[1], rel=0.01)  # 0.003


CORNER = [
    plate([0, 0, 0], [0.2, 0, 0], [0.2, 0.2, 0], [0, 0.2, 0]),
    plate([0, 0, 0], [0, 0.2, 0], [0, 0.2, 0.2], [0, 0, 0.2]),
    plate([0, 0, 0], [0, 0, 0.2], [0.2, 0, 0.2], [0.2, 0, 0]),
]
ASKED = {  # with what the warning says, if there is one
    "half": (half(BALL, 1), {}, r"one side of the plane xz .*half model\? If so, 'symmetry: \[xz\]' completes"),
    "half_with_another_plane": (half(BALL, 1), {"symmetry": ["yz"]}, r"'symmetry: \[yz, xz\]' completes"),
    "quarter": (half(BALL, 0, 1), {}, r"of the planes yz and xz .*'symmetry: \[yz, xz\]' completes"),
    "quarter_with_one_plane": (half(BALL, 0, 1), {"symmetry": ["xz"]}, r"of the plane yz .*'symmetry: \[xz, yz\]'"),
    "loose_triangles": (soup(*half(BALL, 1)), {}, r"'symmetry: \[xz\]' completes"),
    "beside_the_plane": (moved(half(BALL, 1), 0, 0.01, 0), {}, None),
    "whole": (BALL, {}, None),
    "open_box_on_its_floor": (without(BOX, 1, 0.2), {}, None),
    "box": (BOX, {}, None),
    "sheet_on_its_edge": (STANDING, {}, None),
    "corner_of_plates": (together(*CORNER), {}, None),
    "touching": (moved(BALL, 0, 0.1, 0), {}, None),
}  # fmt: skip


@pytest.mark.parametrize("name", ASKED)
def test_a_target_that_is_cut_open_at_a_plane_is_warned_of(tmp_path, name):
    surface, target, message = ASKED[name]
    sentences = loaded(tmp_path, surface, target).measures["warnings"]
    asked = [sentence for sentence in sentences if "half model" in sentence]
    assert len(asked) == (message is not None)
    if message:
        with pytest.raises(InputError, match=message):
            raise InputError(asked[0])


TURNED = (cube(0.2)[0] @ np.array([[1, 1, 0], [-1, 1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2), cube()[1])
BOLT = moved((cube(0.2)[0] * [0.1, 0.4, 0.1], cube()[1]), 0, 0, 0.3)
REFUSED = {
    "beside_the_plane": (moved(half(BALL, 1), 0, 0.01, 0), r"cut open at y = 0\.01 m, .* translate it, or leave"),
    "with_a_face_beside_the_plane": (moved(BOX, 0, 0.01, 0), r"has a flat face at y = 0\.01 m, .* translate it, or"),
    "beyond_the_plane": (
        moved(half(BALL, 1), 0, -0.01, 0),
        r"cut open at y = -0\.01 m, .* translate it, or leave this",
    ),
    "with_a_bolt_through_it": (
        together(half(BALL, 1), moved(BOLT, 0, 0.02, 0)),
        r"but goes on beyond it by 20 mm",
    ),
    "on_its_edge": (moved(TURNED, 0, 0.1 * np.sqrt(2), 0), r"lies on one side, but is not cut in this plane.*mend it"),
    "sheet_beside_it": (moved(CORNER[0], 0, -0.07, 0), r"mm\); mend it or leave this plane out\.$"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_one_that_is_no_half_of_its_plane_is_told_what_would_make_it_one(tmp_path, name):
    surface, message = REFUSED[name]
    with pytest.raises(InputError, match=rf"a\.ply is not symmetric about y = 0: .*{message}"):
        loaded(tmp_path, surface, {"symmetry": ["xz"]})
