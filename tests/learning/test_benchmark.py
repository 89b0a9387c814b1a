"""Predictions of one's own, scored by a run's protocol: the same scores as the run's own."""

import numpy as np
import pandas as pd
import pytest
from scenes import ALL_TARGETS, fitted, tables_of

import isarflow
from isarflow.core.errors import InputError
from isarflow.learning import judge
from isarflow.learning.benchmark import BOARD, KEY, leaderboard, main


@pytest.fixture(scope="module")
def run(stores, tmp_path_factory):
    """The folder of a run with one open experiment, and its tables by SNR."""
    folder = tmp_path_factory.mktemp("results")
    model = fitted(stores("clean"), folder / "learning/models/multi/fcnn", "fcnn", open=True)
    where = folder / "learning/predictions/multi/fcnn"
    every = [path for label in ("snr_0dB", "snr_30dB") for path in stores(label, ALL_TARGETS)]
    predictions = tables_of(every, model, where, is_open=True)
    return folder, predictions


def mine(predictions, confidence="known_softmax"):
    """Tables of the run's own predictions as a stranger's file."""
    parts = []
    for snr, table in ((0, predictions["snr_0dB"]), (30, predictions["snr_30dB"])):
        table = table[table["side"] != "left_out"].assign(test_snr_db=snr)
        parts.append(table.rename(columns={confidence: "confidence"})[[*KEY, "predicted", "confidence"]])
    return pd.concat(parts).sample(frac=1, random_state=1)


def test_the_run_s_own_predictions_have_the_run_s_own_scores(run):
    folder, predictions = run
    found = isarflow.benchmark.score(folder, "multi", mine(predictions))
    for snr in (0, 30):
        table = predictions[f"snr_{snr}dB"]
        for decision in judge.decide(table):
            if decision.score not in ("", "softmax"):
                continue
            for fold, metric, value, low, high, n in judge.rows(decision, 0):
                same = found.query("test_snr_db == @snr and threshold == @decision.threshold and metric == @metric")
                same = same[(same["fold"] == fold) & (same["n"] == n)]
                found_here = same[["value", "low", "high"]].to_numpy(float)
                assert any(np.allclose(one, (value, low, high), equal_nan=True) for one in found_here), (snr, metric)
    assert set(found["threshold"]) == {"", "blind", "thesis", "kept"}
    closed = isarflow.benchmark.score(folder, "multi", mine(predictions).drop(columns="confidence"))
    assert set(closed["threshold"]) == {""} and "auroc" not in set(closed["metric"])


def test_the_images_say_what_is_asked(run):
    folder, predictions = run
    every = isarflow.benchmark.images(folder, "multi", [0])
    assert set(every["test_snr_db"]) == {0} and set(every["side"]) == {"validation", "test"}
    assert set(every[every["role"] == "unknown"]["truth"]) == {"other"}
    assert len(every) == (predictions["snr_0dB"]["side"] != "left_out").sum()


def test_what_cannot_be_scored_is_said(run, tmp_path, capsys):
    folder, predictions = run
    table = mine(predictions)
    for wrong, text in (
        (table.drop(columns="fold"), "has no column fold"),
        (table.iloc[1:], f"lacks 1 of {len(table)} images; the first is test_snr_db"),
        (pd.concat([table, table.iloc[:1]]), "has an image twice"),
        (table.iloc[:0], "has no row"),
        (table.assign(predicted="zeppelin"), "has a class 'zeppelin'; classes are .*other"),
        (table.assign(confidence=np.nan), "image 1: confidence is 'nan', which is no finite number"),
        (table.assign(fold="first"), "image 1: fold is 'first', which is no finite number"),
        (table.assign(test_snr_db=13), "has no predictions at 13 dB, but at .*0"),
        (tmp_path / "none.csv", "none.csv cannot be read as a CSV file"),
        (tmp_path, "cannot be read as a CSV file"),
    ):
        with pytest.raises(InputError, match=text):
            isarflow.benchmark.score(folder, "multi", wrong)
    with pytest.raises(InputError, match="no predictions of an experiment 'none'"):
        isarflow.benchmark.images(folder, "none")
    with pytest.raises(InputError, match="is no folder"):
        isarflow.benchmark.images(tmp_path / "none", "multi")
    table.round(2).to_csv(tmp_path / "mine.csv", index=False)
    main([str(folder), "multi", str(tmp_path / "mine.csv")])
    assert "f1_weighted" in capsys.readouterr().out
    table.iloc[1:].to_csv(tmp_path / "mine.csv", index=False)
    with pytest.raises(SystemExit, match="lacks 1 of"):
        main([str(folder), "multi", str(tmp_path / "mine.csv")])


def test_scores_that_order_images_alike_have_rows_of_the_first_alone():
    """At every SNR or at none: a difference of rounding at one SNR leaves no row of its own."""
    case = {"experiment": "one", "split": "random", "training": "clean", "model": "lr", "fold": "", "n": 9}
    rows = []
    for score, snr, shift in (("a", 0, 0), ("a", 6, 0), ("b", 0, 0), ("b", 6, 1e-4), ("c", 0, 0), ("c", 6, 0.01)):
        for name, (threshold, metric) in BOARD.items():
            low = 0.5 + shift
            of = {"score": "" if name == "accuracy" else score, "threshold": threshold, "metric": metric}
            rows.append(case | of | {"test_snr_db": snr, "value": low + 0.1, "low": low, "high": low + 0.2})
    table = pd.DataFrame(rows).drop_duplicates(["score", "threshold", "metric", "test_snr_db"])
    found = leaderboard(table)
    assert sorted(zip(found["score"], found["test_snr_db"], strict=True)) == [("a", 0), ("a", 6), ("c", 0), ("c", 6)]
