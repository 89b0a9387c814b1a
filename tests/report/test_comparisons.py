"""What the page says of splits, folds, definitions of SNR, gains and published values."""

import copy
import json
import re
from html import unescape
from types import MappingProxyType

import fake
import fake_learning
import matplotlib
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from pages import Page, table_rows, unpacked

from isarflow.learning import likeness
from isarflow.report import section_alike, section_headline, section_learning, section_open
from isarflow.report.layout import style
from isarflow.report.plots import REJECTING
from isarflow.report.results import Results


def caption_of(report, name):
    """The caption of a figure of the page, without its links."""
    html = (report / "index.html").read_text()
    figure = html[html.index(f'id="figure-{name}"') :]
    return unescape(re.search(r"<figcaption>(.*?) <a ", figure, re.DOTALL)[1])


def test_the_open_set_stands_beside_what_was_published(whole):
    page = Page(whole / "index.html")
    scores = pd.read_csv(whole.parent / "learning" / "scores.csv")
    one = scores.query("model == 'knn' and threshold == 'blind' and metric == 'f1_weighted'")
    one = one.query("experiment == 'fcnn_open' and snr_definition == 'peak_3db' and test_snr_db == 24").iloc[0]
    assert f"{one['value']:.3f} [{one['low']:.3f}, {one['high']:.3f}]" in page.words
    assert "0.7981" in page.words  # the published weighted F1 of the same adaptation


def test_gains_stand_with_their_intervals_in_the_table_of_all_that_was_tried(whole):
    table = pd.read_csv(whole / "tables" / "tried.csv", keep_default_na=False)
    case = "model == 'knn' and score == 'softmax' and split == 'random' and threshold == 'blind' and test_snr_db == 0"
    gain, value = (table.query(f"{case} and metric == '{of}'") for of in ("f1_weighted_gain", "f1_weighted"))
    theirs = table.query(
        "experiment == 'capsule_open' and score == 'zncc' and threshold == 'blind' and test_snr_db == 0"
    )
    theirs = theirs.query("metric == 'f1_weighted'")["value"].iloc[0]
    # The second model of an experiment does better than the first: so the fake results are made.
    assert gain["value"].iloc[0] == pytest.approx(value["value"].iloc[0] - theirs, abs=2e-6)
    assert float(gain["low"].iloc[0]) > 0
    # One fold has no interval.
    sector = table.query("split == 'sector' and metric == 'f1_weighted_gain'")
    assert len(sector) and set(sector["low"]) == {""}


def test_published_statements_stand_beside_their_counterparts_at_the_same_snr(whole):
    paths = [whole / "tables" / f"{name}.csv" for name in ("published", "published_open")]
    tables = [pd.read_csv(path, dtype={"value": str}, keep_default_na=False) for path in paths]
    # All SNRs are by mean power: the last at which all of the made-up images have scores is 12 dB.
    here = {
        (row.experiment, row.model, row.score, row.elevation, row.snr_db): row.here_at_snr_db
        for table in tables
        for row in table.assign(elevation=table["condition"].eq("test at elevation 0")).itertuples()
    }
    assert here == {
        ("single_elevation", "knn", "", True, -3): -3,
        ("single_elevation", "svm", "", True, 6): 6,
        ("single_elevation", "lr", "", False, 24): 12,
        ("single_elevation", "svm", "", False, 24): 12,
        ("single_elevation", "svm", "", True, 24): 12,
        ("single_elevation", "knn", "", False, 21): 12,
        ("single_elevation", "knn", "", False, 6): 6,
        ("multi_elevation", "knn", "", False, 0): 0,
        ("multi_elevation", "knn", "", False, -6): -6,
        ("fcnn_open", "fcnn", "", False, 12): 12,
        ("capsule_open", "capsule", "", False, 0): 0,
        ("capsule_open", "capsule", "", False, -6): -6,
        ("fcnn_open", "fcnn", "softmax", False, 24): 12,
        ("capsule_open", "capsule", "mse", False, 15): 12,
        ("capsule_open", "capsule", "zncc", False, 6): 6,
    }
    # The nearest neighbour is the second of its experiment; by mean power 0 dB are 2.1 dB by peak_3db.
    row = tables[0].query("experiment == 'multi_elevation' and snr_db == 0").iloc[0]
    assert row["ours"] == pytest.approx(fake_learning.right(2.1, 1))


def test_figures_with_published_values_are_drawn_by_mean_power(whole):
    for name, definitions in (
        ("headline", {"mean"}),
        ("learning_multi_elevation", {"mean"}),
        ("learning_sector", {"peak_3db"}),
        ("open_fcnn_open", {"mean"}),
        ("open_sector", {"peak_3db"}),
    ):
        data, caption = pd.read_csv(whole / "tables" / f"figure_{name}.csv"), caption_of(whole, name)
        assert set(data["snr_definition"]) == definitions, name
        assert ("Open markers: thesis" in caption) == ("mean" in definitions), name
        assert f"SNR by {''.join(definitions)} power" in caption, name
    data = pd.read_csv(whole / "tables" / "figure_headline.csv").query("set == 'closed set' and model == 'capsule'")
    values = data.query("split == 'random'").set_index("test_snr_db")["value"]
    assert values.to_dict() == pytest.approx({snr: fake_learning.right(snr + 2.1, 0) for snr in (-12, 0, 2.5, 12)})


@pytest.mark.parametrize(
    ("noise", "axis", "marked"),
    [
        ({"definition": "mean"}, "mean", True),
        ({"definition": "peak_3db", "snr_db": [0, 3]}, "peak_3db", False),  # too few SNRs for any by mean power
        ({"definition": "peak_3db", "per": "sweep"}, "mean", True),
    ],
)
def test_the_axis_names_the_definition_of_snr_and_published_values_have_theirs(tmp_path, noise, axis, marked):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["noise"] |= noise
    settings["learning"]["experiments"] = {
        name: settings["learning"]["experiments"][name] for name in ("capsule_open", "sector", "multi_elevation")
    }
    fake_learning.learn(tmp_path / "learning", settings)
    results = Results(tmp_path, settings, fake.names(settings))
    # Letters as letters, to read the labels of the axes.
    with style(), matplotlib.rc_context({"svg.fonttype": "none"}):
        figures = [section_headline.headline(results), *section_learning.section(results).figures]
        figures += [section_open.open_figure(results, name) for name in results.opened]
    drawn = {one.name: one for one in figures}
    axes = {name: set(re.findall(r"test SNR by (\w+) power \[dB\]", one.svg.decode())) for name, one in drawn.items()}
    own = noise["definition"]
    assert axes["headline"] == axes["learning_multi_elevation"] == axes["open_capsule_open"] == {axis}
    assert axes["open_sector"] == axes["learning_sector"] == {own}
    for name in ("headline", "learning_multi_elevation", "open_capsule_open"):
        assert ("Open markers: thesis" in drawn[name].caption) == marked
        assert ("Published values are left out" in drawn[name].caption) != marked
    assert ("(mean of a sweep over azimuth)" in drawn["open_sector"].caption) == (noise.get("per") == "sweep")


def test_every_comparison_names_networks_thresholds_split_and_snr(whole):
    capsule, fcnn = "(16 filters, 2 capsule channels; the thesis's 256 and 32)", "FCNN (756 hidden units)"
    every = "Thresholds: blind, thesis and kept"
    sector = "split by sector (3 folds; of capsule sector only no. 2; of sector FCNN only no. 1 and 3)"
    for name, parts in {
        "headline": [f"capsule {capsule}", "Thresholds: blind and thesis", "split by sector (3 folds; of capsule"],
        "open_noisy_capsule": [f"capsule and capsule, denoising {capsule}", every, "Images split at random."],
        "open_capsule_sector": [capsule, every, "split by sector (3 folds; of capsule sector only no. 2)"],
        "open_fcnn_open": [fcnn, every, "Images split at random."],
        "published_confusion": [fcnn, "Thresholds: thesis", "Images split at random."],
        "learning_sector_fcnn": [fcnn, "split by sector (3 folds; of sector FCNN only no. 1 and 3)"],
    }.items():
        caption = caption_of(whole, name)
        assert [part for part in [*parts, "SNR by "] if part not in caption] == [], name
    words = Page(whole / "index.html").words
    plot = words[words.index("Weighted F1 of every experiment") :]
    assert f"{fcnn}; capsule and capsule, denoising {capsule}. {every}." in plot
    assert f"Images {sector} and split at random. SNR by peak_3db power." in plot


def test_the_page_never_says_nan(whole):
    page = Page(whole / "index.html")
    assert "nan" not in page.words.lower().split() and "[nan" not in page.words
    text = unpacked(whole / "index.html")["compare.json"].decode()
    curves = json.loads(text, parse_constant=pytest.fail)["curves"]
    lows = {one["experiment"]: one["points"][0][2] is None for one in curves}
    assert lows == {name: name == "capsule sector" for name in lows} and len(lows) > 5
    # One fold alone: no brackets.
    assert [row[-1] for row in table_rows(whole / "index.html", "table-accuracy") if row[1] == "capsule sector"] == [
        "0.990"
    ]


def test_training_curves_are_of_the_first_fold_and_show_the_learning_rate(whole):
    data = pd.read_csv(whole / "tables" / "figure_training_curves.csv")
    runs = set(data["run"])
    assert {"sector_fcnn_fold1", "capsule_sector_fold2", "fcnn_open"} <= runs and "sector_fcnn_fold3" not in runs
    assert data.query("run == 'fcnn_open'")["learning_rate"].tolist() == [1e-3, 4e-4, 1e-9]


def test_settings_that_were_tried_stand_with_their_validation_accuracy(whole):
    # The last fold chooses otherwise than the other two.
    assert table_rows(whole / "index.html", "table-search_lr_tuned") == [
        ["penalty", "sector"],
        ["0.001", "0.783 ✓ in 1 of 3 folds"],
        ["0.1", "0.800 ✓ in 2 of 3 folds"],
    ]


def test_the_definitions_of_snr_differ_image_by_image(whole):
    # The one image without a signal does not count.
    assert fake_learning.OFFSET == 2.1
    told = "; ".join(f"2.1 dB for {name} (0.0 to 4.2 dB)" for name in ("drone", "missile", "ufo"))
    assert f"by mean power, on average (and image by image) by {told}." in Page(whole / "index.html").words


class _Random:
    """Images of noise of four targets, one of the unknown ones' nearly the same as one of a known target's."""

    surfaces = MappingProxyType({})

    def __init__(self):
        random, axes = np.random.default_rng(4), ("elevation", "azimuth", "range", "crossrange")
        coords = dict(
            zip(axes, ([-30.0, 2.0], np.arange(8) * 45.0, np.arange(6) * 0.1, np.arange(5) * 0.1), strict=True)
        )
        parts = {name: random.standard_normal((2, 8, 6, 5, 2)) @ [1, 1j] for name in "abuv"}
        parts["v"][1, 5] = parts["b"][1, 2] * 1.3j + 0.05  # the phase counts for nothing, nor does the size
        parts["u"][0, 0] = parts["a"][0, 0]  # far from the horizon
        self.stores = {
            name: xr.Dataset({"image": (axes, of.astype(np.complex64))}, coords) for name, of in parts.items()
        }

    def of_role(self, role):
        return ["a", "b"] if role == "known" else ["u", "v"]

    def images(self, name, store):
        return self.stores[name]


def test_the_images_that_look_alike_are_those_with_the_largest_correlation():
    with style():
        (figure,) = section_alike.alike_figure(_Random())
    assert "v 225° and b 90°, 1.00." in figure.caption
    shown = figure.data["image"].unique().tolist()
    assert shown[2:] == ["2: v 225°", "2: b 90°"] and shown[0].startswith("1: u ")
    assert "elevation 2°" in figure.caption and "u 0° and a 0°" not in figure.caption


def test_likeness_is_one_for_the_same_image_and_none_without_contrast():
    images = np.random.default_rng(3).normal(size=(4, 5, 6, 2)) @ [1, 1j]
    rows = likeness.standardized(images)
    same = likeness.standardized((3 * np.abs(images) + 2).astype(complex))
    np.testing.assert_allclose(np.diag(rows @ same.T), 1)
    assert np.abs(rows @ rows.T - np.eye(4)).max() <= 1
    assert not likeness.standardized(np.ones((1, 5, 6))).any()


def test_every_plot_of_the_open_set_has_the_line_of_rejecting_everything(whole):
    opened = [name for name, one in fake.SETTINGS["learning"]["experiments"].items() if one.get("open")]
    for name in ("headline", *(f"open_{name}" for name in opened)):
        svg = (whole / "figures" / f"{name}.svg").read_text()
        assert re.search(f'stroke-dasharray: [^"]*stroke: {REJECTING["color"]}', svg), name
    # One of three targets is unknown: F1 1/2 for a third of the images.
    assert "Rejecting everything gives a weighted F1 of 0.167" in Page(whole / "index.html").words
