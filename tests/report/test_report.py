"""The page is made from results in every shape that a config allows, is whole, and asks nothing of a network."""

import copy
import importlib.util
import itertools
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from report.page import write_report

ROOT = Path(__file__).resolve().parents[2]
ONE_ELEVATION = {"start": 10, "stop": 10, "step": 1}
VOID = {"meta", "link", "img", "br"}


def _fake():
    # Tests are imported without packages, so a helper beside them is loaded by its path.
    spec = importlib.util.spec_from_file_location("report_fake", Path(__file__).with_name("fake.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


fake = _fake()


class Page(HTMLParser):
    """Parses a page and keeps its tags; raises when an element is closed that is not the innermost open one."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.text, self.open, self.path = [], [], [], path
        self.feed(path.read_text())
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def attributes(self, *names):
        return [attrs for tag, attrs in self.tags if tag in names]

    @property
    def words(self):
        return " ".join(" ".join(self.text).split())


def write(root, settings):
    fake.make(root, settings)
    return again(root, settings, root / "report")


def again(root, settings, report):
    write_report(
        root, settings, report / "index.html", report / "figures", report / "tables", ROOT / "resources" / "reference"
    )
    return report


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The report of a run with all stages."""
    return write(tmp_path_factory.mktemp("whole") / "fake", fake.SETTINGS)


def check_whole(report):
    """What holds for every report; returns the parsed page."""
    page = Page(report / "index.html")
    for attrs in page.attributes("img"):
        assert attrs["alt"].strip()
        assert attrs["src"].startswith("data:")
    for attrs in page.attributes("script", "iframe", "object", "embed", "video", "audio", "source"):
        assert "src" not in attrs and "data" not in attrs
    assert all(attrs["href"].startswith("data:") for attrs in page.attributes("link"))
    assert "@import" not in page.words and "url(" not in page.words
    ids = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    for attrs in page.attributes("a"):
        target = attrs["href"]
        if target.startswith("#"):
            assert target[1:] in ids
        else:
            assert (report / target).stat().st_size > 0
    levels = [int(tag[1]) for tag, _ in page.tags if tag in ("h1", "h2", "h3")]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    figures = {path.stem for path in (report / "figures").iterdir()}
    assert len(figures) == len(page.attributes("img"))
    for name in figures:
        svg = (report / "figures" / f"{name}.svg").read_text()
        assert "<path" in svg or "<image" in svg
        assert "<dc:date>" not in svg
        assert len(pd.read_csv(report / "tables" / f"figure_{name}.csv")) > 0
    return page


def test_page_shows_all_stages(whole):
    page = check_whole(whole)
    headings = [attrs["id"] for attrs in page.attributes("h2")]
    assert headings == ["headline", "meshes", "scattering", "images", "learning", "open", "splits", "times", "made"]
    figures = {attrs["id"] for attrs in page.attributes("figure")}
    for target in fake.SETTINGS["targets"]:
        assert {f"figure-{kind}_{target}" for kind in ("mesh", "rcs", "range_profiles", "images")} <= figures
    for experiment in fake.SETTINGS["learning"]["experiments"]:
        assert f"figure-learning_{experiment}" in figures
        # Models trained at several SNRs are too many for matrices.
        assert (f"figure-confusion_{experiment}" in figures) == (experiment != "noisy_training")
    assert {"figure-headline", "figure-images_snr", "figure-prediction_times", "figure-training_curves"} <= figures
    assert {"figure-open_fcnn_open", "figure-open_confusion"} <= figures


def test_the_open_set_stands_beside_what_was_published(whole):
    page = Page(whole / "index.html")
    scores = pd.read_csv(whole.parent / "learning" / "scores.csv")
    one = scores.query("model == 'fcnn' and threshold == 'blind' and metric == 'f1_weighted'").iloc[-1]
    assert f"{one['value']:.3f} [{one['low']:.3f}, {one['high']:.3f}]" in page.words
    assert "0.7981" in page.words  # the published weighted F1 of the same adaptation
    table = pd.read_csv(whole / "tables" / "open_fcnn_open.csv")
    assert {"auroc", "fpr95", "oscr", "f1_weighted"} <= set(table["metric"])


def test_the_splits_are_compared_for_the_same_training_images_only(whole):
    page = Page(whole / "index.html")
    table = pd.read_csv(whole / "tables" / "split_accuracy.csv")
    # Both splits know lr and knn; the svm, and what trains at one elevation or with noise, have no counterpart.
    assert set(table["model"]) == {"lr", "knn"}
    assert set(table["experiment_random"]) <= {"multi_elevation", "fcnn_open"}
    assert set(table["experiment_sector"]) == {"sector"}
    # The fake scores do not know of splits.
    assert "Accuracy at 24 dB under the random split less that under sector: LR +0.000; KNN +0.000." in page.words


def test_same_inputs_give_same_bytes(whole, tmp_path):
    second = again(whole.parent, fake.SETTINGS, tmp_path / "second")
    files = sorted(path.relative_to(whole) for path in whole.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(second) for path in second.rglob("*") if path.is_file())
    assert [str(file) for file in files if (whole / file).read_bytes() != (second / file).read_bytes()] == []


def test_numbers_on_the_page_are_those_of_the_results(whole):
    page = Page(whole / "index.html")
    scores = pd.read_csv(whole.parent / "learning" / "scores.csv")
    one = scores.query("experiment == 'multi_elevation' and model == 'knn' and metric == 'accuracy'").iloc[-1]
    assert f"{one['value']:.3f} [{one['low']:.3f}, {one['high']:.3f}]" in page.words
    # The nose and tail of the fake drone add up in phase broadside: 0.15 m, half as much again in HH.
    rcs = pd.read_csv(whole / "tables" / "figure_rcs_drone.csv").query("azimuth == 90 and elevation == 0")
    expected = 10 * np.log10(4 * np.pi * np.array([0.15, 0.225]) ** 2)
    np.testing.assert_allclose(rcs.set_index("polarization").loc[["VV", "HH"], "rcs_dbsm"], expected, atol=1e-4)


def test_published_statements_stand_beside_their_counterparts(whole):
    table = pd.read_csv(whole / "tables" / "published.csv", dtype={"value": str})
    # Of the fake run's SNRs (-12, 0, 2.5, 12, 24) and models only these were published.
    assert set(zip(table["experiment"], table["model"], table["snr_db"], strict=True)) == {
        ("single_elevation", "lr", 24),
        ("single_elevation", "svm", 24),
        ("multi_elevation", "knn", 0),
    }
    times = pd.read_csv(whole / "tables" / "prediction_times.csv").set_index(["experiment", "model"])
    assert times.loc[("multi_elevation", "knn"), "published_ms"] == 48.8
    assert times.loc[("single_elevation", "lr"), "published_ms"] == 0.0365


def test_no_experiments_leave_out_learning(tmp_path):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["learning"]["experiments"] = {}
    settings["targets"] = {"ufo": settings["targets"]["ufo"]}
    page = check_whole(write(tmp_path / "fake", settings))
    assert [attrs["id"] for attrs in page.attributes("h2")] == ["meshes", "scattering", "images", "made"]


def test_one_frequency_shows_meshes_and_rcs_only(tmp_path):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["radar"] |= {"frequencies": 1, "bandwidth": 0}
    settings["mesh"]["bands"] = 1
    settings["targets"]["drone"]["mesh"] = "<b>.stl"  # shown as text, not taken as markup
    report = write(tmp_path / "fake", settings)
    page = check_whole(report)
    assert not page.attributes("b") and "<b>.stl" in page.words
    assert [attrs["id"] for attrs in page.attributes("h2")] == ["meshes", "scattering", "made"]
    # Here every elevation and polarization is drawn.
    rcs = pd.read_csv(report / "tables" / "figure_rcs_ufo.csv")
    assert sorted(rcs["elevation"].unique()) == [-30, 0, 30]
    assert set(rcs["polarization"]) == {"VV", "HH"}


@pytest.mark.parametrize("given", [["ufo"], ["drone", "missile", "ufo"]])
def test_targets_given_by_their_field_have_no_mesh(tmp_path, given):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["learning"]["experiments"] = {}
    for name in given:
        settings["targets"][name] = {"role": settings["targets"][name]["role"], "field": f"<{name}>.ffe"}
    report = write(tmp_path / "fake", settings)
    page = check_whole(report)
    meshed = {"drone", "missile", "ufo"}.difference(given)
    assert f"No mesh: {', '.join(given)}, given by the field alone." in page.words
    assert ("Each target has one mesh per frequency band" in page.words) == bool(meshed)
    assert ("The method of moments gives" in page.words) == bool(meshed)
    for name in given:
        assert f"field of {name} was not solved here; it comes from <{name}>.ffe (SHA-256 0123456789ab…)" in page.words
    figures = {attrs["id"] for attrs in page.attributes("figure")}
    assert {name for name in figures if name.startswith("figure-mesh_")} == {
        f"figure-{kind}_{name}" for kind in ("mesh", "mesh_bands") for name in meshed
    }
    assert {f"figure-rcs_{name}" for name in settings["targets"]} <= figures
    tables = [pd.read_csv(report / f"tables/{name}.csv").set_index("target") for name in ("targets", "scattering")]
    for name in settings["targets"]:
        assert np.isnan(tables[0].loc[name, "unknowns"]) == (name in given)
        assert np.isnan(tables[1].loc[name, "residual_max"]) == (name in given)
    assert (report / "tables/meshes.csv").exists() == bool(meshed)


@pytest.mark.parametrize(
    ("aspect", "across"),
    [
        ({"elevation": {"start": -60, "stop": 60, "step": 20}, "azimuth": {"count": 1}}, "elevation"),
        (
            {"elevation": {"start": 10, "stop": 10, "step": 1}, "azimuth": {"start": 0, "stop": 50, "step": 25}},
            "azimuth",
        ),
        ({"elevation": {"start": 0, "stop": 0, "step": 1}, "azimuth": {"count": 1}}, "azimuth"),
    ],
)
def test_rcs_of_odd_sweeps(tmp_path, aspect, across):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["radar"] |= {"frequencies": 1, "bandwidth": 0, "polarizations": ["HH"]}
    settings["mesh"]["bands"], settings["aspect"] = 1, aspect
    settings["targets"] = {"drone": settings["targets"]["drone"]}
    page = check_whole(write(tmp_path / "fake", settings))
    assert f"against {across}" in next(
        attrs["alt"] for attrs in page.attributes("img") if attrs["alt"].startswith("RCS of drone")
    )
