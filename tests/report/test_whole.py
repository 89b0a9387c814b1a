"""The report of a run that has all: its words, numbers and first screen; and of one that splits by elevation."""

import json
import re
import shutil

import fake
import fake_learning
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from pages import check_whole, unpacked

from isarflow.core.folders import ROOT
from isarflow.core.sweep import C0
from isarflow.learning.data import likeness
from isarflow.report import (
    section_alike,
    section_full_size,
    section_headline,
    section_learning,
    section_open,
    section_run,
)
from isarflow.report.plots import REJECTING
from isarflow.report.vocabulary import PROTOCOLS, SCHEMES, SPLITS, select

CAPSULE, FCNN = "(16 filters, 2 capsule channels; the thesis's 256 and 32)", "FCNN (756 hidden units)"
THRESHOLDS, AT_RANDOM = "Thresholds kept, blind and thesis", "images split at random;"
SECTOR = "split by sector (3 folds; of capsule sector only fold 2; of sector FCNN only folds 1 and 3)"
OFFSETS = "; ".join(f"2.1 dB for {name} (0.0 to 4.2 dB)" for name in ("drone", "missile", "ufo"))
# The made-up missile's half axis is 0.5 m; at 24 azimuths and 1 GHz cross-range is unambiguous over 0.57 m.
HALF = C0 / 1e9 / (2 * 2 * np.pi / 24) / 2
SAID = (
    "Repairs in the CAD files: drone (2 duplicate triangles); missile (2 duplicate triangles);",
    "missile: EFIE, 792 unknowns, largest relative residual 5.0×10⁻⁶.",
    "Of each target there are 72 noise-free images, of 5 × 3 pixels",
    # 5 frequencies over 0.4 GHz about 1 GHz: c / (2 x 0.5 GHz); in azimuth the wavelength over twice 3 x 15 degrees.
    f"They resolve {C0 / (2 * 0.5e9):.3f} × {C0 / 1e9 / (2 * 3 * np.radians(15)):.3f} m",
    "unknown 0.60 × 0.60 × 0.20 m 480 unknowns",
    "12.5 s of jobs (mesh 12.5 s)",
    # The one image without a signal does not count.
    f"by mean power, on average (and image by image) by {OFFSETS}.",
    # One of three targets is unknown: F1 1/2 for a third of the images.
    "Rejecting everything gives a weighted F1 of 0.167",
    "0.7981",  # the published weighted F1 of softmax with a threshold
    "with squares, of the capsule network, trained without noise",
    f"{THRESHOLDS}; images {SECTOR} and split at random; SNR by peak_3db power; "
    f"networks: {FCNN}; capsule and capsule, denoising {CAPSULE}.",
)
# Every comparison names its networks, thresholds, split and definition of SNR.
CAPTIONS = {
    "headline": [f"capsule {CAPSULE}", "Thresholds kept and thesis", "split by sector (3 folds"],
    "open_noisy_capsule": [f"capsule and capsule, denoising {CAPSULE}", THRESHOLDS, AT_RANDOM],
    "open_capsule_sector": [CAPSULE, THRESHOLDS, "split by sector (3 folds; of capsule sector only fold 2)"],
    "open_fcnn_open": [FCNN, THRESHOLDS, AT_RANDOM],
    "learning_sector_fcnn": [FCNN, "split by sector (3 folds; of sector FCNN only folds 1 and 3)"],
}


@pytest.fixture(scope="module")
def page(whole):
    return check_whole(whole)


@pytest.fixture(scope="module")
def scores(whole):
    rows = pd.read_csv(whole.parent / "learning" / "scores.csv", dtype={"fold": str}, keep_default_na=False)
    return select(rows, snr_definition="peak_3db", fold="")


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


def test_the_page_shows_all_stages(page):
    expected = "checks headline look explore fields meshes scattering imaging images recognition compare matrices"
    expected += " learning open capsule alike run facts made glossary"
    assert page.headings() == expected.split()
    assert len([attrs for attrs in page.attributes("details") if attrs.get("class") == "part"]) == 5
    kinds = ("mesh", "bands", "rcs", "range_profiles", "images")
    expected = {f"{kind}_{target}" for kind in kinds for target in fake.SETTINGS["targets"]}
    expected |= {f"learning_{experiment}" for experiment in fake.SETTINGS["learning"]["experiments"]}
    expected |= {"open_fcnn_open", "capsule_reconstructions", "capsule_reconstructions_capsule_denoise"}
    assert expected <= page.figures
    assert {"headline", "gallery_snr", "training_curves", "images_alike"} <= page.figures


def test_the_page_says_what_was_run_and_how_well_it_was_solved(page):
    assert [text for text in SAID if text not in page.words] == []
    parts = {name: [*parts, "SNR by "] for name, parts in CAPTIONS.items()}
    assert [(name, part) for name in parts for part in parts[name] if part not in page.caption(name)] == []
    assert "<table" not in page.html.partition("</header>")[0]  # of the first screen
    # Warnings stand near the top.
    box = page.html[page.html.index('<details class="warnings"') : page.html.index('<ul class="targets">')]
    assert "<strong>missile</strong>: the target reaches 0.50 m from the origin" in box and f"only {HALF:.2f} m" in box


def test_numbers_on_the_page_are_those_of_the_results(page, whole, scores):
    closed = select(scores, experiment="multi_elevation", model="knn", metric="accuracy", test_snr_db=24)
    opened = select(scores, experiment="fcnn_open", model="knn", metric="f1_weighted", test_snr_db=24)
    for one in (closed.iloc[0], select(opened, threshold="kept").iloc[0]):
        low, high = float(one["low"]), float(one["high"])
        assert f"{one['value']:.3f} [{low:.3f}, {high:.3f}]" in page.words
    # The nose and tail of the fake drone add up in phase broadside: 0.15 m, half as much again in HH.
    rcs = pd.read_csv(whole / "tables" / "figure_rcs_drone.csv").query("azimuth == 90 and elevation == 0")
    expected = 10 * np.log10(4 * np.pi * np.array([0.15, 0.225]) ** 2)
    np.testing.assert_allclose(rcs.set_index("polarization").loc[["VV", "HH"], "rcs_dbsm"], expected, atol=1e-4)
    # The last fold chooses otherwise than the other two.
    assert page.table("table-search_lr_tuned") == [
        ["penalty", "sector"],
        ["0.001", "0.783 ✓ in 1 of 3 folds"],
        ["0.1", "0.800 ✓ in 2 of 3 folds"],
    ]
    data = pd.read_csv(whole / "tables" / "figure_capsule_reconstructions.csv")
    store = xr.open_zarr(whole.parent / "learning" / "reconstructions" / "capsule_sector_fold2" / "capsule.zarr")
    cell = select(data, target="ufo", example=2, snr=2.5, range=3, crossrange=7).iloc[0]
    one = store.isel(example=2, range=3, crossrange=7).sel(target="ufo")
    expected = [float(one.truth), float(one.sel(snr=2.5).seen), float(one.sel(snr=2.5).made)]
    np.testing.assert_allclose(cell[["truth", "seen", "made"]].astype(float), expected, atol=1e-4)
    assert (cell["elevation"], cell["azimuth"]) == (0, 100)  # every target's examples stand at azimuths of its own
    # Curves are of the first fold.
    data = pd.read_csv(whole / "tables" / "figure_training_curves.csv")
    runs = set(data["run"])
    assert {"sector_fcnn_fold1", "capsule_sector_fold2", "fcnn_open"} <= runs and "sector_fcnn_fold3" not in runs
    assert select(data, run="fcnn_open")["learning_rate"].tolist() == [1e-3, 4e-4, 1e-9]


def test_everything_tried_is_listed_the_best_first_with_its_gain(page, whole, scores):
    opened = select(scores, threshold="kept", elevation="all", metric="f1_weighted", test_snr_db=[-12, 0, 2.5, 12])
    means = opened.groupby(["split", "experiment", "model", "training", "score"])["value"].mean()
    head, *body = page.table("table-tried")
    listed = [(row[head.index("split")], float(row[head.index("mean")])) for row in body]
    assert len(listed) == len(means) == 15 and listed == sorted(listed, reverse=True)
    assert sorted(mean for _, mean in listed) == pytest.approx(sorted(means), abs=5e-4)
    gains = {(row[1], row[4], row[2]): row[head.index("gain")] for row in body}
    assert gains["capsule open", "ZNCC", "capsule"] == gains["noisy capsule", "ZNCC", "capsule"] == "+0.000"
    table = pd.read_csv(whole / "tables" / "tried.csv", keep_default_na=False)
    assert set(table["metric"]) == {"f1_weighted", "f1_weighted_gain", "auroc", "fpr95", "oscr"}
    case = {"threshold": "kept", "split": "random", "test_snr_db": 0}
    knn, reference = select(table, **case, model="knn"), select(table, **case, experiment="capsule_open", score="zncc")
    gain = select(knn, metric="f1_weighted_gain").iloc[0]
    value, theirs = (select(of, metric="f1_weighted")["value"].iloc[0] for of in (knn, reference))
    # The second model of an experiment does better than the first: so the fake results are made.
    assert gain["value"] == pytest.approx(value - theirs, abs=2e-6)
    assert float(gain["low"]) > 0
    # One fold has no interval.
    sector = select(table, split="sector", metric="f1_weighted_gain")
    assert len(sector) and set(sector["low"]) == {""}


def test_published_statements_and_curves_stand_beside_their_counterparts_at_the_same_snr(whole):
    paths = [whole / "tables" / f"{name}.csv" for name in ("published", "published_open")]
    closed, opened = (pd.read_csv(path, dtype={"value": str}, keep_default_na=False) for path in paths)
    table = pd.concat([closed, opened])
    # All SNRs are by mean power: the last at which all of the made-up images have scores is 12 dB.
    assert table["here_at_snr_db"].tolist() == np.minimum(table["snr_db"], 12).tolist()
    assert table.groupby(["experiment", "model"])["snr_db"].apply(sorted).to_dict() == {
        ("capsule_open", "capsule"): [-6, 0, 6, 15],
        ("fcnn_open", "fcnn"): [12, 24],
        ("multi_elevation", "knn"): [-6, 0],
        ("single_elevation", "knn"): [-3, 6, 21],
        ("single_elevation", "lr"): [24],
        ("single_elevation", "svm"): [6, 24, 24],
    }
    assert table["condition"].eq("test at elevation 0").tolist().count(True) == 3
    assert sorted(opened["score"]) == ["mse", "softmax", "zncc"]
    # The nearest neighbour is the second of its experiment; by mean power 0 dB are 2.1 dB by peak_3db.
    row = select(closed, experiment="multi_elevation", snr_db=0).iloc[0]
    assert row["ours"] == pytest.approx(fake_learning.right(2.1, 1))
    # The headline, with published values, is by mean power; every plot of the open set has the line of rejecting.
    data = pd.read_csv(whole / "tables" / "figure_headline.csv")
    values = select(data, set="closed set", model="capsule", split="random").set_index("test_snr_db")["value"]
    assert values.to_dict() == pytest.approx({snr: fake_learning.right(snr + 2.1, 0) for snr in (-12, 0, 2.5, 12)})
    opened = [name for name, one in fake.SETTINGS["learning"]["experiments"].items() if one.get("open")]
    for name in ("headline", *(f"open_{name}" for name in opened)):
        svg = (whole / "figures" / f"{name}.svg").read_text()
        assert re.search(f'stroke-dasharray: [^"]*stroke: {REJECTING["color"]}', svg), name


def test_the_page_never_says_nan(page, whole):
    assert "nan" not in page.words.lower().split() and "[nan" not in page.words
    text = unpacked(whole / "index.html")["compare.json"].decode()
    curves = json.loads(text, parse_constant=pytest.fail)["curves"]
    lows = {one["experiment"]: one["points"][0][2] is None for one in curves}
    assert lows == {name: name == "capsule sector" for name in lows} and len(lows) > 5
    # One fold alone: no brackets.
    assert [row[-1] for row in page.table("table-accuracy") if row[1] == "capsule sector"] == ["0.990"]


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


def test_the_time_is_that_of_the_run_s_own_jobs(tmp_path):
    """Meshes and fields of another run are named apart; records of jobs that the config no longer has do not count."""
    records = {
        "base/mesh/drone": 1,
        "base/mesh/gone": 2,
        "base/scattering/bands/drone-1": 4,
        "base/scattering/bands/drone-2": 8,  # there are two bands, 0 and 1
        "base/scattering/check/sphere": 16,
        "base/imaging/drone/clean": 32,
        "mine/mesh/drone": 64,  # of before it took them from another run
        "mine/imaging/drone/clean": 0.5,
        "mine/imaging/gone/clean": 128,
        "mine/learning/predict/capsule_open/capsule-2": 0.25,
        "mine/learning/timing": 1,
        "mine/report": 256,
    }
    for record, seconds in records.items():
        run, _, job = record.partition("/")
        path = tmp_path / run / "benchmarks" / f"{job}.tsv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"s\th:m:s\n{seconds}\t-\n")
    taken = dict(section_run.facts(fake.results(tmp_path / "mine", fake.SETTINGS | {"from": "base"})))
    assert taken["Computed in"] == "1.8 s of jobs (imaging 0.5 s, learning 1.2 s)"
    where = "taken from the run base, where they took 21.0 s of jobs (mesh 1.0 s, scattering 20.0 s)"
    assert taken["Meshes and fields"] == where
    of_base = dict(section_run.facts(fake.results(tmp_path / "base")))
    assert of_base["Computed in"] == "53.0 s of jobs (mesh 1.0 s, scattering 20.0 s, imaging 32.0 s)"
    assert "Meshes and fields" not in of_base
    shutil.rmtree(tmp_path / "base")
    without = dict(section_run.facts(fake.results(tmp_path / "mine", fake.SETTINGS | {"from": "base"})))
    assert without["Meshes and fields"] == "taken from the run base"


def test_the_sentences_say_what_the_scores_say(results, page):
    done, reached, bounds = section_run.sentences(results)
    assert "3 targets at 0.8 to 1.2 GHz from 3 × 24 directions, solved on their meshes; ISAR" in done
    assert "to reject ufo" in done
    case = {"split": "sector", "threshold": "kept", "metric": "f1_weighted", "test_snr_db": 12, "elevation": "all"}
    best = select(results.scores, **case, model="knn", score="softmax")["value"].iloc[0]
    start = "At 12 dB by peak_3db power, split by sector, with thresholds chosen by known targets alone, KNN, softmax,"
    chosen = "the best model on the validation images by its main confidence score,"
    assert f"{start} {chosen} reaches a weighted F1 of {best:.2f} (" in reached
    assert "where rejecting everything has 0.17" in reached and "split at random, with near copies" in reached
    assert "missile and ufo reach beyond that" in bounds
    assert all(text in page.words for text in (done, reached, bounds))


def test_the_headline_s_methods_stand_beside_the_same_ones_at_full_size(tmp_path):
    """Of the same polarizations, split and targets; others have no rows."""
    settings = fake.changed([], noise={"definition": "mean", "snr_db": [-6, 0, 3, 12]})
    settings["targets"]["aircraft"] = settings["targets"]["ufo"]
    settings["imaging"]["polarizations"] = ["VV", "HH", "HV"]
    settings["learning"]["models"] = {"likelihood": {}}
    open_set = {"train": fake.CLEAN, "models": ["likelihood"], "open": True}
    settings["learning"]["experiments"] = {
        f"by_{split}": open_set | {"split": split} for split in SCHEMES if not split.startswith("family")
    }
    fake_learning.learn(tmp_path / "learning", settings, {"likelihood": ("rice", "likelihood", "coherence")})

    def shown(**changes):
        return section_full_size.full_size_table(fake.results(tmp_path, settings | changes))

    (table,) = shown()
    kept, sets = (
        pd.read_csv(ROOT / "resources/results/recognition/scores.csv.xz", keep_default_na=False),
        table.shown["images"],
    )
    assert list(dict.fromkeys(sets)) == [
        f"{of}, {SPLITS[split]}"
        for of in ("open set, kept thresholds", "closed set")
        for split in ("elevation", "random")
    ]
    assert table.shown["run"].tolist() == ["this run", "full size"] * 4 and set(table.shown["method"]) == {"likelihood"}
    assert list(table.shown.columns[3:]) == ["-6 dB", "0 dB", "12 dB"]  # those of both
    case = {
        "threshold": "kept",
        "metric": "f1_weighted",
        "model": "likelihood",
        "score": "likelihood",
        "test_snr_db": 12,
    }
    case |= {"elevation": "all", "snr_definition": "mean", "fold": ""}
    for split in ("elevation", "random"):
        (row,) = select(kept, experiment=split, **case).astype({"low": float, "high": float}).to_dict("records")
        at = select(table.shown, images=f"open set, kept thresholds, {SPLITS[split]}")["12 dB"].tolist()
        assert at == ["0.989 [0.959, 1.000]", f"{row['value']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"], split
    learning = settings["learning"]
    narrow = {name: own | {"channels": ["VV"]} for name, own in learning["experiments"].items()}
    (table,) = shown(learning=learning | {"experiments": narrow})
    (row,) = select(kept, experiment="elevation_vv", **case).to_dict("records")
    assert table.shown["12 dB"].iloc[1].startswith(f"{row['value']:.3f} [")
    # That run itself, a run of other targets, and those that learn from fewer targets or views.
    fewer = {name: own | {"without": ["drone"]} for name, own in learning["experiments"].items()}
    views = {name: own | {"train": fake.CLEAN | {"elevation": [0]}} for name, own in learning["experiments"].items()}
    targets = {name: own for name, own in settings["targets"].items() if name != "aircraft"}
    less = [{"learning": learning | {"experiments": each}} for each in (fewer, views)]
    less += [of | {"targets": targets} for of in less]
    for changes in ({"name": "recognition"}, {"targets": targets}, *less):
        assert shown(**changes) == ()


def test_matrices_count_what_the_table_counts(results):
    entries = section_headline.matrices(results)["entries"]
    one = next(one for one in entries if one["words"].startswith("KNN, softmax: sector (sector)"))
    assert one["set"] == "open set, kept thresholds" and one["targets"] == ["drone", "missile", "ufo"]
    case = {"experiment": "sector", "model": "knn", "score": "softmax", "threshold": "kept", "elevation": "all"}
    cells = select(results.confusion, **case, test_snr_db=0).pivot(index="target", columns="predicted", values="count")
    counts = cells.loc[one["targets"], one["classes"]].astype(int).to_numpy()
    assert one["counts"][one["snrs"].index(0)] == counts.tolist()
    assert [len(entry["counts"]) for entry in entries] == [len(entry["snrs"]) for entry in entries]
    assert any(entry["set"] == "closed set" for entry in entries)
    # Each model is there by its main confidence score alone.
    capsules = {entry["words"].partition(":")[0] for entry in entries if entry["words"].startswith("capsule")}
    assert capsules == {"capsule, ZNCC", "capsule, denoising, ZNCC", "capsule", "capsule, denoising"}


def test_compare_opens_on_the_headline_s_curves(results):
    found = section_headline.comparison(results)
    opened = [one for one in found["curves"] if one["set"] == "open set, kept thresholds"]
    assert opened[0] == found["curves"][0]  # the set that it opens with
    words = "capsule, ZNCC: capsule open (random), trained without noise"
    assert any(one["shown"] and one["words"].startswith(words) for one in opened)
    assert {one["dashes"] for one in found["curves"] if "(random)" in one["words"]} == {"6 4"}
    # One of three targets is unknown.
    assert found["rejecting"] == {f"open set, {name} thresholds": [0.1667] for name in PROTOCOLS}
    # One confidence score of each model in each experiment is its main one.
    main = [(one["words"].partition(": ")[2], one["model"]) for one in opened if one["main"]]
    assert len(set(main)) == len(main) < len(opened)


def test_all_splits_stand_beside_each_other_the_one_by_elevation_first(by_elevation):
    _, reached, _ = section_run.sentences(by_elevation)
    assert reached.startswith(
        "At 12 dB by peak_3db power, split by elevation, with thresholds chosen by known targets "
    )
    assert "split by sector, far from all in training, the same has" in reached
    assert "split at random, with near copies in training, the same has" in reached
    drawn = section_headline.headline(by_elevation)
    assert list(drawn.data["split"].unique()) == ["elevation", "sector", "random"]
    assert set(drawn.data["threshold"]) == {"", "kept"}  # the protocol that asks for least, without the thesis's method
    text = section_learning.section(by_elevation).text[0]
    assert "every second elevation trains and test images are of those between" in text
    assert "split by elevation (2 folds), split by sector (3 folds) and split at random" in drawn.caption
    found = section_headline.comparison(by_elevation)
    dashes = {one["words"].partition("(")[2].partition(")")[0]: one["dashes"] for one in found["curves"]}
    assert len(set(dashes.values())) == 3 and dashes["elevation"] == ""
    assert found["lines"].startswith("solid lines: split by elevation; dashed lines: split by sector; ")
    assert {one["set"] for one in found["curves"]} >= {f"open set, {name} thresholds" for name in ("blind", "kept")}


def test_protocols_and_splits_are_in_the_table_of_all_tried_and_several_looks_in_a_figure(by_elevation):
    section, scores = section_open.section(by_elevation), by_elevation.scores.query("score != ''")
    shown = section.tables[0].shown
    assert {"mean", "mean, thesis", "mean, blind"} <= set(shown) and "gain" not in shown
    assert shown["split"].tolist() == ["elevation"] * 2 + ["sector"] + ["random"] * 2
    assert "so that 95 % of the known ones are kept" in section.text[0]
    assert "Thresholds kept, blind and thesis;" in section.figures[0].caption
    assert section_open.looks_figure(by_elevation, scores) == ()
    one = scores.query("metric == 'f1_weighted' and model == 'knn'")
    several = [one.assign(metric=f"f1_weighted_{count}_looks", value=1 - 1 / count) for count in (2, 3, 5)]
    (drawn,) = section_open.looks_figure(by_elevation, pd.concat([scores, *several]))
    assert set(drawn.data["looks"]) == {1, 2, 3, 5} and set(drawn.data["model"]) == {"knn"}
    assert set(drawn.data["threshold"]) == {"blind"} and set(drawn.data["split"]) == {"elevation", "sector", "random"}
    assert (drawn.data.query("looks == 5")["value"] == 0.8).all()


def test_likeness_is_measured_by_the_angle_between_views(by_elevation):
    data = likeness.by_angle(by_elevation.images("drone", "clean").image, 45).set_index(["along", "degrees"])
    image = np.abs(by_elevation.images("drone", "clean").image.transpose("elevation", "azimuth", ...).values)
    flat = image.reshape(5, 24, -1)
    beside = [(flat[e, a - 2], flat[e, a]) for e in range(5) for a in range(24)]
    above = [(flat[e, a], flat[e + 3, a]) for e in range(2) for a in range(24)]
    for where, pairs in ((("azimuth", 30.0), beside), (("elevation", 45.0), above)):
        alike = [np.corrcoef(one, other)[0, 1] for one, other in pairs]
        assert data.loc[where, "mean"] == pytest.approx(np.mean(alike), abs=1e-5)
        assert data.loc[where, "low"] == pytest.approx(np.quantile(alike, 0.1), abs=1e-5)
    assert all(data.loc[along].index.tolist() == [15, 30, 45] for along in ("azimuth", "elevation"))
    drawn = section_alike.angle_figure(by_elevation)
    assert set(drawn.data["target"]) == {"drone", "missile"}
    assert drawn.data.query("along == 'elevation'")["degrees"].min() == 15
