"""Targets whose parts move in a config: what their poses are, and what a user reads of poses that cannot be."""

import pytest

from isarflow.core.errors import InputError
from isarflow.learning.experiments import imaged, runs
from isarflow.mesh.families import solid, values_of
from isarflow.mesh.read.target import read_target
from isarflow.setup.artefacts import Plan
from isarflow.setup.config import ROOT, load_config
from isarflow.setup.overview import overview

CAD = [f"resources/cad/{name}.stl" for name in ("bird", "drone", "ufo")]
FLYER = {"poses": CAD, "role": "known", "class": "flyer", "symmetry": ["xz"]}
QUAD = {"family": {"kind": "quadcopter", "seed": 3}, "role": "unknown"}


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch):
    monkeypatch.chdir(ROOT)


def loaded(motion=None, **targets):
    return load_config({"targets": targets or {"drone": {}}, "motion": motion or {}})


def test_the_first_pose_is_the_target_and_the_others_are_solved_alone():
    config = loaded(flyer=FLYER)
    of_flyer = {name: target for name, target in config["targets"].items() if "flyer" in name}
    shared = {"symmetry": ["xz"]}
    assert of_flyer == {
        "flyer": shared
        | {"mesh": CAD[0], "role": "known", "class": "flyer", "poses": ["flyer_pose_01", "flyer_pose_02"]},
        "flyer_pose_01": shared | {"mesh": CAD[1], "role": "pose"},
        "flyer_pose_02": shared | {"mesh": CAD[2], "role": "pose"},
    }
    plan = Plan(config)
    assert "flyer_pose_01" in plan.meshed and "flyer_pose_01" not in plan.targets
    assert plan.poses("flyer") == of_flyer["flyer"]["poses"] and plan.poses("drone") == []
    assert "flyer_pose_01" not in imaged(config) and "flyer_pose_01" not in str(runs(config))


def test_poses_of_a_family_stand_evenly_over_what_repeats_and_share_its_planes():
    config = loaded(quad=QUAD | {"poses": 4}, plane=QUAD | {"family": {"kind": "twin_boom", "seed": 1}, "poses": 2})
    targets, blades = config["targets"], values_of("quadcopter", 3, 1, {})["blades"]
    poses = [targets[name]["family"].get("pose", 0) for name in ("quad", *targets["quad"]["poses"])]
    assert poses == pytest.approx([number / 4 / blades for number in range(4)])
    assert targets["plane"]["symmetry"] == targets["plane_pose_01"]["symmetry"] == []  # the airscrew has left them
    assert targets["plane_pose_01"]["family"]["pose"] == 0.5
    read, *_ = read_target("", targets["quad_pose_01"], config["mesh"], config["radar"])
    assert (read == solid(targets["quad_pose_01"]["family"], 0.25 / blades)[0]).all()


def test_a_family_without_a_count_is_one_target_and_each_model_of_others_has_poses():
    targets = loaded(quad=QUAD, many=QUAD | {"family": QUAD["family"] | {"count": 2}, "poses": 2})["targets"]
    assert targets["quad"]["family"] == {"kind": "quadcopter", "seed": 3, "number": 1, "vary": {}}
    assert [name for name in targets if "many" in name] == ["many_01", "many_01_pose_01", "many_02", "many_02_pose_01"]
    assert targets["many_01"]["kind"] == "quadcopter" and "kind" not in targets["many_01_pose_01"]


def test_parts_move_together():
    parts = {"body": {"mesh": CAD[0], "material": {"resistance": 9}}, "wing": {"poses": CAD[1:]}}
    targets = loaded(flyer={"parts": parts, "role": "other"})["targets"]
    assert targets["flyer"]["parts"]["wing"] == {"mesh": CAD[1]}
    assert targets["flyer_pose_01"]["parts"]["wing"] == {"mesh": CAD[2]}
    assert targets["flyer_pose_01"]["parts"]["body"] == targets["flyer"]["parts"]["body"]


def test_a_plan_has_a_line_for_a_target_with_its_poses():
    lines = overview(loaded(flyer=FLYER, quad=QUAD | {"poses": 2}), "results/none")
    assert {"  flyer (3 models and poses)", "  quad (2 models and poses)"} <= {line.split(":")[0] for line in lines}


def test_still_is_no_pose_a_pulse():
    experiments = {
        "e": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["lr"], "motion": {"poses": "random"}}
    }
    config = load_config({"targets": {"flyer": FLYER}, "learning": {"experiments": {"*": None, **experiments}}})
    assert config["motion"]["poses"] == 0 and Plan(config).folder("e") == "moved/poses_random"
    assert loaded(flyer=FLYER, motion={"poses": "still"}) == loaded(flyer=FLYER)
    at_rate = load_config({"targets": {"flyer": FLYER}, "motion": {"poses": 2.5}})
    assert Plan(at_rate).motions["imaging"]["poses"] == 2.5


PARTS = {"body": {"poses": CAD}, "wing": {"poses": CAD[1:]}}
WRONG = {
    "poses that differ in number": ({"parts": PARTS, "role": "other"}, "targets.flyer.parts", "body has 3, wing has 2"),
    "one pose": (FLYER | {"poses": CAD[:1]}, "targets.flyer.poses", "two"),
    "a number of files": (FLYER | {"poses": 3}, "targets.flyer.poses", "the paths of two or more CAD files"),
    "files of a family": (QUAD | {"poses": CAD}, "targets.flyer.poses", "the number of poses"),
    "a mesh beside": (FLYER | {"mesh": CAD[0]}, "targets.flyer", "one of 'mesh'"),
    "a part with both": (
        {"parts": {"body": {"mesh": CAD[0], "poses": CAD}}, "role": "other"},
        "targets.flyer.parts.body",
        "one of 'mesh'",
    ),
    "no such file": (
        FLYER | {"poses": [CAD[0], "none.stl"]},
        "targets.flyer_pose_01.mesh",
        "there is no file none.stl",
    ),
    "a field": (FLYER | {"poses": ["a.zarr", "b.zarr"]}, "targets.flyer.mesh", "a.zarr is not one of .stl"),
}


@pytest.mark.parametrize(("target", "key", "text"), WRONG.values(), ids=WRONG)
def test_bad_poses_are_refused(target, key, text):
    with pytest.raises(InputError) as refused:
        loaded(flyer=target)
    assert key in str(refused.value) and text in str(refused.value), refused.value


def test_motion_of_poses_that_nothing_has_is_refused():
    with pytest.raises(InputError, match=r"'motion.poses' is random, and no target has several 'poses'"):
        loaded(motion={"poses": "random"})
    with pytest.raises(InputError, match=r"config key 'motion.poses'"):
        loaded(flyer=FLYER, motion={"poses": "sometimes"})


def test_a_pose_has_no_name_of_another_target():
    with pytest.raises(InputError, match=r"flyer_pose_01 is also a pose of flyer"):
        loaded(flyer=FLYER, flyer_pose_01={"mesh": CAD[0], "role": "other"})


def test_an_overlay_takes_the_poses_of_a_family_away_and_leaves_the_family():
    moving = {"targets": {"quad": QUAD | {"poses": 3}}}
    targets = load_config(moving, {"targets": {"quad": {"poses": None}}})["targets"]
    assert "poses" not in targets["quad"] and targets["quad"]["family"]["kind"] == "quadcopter"
    assert "quad_pose_01" not in targets
