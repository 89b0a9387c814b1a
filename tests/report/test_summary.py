"""The first screen: whether it is right, how well it works, and a run of full size beside it, once there is one."""

import itertools
import re

import fake
import pandas as pd
from pages import Page

import isarflow.report.results
from isarflow.report import section_headline, section_run
from isarflow.report.vocabulary import PROTOCOLS, select


def test_is_it_right_says_what_is_not(results):
    results.sphere["error_db"] = -0.21
    rows = {what: (right, finding) for right, what, finding, _ in section_run.checks(results, [])}
    assert rows["Sphere, solved in this run"] == (False, "0.210 dB and 0.30° from the Mie series, 570 unknowns")
    assert rows["Residuals"] == (True, "at most 5.0×10⁻⁶, over 15 systems")
    # Spheres that are squeezed have narrow triangles.
    assert rows["Meshes"] == (False, "0 of 6 meet all their goals; some missed by drone, missile, ufo")
    assert rows["Warnings"] == (True, "none on this run")
    results.sphere["error_db"] = -0.19
    rows = section_run.checks(results, [("ufo", "folds")])
    assert rows[0][0] and not rows[-1][0]


def test_the_sentences_say_what_the_scores_say(results, whole):
    done, reached, bounds = section_run.sentences(results)
    assert "3 targets at 0.8 to 1.2 GHz from 3 × 24 directions, solved on their meshes; ISAR" in done
    assert "to reject ufo" in done
    case = {"split": "sector", "threshold": "blind", "metric": "f1_weighted", "test_snr_db": 12, "elevation": "all"}
    best = select(results.scores, **case, model="knn", score="softmax")["value"].iloc[0]
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
        table.assign(snr_definition="mean").to_csv(tmp_path / f"{name}.csv.xz", index=False)
    (table,) = section_run.full_size_table(fake.results(whole.parent))
    assert set(table.shown["run, and its SNR"]) == {"this run, peak_3db", "full size, mean"}
    assert re.fullmatch(r"0\.\d\d \(0\.\d\d–[01]\.\d\d\)", table.shown["12 dB"].iloc[0])
    assert {"0 dB", "12 dB", "24 dB"} <= set(table.shown.columns)
    assert "docs/results.md" in table.caption
    assert fake.results(whole.parent, fake.SETTINGS | {"name": "thesis"}).full_size is None


def test_matrices_count_what_the_table_counts(results):
    entries = section_headline.matrices(results)["entries"]
    one = next(one for one in entries if one["words"].startswith("KNN, softmax: sector (sector)"))
    assert one["set"] == "open set, blind thresholds" and one["targets"] == ["drone", "missile", "ufo"]
    case = {"experiment": "sector", "model": "knn", "score": "softmax", "threshold": "blind", "elevation": "all"}
    cells = select(results.confusion, **case, test_snr_db=0)
    counts = one["counts"][one["snrs"].index(0)]
    for (row, target), (column, label) in itertools.product(enumerate(one["targets"]), enumerate(one["classes"])):
        assert counts[row][column] == int(select(cells, target=target, predicted=label)["count"].sum())
    assert [len(entry["counts"]) for entry in entries] == [len(entry["snrs"]) for entry in entries]
    assert any(entry["set"] == "closed set" for entry in entries)


def test_compare_opens_on_the_headline_s_curves(results):
    found = section_headline.comparison(results)
    opened = [one for one in found["curves"] if one["set"] == "open set, blind thresholds"]
    words = "capsule, ZNCC: capsule open (random), trained without noise"
    assert any(one["shown"] and one["words"].startswith(words) for one in opened)
    for split, dashes in (("(sector)", ""), ("(random)", "6 4")):
        assert {one["dashes"] for one in found["curves"] if split in one["words"]} == {dashes}
    # One of three targets is unknown.
    assert found["rejecting"] == {f"open set, {name} thresholds": [0.1667] for name in PROTOCOLS}
    # One known score of each model in each experiment is the best of them.
    best = [(one["words"].partition(": ")[2], one["model"]) for one in opened if one["best"]]
    assert len(set(best)) == len(best) < len(opened)
