"""What the page says of a run that splits by elevation, too, and of thresholds that need no unknown target."""

import copy

import fake
import numpy as np
import pandas as pd
import pytest

from isarflow.report import section_alike, section_headline, section_open, section_run, section_split, section_summary
from isarflow.report.results import Results

ALL = {"train": {"elevation": "all", "snr_db": "clean"}, "open": True}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["aspect"]["elevation"] = {"start": -30, "stop": 30, "step": 15}
    settings["noise"]["snr_db"] = [0, 12]
    settings["learning"]["experiments"] = {
        "any": {**ALL, "models": ["lr", "knn"]},
        "between": {**ALL, "models": ["lr", "knn"], "split": "elevation"},
        "far": {**ALL, "models": ["knn"], "split": "sector"},
    }
    folder = tmp_path_factory.mktemp("by_elevation")
    fake.make(folder, settings)
    return Results(folder, settings, fake.names(settings))


def test_the_summary_leads_with_the_split_by_elevation(results):
    _, reached, _ = section_summary.sentences(results)
    assert reached.startswith("At 12 dB by peak_3db power, split by elevation, with blind thresholds, ")
    assert "split by sector, far from all in training, the same has" in reached
    assert "split at random, with near copies in training, the same has" in reached


def test_the_headline_has_a_column_for_each_split(results):
    drawn = section_headline.headline(results)
    assert list(drawn.data["split"].unique()) == ["elevation", "sector", "random"]
    assert set(drawn.data["threshold"]) == {"", "blind", "thesis"}  # two at once are enough
    assert "every second elevation trains and test images are of those between" in drawn.caption
    assert "split by elevation (2 folds), split by sector (3 folds) and split at random" in drawn.caption
    found = section_headline.comparison(results)
    dashes = {one["words"].partition("(")[2].partition(")")[0]: one["dashes"] for one in found["curves"]}
    assert len(set(dashes.values())) == 3 and dashes["elevation"] == ""
    assert found["lines"].startswith("solid lines: split by elevation; dashed lines: split by sector; ")
    assert {one["set"] for one in found["curves"]} >= {f"open set, {name} thresholds" for name in ("blind", "kept")}


def test_all_splits_stand_beside_each_other(results):
    (section,) = section_split.section(results)
    text = " ".join(section.text)
    assert "every second elevation trains" in text and "arcs of the aspects" in text and "near copies" in text
    assert "3 arcs of the aspects take turns" in section_run._splits(results)
    trained = results.times.groupby("experiment")["training_observations"].min()
    assert trained.to_dict() == {"any": 1234, "between": 1000, "far": 1000}
    tables = {table.name: table for table in section.tables}
    accuracy = tables["split_accuracy"].shown
    kinds = ["elevation", "sector", "random", "random − elevation", "random − sector"]
    assert accuracy[accuracy["model"] == "KNN"]["split"].tolist() == kinds
    gains = accuracy[accuracy["split"] == "random − elevation"].set_index("model")["12 dB"]
    assert gains.to_dict() == {"LR": "+0.000", "KNN": "+0.000"}
    # LR is not split by sector.
    assert accuracy[accuracy["model"] == "LR"]["split"].tolist() == [kinds[i] for i in (0, 2, 3)]
    opened = tables["split_open"].shown
    assert set(opened["thresholds"]) == {"blind", "thesis", "kept"}
    assert set(opened.loc[opened["model"] == "LR", "random − sector"]) == {"–"} and not opened.isna().any(axis=None)
    (folds,) = section.figures
    assert set(folds.data["split"]) == {"elevation", "sector"}
    assert set(folds.data[folds.data["split"] == "elevation"]["fold"]) == {"", "1", "2"}


def test_the_facts_say_how_far_tested_elevations_are(results):
    assert "by elevation: every second elevation trains, those between are tested;" in section_run._splits(results)
    settings = copy.deepcopy(results.settings)
    settings["learning"]["split"]["spacing"] = 10
    words = section_run._splits(Results(results.folder, settings, results.names.stated))
    assert "those between are tested, 10° away or more;" in words


def test_every_protocol_has_its_column(results):
    section = section_open.section(results)
    shown = section.tables[0].shown
    assert {f"weighted F1, {name}" for name in ("blind", "thesis", "kept")} <= set(shown)
    assert "so that 95 % of the known ones are kept" in section.text[0]
    assert "Thresholds: blind, thesis and kept." in section.figures[0].caption


def test_several_looks_have_a_figure_where_scores_add_up(results):
    scores = results.scores[results.scores["score"] != ""]
    assert section_open.looks_figure(results, scores) == ()
    several = [
        scores.query("metric == 'f1_weighted' and model == 'knn'").assign(
            metric=f"f1_weighted_{count}_looks", value=1 - 1 / count
        )
        for count in (2, 3, 5)
    ]
    (drawn,) = section_open.looks_figure(results, pd.concat([scores, *several]))
    assert set(drawn.data["looks"]) == {1, 2, 3, 5} and set(drawn.data["model"]) == {"knn"}
    assert set(drawn.data["threshold"]) == {"blind"} and set(drawn.data["split"]) == {"elevation", "sector", "random"}
    assert (drawn.data.query("looks == 5")["value"] == 0.8).all()


def test_training_images_by_elevation_are_of_every_second_one(results):
    elevations = {
        (fold, side): np.unique(
            section_alike._stacked(results, f"between_fold{fold}", "drone", side).elevation
        ).tolist()
        for fold in (1, 2)
        for side in ("train", "test")
    }
    train = [-30, 0, 30]
    assert elevations == {(1, "train"): train, (1, "test"): [-15], (2, "train"): train, (2, "test"): [15]}


def test_likeness_is_measured_by_the_angle_between_views(results):
    data = section_alike.likeness_by_angle(results, "drone", 45).set_index(["along", "degrees"])
    image = np.abs(results.images("drone", "clean").image.transpose("elevation", "azimuth", ...).values)
    flat = image.reshape(5, 24, -1)

    def likeness(pairs):
        return [np.corrcoef(one, other)[0, 1] for one, other in pairs]

    beside = likeness((flat[e, a], flat[e, (a + 2) % 24]) for e in range(5) for a in range(24))
    above = likeness((flat[e, a], flat[e + 3, a]) for e in range(2) for a in range(24))
    for where, found in ((("azimuth", 30.0), beside), (("elevation", 45.0), above)):
        assert data.loc[where, "mean"] == pytest.approx(np.mean(found), abs=1e-5)
        assert data.loc[where, "low"] == pytest.approx(np.quantile(found, 0.1), abs=1e-5)
    assert all(data.loc[along].index.tolist() == [15, 30, 45] for along in ("azimuth", "elevation"))
    drawn = section_alike.angle_figure(results)
    assert set(drawn.data["target"]) == {"drone", "missile"}
    assert drawn.data.query("along == 'elevation'")["degrees"].min() == 15
