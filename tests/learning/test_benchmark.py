"""Predictions of one's own, scored by a run's protocol: the same scores as the run's own."""

import doctest
import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scenes import ALL_TARGETS, fitted, run_of, tables_of

import isarflow
from isarflow.core.errors import InputError
from isarflow.core.store import open_store, write
from isarflow.learning.evaluation import judge, paired, record, scores
from isarflow.learning.evaluation.leaderboard import BOARD, KEY, leaderboard, main

SEED, KEPT = 7, 0.8  # of the run: other ones than where nothing is said


@pytest.fixture(scope="module")
def run(stores, tmp_path_factory):
    """The folder of a finished run with one open experiment, and its tables by SNR.

    The folder also holds a fold of an earlier config, of which this is no part.
    """
    folder = tmp_path_factory.mktemp("runs") / "results/example"
    models, where = folder / "learning/models", folder / "learning/predictions"
    every = [path for label in ("snr_0dB", "snr_30dB") for path in stores(label, ALL_TARGETS)]
    model = fitted(stores("clean"), models / "multi/lr", "lr", open=True)
    tables = tables_of(every, model, where / "multi/lr", is_open=True)
    earlier = shutil.copytree(models / "multi", models / "multi_fold3") / "lr"
    config, split = (json.loads((earlier / name).read_text()) for name in ("config.json", "split.json"))
    config["run"]["name"], split["division"]["fold"], config["run"]["division"]["fold"] = "multi_fold3", 3, 3
    for name, content in (("config.json", config), ("split.json", split)):
        (earlier / name).write_text(json.dumps(content))
    (where / "multi_fold3/lr").mkdir(parents=True)
    for label, table in tables.items():
        table.assign(fold=3).to_csv(where / f"multi_fold3/lr/{label}.csv", index=False)
    settings = {"runs": {"multi": run_of(open=True)}, "noise.definition": "mean", "seed": SEED, "learning.kept": KEPT}
    settings |= {"kinds": {}, "classes": {}}
    paths = [folder / f"learning/predictions/multi/lr/snr_{snr}dB.csv" for snr in (0, 30)]
    made = [folder / f"learning/{name}.csv" for name in ("scores", "confusion", "validation")]
    scores.score(paths, settings["runs"], "mean", SEED, 1, *made, kept_share=KEPT)
    record.write(folder / "learning/scores.json", settings, paths)
    return folder, tables


@pytest.fixture
def copy(run, tmp_path):
    """The same in a folder of its own, without images."""
    return shutil.copytree(run[0], tmp_path / "copy")


def mine(predictions, confidence="known_softmax"):
    """Tables of the run's own predictions as a stranger's file."""
    parts = []
    for snr, table in ((0, predictions["snr_0dB"]), (30, predictions["snr_30dB"])):
        table = table[table["side"] != "left_out"].assign(test_snr_db=snr)
        parts.append(table.rename(columns={confidence: "confidence"})[[*KEY, "predicted", "confidence"]])
    return pd.concat(parts).sample(frac=1, random_state=1)


def test_the_run_s_own_predictions_have_the_run_s_own_scores(run, capsys, tmp_path):
    """By its seed and settings, in Python and beside the run's rows on the command line."""
    folder, predictions = run
    found = isarflow.benchmark.score(folder, "multi", mine(predictions))
    for snr in (0, 30):
        table = predictions[f"snr_{snr}dB"]
        for decision in judge.decide(table, KEPT):
            if decision.score not in ("", "softmax"):
                continue
            for fold, metric, value, low, high, n in judge.rows(decision, SEED):
                same = found.query("test_snr_db == @snr and threshold == @decision.threshold and metric == @metric")
                same = same[(same["fold"] == fold) & (same["n"] == n)]
                found_here = same[["value", "low", "high"]].to_numpy(float)
                assert any(np.allclose(one, (value, low, high), equal_nan=True) for one in found_here), (snr, metric)
    assert set(found["threshold"]) == {"", "blind", "thesis", "kept"}
    closed = isarflow.benchmark.score(folder, "multi", mine(predictions).drop(columns="confidence"))
    assert set(closed["threshold"]) == {""} and "auroc" not in set(closed["metric"])
    thresholds = found.query("metric == 'threshold' and threshold == 'kept' and test_snr_db == 0")["value"]
    usual = [one for one in judge.decide(predictions["snr_0dB"]) if (one.score, one.threshold) == ("softmax", "kept")]
    assert thresholds.item() > usual[0].fixed[0][1]  # as more known images are rejected
    mine(predictions).to_csv(tmp_path / "mine.csv", index=False)
    main([str(folder), "multi", str(tmp_path / "mine.csv")])
    lines = [line.split()[1:] for line in capsys.readouterr().out.splitlines()[1:]]
    own, here = ([line[2:] for line in lines if line[:2] == of] for of in (["lr", "softmax"], ["mine", "confidence"]))
    assert len(here) == 2 and here == own and len(here[0]) > len(BOARD)


def test_the_example_of_score_runs(run, monkeypatch):
    monkeypatch.chdir(run[0].parents[1])
    examples = doctest.testmod(isarflow.benchmark)
    assert examples.attempted and not examples.failed


def test_what_an_earlier_config_left_behind_is_not_taken(run, copy):
    folder, predictions = run
    every = isarflow.benchmark.images(folder, "multi")
    assert set(every["fold"]) == {0} and len(every) == len(mine(predictions))
    trained = isarflow.benchmark.training(folder, "multi")
    assert set(trained["fold"]) == {0} and not trained.duplicated().any()
    tested = every.query("side == 'test' and role == 'known' and test_snr_db == 0")
    differences = paired.differences({"one": folder, "other": folder}, 0, KEPT)
    assert set(differences.query("score == ''")["n"]) == {len(tested)}
    # A run that is not finished, or no more, is refused.
    config = copy / "learning/models/multi/lr/config.json"
    content = json.loads(config.read_text())
    content["run"]["division"]["seed"] = 1
    config.write_text(json.dumps(content))
    for spoilt, said in (
        (lambda: None, "multi/lr is of another config than .*scores.json; finish the run"),
        (lambda: (copy / "learning/predictions/multi/lr/snr_0dB.csv").unlink(), "snr_0dB.csv is missing"),
        (
            lambda: (copy / "learning/scores.json").write_text('{"seed": 0}'),
            "scores.json: it is not what a run of this",
        ),
        (lambda: (copy / "learning/scores.json").unlink(), "scores.json is missing, which says how"),
    ):
        spoilt()
        for asks in (isarflow.benchmark.images, isarflow.benchmark.training):
            with pytest.raises(InputError, match=said):
                asks(copy, "multi")
        with pytest.raises(InputError, match=said):
            isarflow.benchmark.score(copy, "multi", mine(predictions))


def test_an_experiment_of_some_elevations_trains_at_these(stores, run, copy):
    where = copy / "learning/models/multi/lr"
    shutil.rmtree(where)
    fitted(stores("clean"), where, "lr", {"elevation": [-15, 15], "snr_db": "clean"}, open=True)
    made = json.loads((copy / "learning/scores.json").read_text())
    made["runs"]["multi"] = json.loads((where / "config.json").read_text())["run"]
    (copy / "learning/scores.json").write_text(json.dumps(made))
    found = isarflow.benchmark.training(copy, "multi")
    assert set(found["elevation"]) == {-15, 15}
    assert set(isarflow.benchmark.training(run[0], "multi")["elevation"]) == {-15, 0, 15}


def test_the_images_say_what_is_asked(run):
    folder, predictions = run
    every = isarflow.benchmark.images(folder, "multi", [0])
    assert set(every["test_snr_db"]) == {0} and set(every["side"]) == {"validation", "test"}
    assert set(every[every["role"] == "unknown"]["truth"]) == {"other"}
    assert len(every) == (predictions["snr_0dB"]["side"] != "left_out").sum()


def test_images_that_move_are_those_of_their_experiment(stores, copy):
    """Two experiments of a run, of which one has images of its own; without its name these would be the others."""
    still = Path(stores("snr_0dB", ["dart"])[0])
    shutil.copytree(still, copy / "imaging/dart/snr_0dB.zarr")
    with open_store(still) as dataset:
        moved = dataset.load().drop_encoding()
    moved["image"] = 2 * moved["image"]
    write(moved, copy / "moved/place_0.1/dart/snr_0dB.zarr", {"image": {"chunks": moved["image"].shape}})
    asked = isarflow.benchmark.images(copy, "multi", [0]).query("target == 'dart'").head(3)
    once = isarflow.benchmark.pixels(copy, asked)  # all experiments of the run have the same images
    content = json.loads((copy / "learning/scores.json").read_text())
    content["runs"]["sky"] = content["runs"]["multi"] | {
        "experiment": "sky",
        "motion": {"folder": "moved/place_0.1", "limits": {"place": 0.1}},
    }
    (copy / "learning/scores.json").write_text(json.dumps(content))
    np.testing.assert_array_equal(isarflow.benchmark.pixels(copy, asked, "multi"), once)
    np.testing.assert_allclose(isarflow.benchmark.pixels(copy, asked, "sky"), 2 * once)
    with pytest.raises(InputError, match="differ in how targets move; name that of the images: multi, sky"):
        isarflow.benchmark.pixels(copy, asked)
    with pytest.raises(InputError, match="has no experiment 'skye', but multi, sky"):
        isarflow.benchmark.pixels(copy, asked, "skye")


def test_what_cannot_be_scored_is_said(run, tmp_path, capsys):
    folder, predictions = run
    table = mine(predictions).sort_values(KEY)
    # At azimuth 0 degrees are radians, too.
    count, lost = len(table), (table["azimuth"] > 0).sum()
    strange = rf"lacks {lost} of {count} images; .* {lost} of its {count} rows match no image of 'multi'; the first is "
    strange += r"test_snr_db 0, fold 0, target cube, elevation -15.0, azimuth 0.524, realization 0\.$"  # 30 degrees
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
        (table.assign(azimuth=np.radians(table["azimuth"])), strange),
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
    # Other rows beside all that are asked for do no harm, but are said.
    more = pd.concat([table.iloc[:2].assign(fold=3), table])
    with pytest.warns(UserWarning, match=rf"the table: 2 of its {count + 2} rows match no image of 'multi'; the first"):
        found = isarflow.benchmark.score(folder, "multi", more)
    pd.testing.assert_frame_equal(found, isarflow.benchmark.score(folder, "multi", table))
    turned = table.assign(azimuth=(table["azimuth"] + 180) % 360 - 180)  # from -180 degrees on
    pd.testing.assert_frame_equal(found, isarflow.benchmark.score(folder, "multi", turned))
    more.to_csv(tmp_path / "mine.csv", index=False)
    main([str(folder), "multi", str(tmp_path / "mine.csv")])
    assert f"mine.csv: 2 of its {count + 2} rows" in capsys.readouterr().err
    table.iloc[1:].to_csv(tmp_path / "mine.csv", index=False)
    with pytest.raises(SystemExit, match="lacks 1 of"):
        main([str(folder), "multi", str(tmp_path / "mine.csv")])


def test_every_confidence_score_has_rows_also_where_metrics_are_alike():
    """Scores that separate perfectly have equal metrics, and may order images in many ways."""
    case = {"experiment": "one", "split": "random", "training": "clean", "model": "lr", "fold": "", "n": 9}
    rows = []
    for score, shift in (("a", 0), ("b", 0), ("c", 1e-4)):
        for name, (threshold, metric) in BOARD.items():
            value = (metric != "fpr95") * (1.0 - shift)
            of = {"score": "" if name == "accuracy" else score, "threshold": threshold, "metric": metric}
            rows.append(case | of | {"test_snr_db": 0, "value": value, "low": value, "high": value})
    found = leaderboard(pd.DataFrame(rows).drop_duplicates(["score", "threshold", "metric"]))
    assert found["score"].tolist() == ["a", "b", "c"] and found["auroc"].tolist() == [1, 1, 0.9999]
