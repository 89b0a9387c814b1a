"""The first screen: whether it is right, how well it works, and a run of full size beside it, once there is one."""

import copy
import itertools
import re

import fake
import numpy as np
import pandas as pd
from pages import Page

import isarflow.report.results
from isarflow.core.kinds import page_names
from isarflow.report import section_headline, section_run, vocabulary
from isarflow.report.results import Results


def test_is_it_right_says_what_is_not(results):
    results.sphere["error_db"] = -0.21
    rows = {what: (right, finding) for right, what, finding, _ in section_run.checks(results, [])}
    assert rows["Sphere, solved in this run"] == (False, "0.210 dB and 0.30° from the Mie series, 570 unknowns")
    assert rows["Residuals"] == (True, "at most 5.0×10⁻⁶, over 15 systems")
    # Ellipsoids of rings have narrow triangles at their poles.
    assert rows["Meshes"] == (False, "0 of 6 meet all their goals; some missed by drone, missile, ufo")
    assert rows["Warnings"] == (True, "none on this run")
    results.sphere["error_db"] = -0.19
    right, *_ = section_run.checks(results, [("ufo", "folds")])[0]
    assert right and not section_run.checks(results, [("ufo", "folds")])[-1][0]


def test_the_sentences_say_what_the_scores_say(results, whole):
    done, reached, bounds = section_run.sentences(results)
    assert (
        "3 targets at 0.8 to 1.2 GHz from 3 × 24 directions, solved on their meshes; ISAR" in done
        and "to reject ufo" in done
    )
    scores = results.scores.query("split == 'sector' and threshold == 'blind' and metric == 'f1_weighted'")
    scores = scores.query("test_snr_db == 12 and elevation == 'all'")
    best = scores[(scores["model"] == "knn") & (scores["score"] == "softmax")]["value"].iloc[0]
    start = "At 12 dB by peak_3db power, split by sector, with blind thresholds, KNN, softmax, the best one on the"
    assert f"{start} validation images, reaches a weighted F1 of {best:.2f} (" in reached
    assert "where rejecting everything has 0.17" in reached and "split at random, with near copies" in reached
    assert "missile and ufo reach beyond that" in bounds
    words = Page(whole / "index.html").words
    assert all(text in words for text in (done, reached, bounds))


def test_the_full_size_run_stands_beside_once_it_is_there(results, whole, tmp_path, monkeypatch):
    monkeypatch.setattr(isarflow.report.results, "FULL_SIZE", tmp_path)
    assert section_run.full_size_table(results) == ()
    for name in ("scores", "validation"):
        table = pd.read_csv(whole.parent / "learning" / f"{name}.csv", keep_default_na=False)
        table["snr_definition"] = "mean"
        table.to_csv(tmp_path / f"{name}.csv.xz", index=False)
    again = Results(whole.parent, fake.SETTINGS, fake.names(fake.SETTINGS))
    (table,) = section_run.full_size_table(again)
    assert set(table.shown["run, and its SNR"]) == {"this run, peak_3db", "full size, mean"}
    assert re.fullmatch(r"0\.\d\d \(0\.\d\d–[01]\.\d\d\)", table.shown["12 dB"].iloc[0])
    assert {"0 dB", "12 dB", "24 dB"} <= set(table.shown.columns)
    assert "docs/results.md" in table.caption
    thesis = copy.deepcopy(fake.SETTINGS) | {"name": "thesis"}
    assert Results(whole.parent, thesis, fake.names(thesis)).full_size is None


def test_matrices_count_what_the_table_counts(results):
    entries = section_headline.matrices(results)["entries"]
    one = next(one for one in entries if one["words"].startswith("KNN, softmax: sector (sector)"))
    assert one["set"] == "open set, blind thresholds" and one["targets"] == ["drone", "missile", "ufo"]
    cells = results.confusion.query("experiment == 'sector' and model == 'knn' and score == 'softmax'")
    cells = cells.query("threshold == 'blind' and test_snr_db == 0 and elevation == 'all'")
    counts = np.array(one["counts"][one["snrs"].index(0)])
    for (row, target), (column, label) in itertools.product(enumerate(one["targets"]), enumerate(one["classes"])):
        expected = cells[(cells["target"] == target) & (cells["predicted"] == label)]["count"].sum()
        assert counts[row, column] == int(expected)
    assert [len(entry["counts"]) for entry in entries] == [len(entry["snrs"]) for entry in entries]
    assert any(entry["set"] == "closed set" for entry in entries)


def test_models_of_one_s_own_have_colours_that_no_other_has():
    names = vocabulary.Names(page_names({"svm": {}, "knn": {}}), ["svm", "knn", "mine", "yours"])
    assert len({names.model(model).color for model in ("svm", "knn", "mine", "yours")}) == 4
    many = [f"own{number}" for number in range(30)]
    assert len({vocabulary.Names(page_names({}), many).model(model).color for model in many}) == 12
