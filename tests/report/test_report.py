"""The page is made from results in every shape that a config allows, is whole, and asks nothing of a network."""

import copy

import fake
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from pages import Page, check_whole, headings, table_rows

ONE_ELEVATION = {"start": 10, "stop": 10, "step": 1}


def test_page_shows_all_stages(whole):
    page = check_whole(whole)
    expected = "checks headline look explore fields meshes scattering imaging images recognition compare matrices"
    expected += " learning open capsule alike run facts times made glossary"
    assert headings(page) == expected.split()
    assert len([attrs for attrs in page.attributes("details") if attrs.get("class") == "part"]) == 5
    figures = {attrs["id"] for attrs in page.attributes("figure")}
    for target in fake.SETTINGS["targets"]:
        assert {f"figure-{kind}_{target}" for kind in ("mesh", "rcs", "range_profiles", "images")} <= figures
    for experiment in fake.SETTINGS["learning"]["experiments"]:
        assert f"figure-learning_{experiment}" in figures
    assert {"figure-headline", "figure-gallery_snr", "figure-prediction_times", "figure-training_curves"} <= figures
    assert {"figure-open_fcnn_open", "figure-published_confusion", "figure-mistaken", "figure-folds"} <= figures
    assert {f"figure-capsule_reconstructions{of}" for of in ("", "_capsule_denoise")} <= figures


def test_warnings_of_the_run_stand_near_the_top(whole):
    html = (whole / "index.html").read_text()
    box = html[html.index('<details class="warnings"') : html.index('<ul class="targets">')]
    assert box.index("<summary>") < box.index("<ul>")
    # The made-up missile's half axis is 0.5 m; at 24 azimuths and 1 GHz cross-range is unambiguous over 0.57 m.
    half = 0.299792458 / (2 * 2 * np.pi / 24) / 2
    assert "<strong>missile</strong>: the target reaches 0.50 m from the origin" in box and f"only {half:.2f} m" in box


def test_a_page_names_the_experiments_left_out_and_those_without_unknown_targets(tmp_path, few_pictures):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["targets"]["ufo"]["role"] = "other"
    settings["aspect"]["azimuth"]["count"] = 240
    experiments = settings["learning"]["experiments"]
    settings["learning"]["experiments"] = {name: experiments[name] for name in ("fcnn_open", "multi_elevation")}
    settings["learning"]["left_out"] = {"capsule_open": "Too few pixels."}
    page = check_whole(fake.write(tmp_path / "fake", settings))
    assert "3 warnings on this run: learning" in page.words
    assert "the default experiment 'capsule_open' is left out. Too few pixels." in page.words
    assert "experiment 'fcnn_open' is open, but no target has role unknown" in page.words


def test_reconstructions_are_those_of_the_store(whole):
    data = pd.read_csv(whole / "tables" / "figure_capsule_reconstructions.csv")
    store = xr.open_zarr(whole.parent / "learning" / "reconstructions" / "capsule_sector_fold2" / "capsule.zarr")
    cell = data.query("target == 'ufo' and example == 2 and snr == 2.5 and range == 3 and crossrange == 7").iloc[0]
    one = store.isel(example=2, range=3, crossrange=7).sel(target="ufo")
    expected = [float(one.truth), float(one.sel(snr=2.5).seen), float(one.sel(snr=2.5).made)]
    np.testing.assert_allclose(cell[["truth", "seen", "made"]].astype(float), expected, atol=1e-4)
    assert (cell["elevation"], cell["azimuth"]) == (0, 100)  # every target's examples stand at azimuths of its own
    shown = store.sel(target="drone", snr=24).isel(example=slice(data["example"].nunique()))
    drawn = data.query("target == 'drone' and snr == 24")
    error = float(((shown.made - shown.truth) ** 2).mean())
    assert f"{((drawn['made'] - drawn['truth']) ** 2).mean():.2g}" == f"{error:.2g}"


def test_everything_tried_is_listed_the_best_first(whole):
    scores = pd.read_csv(whole.parent / "learning" / "scores.csv", keep_default_na=False)
    opened = scores.query("threshold == 'blind' and elevation == 'all' and metric == 'f1_weighted' and fold == ''")
    opened = opened.query("snr_definition == 'peak_3db'")
    method = ["split", "experiment", "model", "training", "score"]
    means = opened.query("test_snr_db >= -12 and test_snr_db <= 12").groupby(method)["value"].mean()
    rows = table_rows(whole / "index.html", "table-tried")
    head, *body = rows
    assert len(body) == len(means) == 15
    listed = [float(row[head.index("mean")]) for row in body]
    splits = [row[head.index("split")] for row in body]
    assert splits == sorted(splits, reverse=True)
    for split in ("sector", "random"):
        within = [value for value, of in zip(listed, splits, strict=True) if of == split]
        assert within == sorted(within, reverse=True)
    assert sorted(listed) == pytest.approx(sorted(means), abs=5e-4)
    gains = {(row[1], row[4], row[2]): row[head.index("gain")] for row in body}
    assert gains["capsule open", "ZNCC", "capsule"] == gains["noisy capsule", "ZNCC", "capsule"] == "+0.000"
    listed = {"f1_weighted", "f1_weighted_gain", "auroc", "fpr95", "oscr"}
    assert set(pd.read_csv(whole / "tables" / "tried.csv")["metric"]) == listed


def test_a_network_of_ones_own_has_the_capsules_section(tmp_path, few_pictures):
    """A decoder with known scores of its own, three classes, one SNR, and no method of the thesis."""
    settings = copy.deepcopy(fake.SETTINGS)
    settings["targets"]["disc"] = {"mesh": "disc.stl", "role": "known"}
    settings["noise"]["snr_db"] = [6]
    learning = settings["learning"]
    learning["models"] = {"own": {"kind": "own"}}
    learning["experiments"] = {
        "mine": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["own"], "open": True, "split": "sector"}
    }
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    expected = "imaging images recognition compare matrices learning open capsule alike"
    assert headings(page)[7:-5] == expected.split()
    figures = {path.stem for path in (report / "figures").iterdir()}
    assert {"capsule_reconstructions", "open_mine"} <= figures and "published_confusion" not in figures
    assert set(pd.read_csv(report / "tables" / "figure_open_mine.csv")["score"].dropna()) == {"fit", "my_error"}


def test_no_decoder_leaves_out_the_capsule(tmp_path, few_pictures):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["learning"]["experiments"] = {"fcnn_open": settings["learning"]["experiments"]["fcnn_open"]}
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    assert "open" in headings(page) and "capsule" not in headings(page)
    assert "gain" not in table_rows(report / "index.html", "table-tried")[0]


def test_same_inputs_give_same_bytes(tmp_path, few_pictures):
    settings = copy.deepcopy(fake.SETTINGS)
    kept = ("multi_elevation", "capsule_open")
    settings["learning"]["experiments"] = {name: settings["learning"]["experiments"][name] for name in kept}
    first = fake.write(tmp_path / "fake", settings)
    second = fake.again(first.parent, settings, tmp_path / "second")
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(second) for path in second.rglob("*") if path.is_file())
    assert [str(file) for file in files if (first / file).read_bytes() != (second / file).read_bytes()] == []


def test_numbers_on_the_page_are_those_of_the_results(whole):
    page = Page(whole / "index.html")
    scores = pd.read_csv(whole.parent / "learning" / "scores.csv")
    one = scores.query("experiment == 'multi_elevation' and model == 'knn' and metric == 'accuracy'").iloc[-1]
    assert f"{one['value']:.3f} [{one['low']:.3f}, {one['high']:.3f}]" in page.words
    # The nose and tail of the fake drone add up in phase broadside: 0.15 m, half as much again in HH.
    rcs = pd.read_csv(whole / "tables" / "figure_rcs_drone.csv").query("azimuth == 90 and elevation == 0")
    expected = 10 * np.log10(4 * np.pi * np.array([0.15, 0.225]) ** 2)
    np.testing.assert_allclose(rcs.set_index("polarization").loc[["VV", "HH"], "rcs_dbsm"], expected, atol=1e-4)


def test_no_published_time_stands_beside_a_reduced_network(whole):
    times = pd.read_csv(whole / "tables" / "prediction_times.csv").set_index(["experiment", "model"])
    assert times.loc[("multi_elevation", "knn"), "published_ms"] == 48.8
    assert times.loc[("single_elevation", "lr"), "published_ms"] == 0.0365
    # 16 filters here, 256 there; the experiment is one that the thesis timed.
    assert np.isnan(times.loc[("capsule_open", "capsule"), "published_ms"])


def test_a_reduced_network_is_called_so_with_its_size(whole):
    words = Page(whole / "index.html").words
    assert "reduced: 16 filters, 2 capsule channels; the thesis's has 256 and 32, 107 times the weights" in words
    assert "with squares, of the capsule network, trained without noise" in words
    assert "(16 filters, 2 capsule channels; the thesis's 256 and 32)" in words


def test_the_best_is_chosen_on_validation_images(whole):
    """The made-up nearest neighbour beats logistic regression on the test images, and not on the validation images."""
    scores = pd.read_csv(whole / "tables" / "accuracy.csv")
    scores = scores.query("experiment == 'multi_elevation' and elevation == 'all'").pivot_table(
        index="test_snr_db", columns="model", values="value"
    )
    assert (scores["knn"] > scores["lr"]).any() and scores.loc[24, "lr"] == pytest.approx(0.99, abs=5e-4)
    data = pd.read_csv(whole / "tables" / "figure_headline.csv")
    closed = data[(data["set"] == "closed set") & data["curve"].str.startswith("best")]
    assert set(closed["model"]) == {"lr"} and set(closed["split"]) == {"sector", "random"}
    scores = pd.read_csv(whole.parent / "learning" / "scores.csv", keep_default_na=False)
    tested = scores.query("experiment == 'sector' and metric == 'f1_weighted' and test_snr_db == 0 and score == ''")
    tested = tested.query("fold == '' and snr_definition == 'peak_3db'").set_index("model")
    assert tested.loc["knn", "value"] > tested.loc["lr", "value"]


def test_no_experiments_leave_out_learning(tmp_path, few_pictures):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["learning"]["experiments"] = {}
    settings["targets"] = {"ufo": settings["targets"]["ufo"]}
    page = check_whole(fake.write(tmp_path / "fake", settings))
    expected = "checks look explore fields meshes scattering imaging images run facts made glossary"
    assert headings(page) == expected.split()


def test_one_frequency_shows_meshes_and_rcs_only(tmp_path):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["radar"] |= {"frequencies": 1, "bandwidth": 0}
    settings["mesh"]["bands"] = 1
    settings["targets"]["drone"]["mesh"] = "<b>.stl"  # shown as text, not taken as markup
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    assert not page.attributes("b") and "<b>.stl" in page.words
    assert headings(page) == ["checks", "fields", "meshes", "scattering", "run", "facts", "made", "glossary"]
    # Of the glossary what the page says, and no word of learning.
    glossary = page.words.partition("Glossary")[2]
    assert "unknowns Edges of the mesh" in glossary
    assert not any(word in glossary for word in ("weighted F1", "open set", "capsule", "softmax"))
    # Here every elevation and polarization is drawn.
    rcs = pd.read_csv(report / "tables" / "figure_rcs_ufo.csv")
    assert sorted(rcs["elevation"].unique()) == [-30, 0, 30]
    assert set(rcs["polarization"]) == {"VV", "HH"}


@pytest.mark.parametrize("given", [["ufo"], ["drone", "missile", "ufo"]])
def test_targets_given_by_their_field_have_no_mesh(tmp_path, few_pictures, given):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["learning"]["experiments"] = {}
    for name in given:
        settings["targets"][name] = {"role": settings["targets"][name]["role"], "field": f"<{name}>.ffe"}
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    meshed = {"drone", "missile", "ufo"}.difference(given)
    assert f"No mesh: {', '.join(given)}, given by the field alone." in page.words
    assert ("Each target has one mesh per frequency band" in page.words) == bool(meshed)
    assert ("The method of moments gives" in page.words) == bool(meshed)
    for name in given:
        assert f"field of {name} was not solved here; it comes from <{name}>.ffe (SHA-256 0123456789ab…)" in page.words
    figures = {attrs["id"] for attrs in page.attributes("figure")}
    assert {name for name in figures if name.startswith(("figure-mesh_", "figure-bands_"))} == {
        f"figure-{kind}_{name}" for kind in ("mesh", "bands") for name in meshed
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
    page = check_whole(fake.write(tmp_path / "fake", settings))
    assert f"against {across}" in next(
        attrs["alt"] for attrs in page.attributes("img") if attrs["alt"].startswith("RCS of drone")
    )
