"""How an overlay changes the default config: key by key; targets, models and experiments one by one."""

import pytest

from isarflow.core.errors import InputError
from isarflow.setup.config import ROOT, load_config, unnamed
from isarflow.setup.overlay import merge

KNOWN = {"mesh": "resources/cad/drone.stl", "role": "known"}
MINE = {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["lr"]}
NARROW = {"start": 0, "stop": 60, "step": 3}


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_overlay_changes_only_what_it_names():
    merged, plain = load_config({"aspect": {"elevation": {"step": 5}}, "noise": {"realizations": 7}}), load_config()
    assert merged["aspect"]["elevation"] == {"start": -45, "stop": 45, "step": 5}
    assert merged["noise"]["realizations"] == 7
    assert merged["noise"]["snr_db"] == plain["noise"]["snr_db"]
    assert merged["targets"] == plain["targets"]


def test_overlay_replaces_alternatives():
    merged = load_config({"aspect": {"azimuth": {"start": 0, "stop": 90, "step": 1}}})
    assert merged["aspect"]["azimuth"] == {"start": 0, "stop": 90, "step": 1}


def test_targets_models_and_experiments_are_merged_one_by_one():
    plain, mine = load_config(), {"mesh": "resources/cad/drone.stl", "role": "known"}
    merged = load_config(
        {
            "targets": {"mine": mine, "ufo": None, "drone": {"role": "unknown"}, "missile": {"symmetry": None}},
            "learning": {
                "models": {"svm": {"C": 3}, "lr_tuned": None},
                "experiments": {
                    "sector": None,
                    "multi_elevation": {"models": ["lr"]},
                    "fcnn_open": {"train": {"elevation": [15]}, "models": ["lr"]},
                    "capsule_open": {"upsample": 40, "open": None},
                },
            },
        }
    )
    targets, learning = dict(plain["targets"]), plain["learning"]
    del targets["ufo"]
    targets["drone"] = targets["drone"] | {"role": "unknown"}
    targets["missile"] = {"mesh": "resources/cad/missile.stl", "role": "known"}
    assert merged["targets"] == targets | {"mine": mine}
    models = {name: settings for name, settings in learning["models"].items() if name != "lr_tuned"}
    assert merged["learning"]["models"] == models | {"svm": {"C": 3, "scale": 2.75}}
    experiments = {name: what for name, what in learning["experiments"].items() if name != "sector"}
    everywhere = {"elevation": "all", "snr_db": "clean"}
    assert merged["learning"]["experiments"] == experiments | {
        "multi_elevation": {"train": everywhere, "models": ["lr"]},
        "fcnn_open": {"train": {"elevation": [15], "snr_db": "clean"}, "models": ["lr"], "open": True},
        "capsule_open": {"train": everywhere, "models": ["capsule"], "upsample": 40},
    }


def test_another_focus_method_has_none_of_the_settings_before_it():
    base = {"imaging": {"focus": {"method": "entropy", "error": "pulse"}}}
    for focus in ({"method": "phase_gradient"}, {"method": "entropy"}, "none"):
        assert load_config(base, {"imaging": {"focus": focus}})["imaging"]["focus"] == focus


def test_how_an_experiment_trains_is_one_value():
    overlay = {"learning": {"experiments": {"adaptive": {"train": {"snr_db": {"random": ["clean", 0]}}}}}}
    assert load_config(overlay)["learning"]["experiments"]["adaptive"]["train"] == {
        "elevation": "all",
        "snr_db": {"random": ["clean", 0]},
    }


def test_an_overlay_may_start_from_nothing():
    mine, plain = {"mesh": "resources/cad/drone.stl", "role": "known"}, load_config()
    merged = load_config(
        {
            "targets": {"mine": mine, "*": None, "missile": {}, "drone": {}},
            "learning": {"experiments": {"*": None, "fcnn_open": {"models": ["knn"]}}},
        }
    )
    assert merged["targets"] == {"mine": mine} | {name: plain["targets"][name] for name in ("drone", "missile")}
    assert list(merged["learning"]["experiments"]) == ["fcnn_open"]
    assert merged["learning"]["experiments"]["fcnn_open"]["open"] is True
    for nothing in ({}, {"*": None}):
        assert load_config({"learning": {"experiments": nothing}})["learning"]["experiments"] == {}


def test_each_of_several_overlays_is_laid_over_those_before():
    first = {"targets": {"*": None, "a": KNOWN, "b": KNOWN, "c": KNOWN}}
    assert list(load_config(first, {"targets": {"a": None, "d": KNOWN}})["targets"]) == ["b", "c", "d"]
    assert list(load_config(first, {"targets": {"*": None, "c": {}, "d": KNOWN}})["targets"]) == ["c", "d"]
    assert list(load_config(first, {"targets": {"[ab]*": None, "b": {}, "d": KNOWN}})["targets"]) == ["c", "b", "d"]
    with pytest.raises(InputError, match=r"targets\.d.*no 'd' here"):
        load_config(first, {"targets": {"d": None}})


def test_another_material_of_a_part_leaves_the_rest_of_its_target():
    first = {"targets": {"a": {"parts": {"s": {"mesh": "a.stl", "material": "abs"}}, "role": "known", "unit": "mm"}}}
    for part, kept in (({"mesh": "a.stl"}, True), ({"mesh": "b.stl"}, False)):
        merged = merge(first, {"targets": {"a": {"parts": {"s": part}}}})["targets"]["a"]
        assert merged["parts"] == {"s": part} and ("unit" in merged) == kept


def test_another_material_of_a_part_of_one_file_leaves_its_target():
    first = {"targets": {"a": {"mesh": "a.obj", "parts": {"s": {"material": "abs"}}, "role": "known", "unit": "mm"}}}
    changes = {
        "material": ({"parts": {"s": {}}}, {"mesh": "a.obj", "parts": {"s": {}}, "unit": "mm"}),
        "same file": ({"mesh": "a.obj"}, first["targets"]["a"]),
        "no parts": ({"parts": None}, {"mesh": "a.obj", "unit": "mm"}),
        "another file": ({"mesh": "b.obj"}, {"mesh": "b.obj"}),
        "several files": ({"parts": {"s": {"mesh": "s.obj"}}}, {"parts": {"s": {"mesh": "s.obj"}}}),
    }
    for change, merged in changes.values():
        assert merge(first, {"targets": {"a": change}})["targets"]["a"] == {"role": "known"} | merged
    several = {"targets": {"a": {"parts": {"s": {"mesh": "s.obj"}}, "role": "known", "unit": "mm"}}}
    one = {"mesh": "a.obj", "parts": {"s": {}}}
    assert merge(several, {"targets": {"a": one}})["targets"]["a"] == {"role": "known"} | one


@pytest.mark.parametrize("key", ["mesh", "field"])
def test_what_is_said_of_a_file_does_not_hold_for_another(key, tmp_path):
    path = tmp_path / {"mesh": "a.stl", "field": "a.ffe"}[key]
    path.touch()
    overlay = {"targets": {"ufo": {key: str(path)}}, "radar": {"polarizations": ["VV"]}}
    assert load_config(overlay)["targets"]["ufo"] == {key: str(path), "role": "unknown"}
    same = {"mesh": "resources/cad/ufo.stl", "role": "known"}
    assert load_config({"targets": {"ufo": same}})["targets"]["ufo"] == {**same, "symmetry": ["xz", "yz"]}


def test_default_targets_and_experiments_that_run_besides_are_said():
    def said(*overlays):
        return unnamed(load_config(*overlays), *overlays)

    train = {"experiments": {"e": MINE}}
    targets, experiments = said({"targets": {"a": KNOWN, "drone": {}, "ufo": None}, "learning": train})
    assert "remain: missile, aircraft, trihedral. 'targets.missile: null' removes one" in targets
    assert "remain: multi_elevation, library, library_elevation" in experiments
    assert "'learning.experiments.\"*\": null' all of them" in experiments
    for silent in ({}, {"targets": {"ufo": None}}, {"targets": {"*": None, "a": KNOWN, "drone": {}}}):
        assert said(silent) == []
    assert said({"targets": {"*": None, "a": KNOWN, "b": KNOWN}}, {"targets": {"c": KNOWN}}) == []
    assert len(said({"targets": {"a": KNOWN}, "learning": train, "radar": {"frequencies": 1, "bandwidth": 0}})) == 1


def test_default_experiments_beside_ones_own_may_be_left_out_but_ones_own_may_not():
    overlay = {"aspect": {"azimuth": NARROW}, "learning": {"experiments": {"e": MINE}}}
    config = load_config(overlay)
    assert {"e", "multi_elevation"} <= set(config["learning"]["experiments"])
    assert "sector" in config["learning"]["left_out"]
    with pytest.raises(InputError, match="10 as a guard"):
        load_config({"aspect": {"azimuth": NARROW}, "learning": {"experiments": {"sector": {"models": ["lr"]}}}})
