"""The first screen: whether it is right, how well it works, and a run of full size beside it, once there is one."""

import copy
import itertools
import json
import re

import fake
import numpy as np
import pandas as pd
import pytest
from pages import Page, unpacked

import isarflow.report.results
from isarflow.core.kinds import page_names
from isarflow.report import section_confusion, section_mesh, section_summary, vocabulary
from isarflow.report.results import Results
from isarflow.scattering import interpolation
from isarflow.scattering.sphere import backscatter, check


def test_mie_has_its_two_limits():
    # Rayleigh: |f| = 3/2 k^2 a^3 of a conducting sphere in backscatter. Large: the geometric cross section.
    assert abs(backscatter(0.01, 1.0)) == pytest.approx(1.5e-4, rel=1e-3)
    assert 4 * abs(backscatter(200.0, 1.0)) ** 2 == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("formulation", ["efie", "cfie"])
def test_a_run_s_sphere_is_solved_and_agrees_with_mie(tmp_path, formulation):
    settings = {"solver": "mom", "formulation": formulation, "precision": "single", "tolerance": 1e-5}
    check(tmp_path / "sphere.json", settings, 10, 1)
    found = json.loads((tmp_path / "sphere.json").read_text())
    # Measured: 0.006 dB and 0.02 degrees (efie), 0.018 dB and 0.14 degrees (cfie).
    assert 0 < abs(found["error_db"]) < 0.05 and abs(found["phase_deg"]) < 0.5
    assert found["rcs_db"] - found["mie_db"] == pytest.approx(found["error_db"])
    assert found["unknowns"] == 3 * found["triangles"] // 2 and 0 < found["residual"] < 1e-4


def test_is_it_right_says_what_is_not(results):
    results.sphere["error_db"] = -0.21
    rows = {what: (right, finding) for right, what, finding, _ in section_summary.checks(results, [])}
    assert rows["Sphere, solved in this run"] == (False, "0.210 dB and 0.30° from the Mie series, 570 unknowns")
    assert rows["Residuals"] == (True, "at most 5.0×10⁻⁶, over 15 systems")
    # Ellipsoids of rings have narrow triangles at their poles.
    assert rows["Meshes"] == (False, "0 of 6 meet all their goals; some missed by drone, missile, ufo")
    assert rows["Warnings"] == (True, "none on this run")
    results.sphere["error_db"] = -0.19
    right, *_ = section_summary.checks(results, [("ufo", "folds")])[0]
    assert right and not section_summary.checks(results, [("ufo", "folds")])[-1][0]


def test_meshes_that_meet_their_goals_are_not_doubted(results):
    shown = section_mesh.quality_table(results).shown
    marked = shown.set_index("target").apply(lambda column: column.str.contains("✗"))
    assert section_mesh.missed(results) == marked.any(axis=1).groupby("target").sum().to_dict()


def test_the_sentences_say_what_the_scores_say(results, whole):
    done, reached, bounds = section_summary.sentences(results)
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


def test_naming_one_class_for_all_by_hand(results):
    # Two classes of as many images: precision 1/2, recall 1, F1 2/3 for a half of the weight.
    assert results.guessing(["multi_elevation"]) == [pytest.approx(1 / 3)]
    cells = results.confusion.copy()
    cells.loc[cells["target"] == "drone", "count"] *= 3
    results.confusion = cells
    assert results.guessing(["multi_elevation"]) == [pytest.approx(0.75 * 2 * 0.75 / 1.75)]


def test_the_full_size_run_stands_beside_once_it_is_there(results, whole, tmp_path, monkeypatch):
    monkeypatch.setattr(isarflow.report.results, "FULL_SIZE", tmp_path)
    assert section_summary.full_size_table(results) == ()
    for name in ("scores", "validation"):
        table = pd.read_csv(whole.parent / "learning" / f"{name}.csv", keep_default_na=False)
        table["snr_definition"] = "mean"
        table.to_csv(tmp_path / f"{name}.csv.xz", index=False)
    again = Results(whole.parent, fake.SETTINGS, fake.names(fake.SETTINGS))
    (table,) = section_summary.full_size_table(again)
    assert set(table.shown["run, and its SNR"]) == {"this run, peak_3db", "full size, mean"}
    assert re.fullmatch(r"0\.\d\d \(0\.\d\d–[01]\.\d\d\)", table.shown["12 dB"].iloc[0])
    assert {"0 dB", "12 dB", "24 dB"} <= set(table.shown.columns)
    assert "docs/results.md" in table.caption
    thesis = copy.deepcopy(fake.SETTINGS) | {"name": "thesis"}
    assert Results(whole.parent, thesis, fake.names(thesis)).full_size is None


def test_matrices_count_what_the_table_counts(results):
    entries = section_confusion.matrices(results)["entries"]
    one = next(one for one in entries if one["words"].startswith("KNN, softmax: sector, split by sector"))
    assert one["set"] == "open set, blind thresholds" and one["targets"] == ["drone", "missile", "ufo"]
    cells = results.confusion.query("experiment == 'sector' and model == 'knn' and score == 'softmax'")
    cells = cells.query("threshold == 'blind' and test_snr_db == 0 and elevation == 'all'")
    counts = np.array(one["counts"][one["snrs"].index(0)])
    for (row, target), (column, label) in itertools.product(enumerate(one["targets"]), enumerate(one["classes"])):
        expected = cells[(cells["target"] == target) & (cells["predicted"] == label)]["count"].sum()
        assert counts[row, column] == int(expected)
    assert [len(entry["counts"]) for entry in entries] == [len(entry["snrs"]) for entry in entries]
    assert any(entry["set"] == "closed set" for entry in entries)


def test_what_the_page_s_scripts_read_is_there(whole):
    assert {"explore.json", "compare.json", "matrices.json"} <= set(unpacked(whole / "index.html"))


def test_models_of_one_s_own_have_colours_that_no_other_has():
    names = vocabulary.Names(page_names({"svm": {}, "knn": {}}), ["svm", "knn", "mine", "yours"])
    assert len({names.model(model).color for model in ("svm", "knn", "mine", "yours")}) == 4
    many = [f"own{number}" for number in range(30)]
    assert len({vocabulary.Names(page_names({}), many).model(model).color for model in many}) == 12


def test_a_field_of_unknown_reach_is_known_between_its_samples_where_they_are_dense():
    turn = np.arange(48) * 7.5
    wave = lambda azimuth: np.exp(12j * np.cos(np.radians(azimuth)))  # noqa: E731
    highest = interpolation.order_told(wave(turn))
    finer = np.linspace(0, 360, 241)
    # Its harmonics fall off beyond the 12th; the 24th is 1e-5 of the first.
    np.testing.assert_allclose(interpolation.between(turn, wave(turn), highest, finer), wave(finer), atol=1e-3)
    assert interpolation.order_told(wave(turn[::2])) is None
