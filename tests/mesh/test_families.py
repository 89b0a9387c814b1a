"""The generators of families: closed parts, one sound body, no two alike, and the same whenever they are made.

Parts are looked at for 50 models of each kind. Their union takes half a second, so it is made of MODELS of each:
FAMILY_MODELS=50 makes as many (ten minutes).
"""

import os

import numpy as np
import pytest

from isarflow.core.kinds import FAMILIES, available, kind
from isarflow.mesh import topology
from isarflow.mesh.build import build_bands, build_meshes, load_source
from isarflow.mesh.families import (
    is_whole,
    joined,
    materials_of,
    mirror_planes,
    parts_of,
    solid,
    stated_values,
    surfaces,
    values_of,
)
from isarflow.mesh.parts import carried
from isarflow.mesh.repair.surface import repair
from isarflow.mesh.symmetry import AXES
from isarflow.setup.config import ROOT, load_config

MODELS = int(os.environ.get("FAMILY_MODELS", 1))
LOOKED_AT = range(1, 51)
EVERY = available(FAMILIES)
OF_PARTS = [name for name in EVERY if materials_of(name)]
KINDS = [name for name in EVERY if name not in OF_PARTS]  # of metal
CLASSES = {
    "drone": ("quadcopter", "hexacopter", "octocopter", "fixed_wing_drone"),
    "missile": ("cruise_missile", "cruciform_missile", "plain_missile", "bomb"),
}
MOVING = {*OF_PARTS, "bird", "fixed_wing_drone", "helicopter", "satellite", "twin_boom", *CLASSES["drone"]}


def family(name, number, **more):
    return {"kind": name, "seed": 1, "number": number, "vary": {}} | more


def is_symmetric(vertices, triangles, plane):
    """Tell whether each triangle has its mirror image, bit for bit."""
    sign = np.where(np.arange(3) == AXES[plane], -1.0, 1.0)
    faces, images = (
        {tuple(sorted(map(tuple, face))) for face in v[triangles]} for v in (vertices, vertices * sign + 0.0)
    )
    return faces == images


def test_there_are_drones_missiles_and_fifteen_kinds_of_others():
    others = {*KINDS} - {name for names in CLASSES.values() for name in names}
    assert len(KINDS) == 23 and len(others) == 15


@pytest.mark.parametrize("name", EVERY)
def test_parameters_are_stated_with_bounds_and_units(name):
    stated = kind(FAMILIES, name).stated["PARAMETERS"]
    assert len(stated) >= 5
    for rule in stated.values():
        assert {*rule} <= {"minimum", "maximum", "unit", "description", "whole"} and rule["description"]
        assert rule["minimum"] < rule["maximum"] and rule["unit"] in ("", "m", "degrees")
    numbers = [values_of(name, seed, number, {}) for seed in (0, 1) for number in range(1, 101)]
    for parameter, rule in stated.items():
        drawn = np.array([values[parameter] for values in numbers])
        assert rule["minimum"] <= drawn.min() and drawn.max() <= rule["maximum"]
        if is_whole(rule):
            assert {*drawn} == {*range(rule["minimum"], rule["maximum"] + 1)}
        else:
            assert np.ptp(drawn) > 0.9 * (rule["maximum"] - rule["minimum"])  # 0.95 to 1.00 of 200 draws
    assert len({tuple(values.values()) for values in numbers}) == 200
    low = next(iter(stated))
    narrow = {low: [stated[low]["minimum"]] * 2}
    narrowed = values_of(name, 1, 1, narrow)
    assert narrowed == numbers[100] | {low: stated[low]["minimum"]}  # the other parameters are what they were


def test_a_models_numbers_are_those_of_the_dataset():
    """What was drawn when the fields were solved; another way of drawing would be another dataset."""
    values = stated_values(family("quadcopter", 1))
    assert values["reach"] == {"value": 0.27522, "unit": "m"} and values["blades"] == {"value": 3, "unit": ""}


@pytest.mark.parametrize("name", KINDS)
def test_every_part_of_fifty_models_is_closed(name):
    for number in LOOKED_AT:
        parts = parts_of(family(name, number))
        for part, (vertices, triangles) in parts.items():
            said = f"{part} of {number}"
            assert topology.is_watertight(triangles) and topology.components(triangles)[0] == 1, said
            assert topology.tetrahedra(vertices, triangles).sum() > 0, said
        vertices, _ = joined(family(name, number))
        assert 0.25 <= np.ptp(vertices, axis=0).max() <= 1.15, number  # 0.26 to 1.14 when this was set


@pytest.mark.parametrize("name", KINDS)
def test_a_model_is_one_closed_symmetric_body_and_always_the_same(name):
    for number in range(1, MODELS + 1):
        vertices, triangles = solid(family(name, number))
        assert topology.is_watertight(triangles) and topology.components(triangles)[0] == 1, number
        assert topology.tetrahedra(vertices, triangles).sum() > 0
        assert is_symmetric(vertices, triangles, "xz"), number
        box = np.ptp(vertices, axis=0)
        np.testing.assert_allclose(box, np.ptp(joined(family(name, number))[0], axis=0), atol=1e-6)  # no part is lost
    again = solid(family(name, MODELS))
    assert np.array_equal(vertices, again[0]) and np.array_equal(triangles, again[1])


@pytest.mark.parametrize("name", EVERY)
def test_a_pose_moves_what_turns_or_beats_and_nothing_else(name):
    for number in LOOKED_AT[:5]:
        rest, whole, moved = (parts_of(family(name, number), pose) for pose in (0.0, 1.0, 0.3))
        for part, (vertices, triangles) in rest.items():
            np.testing.assert_allclose(whole[part][0], vertices, atol=1e-9)
            assert len(moved[part][1]) == len(triangles)
        still = {part for part in rest if np.allclose(rest[part][0], moved[part][0], atol=1e-9)}
        assert ({*rest} != still) == (name in MOVING)
        assert still


@pytest.mark.parametrize("name", sorted(MOVING - {*OF_PARTS}))
def test_a_moved_model_is_one_closed_body(name):
    vertices, triangles = solid(family(name, 2), 0.3)
    assert topology.is_watertight(triangles) and topology.components(triangles)[0] == 1
    planes = mirror_planes(name, 0.3)
    assert all(is_symmetric(vertices, triangles, plane) for plane in planes)
    assert (planes == []) == (name in ("fixed_wing_drone", "helicopter", "twin_boom"))


@pytest.mark.parametrize("name", OF_PARTS)
def test_every_part_of_fifty_models_is_closed_or_a_flat_sheet(name):
    for number in LOOKED_AT:
        for part, (vertices, triangles) in parts_of(family(name, number)).items():
            said = f"{part} of {number}"
            assert topology.components(triangles)[0] == 1, said
            if topology.is_watertight(triangles):
                assert topology.tetrahedra(vertices, triangles).sum() > 0, said
            else:
                normal = topology.shape(vertices[triangles])[0]
                np.testing.assert_allclose(normal, normal[:1].repeat(len(normal), 0), atol=1e-9, err_msg=said)
        assert 0.25 <= np.ptp(joined(family(name, number))[0], axis=0).max() <= 1.15, number


@pytest.mark.parametrize("name", OF_PARTS)
@pytest.mark.parametrize("pose", [0.0, 0.3])
def test_a_model_of_parts_has_the_surface_of_each_and_always_the_same(name, pose):
    made, again = (surfaces(family(name, 1), pose) for _ in range(2))
    assert made.keys() == materials_of(name).keys()
    for part, (vertices, triangles) in made.items():
        assert np.array_equal(vertices, again[part][0]) and np.array_equal(triangles, again[part][1])
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        assert low[1] == -high[1], part
    every = np.concatenate([vertices for vertices, _ in made.values()])
    np.testing.assert_allclose(
        np.ptp(every, axis=0),
        np.ptp(np.concatenate([own for own, _ in parts_of(family(name, 1), pose).values()]), axis=0),
    )


def test_sizes_of_the_classes_overlap():
    """No length tells a class: of each, a quarter of the models is longer than the median of another."""
    kinds = {name: [name] for name in KINDS} | CLASSES
    kinds = {label: kinds[label] for label in CLASSES} | {
        "other": [n for n in KINDS if n not in sum(CLASSES.values(), ())]
    }
    longest = {
        label: np.array(
            [np.ptp(joined(family(name, number))[0], axis=0).max() for name in names for number in (1, 2, 3)]
        )
        for label, names in kinds.items()
    }
    for one in longest.values():
        for other in longest.values():
            assert np.mean(one > np.median(other)) > 0.2  # 0.33 at least when this was set


@pytest.mark.parametrize("name", ["quadcopter", "plain_missile"])
def test_the_mesh_stage_takes_a_model(name):
    radar = {"center_frequency": 2.775e9, "bandwidth": 1.5e9, "frequencies": 14}
    target = {"family": family(name, 1), "symmetry": mirror_planes(name)}
    (_,), measures = build_meshes(name, target, {"edges_per_wavelength": 10, "bands": 1}, radar)
    (band,) = measures["bands"]
    assert band["missed"] is None and band["watertight"] and band["components"] == 1


@pytest.mark.parametrize("name", OF_PARTS)
def test_the_mesh_stage_takes_a_model_of_parts(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    said = {"targets": {"model": {"family": {"kind": name, "count": 1, "seed": 1}, "role": "other"}}}
    target, mesh = load_config(said)["targets"]["model_01"], {"edges_per_wavelength": 10, "bands": 1}
    radar = {"center_frequency": 1.4e9, "bandwidth": 0.75e9, "frequencies": 14}
    source = load_source(name, target, mesh, radar)
    ((vertices, triangles),), measures = build_bands(source, name, target, mesh, radar)
    assert measures["bands"][0]["missed"] is None
    part, area = carried(source, (vertices, triangles), target["symmetry"], name), topology.areas(vertices, triangles)
    assert [*target["parts"]] == [*materials_of(name)]
    assert (np.bincount(part, area) / area.sum()).min() > 0.05


def test_edges_of_a_micrometre_go_and_the_body_stays():
    """The legs of this one graze its skids: cutting moves two corners together, and nothing else is to be repaired."""
    vertices, triangles = solid(family("hexacopter", 5))
    assert topology.edge_lengths(vertices, triangles).min() < 1e-6
    repaired, kept, counts, _ = repair(vertices, triangles, 0.0085, "hexacopter")
    assert len(kept) < len(triangles) and topology.is_watertight(kept) and kept.max() == len(repaired) - 1
    volume, before = (topology.tetrahedra(*body).sum() for body in ((repaired, kept), (vertices, triangles)))
    assert volume == pytest.approx(before, rel=1e-6)
    assert not any(counts[name] for name in ("connected_crossings", "hidden_triangles", "united_solids"))
