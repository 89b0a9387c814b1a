"""The page is made from results in every shape that a config allows, is whole, and asks nothing of a network."""

import json
import re

import fake
import fake_learning
import matplotlib
import pandas as pd
import pytest
from pages import check_whole, unpacked

from isarflow.report import section_headline, section_learning, section_open
from isarflow.report.page import write_report

ONE_FREQUENCY = {"mesh": {"bands": 1}, "radar": {"frequencies": 1, "bandwidth": 0}}


def test_a_page_names_the_experiments_left_out_and_those_without_unknown_targets(tmp_path, few_pictures):
    settings = fake.changed(["fcnn_open", "multi_elevation"])
    settings["learning"]["left_out"] = {"capsule_open": "Too few pixels."}
    settings["targets"]["ufo"]["role"] = "other"
    settings["aspect"]["azimuth"]["count"] = 240
    words = check_whole(fake.write(tmp_path / "fake", settings)).words
    assert "3 warnings on this run: learning" in words
    assert "the default experiment 'capsule_open' is left out. Too few pixels." in words
    assert "experiment 'fcnn_open' is open, but no target has role unknown" in words


def test_targets_that_move_are_a_split_of_their_own_and_a_figure(tmp_path, few_pictures):
    settings = fake.changed(["fcnn_open"])
    experiments = settings["learning"]["experiments"]
    limits = {"near": {"place": 0.2}, "far": {"place": 0.4}, "drifting": {"place": 0.2, "drift": 0.5}}
    experiments |= {name: experiments["fcnn_open"] | {"motion": motion} for name, motion in limits.items()}
    experiments["lossy"] = experiments["fcnn_open"] | {"motion": {"missing": 0.2}}  # not in the figure
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    assert {"motion", "open_near", "open_lossy"} <= page.figures
    rows = pd.read_csv(report / "tables" / "figure_motion.csv")
    assert {*rows["experiment"]} == {"fcnn_open", *limits} and {*rows["place"]} == {0, 0.2, 0.4}
    assert {*rows["drift"]} == {0, 0.5}
    assert "split at random, targets that move" in page.words


def test_a_network_of_ones_own_has_the_capsules_section(tmp_path, few_pictures):
    """A decoder with known scores of its own, three classes, one SNR, and no method of the thesis."""
    settings = fake.changed(noise={"snr_db": [6]}, targets={"disc": {"mesh": "disc.stl", "role": "known"}})
    mine = {"train": fake.CLEAN, "models": ["own"], "open": True, "split": "sector"}
    settings["learning"] |= {"models": {"own": {"kind": "own"}}, "experiments": {"mine": mine}}
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    shown = " ".join(page.headings()[7:-4])
    assert shown == "imaging images recognition compare matrices learning open capsule alike"
    assert {"capsule_reconstructions", "open_mine"} <= page.figures
    assert set(pd.read_csv(report / "tables" / "figure_open_mine.csv")["score"].dropna()) == {"fit", "my_error"}


def test_no_decoder_leaves_out_the_capsule(tmp_path, few_pictures):
    page = check_whole(fake.write(tmp_path / "fake", fake.changed(["fcnn_open"])))
    assert "open" in page.headings() and "capsule" not in page.headings()
    assert "gain" not in page.table("table-tried")[0]


def test_the_first_model_of_a_kind_is_drawn_and_tables_have_all(tmp_path, few_pictures):
    settings = fake.changed([])
    for name in ("drone", "missile"):
        settings["targets"][name] |= {"kind": "flyer", "class": "flyer"}
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    assert {"mesh_drone", "mesh_ufo", "images_drone"} <= page.figures
    assert not {name for name in page.figures if name.endswith("missile")}
    assert {*pd.read_csv(report / "tables" / "meshes.csv")["target"]} == {"drone", "missile", "ufo"}
    assert "of 3 targets at 0.8 to 1.2 GHz" in page.words and "(the first model of each kind is drawn)" in page.words


def test_same_inputs_give_same_bytes(tmp_path, few_pictures):
    settings = fake.changed(["multi_elevation", "capsule_open"])
    first = fake.write(tmp_path / "fake", settings)
    second = tmp_path / "second"
    write_report(first.parent, settings, fake.names(settings), second / "index.html")
    files, again = ({path.relative_to(of): path for path in of.rglob("*.*")} for of in (first, second))
    assert files.keys() == again.keys()
    assert [file for file in files if files[file].read_bytes() != again[file].read_bytes()] == []


def test_one_frequency_shows_meshes_and_rcs_only(tmp_path):
    settings = fake.changed([], **ONE_FREQUENCY)
    settings["targets"]["drone"]["mesh"] = "<b>.stl"  # shown as text, not taken as markup
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    assert not page.attributes("b") and "<b>.stl" in page.words
    assert page.headings() == ["checks", "fields", "meshes", "scattering", "run", "facts", "made", "glossary"]
    # Of the glossary what the page says, and no word of learning.
    glossary = page.words.partition("Glossary")[2]
    assert "unknowns Edges of the mesh" in glossary
    assert not any(word in glossary for word in ("weighted F1", "open set", "capsule", "softmax"))
    # Here every elevation and polarization is drawn.
    rcs = pd.read_csv(report / "tables" / "figure_rcs_ufo.csv")
    assert sorted(rcs["elevation"].unique()) == [-30, 0, 30] and set(rcs["polarization"]) == {"VV", "HH"}


@pytest.mark.parametrize("given", [["ufo"], ["drone", "missile", "ufo"]])
def test_targets_given_by_their_field_have_no_mesh(tmp_path, few_pictures, given):
    settings = fake.changed([])
    plastic = {"material": {"name": "abs", "permittivity": 2.7, "thickness": 0.0015}}
    settings["targets"]["drone"] |= plastic
    settings["targets"]["missile"]["parts"] = {"body": {}, "nose": plastic}
    for name in given:
        settings["targets"][name] = {"role": settings["targets"][name]["role"], "field": f"<{name}>.ffe"}
    report = fake.write(tmp_path / "fake", settings)
    page = check_whole(report)
    expected = "checks look explore fields meshes scattering imaging images run facts made glossary"
    assert page.headings() == expected.split()
    meshed = {"drone", "missile", "ufo"}.difference(given)
    assert f"No mesh: {', '.join(given)}, given by the field alone." in page.words
    assert ("Each target has one mesh per frequency band" in page.words) == bool(meshed)
    assert ("The method of moments gives" in page.words) == bool(meshed)
    assert ("Each part has a colour; one can see through sheets" in page.words) == ("missile" in meshed)
    viewed = json.loads(unpacked(report / "index.html")["explore.json"])["targets"]
    assert {one["name"] for one in viewed if "part" in (one["mesh"] or {})} == meshed & {"missile"}
    for name in settings["targets"]:
        text = f"field of {name} was not solved here; it comes from <{name}>.ffe (SHA-256 0123456789ab…)"
        plastic = "a sheet of abs (permittivity 2.7, thickness 0.0015 m), "
        made = {"drone": plastic, "missile": f"body: metal, nose: {plastic}"}.get(name, "")
        solved = f"{name}: EFIE, {made}792 unknowns" in page.words
        assert (text in page.words, solved) == (name in given, name in meshed)
    assert page.words.count("given by its field") == len(given)
    drawn = {name for name in page.figures if name.startswith(("mesh_", "bands_"))}
    assert drawn == {f"{kind}_{name}" for kind in ("mesh", "bands") for name in meshed}
    assert {f"rcs_{name}" for name in settings["targets"]} <= page.figures
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
    settings = fake.changed([], **ONE_FREQUENCY, aspect={"elevation": elevation, "azimuth": azimuth})
    settings["radar"]["polarizations"] = ["HH"]
    settings["targets"] = {"drone": settings["targets"]["drone"]}
    page = check_whole(fake.write(tmp_path / "fake", settings))
    first = next(attrs["alt"] for attrs in page.attributes("img") if attrs["alt"].startswith("RCS of drone"))
    assert f"against {across}" in first


@pytest.mark.parametrize(
    ("noise", "axis"),
    [
        ({"definition": "mean"}, "mean"),
        ({"definition": "peak_3db", "snr_db": [0, 3]}, "peak_3db"),  # too few SNRs for any by mean power
        ({"definition": "peak_3db", "per": "sweep"}, "mean"),
    ],
)
def test_the_axis_names_the_definition_of_snr_and_published_values_have_theirs(tmp_path, noise, axis):
    settings = fake.changed(["capsule_open", "sector", "multi_elevation"], noise=noise)
    fake_learning.learn(tmp_path / "learning", settings)
    results = fake.results(tmp_path, settings)
    # Letters as letters, to read the labels of the axes.
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figures = [section_headline.headline(results), *section_learning.section(results).figures]
        figures += [section_open.open_figure(results, name) for name in results.opened]
    drawn = {one.name: one for one in figures}
    own = ("open_sector", "learning_sector")  # the thesis has none of them
    beside = ("headline", "learning_multi_elevation", "open_capsule_open")
    for name, definition in (dict.fromkeys(own, noise["definition"]) | dict.fromkeys(beside, axis)).items():
        caption, labels = drawn[name].caption, re.findall(r"test SNR by (\w+) power \[dB\]", drawn[name].svg.decode())
        assert set(labels) == set(drawn[name].data["snr_definition"]) == {definition}
        assert f"SNR by {definition} power" in caption
        assert ("Open markers: thesis" in caption) == (name in beside and axis == "mean")
        assert ("Published values are left out" in caption) == (name in beside and axis != "mean")
    assert ("(mean of a sweep over azimuth)" in drawn["open_sector"].caption) == (noise.get("per") == "sweep")
