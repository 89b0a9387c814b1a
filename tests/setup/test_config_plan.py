"""What follows from a config: names, paths and memory, without Snakemake."""

import json

import pytest

from isarflow.setup.artefacts import STARTING, Plan
from isarflow.setup.config import load_config

SIX = {"elevation": "all", "snr_db": 6}
MINE = {"models": ["knn", "fcnn_other", "capsule"], "train": SIX, "open": True, "split": "sector", "upsample": 32}
CONFIG = {
    "name": "mine",
    "seed": [3, 5],
    "targets": {"ufo": None, "far": {"field": "resources/fields/ufo.zarr", "role": "unknown"}},
    "learning": {
        "models": {"fcnn_other": {"kind": "fcnn", "other": True}},
        "experiments": {"*": None, "mine": {**MINE, "folds": [1, 2]}, "clean": {"models": ["knn"], "train": {}}},
    },
    "noise": {"snr_db": [0, 6, 24], "realizations": 2},
}
CONFIG["learning"]["experiments"]["clean"]["train"] = {"elevation": "all", "snr_db": "clean"}


@pytest.fixture
def plan():
    return Plan(load_config(CONFIG))


def test_targets_runs_and_models_are_named(plan):
    assert set(plan.targets) == {"drone", "missile", "aircraft", "trihedral", "far"}
    assert plan.given == ["far"] and "far" not in plan.meshed
    assert (plan.known, plan.unknown) == (["drone", "missile"], ["aircraft", "far"])
    assert set(plan.runs) == {"mine_fold1", "mine_fold2", "clean"}
    assert len(plan.fitted) == 7 and set(plan.fitted) - set(plan.timed) == {
        f"mine_fold2/{model}" for model in ("knn", "fcnn_other", "capsule")
    }
    assert plan.snrs == ["snr_0dB", "snr_6dB", "snr_24dB"]
    assert plan.decoders() == ["mine_fold1/capsule"]
    assert plan.tested_targets("clean") == plan.known and plan.tested_targets("mine_fold1") == plan.targets


def test_further_seeds_have_folders_of_their_own(plan):
    further = "results/mine/seed_5"
    assert list(plan.seeded) == ["results/mine", further]
    assert [config["seed"] for config in plan.seeded.values()] == [3, 5]
    noisy = plan.training_stores(further, "mine_fold1", "knn")
    assert noisy == [f"{further}/imaging/{target}/snr_6dB.zarr" for target in ("drone", "missile")]
    # What has no noise does not follow from the seed, but for the images of noise alone.
    clean = plan.training_stores(further, "clean", "knn")
    assert clean == [f"results/mine/imaging/{target}/clean.zarr" for target in ("drone", "missile")]
    other = plan.training_stores(further, "mine_fold1", "fcnn_other")
    assert f"{further}/imaging/trihedral/snr_6dB.zarr" in other
    assert other[-1] == f"{further}/imaging/pure-noise/clean.zarr"
    assert plan.roots() == {"mine": "results/mine", "seed_5": further}
    assert len(plan.judged(further)) == 2 + len(plan.fitted) * (1 + len(plan.snrs))


def test_memory_follows_from_the_images(plan):
    assert plan.image_megabytes(2) > plan.image_megabytes(1) > STARTING
    assert plan.megabytes("mine_fold1", "knn") > plan.megabytes("clean", "knn")
    assert plan.most_megabytes(plan.fitted, 1) == max(plan.megabytes(*name.split("/")) for name in plan.fitted)
    assert plan.most_megabytes([], 7) == 7


def test_a_solve_is_planned_from_its_mesh(plan, tmp_path):
    path, band = tmp_path / "drone.json", {"unknowns": 4000, "triangles": 2700, "box": [0.5, 0.5, 0.2]}
    path.write_text(json.dumps({"bands": [band] * 2}))
    low, high = (plan.cost_of_solve("drone", band, path) for band in (0, 1))
    assert low["megabytes"] > 0 and 0 < low["seconds"] < high["seconds"]
    with pytest.raises(FileNotFoundError):
        plan.cost_of_solve("drone", 2, path)
