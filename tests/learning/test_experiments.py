import numpy as np
import pytest

from common.errors import InputError
from learning.classifier import choices
from learning.descent import ANY_SNR, Batches
from learning.experiments import label, runs, snr_text


def learning(**experiments):
    targets = {"a": {"role": "known"}, "u": {"role": "unknown"}}
    return {"targets": targets, "learning": {"split": {"scheme": "random"}, "experiments": experiments}}


def one(snr_db, **more):
    return {"train": {"elevation": "all", "snr_db": snr_db}, "models": ["knn"], **more}


def test_an_experiment_is_a_run():
    found = runs(learning(a=one("clean"), b=one(-6, open=True, split="sector", upsample=32)))
    assert list(found) == ["a", "b"]
    assert found["a"] == {
        "name": "a",
        "experiment": "a",
        "models": ["knn"],
        "elevation": "all",
        "snrs": ["clean"],
        "random_snr": False,
        "open": False,
        "split": "random",
        "upsample": "none",
    }
    assert (found["b"]["snrs"], found["b"]["open"]) == ([-6], True)
    assert (found["b"]["split"], found["b"]["upsample"]) == ("sector", 32)


def test_each_snr_is_a_run_of_its_own():
    found = runs(learning(noisy=one({"each": [6, "clean", -3.5]})))
    assert list(found) == ["noisy_clean", "noisy_snr_-3.5dB", "noisy_snr_6dB"]
    assert [run["snrs"] for run in found.values()] == [["clean"], [-3.5], [6]]
    assert {run["experiment"] for run in found.values()} == {"noisy"}


def test_several_snrs_at_once_are_one_run_in_one_order():
    found = runs(learning(a=one([6, -3, "clean"]), b=one({"random": [6, 0]})))
    assert found["a"]["snrs"] == ["clean", -3, 6] and found["b"]["snrs"] == [0, 6]
    assert not found["a"]["random_snr"] and found["b"]["random_snr"]
    assert (snr_text(found["a"]), snr_text(found["b"])) == ("clean+-3+6", "random 0+6")
    assert [label(snr) for snr in found["a"]["snrs"]] == ["clean", "snr_-3dB", "snr_6dB"]


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
