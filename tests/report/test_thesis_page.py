"""The page "the thesis, figure by figure": all of it is there or named as missing, and its numbers are the run's."""

import copy
import re

import fake
import fake_thesis
import numpy as np
import pandas as pd
import pytest
import study.figures
import study.texts
from study.selection import PAGE, images_of, networks_of
from study.statements import JUDGED, READINGS
from thesis_pages import anew, check_links, missing, parts, tables, without

from isarflow.core.sweep import snr_label
from isarflow.learning import images
from isarflow.learning.classifier import OTHER
from isarflow.learning.experiments import runs
from isarflow.learning.metrics import metrics_of_labels
from isarflow.report.results import REFERENCE, Results
from isarflow.report.vocabulary import select
from isarflow.setup.config import ROOT, load
from isarflow.setup.yaml_file import read_yaml

# All tables and figures of chapters 4 and 5 that show data, in the document's order.
ITEMS = (
    *("Table 4.1", "Fig. 4.7", "Fig. 4.8, Fig. 4.9", "Fig. 4.10", "Fig. 4.12", "Table 4.2", "Fig. 4.13", "Fig. 4.14"),
    *("Fig. 4.15", "Fig. 4.16", "Fig. 4.17", "Table 4.3", "Fig. 5.3", "Table 5.1", "Fig. 5.4, Table 5.2", "Fig. 5.6"),
    *("Fig. 5.7", "Table 5.3", "Fig. 5.8", "Fig. 5.9", "Fig. 5.10", "Fig. 5.11", "Fig. 5.12", "Fig. 5.13", "Fig. 5.14"),
    *("Sec. 5.4.2, Sec. 5.4.4", "Slips of the document"),
)
# What a table of values shows: experiment and metric of each figure; elevations that are tested.
SHOWN = {
    "Fig. 4.7": ("single_elevation", "accuracy", "trained"),
    "Fig. 4.10": ("single_elevation", "accuracy", "all"),
    "Fig. 4.12": ("multi_elevation", "accuracy", "all"),
    "Fig. 5.3": ("fcnn_open", "accuracy", "all"),
    "Fig. 5.6": ("capsule_open", "f1_weighted", "all"),
    "Fig. 5.10": ("capsule_open", "f1_weighted", "all"),
    "Fig. 5.14": ("capsule_open", "f1_weighted", "all"),
    "Sec. 5.4.2, Sec. 5.4.4": ("capsule_open", "f1_weighted", "all"),
}
BY_SECTOR = {"multi_elevation": "sector", "fcnn_open": "sector", "capsule_open": "capsule_sector"}
SCORES = {"MSE": "mse", "ZNCC": "zncc", "capsule length": "length", "Gaussian mixture": "mixture"}


@pytest.fixture(scope="module")
def scores(thesis_page):
    return pd.read_csv(thesis_page.parents[1] / "learning" / "scores.csv", dtype={"fold": str}, keep_default_na=False)


def test_what_the_page_s_data_names_is_there(thesis_page):
    """Each part is a function or a sentence, each sentence is said and has its places filled, each statement shown."""
    figures = [figure for every in PAGE["chapters"].values() for figure in every]
    named = {name for figure in figures for name in (*figure["shows"], *figure.get("why", []))}
    named |= {*PAGE["everywhere"]}
    functions = {name for name in named if hasattr(study.figures, name) or hasattr(study.texts, name)}
    sentences = PAGE["sentences"]
    assert {name for name in sentences if "{" not in sentences[name]} == named - functions
    assert {name for name in sentences if "{" in sentences[name]} == functions & {*sentences}
    stated = pd.read_csv(REFERENCE / "thesis_results.csv", dtype=str, keep_default_na=False)
    assert {*stated["figure"]} - {""} <= {figure["names"][0] for figure in figures}
    assert {*stated["reading"]} == {*READINGS}
    assert {reading.get("judged") for reading in PAGE["readings"].values()} == {None, *JUDGED}


def test_every_reading_names_rows_of_the_reference_experiment():
    every = runs(load(read_yaml(ROOT / "config/thesis.yaml")))
    fitted = {f"{name}/{model}" for name, run in every.items() for model in run["models"]}
    named = [rows for reading in PAGE["readings"].values() for rows in reading.get("rows", {}).items()]
    assert len(named) > 15 and {name for rows in named for name in rows} <= fitted


def test_every_figure_and_table_is_there_in_the_document_s_order(thesis_page):
    found = parts(thesis_page)
    assert tuple(found)[1:] == ITEMS
    assert missing(thesis_page) == {} and "All of the document is part of this run." in found[""]
    for name in ITEMS:
        assert "*The document:* " in found[name] and "**Not part of this run:**" not in found[name]


def test_the_head_says_what_run_it_is(thesis_page):
    facts, settings = (table.set_index("")["this run"] for table in tables(parts(thesis_page)[""])[2:])
    assert facts["config"] == "`fake`, seed 3" and facts["processor"] == "A processor"
    assert facts["images"].startswith("4,608 noisy ones of 5 × 3 pixels: 4 targets, 3 elevations, 24 azimuths, 8 SNRs")
    assert settings["azimuths of a circle"] == "24" and settings["SNR by"] == "mean"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d, of the scores", facts["date"]) and "commit" in facts["Made with"]


def _row(scores, figure, label, snr):
    """The row of scores.csv that a cell of a table of values must show. label: the row's, as 'KNN, split at random'."""
    experiment, metric, elevation = SHOWN[figure]
    sector = "split by sector" in label
    experiment = BY_SECTOR[experiment] if sector else experiment
    score = next((name for words, name in SCORES.items() if f"open set, {words}," in label), "")
    assert bool(score) == label.startswith("open set")
    threshold = ("blind" if sector else "thesis") if score else ""
    model = {"LR": "lr", "SVM": "svm", "KNN": "knn"}.get(label.partition(",")[0])
    model = model or ("fcnn" if figure == "Fig. 5.3" else "capsule")
    case = {"experiment": experiment, "model": model, "score": score, "threshold": threshold, "elevation": elevation}
    rows = select(scores, **case, metric=metric, test_snr_db=snr, fold="", snr_definition="mean")
    assert len(rows) == 1, (figure, label, snr)
    return rows.iloc[0]


def test_values_are_those_of_scores_csv(thesis_page, scores):
    """Sixty cells picked at random, and the numbers and signs around them."""
    cells, found = [], parts(thesis_page)
    for figure in SHOWN:
        (values,) = (table for table in tables(found[figure]) if "24 dB" in table and "0 dB" in table)
        labels = values.iloc[:, 0].tolist()
        assert len(set(labels)) == len(labels) > 1
        cells += [(figure, row.iloc[0], head, row[head]) for _, row in values.iterrows() for head in values.columns[1:]]
    assert len(cells) > 150
    picked = np.random.default_rng(4).choice(len(cells), 60, replace=False)
    shown = set()
    for figure, label, head, cell in (cells[place] for place in picked):
        row = _row(scores, figure, label, float(head.removesuffix(" dB")))
        assert cell == f"{row['value']:.3f} [{float(row['low']):.3f}, {float(row['high']):.3f}]", (figure, label, head)
        shown.add(cell)
    assert len(shown) > 40  # curves differ, so that another one would be found out


def test_by_sector_stands_beside_where_the_run_has_it(thesis_page):
    found = parts(thesis_page)
    for name in ("Fig. 4.12", "Fig. 5.3", "Fig. 5.6", "Fig. 5.10", "Fig. 5.14"):
        assert "split by sector" in found[name]
    # Of one training elevation there is none, nor of several training SNRs.
    for name in ("Fig. 4.7", "Fig. 4.10", "Fig. 4.13", "Fig. 4.17"):
        assert "sector" not in found[name]


def test_trainings_and_up_sampling_are_those_of_scores_csv(thesis_page, scores):
    rows = scores.query("fold == '' and snr_definition == 'mean' and metric == 'accuracy' and elevation == 'all'")
    rows = rows.set_index(["experiment", "model", "training", "test_snr_db"])["value"].astype(float)
    found = parts(thesis_page)
    for name, experiment, model in (
        ("Fig. 4.13", "noisy_training", "lr"),
        ("Fig. 4.14", "noisy_training", "svm"),
        ("Fig. 4.16", "upsampling", "lr"),
        ("Fig. 4.17", "upsampling", "svm"),
    ):
        values = next(table for table in tables(found[name]) if "trained at" in table).set_index("trained at")
        for training in ("-18 dB", "0 dB", "24 dB"):
            assert values.loc[training, "-6 dB"].startswith(f"{rows[experiment, model, training, -6]:.3f} [")
    plain = tables(found["Fig. 4.16"])[-1].set_index("trained at").loc["0 dB, without up-sampling", "12 dB"]
    assert plain.startswith(f"{rows['noisy_training', 'lr', '0 dB', 12]:.3f} [")
    # The largest of all training and test SNRs stands beside the published maximum.
    largest = rows[[key[:2] == ("upsampling", "svm") for key in rows.index]].max()
    assert f"{largest:.3f} [" in tables(found["Fig. 4.17"])[0]["here"][0]


def test_the_overview_has_every_published_score_once_and_judges_it(thesis_page, scores):
    printed = pd.read_csv(REFERENCE / "thesis_results.csv", dtype=str, keep_default_na=False)
    overview = tables(parts(thesis_page)[""])[1]
    left_out = printed.query("metric == 'training_accuracy' and model == 'svm'")  # not recorded; its figure says so
    assert len(overview) == len(printed) - len(left_out) > 20 and (overview["as published"] != "–").all()
    count, read = (overview["as published"] == "yes").sum(), overview["read otherwise"].str.contains("**", regex=False)
    said = f"{count} of the {len(overview)} statements that this run can judge hold as the document's text reads, "
    said += f"and {count + read.sum()} by its text or by one of the readings"
    assert said in parts(thesis_page)[""] and not read[overview["as published"] == "yes"].any() and read.any()
    for line in overview.to_dict("records"):
        relation, value = line["published"].split()
        here = float(line["here"].split()[0])
        kept = {
            "≥": here >= float(value),
            "≤": here <= float(value),
            ">": here > float(value),
            "<": here < float(value),
        }
        low, high = map(float, re.findall(r"[\[,] ?([\d.]+)", line["here"]) or (np.nan, np.nan))
        kept["="] = round(here, len(value.partition(".")[2])) == float(value) or low <= float(value) <= high
        assert line["as published"] == ("yes" if kept[relation] else "no"), line
    # A maximum is that of the curve, at whatever SNR.
    case = "experiment == 'single_elevation' and model == 'svm' and metric == 'accuracy' and elevation == 'all'"
    curve = scores.query(f"{case} and snr_definition == 'mean'").set_index("test_snr_db")["value"]
    maximum = overview[(overview["stated"] == "maximum") & (overview["what"] == "SVM, accuracy")].iloc[0]
    assert maximum["here"].startswith(f"{curve.max():.3f} [")
    # One of them by the run's own table: the share of wrong images is one less the accuracy of the open set.
    case = "experiment == 'capsule_open' and model == 'capsule' and score == 'mse' and threshold == 'thesis'"
    row = scores.query(f"{case} and metric == 'accuracy' and snr_definition == 'mean' and test_snr_db == 24").iloc[0]
    wrong = overview[overview["what"] == "capsule, MSE, share of wrong images"].iloc[0]
    assert wrong["published"] == "= 0.0032"
    assert wrong["here"] == f"{1 - row['value']:.3f} [{1 - float(row['high']):.3f}, {1 - float(row['low']):.3f}]"


def test_readings_are_the_run_s_own_values_and_judged_alike(thesis_page, scores):
    """Each statement that does not hold has its readings beside it: rows of scores.csv, and predictions judged anew."""
    overview = tables(parts(thesis_page)[""])[1].set_index(["", "what", "stated"])["read otherwise"]
    figure = "[Fig. 4.12](#fig-412-trained-and-tested-at-all-elevations)"
    said = dict(
        re.findall(r"\**([a-z][a-z ,]*?) ([\d.]+ \[[^\]]*\])", overview[figure, "KNN, accuracy", "down to 0 dB"])
    )
    assert said.keys() == {"magnitudes", "shuffled", "tuned"}
    case = {"metric": "accuracy", "fold": "", "snr_definition": "mean", "test_snr_db": 0, "elevation": "all"}
    for reading, experiment, model in (
        ("magnitudes", "multi_elevation", "knn_magnitude"),
        ("shuffled", "multi_shuffled", "knn"),
        ("tuned", "tuning", "knn_tuned"),
    ):
        row = select(scores, **case, experiment=experiment, model=model).iloc[0]
        assert said[reading] == f"{row['value']:.3f} [{float(row['low']):.3f}, {float(row['high']):.3f}]"
    # Of a network in the open set: other training images, thresholds by errors on the test images, all azimuths.
    every = ("at 24 dB", "by errors", "at 24 dB, by errors", "all azimuths", "at 24 dB, all azimuths")
    figure = "[Fig. 5.4, Table 5.2](#fig-54-table-52-three-adaptations-of-the-fcnn-to-the-open-set)"
    cell = overview[figure, "FCNN, softmax, weighted F1", "24 dB"]
    assert [re.match(r"\**(.+?) \d\.\d+", part)[1] for part in cell.split("; ")] == [*every]
    results = Results(thesis_page.parents[1], fake_thesis.settings(), fake.names(fake_thesis.settings()))
    for experiment, reading in (("fcnn_open", "by errors"), ("fcnn_listing", "at 24 dB, by errors")):
        table = results.predictions(experiment, "fcnn", 24)
        test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
        known, score = test["role"] == "known", test["known_softmax"]
        errors = {level: (score[known] < level).sum() + (score[~known] >= level).sum() for level in [*score, 2.0]}
        few = [level for level in errors if errors[level] == min(errors.values())]
        labels = [test["predicted"].where(score >= level, OTHER) for level in few]
        found = {round(metrics_of_labels(test["truth"], predicted)["f1_weighted"], 3) for predicted in labels}
        assert float(re.search(rf"(?:^|; )\**{reading} ([\d.]+)", cell)[1]) in found


def test_hyper_parameters_stand_beside_those_chosen(thesis_page):
    table = tables(parts(thesis_page)["Table 4.1"])[0].set_index(["model", "setting"])
    assert table.loc[("SVM", "C"), "published"] == "930.66 (T4.1)" and table.loc[("SVM", "C"), "here"] == "930.66"
    # The last setting tried is the best: so the fake searches are made.
    assert table.loc[("SVM", "C"), "chosen on validation images"] == "1000 of 1, 1000"
    assert table.loc[("KNN", "k"), "chosen on validation images"] == "3 of 1, 3"
    assert table.loc[("KNN", "k"), "at most with the published value"] == "0.8000"  # k = 1, the first of two


def test_prediction_times_are_those_of_times_json(thesis_page):
    found = parts(thesis_page)
    table = tables(found["Table 4.2"])[0].set_index(["model", "experiment"])
    assert table.loc[("KNN", "multi elevation"), "published [ms]"] == "48.8"
    assert table.loc[("KNN", "single elevation"), "training images there"] == "340"
    assert float(table.loc[("KNN", "multi elevation"), "here, in batches [ms]"]) == pytest.approx(0.04)  # the fourth
    assert tables(found["Table 4.3"])[0]["published [ms]"].tolist() == ["0.0056", "11.535", "0.0606", "3363.5"]
    assert tables(found["Table 5.3"])[0]["published [ms]"].tolist() == ["0.6934", "0.0445", "1.3", "48.8"]


def test_a_run_without_capsule_networks_says_so(thesis_page, tmp_path):
    every = fake_thesis.settings()
    capsules = [name for name in every["learning"]["experiments"] if "capsule" in name]
    folder = anew(tmp_path, thesis_page.parents[1], without(every, *capsules))
    absent = missing(folder)
    expected = ["Fig. 5.6", "Table 5.3", "Fig. 5.8", "Fig. 5.9", "Fig. 5.10", "Fig. 5.11", "Fig. 5.12", "Fig. 5.13"]
    assert list(absent) == [*expected, "Fig. 5.14", "Sec. 5.4.2, Sec. 5.4.4"]
    found = parts(folder)
    assert tuple(found)[1:] == ITEMS
    for name in absent:
        assert "**Not part of this run:**" in found[name]
    assert "0.9314" in found["Fig. 5.6"] and "54 of 16,872" in found["Fig. 5.11"]  # what was published stays
    # The rest is as it was.
    for name in ("Fig. 4.12", "Fig. 5.3", "Fig. 5.4, Table 5.2"):
        assert found[name] == parts(thesis_page)[name]
    overview = tables(found[""])[1]
    assert set(overview["as published"]) == {"yes", "no", "–"}
    assert not list(folder.glob("fig-5-1*.png"))
    check_links(folder)


def test_a_run_with_little_or_nothing_says_so(thesis_page, tmp_path):
    every = fake_thesis.settings()
    few = without(every, *(name for name in every["learning"]["experiments"] if name != "multi_elevation"))
    few["learning"]["experiments"]["multi_elevation"]["models"] = ["lr", "knn"]
    folder = anew(tmp_path, thesis_page.parents[1], few)
    assert missing(folder)["Fig. 4.12"] == "SVM in experiment `multi_elevation`, split at random"
    assert "Fig. 5.7" not in missing(folder) and "Fig. 4.7" in missing(folder)
    assert len(list(folder.glob("*.png"))) == 4  # Figs. 4.9, 4.12, 4.15 and 5.7
    check_links(folder)
    # No experiment at all; and a solver of radar cross-sections, which makes no image.
    nothing = without(few, "multi_elevation")
    for settings in (nothing, copy.deepcopy(nothing)):
        if settings is not nothing:
            settings["radar"] |= {"frequencies": 1, "bandwidth": 0}
        other = anew(tmp_path / str(settings["radar"]["frequencies"]), thesis_page.parents[1], settings)
        assert tuple(parts(other))[1:] == ITEMS and "This run has none of them." in parts(other)[""]
        assert set(tables(parts(other)[""])[0]["as published"]) == {"–"}
        check_links(other)


def test_experiments_split_otherwise_are_not_the_document_s(thesis_page, tmp_path):
    settings = fake_thesis.settings()
    settings["learning"]["experiments"]["capsule_open"]["split"] = "sector"
    assert ("capsule_open", "capsule") not in networks_of(Results("nowhere", settings, {"models": {}}).runs)
    folder = anew(tmp_path, thesis_page.parents[1], settings)
    assert missing(folder)["Fig. 5.14"] == "capsule in experiment `capsule_open` in the open set, split at random"


def test_a_run_by_the_other_definition_shows_values_by_mean_power(tmp_path):
    settings = fake_thesis.settings()
    settings["noise"]["definition"] = "peak_3db"
    kept = ("multi_elevation", "capsule_open", "sector")
    settings = without(settings, *(name for name in settings["learning"]["experiments"] if name not in kept))
    page = fake_thesis.write(tmp_path / "fake", settings)
    scores = pd.read_csv(page.parents[1] / "learning" / "scores.csv", dtype={"fold": str}, keep_default_na=False)
    row = scores.query("model == 'knn' and experiment == 'multi_elevation' and metric == 'accuracy' and fold == ''")
    by = row.query("test_snr_db == 0").set_index("snr_definition")["value"]
    assert f"{by['mean']:.3f}" != f"{by['peak_3db']:.3f}"
    values = tables(parts(page)["Fig. 4.12"])[-1].set_index("")
    assert values.loc["KNN, split at random", "0 dB"].startswith(f"{by['mean']:.3f} [")
    assert tables(parts(page)[""])[-1].set_index("").loc["SNR by", "this run"] == "peak_3db"


def test_links_lead_somewhere_and_pictures_show_something(thesis_page):
    drawn = check_links(thesis_page)
    assert sorted(drawn) == sorted(path.name for path in thesis_page.glob("*.png")) and len(drawn) == 21
    assert not re.search(r"!\[\]", (thesis_page / "README.md").read_text())


def test_the_same_stores_make_the_same_page_and_are_those_that_the_rule_names(thesis_page, tmp_path, monkeypatch):
    settings = fake_thesis.settings()
    results = Results(thesis_page.parents[1], settings, fake.names(settings))
    taken, opened = set(), Results.images

    def images_in(self, target, store):
        taken.add((target, store))
        return opened(self, target, store)

    def read(stores, *arguments, **options):
        taken.update((images.target_of(store), store.stem) for store in stores)
        return images_read(stores, *arguments, **options)

    images_read = images.read
    monkeypatch.setattr(Results, "images", images_in)
    monkeypatch.setattr(images, "read", read)
    assert study.figures.images is images
    other = anew(tmp_path, thesis_page.parents[1], settings)
    for path in thesis_page.iterdir():
        assert (other / path.name).read_bytes() == path.read_bytes(), path.name
    assert taken == set(images_of(settings, results.runs))
    assert ("trihedral", "clean") not in taken and ("ufo", snr_label(24)) in taken
