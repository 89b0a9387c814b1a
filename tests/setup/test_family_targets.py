"""Families in a config: one target for each model, and what a user reads of a family that cannot be made."""

import re

import pytest
import yaml

from isarflow.core.errors import InputError
from isarflow.learning.experiments import kind_of
from isarflow.mesh import topology
from isarflow.mesh.families import solid, values_of
from isarflow.setup.artefacts import Plan
from isarflow.setup.checkup import REFUSED, brief, checkup
from isarflow.setup.config import ROOT, load_config
from isarflow.setup.overview import overview
from isarflow.setup.yaml_file import read_yaml

FAMILY = {"kind": "quadcopter", "count": 3, "seed": 1}
MESH = {"mesh": "resources/cad/drone.stl", "role": "known"}


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch):
    monkeypatch.chdir(ROOT)


def targets_of(*overlays, **targets):
    return load_config({"targets": targets}, *({"targets": overlay} for overlay in overlays))["targets"]


def test_a_family_becomes_a_target_for_each_model():
    vary = {"arm": [0.02, 0.022]}
    targets = targets_of(quad={"family": FAMILY | {"vary": vary}, "role": "known", "scale": 2})
    assert [name for name in targets if name.startswith("quad")] == ["quad_01", "quad_02", "quad_03"]
    family = {"kind": "quadcopter", "seed": 1, "number": 2, "vary": vary}
    said = {"role": "known", "class": "quad", "kind": "quadcopter", "symmetry": ["xz"], "scale": 2}
    assert targets["quad_02"] == said | {"family": family}
    assert 0.02 <= values_of("quadcopter", 1, 2, vary)["arm"] <= 0.022


def test_a_family_may_say_another_class_kind_and_symmetry():
    targets = targets_of(
        quad={"family": FAMILY, "role": "known", "class": "drone", "kind": "small", "symmetry": []},
        disc={"family": FAMILY | {"kind": "saucer"}, "role": "other"},
        drone=MESH | {"kind": "quadcopter"},
    )
    assert {key: targets["quad_01"][key] for key in ("class", "kind", "symmetry")} == {
        "class": "drone",
        "kind": "small",
        "symmetry": [],
    }
    assert targets["disc_01"]["symmetry"] == ["xz", "yz"] and "class" not in targets["disc_01"]
    kinds = {name: kind_of(targets, name) for name in ("quad_01", "disc_01", "drone", "missile")}
    assert kinds == {"quad_01": "small", "disc_01": "saucer", "drone": "quadcopter", "missile": "missile"}


def test_a_further_model_of_a_family_has_one_line_in_a_check_beside_what_is_wrong():
    config = load_config({"targets": {"box": {"family": FAMILY | {"kind": "box"}, "role": "other"}}})
    found = checkup(config, "box_02")
    (line,) = brief("box_02", found)
    assert re.fullmatch(r"box_02: size .* m, [\d,]+ triangles; up to .* unknowns, .* s on two cores", line)
    assert brief("box_02", [*found, f"{REFUSED} it is too large."]) == [line, f"{REFUSED} it is too large."]


def test_more_than_99_models_have_three_digits():
    names = [*targets_of(quad={"family": FAMILY | {"count": 100}, "role": "other"})]
    assert {"quad_001", "quad_100"} < {*names} and "quad_01" not in names


def test_an_overlay_changes_a_key_of_a_family():
    base = {"quad": {"family": FAMILY | {"vary": {"arm": [0.02, 0.02]}}, "role": "known", "class": "drone"}}
    more = targets_of({"quad": {"family": {"count": 4}}}, **base)
    assert more["quad_04"]["class"] == "drone" and more["quad_04"]["family"]["vary"] == {"arm": [0.02, 0.02]}
    # What is said of one kind does not hold for another, nor for a mesh.
    another = targets_of({"quad": {"family": FAMILY | {"kind": "bird"}}}, **base)
    assert another["quad_01"]["family"]["vary"] == {} and another["quad_01"]["class"] == "quad"
    mesh = targets_of({"quad": {"mesh": MESH["mesh"]}}, **base)
    assert mesh["quad"] == MESH


def test_the_generator_that_the_page_prints(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs/families.md").read_text()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/dumbbell.py").write_text(*re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
    first, twin, own = map(yaml.safe_load, re.findall(r"^```yaml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
    assert load_config(twin | NO_LEARNING)["targets"]["twin_01"]["parts"]["shell"]["material"]["resistance"] == 0
    config = load_config(first, own | NO_LEARNING)
    assert [*config["targets"]] == [
        *("quad_01", "quad_02", "quad_03", "rocket_01", "rocket_02", "rocket_03", "bird_01", "bird_02"),
        *(f"dumbbell_0{number}" for number in (1, 2, 3, 4)),
    ]
    target = config["targets"]["dumbbell_02"]
    assert target["kind"] == "dumbbell" and target["symmetry"] == ["xz"]
    assert Plan(config).generator_file("dumbbell_02") == str(tmp_path / "mine/dumbbell.py")
    vertices, triangles = solid(target["family"])
    assert topology.is_watertight(triangles) and topology.components(triangles)[0] == 1
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert 0.4 < (high - low).max() < 0.8 and low[1] == -high[1]


def test_a_family_of_parts_has_their_materials_and_a_target_may_say_others():
    family = {"family": FAMILY | {"kind": "drone_plastic", "count": 1}, "role": "other"}
    card = {"blades": {"material": "space_cloth"}}
    for targets in (
        targets_of(x=family | {"parts": card}),
        targets_of({"x": {"parts": card}}, x=family | {"scale": 2}),
    ):
        parts = targets["x_01"]["parts"]
        assert parts["metal"] == {} and parts["shell"]["material"]["permittivity"] == 2.7
        assert parts["blades"]["material"] == {"name": "space_cloth", "resistance": 376.73}
    assert targets["x_01"]["scale"] == 2  # other materials are no other target


PARTS = {
    "part": ({"parts": {"shel": {}}}, "parts.shel", "drone_plastic has no such part; did you mean 'shell'?"),
    "material": ({"material": "abs"}, "x.material", "drone_plastic has parts, each of its own: shell, blades, metal."),
    "mesh": ({"parts": {"shell": {"mesh": "a.stl"}}}, "parts.shell.mesh", "nothing, as a family's parts are made"),
    "name": ({"parts": {"shell": {"material": "ab"}}}, "parts.shell.material", "no material 'ab'; did you mean 'abs'?"),
}


@pytest.mark.parametrize("case", PARTS)
def test_parts_that_a_family_does_not_have_are_refused(case):
    more, key, message = PARTS[case]
    family = FAMILY | {"kind": "drone_plastic"}
    with pytest.raises(InputError, match=re.escape(message)) as error:
        targets_of(x={"family": family, "role": "other", **more})
    assert key in str(error.value)


@pytest.mark.parametrize(
    "part, material, why",
    [
        ("feathers", {"name": "muscle", "surface": "leontovich"}, "the mesh is open or its triangles disagree"),
        (
            "flesh",
            {"permittivity": 50, "loss_tangent": 0, "surface": "leontovich"},
            "on 100 % of its area the opaque body",
        ),
        ("feathers", "space_cloth", None),
    ],
)
def test_a_check_refuses_opaque_parts_that_are_open_or_thin(part, material, why):
    family = {"kind": "bird_water", "count": 1, "seed": 1}
    target = {"family": family, "role": "other", "parts": {part: {"material": material}}}
    config = load_config({"targets": {"bird": target}})
    refused = [line for line in checkup(config, "bird_01") if line.startswith(REFUSED)]
    if why is None:
        assert refused == []
    else:
        (line,) = refused
        assert line.startswith(f"{REFUSED} part '{part}': {why}")


def test_a_family_of_one_body_has_no_parts():
    with pytest.raises(InputError, match=r"quadcopter has no such part.* Its models are one body of metal\."):
        targets_of(quad={"family": FAMILY, "role": "other", "parts": {"shell": {"material": "abs"}}})


NO_LEARNING = {"learning": {"experiments": {"*": None}}}
BAD = {
    "kind": (FAMILY | {"kind": "quadcoptr"}, "quad.family.kind", "no family 'quadcoptr'; did you mean 'quadcopter'?"),
    "path": (FAMILY | {"kind": "my/own.py"}, "quad.family.kind", "there is no file my/own.py"),
    "parameter": (FAMILY | {"vary": {"arms": [0, 1]}}, "quad.family.vary.arms", "did you mean 'arm'?"),
    "below": (
        FAMILY | {"vary": {"arm": [0.001, 0.02]}},
        "vary.arm",
        "0.001 to 0.02 must ascend within 0.018 to 0.028 m",
    ),
    "above": (FAMILY | {"vary": {"arm": [0.02, 1]}}, "vary.arm", "0.02 to 1 must ascend"),
    "order": (FAMILY | {"vary": {"arm": [0.025, 0.02]}}, "vary.arm", "0.025 to 0.02 must ascend"),
    "whole": (FAMILY | {"vary": {"blades": [2, 2.5]}}, "vary.blades", "in whole numbers (of a propeller)"),
    "one bound": (FAMILY | {"vary": {"arm": 0.02}}, "vary.arm", "Expected: [low, high]"),
    "no model": (FAMILY | {"count": 0}, "quad.family.count", "0 is less than the minimum of 1"),
    "no seed": ({"kind": "bird", "count": 1}, "quad.family.seed", "is missing"),
    "misspelt": (FAMILY | {"cuont": 3}, "quad.family.cuont", "did you mean 'count'?"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_family_that_cannot_be_made_is_refused(case):
    family, key, message = BAD[case]
    with pytest.raises(InputError, match=re.escape(message)) as error:
        targets_of(quad={"family": family, "role": "other"})
    assert str(error.value).startswith("config key 'targets.") and key in str(error.value)


@pytest.mark.parametrize("more", [{"mesh": MESH["mesh"]}, {"field": "x.zarr"}, {"length": 1}, {"unit": "mm"}])
def test_a_family_is_neither_a_mesh_nor_a_field(more):
    (key,) = more
    with pytest.raises(InputError, match=r"^config key 'targets\.quad\.\w+': .* is not allowed\. Expected: ") as error:
        targets_of(quad={"family": FAMILY, "role": "other", **more})
    assert key in str(error.value)


def test_a_model_with_the_name_of_another_target_is_refused():
    family = {"family": FAMILY, "role": "other"}
    for targets in ({"quad": family, "quad_02": MESH}, {"quad_02": MESH, "quad": family}):
        with pytest.raises(InputError, match=r"^config key 'targets': there are two targets quad_02, one "):
            targets_of(**targets)


def test_the_overview_has_a_row_for_a_family(tmp_path):
    config = load_config(
        {
            "targets": {
                "*": None,
                "quad": {"family": FAMILY, "role": "other"},
                "drone": MESH,
            },
            **NO_LEARNING,
        }
    )
    lines = overview(config, tmp_path)
    (row,) = (line for line in lines if line.startswith("  quad"))
    assert re.fullmatch(r"  quad \(3 models\): up to 20,\d+ unknowns, 1\.4 GB, \d+ to \d+ min", row)
    assert any(line.startswith("  drone: up to ") for line in lines)


def test_a_scaled_model_is_meant_as_it_is(tmp_path):
    """Its numbers are metres, so a size beyond the usual is no mistaken unit."""
    scaled = {"*": None, "quad": {"family": FAMILY, "role": "other", "scale": 30}}
    config = load_config({"targets": scaled, "scattering": {"solver": "po"}, **NO_LEARNING})
    assert any(line.startswith("  quad (3 models): ") for line in overview(config, tmp_path, refuse=True))


def test_the_shipped_families_are_a_hundred_targets():
    targets = load_config(read_yaml(ROOT / "config/families.yaml"))["targets"]
    kinds = {name: kind_of(targets, name) for name in targets}
    assert len(targets) == 100 and len({*kinds.values()}) == 23
    assert sum(target.get("class") == "drone" for target in targets.values()) == 20
    assert sum(target.get("class") == "missile" for target in targets.values()) == 20
