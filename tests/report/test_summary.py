"""What the page says of how well it works: the first screen, the plots to compare, and splits by elevation, too."""

import re

import fake
import numpy as np
import pandas as pd
import pytest
from pages import Page

import isarflow.report.results
from isarflow.report import section_alike, section_headline, section_open, section_run
from isarflow.report.vocabulary import PROTOCOLS, select


@pytest.fixture(scope="module")
def by_elevation(tmp_path_factory):
    """Results of a run that splits by elevation, too."""
    settings = fake.changed([], noise={"snr_db": [0, 12]})
    settings["aspect"]["elevation"]["step"] = 15
    for split, models in (("random", ["lr", "knn"]), ("elevation", ["lr", "knn"]), ("sector", ["knn"])):
        experiment = {"train": fake.CLEAN, "open": True, "models": models, "split": split}
        settings["learning"]["experiments"][f"by_{split}"] = experiment
    folder = tmp_path_factory.mktemp("by_elevation")
    fake.make(folder, settings)
    return fake.results(folder, settings)


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
    cells = select(results.confusion, **case, test_snr_db=0).pivot(index="target", columns="predicted", values="count")
    counts = cells.loc[one["targets"], one["classes"]].astype(int).to_numpy()
    assert one["counts"][one["snrs"].index(0)] == counts.tolist()
    assert [len(entry["counts"]) for entry in entries] == [len(entry["snrs"]) for entry in entries]
    assert any(entry["set"] == "closed set" for entry in entries)


def test_compare_opens_on_the_headline_s_curves(results):
    found = section_headline.comparison(results)
    opened = [one for one in found["curves"] if one["set"] == "open set, blind thresholds"]
    words = "capsule, ZNCC: capsule open (random), trained without noise"
    assert any(one["shown"] and one["words"].startswith(words) for one in opened)
    assert {one["dashes"] for one in found["curves"] if "(random)" in one["words"]} == {"6 4"}
    # One of three targets is unknown.
    assert found["rejecting"] == {f"open set, {name} thresholds": [0.1667] for name in PROTOCOLS}
    # One known score of each model in each experiment is the best of them.
    best = [(one["words"].partition(": ")[2], one["model"]) for one in opened if one["best"]]
    assert len(set(best)) == len(best) < len(opened)


def test_all_splits_stand_beside_each_other_the_one_by_elevation_first(by_elevation):
    _, reached, _ = section_run.sentences(by_elevation)
    assert reached.startswith("At 12 dB by peak_3db power, split by elevation, with blind thresholds, ")
    assert "split by sector, far from all in training, the same has" in reached
    assert "split at random, with near copies in training, the same has" in reached
    drawn = section_headline.headline(by_elevation)
    assert list(drawn.data["split"].unique()) == ["elevation", "sector", "random"]
    assert set(drawn.data["threshold"]) == {"", "blind", "thesis"}  # two at once are enough
    assert "every second elevation trains and test images are of those between" in drawn.caption
    assert "split by elevation (2 folds), split by sector (3 folds) and split at random" in drawn.caption
    found = section_headline.comparison(by_elevation)
    dashes = {one["words"].partition("(")[2].partition(")")[0]: one["dashes"] for one in found["curves"]}
    assert len(set(dashes.values())) == 3 and dashes["elevation"] == ""
    assert found["lines"].startswith("solid lines: split by elevation; dashed lines: split by sector; ")
    assert {one["set"] for one in found["curves"]} >= {f"open set, {name} thresholds" for name in ("blind", "kept")}


def test_protocols_and_splits_are_in_the_table_of_all_tried_and_several_looks_in_a_figure(by_elevation):
    section, scores = section_open.section(by_elevation), by_elevation.scores.query("score != ''")
    shown = section.tables[0].shown
    assert {"mean", "mean, thesis", "mean, kept"} <= set(shown) and "gain" not in shown
    assert shown["split"].tolist() == ["elevation"] * 2 + ["sector"] + ["random"] * 2
    assert "so that 95 % of the known ones are kept" in section.text[0]
    assert "Thresholds: blind, thesis and kept." in section.figures[0].caption
    assert section_open.looks_figure(by_elevation, scores) == ()
    one = scores.query("metric == 'f1_weighted' and model == 'knn'")
    several = [one.assign(metric=f"f1_weighted_{count}_looks", value=1 - 1 / count) for count in (2, 3, 5)]
    (drawn,) = section_open.looks_figure(by_elevation, pd.concat([scores, *several]))
    assert set(drawn.data["looks"]) == {1, 2, 3, 5} and set(drawn.data["model"]) == {"knn"}
    assert set(drawn.data["threshold"]) == {"blind"} and set(drawn.data["split"]) == {"elevation", "sector", "random"}
    assert (drawn.data.query("looks == 5")["value"] == 0.8).all()


def test_likeness_is_measured_by_the_angle_between_views(by_elevation):
    data = section_alike.likeness_by_angle(by_elevation, "drone", 45).set_index(["along", "degrees"])
    image = np.abs(by_elevation.images("drone", "clean").image.transpose("elevation", "azimuth", ...).values)
    flat = image.reshape(5, 24, -1)
    beside = [(flat[e, a - 2], flat[e, a]) for e in range(5) for a in range(24)]
    above = [(flat[e, a], flat[e + 3, a]) for e in range(2) for a in range(24)]
    for where, pairs in ((("azimuth", 30.0), beside), (("elevation", 45.0), above)):
        likeness = [np.corrcoef(one, other)[0, 1] for one, other in pairs]
        assert data.loc[where, "mean"] == pytest.approx(np.mean(likeness), abs=1e-5)
        assert data.loc[where, "low"] == pytest.approx(np.quantile(likeness, 0.1), abs=1e-5)
    assert all(data.loc[along].index.tolist() == [15, 30, 45] for along in ("azimuth", "elevation"))
    drawn = section_alike.angle_figure(by_elevation)
    assert set(drawn.data["target"]) == {"drone", "missile"}
    assert drawn.data.query("along == 'elevation'")["degrees"].min() == 15
