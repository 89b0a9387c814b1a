"""Classes of several targets, and runs that are tested on targets that did not train."""

import numpy as np
import pandas as pd
import pytest
from scenes import ALL, PLANES, SETTINGS, run_of

from isarflow.learning.evaluation import judge
from isarflow.learning.experiments import class_of
from isarflow.learning.predict import Tested, predict
from isarflow.learning.train import Training, train

# Four targets of two classes: dart and wing are arrows, disc and cube are lumps.
CLASSES = {"dart": "arrow", "wing": "arrow", "disc": "lump", "cube": "lump"}
KNOWN = dict.fromkeys(CLASSES, "known")


def predicted(stores, tmp_path, roles=KNOWN, is_open=False, **more):
    """The predictions of a nearest neighbour at 30 dB, and the model's folder."""
    run, folder = run_of(ALL, **more), tmp_path / "model"
    trained = [name for name in roles if name not in run["without"] and roles[name] == "known"]
    training = Training(run, "knn", SETTINGS["knn"], {name: roles[name] for name in trained}, PLANES, 0, CLASSES)
    train(stores("clean", trained), training, folder)
    tested = Tested(roles, PLANES, is_open, 2, CLASSES)
    predict(stores("snr_30dB", tuple(roles)), tested, folder, [tmp_path / "snr_30dB.csv"])
    return pd.read_csv(tmp_path / "snr_30dB.csv"), folder


def test_several_targets_are_one_class(stores, tmp_path):
    table, folder = predicted(stores, tmp_path)
    assert '"arrow"' in (folder / "config.json").read_text() and "dart" not in (folder / "config.json").read_text()
    assert set(table["target"]) == set(CLASSES) and set(table["predicted"]) == {"arrow", "lump"}
    assert (table["truth"] == table["target"].map(CLASSES)).all()
    assert {"score_arrow", "score_lump"} <= set(table)
    (closed, *_) = judge.decide(table)
    values = {name: value for fold, name, value, *_ in judge.rows(closed, 0) if not fold}
    test = table[table["side"] == "test"]
    right = test["truth"] == test["predicted"]
    assert values["accuracy"] == pytest.approx(right.mean())
    assert values["recall_arrow"] == pytest.approx(right[test["truth"] == "arrow"].mean())


def test_targets_that_did_not_train_are_the_known_ones_that_are_tested(stores, tmp_path):
    roles = {"dart": "known", "wing": "known", "disc": "known", "cube": "unknown"}
    table, folder = predicted(stores, tmp_path, roles, is_open=True, open=True, without=["wing"])
    sides = table.groupby(["target", "side"]).size().unstack(fill_value=0)
    assert sides.loc["wing", "validation"] == 0 < sides.loc["wing", "test"]
    for name in ("dart", "disc"):  # thresholds are chosen by what trained, at the validation views
        assert sides.loc[name, "test"] == 0 < sides.loc[name, "validation"]
    assert (sides.loc["cube", ["validation", "test"]] > 0).all()
    wing = table[table["target"] == "wing"]
    assert set(wing["truth"]) == {"arrow"} and set(table[table["target"] == "cube"]["truth"]) == {"other"}
    # Its images are as many as in a run in which it trains, too.
    every, _ = predicted(stores, tmp_path / "every", roles, is_open=True, open=True)
    of_all = every[(every["target"] == "wing") & (every["side"] == "test")]
    np.testing.assert_array_equal(wing["azimuth"], of_all["azimuth"])
    assert "wing" not in (folder / "split.json").read_text()


def test_a_target_is_its_own_class_unless_it_says_another():
    targets = {"a": {"role": "known"}, "b": {"role": "known", "class": "c"}}
    assert [class_of(targets, name) for name in targets] == ["a", "c"]
