import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.learning.classifier import ANY_SNR, choices
from isarflow.learning.experiments import label, runs, snrs_in_words, split_of, train_snr_db, training
from isarflow.learning.networks.training_loop import Batches


def learning(**experiments):
    targets = {"a": {"role": "known"}, "u": {"role": "unknown"}}
    split = {"scheme": "random", "train": 0.7, "validation": 0.33, "folds": 3}
    return {
        "targets": targets,
        "learning": {"split": split, "experiments": experiments},
        "seed": 5,
        "imaging": {"aperture": 11},
        "motion": {},
    }


def one(snr_db, **more):
    return {"train": {"elevation": "all", "snr_db": snr_db}, "models": ["knn"], **more}


def test_an_experiment_is_a_run():
    found = runs(learning(a=one("clean"), b=one(-6, open=True, split="sector", upsample=32)))
    assert list(found) == ["a", "b_fold1", "b_fold2", "b_fold3"]
    assert found["a"] == {
        "name": "a",
        "experiment": "a",
        "tested": "all",
        "models": ["knn"],
        "elevation": "all",
        "snrs": ["clean"],
        "random_snr": False,
        "open": False,
        "split": "random",
        "division": {
            "scheme": "random",
            "fold": 0,
            "settings": {"train": 0.7, "validation": 0.33},
            "seed": 5,
            "aperture": 11,
        },
        "first": True,
        "upsample": "none",
        "channels": "all",
        "without": [],
        "motion": {},
    }
    for fold in (1, 2, 3):
        run = found[f"b_fold{fold}"]
        assert (run["experiment"], run["snrs"], run["open"]) == ("b", [-6], True)
        assert (run["split"], run["upsample"], run["first"]) == ("sector", 32, fold == 1)
        assert run["division"] == {
            "scheme": "sector",
            "fold": fold,
            "settings": {"folds": 3, "validation": 0.33},
            "seed": 5,
            "aperture": 11,
        }


def test_an_experiment_may_name_its_folds():
    found = runs(
        learning(a=one("clean", split="sector", folds=[3, 2]), b=one({"each": [0, 6]}, split="sector", folds=[1]))
    )
    assert [*found] == ["a_fold2", "a_fold3", "b_snr_0dB_fold1", "b_snr_6dB_fold1"]
    assert [run["first"] for run in found.values()] == [True, False, True, True]


def test_each_snr_is_a_run_of_its_own():
    found = runs(learning(noisy=one({"each": [6, "clean", -3.5]})))
    assert list(found) == ["noisy_clean", "noisy_snr_-3.5dB", "noisy_snr_6dB"]
    assert [run["snrs"] for run in found.values()] == [["clean"], [-3.5], [6]]
    assert {run["experiment"] for run in found.values()} == {"noisy"}


def test_several_snrs_at_once_are_one_run_in_one_order():
    found = runs(learning(a=one([6, -3, "clean"]), b=one({"random": [6, 0]})))
    assert found["a"]["snrs"] == ["clean", -3, 6] and found["b"]["snrs"] == [0, 6]
    assert not found["a"]["random_snr"] and found["b"]["random_snr"]
    assert [label(snr) for snr in found["a"]["snrs"]] == ["clean", "snr_-3dB", "snr_6dB"]


def test_a_training_in_words_and_as_a_number():
    def said(snr_db):
        return [(training(run), train_snr_db(run)) for run in runs(learning(a=one(snr_db))).values()]

    assert said(-6) == [("-6 dB", -6.0)] and said([2.5]) == [("2.5 dB", 2.5)]
    assert said({"each": [-0.0, 3]}) == [("0 dB", 0.0), ("3 dB", 3.0)]
    many = ["clean", *range(-24, 25, 3)]
    for snr_db, words in {
        "clean": "clean",
        ("clean", 6): "all: clean, 6 dB",
        tuple(many): "all: clean, -24 to 24 dB by 3",
    }.items():
        ((found, number),) = said(list(snr_db) if isinstance(snr_db, tuple) else snr_db)
        assert found == words and np.isnan(number)
    assert said({"random": many})[0][0] == "random: clean, -24 to 24 dB by 3"
    assert said({"random": [6]}) == [("random: 6 dB", 6.0)]  # not the same as a training at 6 dB


def test_equal_steps_are_a_range_and_no_snr_is_lost():
    assert snrs_in_words([24, 18, 12, 6, 0, -6, -18]) == "-18 dB, -6 to 24 dB by 6"
    assert snrs_in_words([0, 0.1, 0.2, 0.3, 10, 20, 40]) == "0 to 0.3 dB by 0.1, 10 dB, 20 dB, 40 dB"
    assert snrs_in_words([0, 1, 2, 4, 6]) == "0 to 2 dB by 1, 4 dB, 6 dB"
    some = range(-2, 5)
    every = [list(np.flatnonzero(flags) - 2) for flags in np.ndindex(*[2] * len(some))]
    assert len({snrs_in_words(snrs) for snrs in every}) == len(every)


def test_a_run_has_the_motion_of_its_experiment_over_that_of_the_config():
    radar = {"center_frequency": 2e9, "bandwidth": 1e9, "frequencies": 11}
    sweep = {"radar": radar, "aspect": {"azimuth": {"count": 120}}, "motion": {"place": 0.1, "drift": 0}}
    own = {"b": one("clean", motion={"drift": 0.5}), "c": one("clean", motion={"place": 0}), "d": one("clean")}
    found = {name: run["motion"] for name, run in runs(learning(**own) | sweep).items()}
    assert found["d"]["folder"] == "imaging" and found["d"]["limits"] == {"place": 0.1}
    assert found["b"]["folder"] == "moved/drift_0.5_place_0.1"
    assert found["c"]["folder"] == "moved/still" and found["c"]["limits"] == {}
    assert found["b"]["frequencies"] == [1.5e9, 2.5e9, 11] and found["b"]["step"] == pytest.approx(3)
    assert split_of({"split": "elevation", "motion": found["b"]}) == "elevation, moved"
    assert split_of({"split": "elevation", "motion": found["c"]}) == "elevation"


def test_without_unknown_targets_no_run_is_open():
    config = learning(a=one("clean", open=True))
    assert runs(config)["a"]["open"]
    del config["targets"]["u"]
    assert not runs(config)["a"]["open"]


def test_two_runs_of_one_name_are_refused():
    with pytest.raises(InputError, match="a_snr_6dB"):
        runs(learning(a=one({"each": [6]}), a_snr_6dB=one("clean")))


def test_lists_of_settings_are_choices():
    found = choices({"kind": "svm", "other": True, "C": [1, 10], "scale": [2, 3]})
    assert found == [{"C": C, "scale": scale} for C in (1, 10) for scale in (2, 3)]
    assert choices({}) == [{}]


def test_an_epoch_holds_every_image_once():
    batches = Batches(50, 16, np.random.default_rng(0))
    first, second = (list(batches.epoch()) for _ in range(2))
    assert [len(rows) for rows in first] == [16, 16, 16, 2]
    assert sorted(np.concatenate(first)) == sorted(np.concatenate(second)) == list(range(50))
    assert np.concatenate(first).tolist() != np.concatenate(second).tolist()


def test_a_batch_has_one_snr():
    snrs = np.array(["clean"] * 40 + ["snr_0dB"] * 80 + [ANY_SNR] * 10)
    batches = Batches(len(snrs), 10, np.random.default_rng(0), snrs)
    seen, lengths = set(), []
    for _ in range(20):
        epoch = list(batches.epoch())
        lengths.append(sum(map(len, epoch)))
        for rows in epoch:
            names = set(snrs[rows]) - {ANY_SNR}
            assert len(names) <= 1
            seen |= set(snrs[rows])
    assert seen == {"clean", "snr_0dB", ANY_SNR}
    assert set(lengths) == {90}
