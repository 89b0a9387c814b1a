"""What the page says of a run that splits by elevation, too, and of thresholds that need no unknown target."""

import fake
import numpy as np
import pandas as pd
import pytest

from isarflow.report import section_alike, section_headline, section_open, section_run

ALL = {"train": fake.CLEAN, "open": True}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    settings = fake.changed(noise={"snr_db": [0, 12]})
    settings["aspect"]["elevation"]["step"] = 15
    settings["learning"]["experiments"] = {
        "any": {**ALL, "models": ["lr", "knn"]},
        "between": {**ALL, "models": ["lr", "knn"], "split": "elevation"},
        "far": {**ALL, "models": ["knn"], "split": "sector"},
    }
    folder = tmp_path_factory.mktemp("by_elevation")
    fake.make(folder, settings)
    return fake.results(folder, settings)


def test_all_splits_stand_beside_each_other_the_one_by_elevation_first(results):
    _, reached, _ = section_run.sentences(results)
    assert reached.startswith("At 12 dB by peak_3db power, split by elevation, with blind thresholds, ")
    assert "split by sector, far from all in training, the same has" in reached
    assert "split at random, with near copies in training, the same has" in reached
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


def test_every_protocol_and_split_is_in_the_table_of_all_that_was_tried(results):
    section = section_open.section(results)
    shown = section.tables[0].shown
    assert {"mean", "mean, thesis", "mean, kept"} <= set(shown) and "gain" not in shown
    assert shown["split"].tolist() == ["elevation"] * 2 + ["sector"] + ["random"] * 2
    assert "so that 95 % of the known ones are kept" in section.text[0]
    assert "Thresholds: blind, thesis and kept." in section.figures[0].caption


def test_several_looks_have_a_figure_where_scores_add_up(results):
    scores = results.scores[results.scores["score"] != ""]
    assert section_open.looks_figure(results, scores) == ()
    one = scores.query("metric == 'f1_weighted' and model == 'knn'")
    several = [one.assign(metric=f"f1_weighted_{count}_looks", value=1 - 1 / count) for count in (2, 3, 5)]
    (drawn,) = section_open.looks_figure(results, pd.concat([scores, *several]))
    assert set(drawn.data["looks"]) == {1, 2, 3, 5} and set(drawn.data["model"]) == {"knn"}
    assert set(drawn.data["threshold"]) == {"blind"} and set(drawn.data["split"]) == {"elevation", "sector", "random"}
    assert (drawn.data.query("looks == 5")["value"] == 0.8).all()


def test_likeness_is_measured_by_the_angle_between_views(results):
    data = section_alike.likeness_by_angle(results, "drone", 45).set_index(["along", "degrees"])
    image = np.abs(results.images("drone", "clean").image.transpose("elevation", "azimuth", ...).values)
    flat = image.reshape(5, 24, -1)
    beside = [(flat[e, a], flat[e, (a + 2) % 24]) for e in range(5) for a in range(24)]
    above = [(flat[e, a], flat[e + 3, a]) for e in range(2) for a in range(24)]
    for where, pairs in ((("azimuth", 30.0), beside), (("elevation", 45.0), above)):
        likeness = [np.corrcoef(one, other)[0, 1] for one, other in pairs]
        assert data.loc[where, "mean"] == pytest.approx(np.mean(likeness), abs=1e-5)
        assert data.loc[where, "low"] == pytest.approx(np.quantile(likeness, 0.1), abs=1e-5)
    assert all(data.loc[along].index.tolist() == [15, 30, 45] for along in ("azimuth", "elevation"))
    drawn = section_alike.angle_figure(results)
    assert set(drawn.data["target"]) == {"drone", "missile"}
    assert drawn.data.query("along == 'elevation'")["degrees"].min() == 15
