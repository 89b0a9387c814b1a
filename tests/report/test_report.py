"""The page is made from results in every shape that a config allows, is whole, and asks nothing of a network."""

import copy

import fake
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from pages import Page, check_whole, headings, table_rows


def changed(experiments=(), **stages):
    """The made-up run's settings with these of its experiments alone, and with these keys of stages."""
    settings = copy.deepcopy(fake.SETTINGS)
    every = settings["learning"]["experiments"]
    settings["learning"]["experiments"] = {name: every[name] for name in experiments}
    for stage, keys in stages.items():
        settings[stage] |= keys
    return settings


def one_frequency(**stages):
    """The made-up run's settings without images."""
    return changed(mesh={"bands": 1}, radar={"frequencies": 1, "bandwidth": 0}, **stages)


def figures_of(page):
    return {attrs["id"].removeprefix("figure-") for attrs in page.attributes("figure")}


def test_page_shows_all_stages(whole):
    page = check_whole(whole)
    expected = "checks headline look explore fields meshes scattering imaging images recognition compare matrices"
    expected += " learning open capsule alike run facts made glossary"
    assert headings(page) == expected.split()
    assert len([attrs for attrs in page.attributes("details") if attrs.get("class") == "part"]) == 5
    figures = figures_of(page)
    for target in fake.SETTINGS["targets"]:
        assert {f"{kind}_{target}" for kind in ("mesh", "bands", "rcs", "range_profiles", "images")} <= figures
    for experiment in fake.SETTINGS["learning"]["experiments"]:
        assert f"learning_{experiment}" in figures
    expected = "headline gallery_snr training_curves open_fcnn_open published_confusion images_alike"
    assert set(expected.split()) <= figures
    assert {f"capsule_reconstructions{of}" for of in ("", "_capsule_denoise")} <= figures


def test_the_page_says_what_was_run_and_how_well_it_was_solved(whole):
    words = Page(whole / "index.html").words
    assert "Repairs in the CAD files: drone (2 duplicate triangles); missile (2 duplicate triangles);" in words
    assert "missile: EFIE, 792 unknowns, largest relative residual 5.0×10⁻⁶." in words
    # 5 frequencies over 0.4 GHz about 1 GHz: c / (2 x 0.5 GHz); in azimuth the wavelength over twice 3 x 15 degrees.
    resolution = 0.299792458 / (2 * 0.5), 0.299792458 / (2 * 3 * np.radians(15))
    assert "Of each target there are 72 noise-free images, of 5 × 3 pixels" in words
    assert f"They resolve {resolution[0]:.3f} × {resolution[1]:.3f} m" in words
    assert "unknown 0.60 × 0.60 × 0.20 m 792 unknowns" in words
    assert "12.5 s of jobs (mesh 12.5 s)" in words


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


def test_everything_tried_is_listed_the_best_first(whole):
    scores = pd.read_csv(whole.parent / "learning" / "scores.csv", keep_default_na=False)
    opened = scores.query("threshold == 'blind' and elevation == 'all' and metric == 'f1_weighted' and fold == ''")
    opened = opened.query("snr_definition == 'peak_3db' and test_snr_db >= -12 and test_snr_db <= 12")
    means = opened.groupby(["split", "experiment", "model", "training", "score"])["value"].mean()
    head, *body = table_rows(whole / "index.html", "table-tried")
    listed = [(row[head.index("split")], float(row[head.index("mean")])) for row in body]
    assert len(listed) == len(means) == 15 and listed == sorted(listed, reverse=True)
    assert sorted(mean for _, mean in listed) == pytest.approx(sorted(means), abs=5e-4)
    gains = {(row[1], row[4], row[2]): row[head.index("gain")] for row in body}
    assert gains["capsule open", "ZNCC", "capsule"] == gains["noisy capsule", "ZNCC", "capsule"] == "+0.000"
    listed = {"f1_weighted", "f1_weighted_gain", "auroc", "fpr95", "oscr"}
    assert set(pd.read_csv(whole / "tables" / "tried.csv")["metric"]) == listed


def test_a_network_of_ones_own_has_the_capsules_section(tmp_path, few_pictures):
    """A decoder with known scores of its own, three classes, one SNR, and no method of the thesis."""
    settings = changed(noise={"snr_db": [6]}, targets={"disc": {"mesh": "disc.stl", "role": "known"}})
    mine = {"train": dict(fake.CLEAN), "models": ["own"], "open": True, "split": "sector"}
    settings["learning"] |= {"models": {"own": {"kind": "own"}}, "experiments": {"mine": mine}}
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    expected = "imaging images recognition compare matrices learning open capsule alike"
    assert headings(page)[7:-4] == expected.split()
    figures = {path.stem for path in (report / "figures").iterdir()}
    assert {"capsule_reconstructions", "open_mine"} <= figures and "published_confusion" not in figures
    assert set(pd.read_csv(report / "tables" / "figure_open_mine.csv")["score"].dropna()) == {"fit", "my_error"}


def test_no_decoder_leaves_out_the_capsule(tmp_path, few_pictures):
    report = fake.write(tmp_path / "fake", changed(["fcnn_open"]))
    page = check_whole(report)
    assert "open" in headings(page) and "capsule" not in headings(page)
    assert "gain" not in table_rows(report / "index.html", "table-tried")[0]


def test_same_inputs_give_same_bytes(tmp_path, few_pictures):
    settings = changed(("multi_elevation", "capsule_open"))
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


def test_a_reduced_network_is_called_so_and_no_published_time_stands_beside_it(whole):
    times = pd.read_csv(whole / "tables" / "prediction_times.csv").set_index(["experiment", "model"])["published_ms"]
    assert (times["multi_elevation", "knn"], times["single_elevation", "lr"]) == (48.8, 0.0365)
    # 16 filters here, 256 there; the experiment is one that the thesis timed.
    assert np.isnan(times["capsule_open", "capsule"])
    words = Page(whole / "index.html").words
    assert "with squares, of the capsule network, trained without noise" in words
    assert "(16 filters, 2 capsule channels; the thesis's 256 and 32)" in words


def test_one_frequency_shows_meshes_and_rcs_only(tmp_path):
    settings = one_frequency()
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
    assert sorted(rcs["elevation"].unique()) == [-30, 0, 30] and set(rcs["polarization"]) == {"VV", "HH"}


@pytest.mark.parametrize("given", [["ufo"], ["drone", "missile", "ufo"]])
def test_targets_given_by_their_field_have_no_mesh(tmp_path, few_pictures, given):
    settings = changed()
    for name in given:
        settings["targets"][name] = {"role": settings["targets"][name]["role"], "field": f"<{name}>.ffe"}
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    expected = "checks look explore fields meshes scattering imaging images run facts made glossary"
    assert headings(page) == expected.split()
    meshed = {"drone", "missile", "ufo"}.difference(given)
    assert f"No mesh: {', '.join(given)}, given by the field alone." in page.words
    for words in ("Each target has one mesh per frequency band", "The method of moments gives"):
        assert (words in page.words) == bool(meshed)
    for name in settings["targets"]:
        text = f"field of {name} was not solved here; it comes from <{name}>.ffe (SHA-256 0123456789ab…)"
        assert (text in page.words, f"{name}: EFIE, 792 unknowns" in page.words) == (name in given, name in meshed)
    assert page.words.count("given by its field") == len(given)
    figures = figures_of(page)
    drawn = {name for name in figures if name.startswith(("mesh_", "bands_"))}
    assert drawn == {f"{kind}_{name}" for kind in ("mesh", "bands") for name in meshed}
    assert {f"rcs_{name}" for name in settings["targets"]} <= figures
    assert (report / "tables/meshes.csv").exists() == bool(meshed)


@pytest.mark.parametrize(
    ("elevation", "azimuth", "across"),
    [
        ({"start": -60, "stop": 60, "step": 20}, {"count": 1}, "elevation"),
        ({"start": 10, "stop": 10, "step": 1}, {"start": 0, "stop": 50, "step": 25}, "azimuth"),
        ({"start": 0, "stop": 0, "step": 1}, {"count": 1}, "azimuth"),
    ],
)
def test_rcs_of_odd_sweeps(tmp_path, elevation, azimuth, across):
    settings = one_frequency(aspect={"elevation": elevation, "azimuth": azimuth})
    settings["radar"]["polarizations"] = ["HH"]
    settings["targets"] = {"drone": settings["targets"]["drone"]}
    page = check_whole(fake.write(tmp_path / "fake", settings))
    (alt,) = [attrs["alt"] for attrs in page.attributes("img") if attrs["alt"].startswith("RCS of drone")][:1]
    assert f"against {across}" in alt
