"""The page "the thesis, figure by figure": all of it is there or named as missing, and its numbers are the run's."""

import re
from string import Formatter

import fake
import fake_thesis
import numpy as np
import pandas as pd
import pytest
import study.figures
import study.texts
from study.anew import judged
from study.selection import PAGE, images_of, networks_of
from study.statements import JUDGED, READINGS
from thesis_pages import ThesisPage, check_links, interval, tables

from isarflow.core.sweep import snr_label
from isarflow.learning.data import images
from isarflow.learning.experiments import runs
from isarflow.report.results import REFERENCE, Results
from isarflow.setup.config import ROOT, load_config
from isarflow.setup.yaml_file import read_yaml

# All tables and figures of chapters 4 and 5 that show data, in the document's order.
ITEMS = (
    *("Table 4.1", "Fig. 4.7", "Fig. 4.8, Fig. 4.9", "Fig. 4.10", "Fig. 4.12", "Table 4.2", "Fig. 4.13", "Fig. 4.14"),
    *("Fig. 4.15", "Fig. 4.16", "Fig. 4.17", "Table 4.3", "Fig. 5.3", "Table 5.1", "Fig. 5.4, Table 5.2", "Fig. 5.6"),
    *("Fig. 5.7", "Table 5.3", "Fig. 5.8", "Fig. 5.9", "Fig. 5.10", "Fig. 5.11", "Fig. 5.12", "Fig. 5.13", "Fig. 5.14"),
    *("Sec. 5.4.2, Sec. 5.4.4", "Slips of the document"),
)
OF_CAPSULES = (ITEMS[15], *ITEMS[17:-1])
# What a table of values shows: experiment and metric of each figure; elevations that are tested.
SHOWN = {
    "Fig. 4.7": ("single_elevation", "accuracy", "trained"),
    "Fig. 4.10": ("single_elevation", "accuracy", "all"),
    "Fig. 4.12": ("multi_elevation", "accuracy", "all"),
    "Fig. 5.3": ("fcnn_open", "accuracy", "all"),
}
SHOWN |= dict.fromkeys(("Fig. 5.6", "Fig. 5.10", "Fig. 5.14", ITEMS[-2]), ("capsule_open", "f1_weighted", "all"))
# Where values by sector stand beside; of one training elevation there are none, nor of several training SNRs.
BY_SECTOR = {"multi_elevation": "sector", "fcnn_open": "sector", "capsule_open": "capsule_sector"}
SCORES = {"MSE": "mse", "ZNCC": "zncc", "capsule length": "length", "Gaussian mixture": "mixture"}
FIG_412 = "[Fig. 4.12](#fig-412-trained-and-tested-at-all-elevations)"
FIG_54 = "[Fig. 5.4, Table 5.2](#fig-54-table-52-three-adaptations-of-the-fcnn-to-the-open-set)"


def test_what_the_page_s_data_names_is_there(thesis):
    """Each part is a function or a sentence, each sentence is said and has its places filled, each statement shown."""
    figures = [figure for every in PAGE["chapters"].values() for figure in every]
    named = {name for figure in figures for name in (*figure["shows"], *figure.get("why", []))}
    named |= {*PAGE["everywhere"]}
    functions = {name for name in named if hasattr(study.figures, name) or hasattr(study.texts, name)}
    sentences = PAGE["sentences"]
    measured = {name for name in sentences if not isinstance(sentences[name], str)}
    assert {name for name in sentences if name in measured or "{" not in sentences[name]} == named - functions
    assert {name for name in {*sentences} - measured if "{" in sentences[name]} == functions & {*sentences}
    for name in measured:
        places = [place for _, place, *_ in Formatter().parse(sentences[name]["says"]) if place]
        assert sorted(places) == sorted(sentences[name]["values"]), name
    stated = pd.read_csv(REFERENCE / "thesis_results.csv", dtype=str, keep_default_na=False)
    assert {*stated["figure"]} - {""} <= {figure["names"][0] for figure in figures}
    assert {*stated["reading"]} == {*READINGS}
    assert {reading.get("judged") for reading in PAGE["readings"].values()} == {None, *JUDGED}
    # Every reading names rows of the reference experiment, or of those with other models.
    fitted = {}
    for has_models, configs in ((False, ["thesis"]), (True, ["thesis", "models"])):
        every = runs(load_config(*(read_yaml(ROOT / f"config/{name}.yaml") for name in configs)))
        fitted[has_models] = {f"{run['experiment']}/{model}" for run in every.values() for model in run["models"]}
    named = [("models" in of, rows) for of in PAGE["readings"].values() for rows in of.get("rows", {}).items()]
    assert len(named) > 15
    for has_models, (own, instead) in named:
        assert own in fitted[False] and instead in fitted[has_models]


def test_all_of_the_document_is_there_in_its_order_and_what_run_it_is(thesis):
    assert tuple(thesis.entries) == ITEMS
    assert thesis.absent == {} and "All of the document is part of this run." in thesis.head
    for name, text in thesis.entries.items():
        assert "*The document:* " in text and "**Not part of this run:**" not in text, name
    drawn = check_links(thesis.folder)
    assert sorted(drawn) == sorted(path.name for path in thesis.folder.glob("*.png")) and len(drawn) == 21
    assert "![]" not in (thesis.folder / "README.md").read_text()
    facts, settings = (table.set_index("")["this run"] for table in tables(thesis.head)[2:4])
    assert facts["config"] == "`fake`, seed 3" and facts["processor"] == "A processor"
    assert facts["images"].startswith("4,608 noisy ones of 5 × 3 pixels: 4 targets, 3 elevations, 24 azimuths, 8 SNRs")
    assert settings["azimuths of a circle"] == "24" and settings["SNR by"] == "mean"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d, of the scores", facts["date"]) and "commit" in facts["Made with"]


def _row(thesis, figure, label, snr):
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
    (row,) = thesis.scores(**case, metric=metric, test_snr_db=snr).to_dict("records")
    return row


def test_values_are_those_of_scores_csv(thesis):
    """Sixty cells picked at random, and the numbers and signs around them."""
    cells = []
    for figure, (experiment, *_) in SHOWN.items():
        (values,) = (table for table in tables(thesis.entries[figure]) if "24 dB" in table and "0 dB" in table)
        labels = values.iloc[:, 0].tolist()
        assert len(set(labels)) == len(labels) > 1
        assert ("split by sector" in thesis.entries[figure]) == (experiment in BY_SECTOR), figure
        cells += [(figure, row.iloc[0], head, row[head]) for _, row in values.iterrows() for head in values.columns[1:]]
    assert len(cells) > 150
    shown = set()
    for place in np.random.default_rng(4).choice(len(cells), 60, replace=False):
        figure, label, head, cell = cells[place]
        assert cell == interval(_row(thesis, figure, label, float(head.removesuffix(" dB")))), (figure, label, head)
        shown.add(cell)
    assert len(shown) > 40  # curves differ, so that another one would be found out


def test_trainings_and_up_sampling_are_those_of_scores_csv(thesis):
    rows = thesis.scores(metric="accuracy", elevation="all", experiment=["noisy_training", "upsampling"])
    rows = rows.set_index(["experiment", "model", "training", "test_snr_db"])["value"].sort_index()
    values = {}
    for name, experiment, model in (
        ("Fig. 4.13", "noisy_training", "lr"),
        ("Fig. 4.14", "noisy_training", "svm"),
        ("Fig. 4.16", "upsampling", "lr"),
        ("Fig. 4.17", "upsampling", "svm"),
    ):
        assert "split by sector" not in thesis.entries[name]
        values[name] = tables(thesis.entries[name])
        cells = next(table for table in values[name] if "trained at" in table).set_index("trained at")["-6 dB"]
        for training in ("-18 dB", "0 dB", "24 dB"):
            assert cells[training].startswith(f"{rows[experiment, model, training, -6]:.3f} [")
    both = values["Fig. 4.16"][-1].set_index("trained at").loc[["0 dB", "0 dB, without up-sampling"], "12 dB"]
    means = [f"{rows[experiment, 'lr', '0 dB', 12]:.3f}" for experiment in ("upsampling", "noisy_training")]
    assert [cell.split(" [")[0] for cell in both] == means and means[0] != means[1]
    # The largest of all training and test SNRs stands beside the published maximum.
    assert f"{rows['upsampling', 'svm'].max():.3f} [" in values["Fig. 4.17"][0]["here"][0]


def test_the_overview_has_every_published_score_once_and_judges_it(thesis):
    printed = pd.read_csv(REFERENCE / "thesis_results.csv", dtype=str, keep_default_na=False)
    overview = thesis.overview
    left_out = printed.query("metric == 'training_accuracy' and model == 'svm'")  # not recorded; its figure says so
    assert len(overview) == len(printed) - len(left_out) > 20 and (overview["as published"] != "–").all()
    count, kept_by = (
        (overview["as published"] == "yes").sum(),
        overview["read otherwise"].str.findall(r"\*\*([^*]+)\*\*"),
    )
    read, models = kept_by.astype(bool), kept_by.map(lambda names: any("other models" not in name for name in names))
    said = f"{count} of the {len(overview)} statements that this run can judge hold as the document's text reads, "
    said += f"{count + models.sum()} by its text or by one of the readings below, and {count + read.sum()} if the known"
    assert said in thesis.head.replace("\n", " ") and not read[overview["as published"] == "yes"].any() and models.any()
    for line in overview.to_dict("records"):
        relation, value = line["published"].split()
        here, there = float(line["here"].split()[0]), float(value)
        low, high = map(float, re.findall(r"[\[,] ?([\d.]+)", line["here"]) or (np.nan, np.nan))
        kept = {"≥": here >= there, "≤": here <= there, ">": here > there, "<": here < there}
        kept["="] = round(here, len(value.partition(".")[2])) == there or low <= there <= high
        assert line["as published"] == ("yes" if kept[relation] else "no"), line
    # A maximum is that of the curve, at whatever SNR.
    curve = thesis.scores(experiment="single_elevation", model="svm", metric="accuracy", elevation="all")
    maximum = overview[(overview["stated"] == "maximum") & (overview["what"] == "SVM, accuracy")].iloc[0]
    assert maximum["here"].startswith(f"{curve['value'].max():.3f} [")
    # One of them by the run's own table: the share of wrong images is one less the accuracy of the open set.
    case = {"experiment": "capsule_open", "model": "capsule", "score": "mse", "threshold": "thesis"}
    row = thesis.scores(**case, metric="accuracy", test_snr_db=24).iloc[0]
    wrong = overview[overview["what"] == "capsule, MSE, share of wrong images"].iloc[0]
    assert wrong["published"] == "= 0.0032"
    assert wrong["here"] == interval({"value": 1 - row["value"], "low": 1 - row["high"], "high": 1 - row["low"]})


def test_readings_are_the_run_s_own_values_and_judged_alike(thesis):
    """Each statement that does not hold has its readings beside it: rows of scores.csv, and predictions judged anew."""
    overview = thesis.overview.set_index(["", "what", "stated"])["read otherwise"]
    cell = overview[FIG_412, "KNN, accuracy", "down to 0 dB"]
    said = dict(re.findall(r"\**([a-z][a-z ,]*?) ([\d.]+ \[[^\]]*\])", cell))
    sources = {"magnitudes": ("multi_elevation", "knn_magnitude"), "shuffled": ("multi_shuffled", "knn")}
    sources["tuned"] = "tuning", "knn_tuned"
    assert said.keys() - sources.keys() == {"other models", "other models, magnitudes"}
    for reading, (experiment, model) in sources.items():
        case = {"experiment": experiment, "model": model, "metric": "accuracy", "elevation": "all", "test_snr_db": 0}
        assert said[reading] == interval(thesis.scores(**case).iloc[0])
    # Of a network in the open set: other training images, thresholds by errors on the test images, all azimuths.
    every = ("at 24 dB", "by errors", "at 24 dB, by errors", "all azimuths", "at 24 dB, all azimuths")
    every += "other models", "other models, at 24 dB"
    cell = overview[FIG_54, "FCNN, softmax, weighted F1", "24 dB"]
    assert [re.match(r"\**(.+?) \d\.\d+", part)[1] for part in cell.split("; ")] == [*every]
    for experiment, reading in (("fcnn_open", "by errors"), ("fcnn_listing", "at 24 dB, by errors")):
        value = judged(thesis.results, experiment, "fcnn", "softmax", 24).metrics["errors"]["f1_weighted"]
        assert re.search(rf"(?:^|; )\**{reading} {value:.3f}", cell)


def test_hyper_parameters_and_times_stand_beside_those_published(thesis):
    table = tables(thesis.entries["Table 4.1"])[0].set_index(["model", "setting"])
    assert table.loc[("SVM", "C"), "published"] == "930.66 (T4.1)" and table.loc[("SVM", "C"), "here"] == "930.66"
    # The last setting tried is the best: so the fake searches are made.
    assert table.loc[("SVM", "C"), "chosen on validation images"] == "1000 of 1, 1000"
    assert table.loc[("KNN", "k"), "chosen on validation images"] == "3 of 1, 3"
    assert table.loc[("KNN", "k"), "at most with the published value"] == "0.8000"  # k = 1, the first of two
    table = tables(thesis.entries["Table 4.2"])[0].set_index(["model", "experiment"])
    assert table.loc[("KNN", "multi elevation"), "published [ms]"] == "48.8"
    assert table.loc[("KNN", "single elevation"), "training images there"] == "340"
    assert float(table.loc[("KNN", "multi elevation"), "here, in batches [ms]"]) == pytest.approx(0.04)  # the fourth
    ratio = table.loc[("KNN", "multi elevation"), "published / here in batches"]
    assert float(ratio.replace(",", "")) == pytest.approx(48.8 / 0.04, rel=0.05)
    for name, times in (("Table 4.3", "0.0056 11.535 0.0606 3363.5"), ("Table 5.3", "0.6934 0.0445 1.3 48.8")):
        assert tables(thesis.entries[name])[0]["published [ms]"].tolist() == times.split()


def test_a_run_without_capsule_networks_says_so(thesis, tmp_path):
    others = [name for name in thesis.settings["learning"]["experiments"] if "capsule" not in name]
    page = thesis.anew(tmp_path, fake.changed(others, thesis.settings))
    assert tuple(page.absent) == OF_CAPSULES and tuple(page.entries) == ITEMS
    assert all("**Not part of this run:**" in page.entries[name] for name in OF_CAPSULES)
    # What was published stays, and the rest is as it was.
    assert "0.9314" in page.entries["Fig. 5.6"] and "54 of 16,872" in page.entries["Fig. 5.11"]
    for name in ("Fig. 4.12", "Fig. 5.3", "Fig. 5.4, Table 5.2"):
        assert page.entries[name] == thesis.entries[name]
    assert set(page.overview["as published"]) == {"yes", "no", "–"}
    assert not list(page.folder.glob("fig-5-1*.png"))
    check_links(page.folder)


def test_a_run_with_little_or_nothing_says_so(thesis, tmp_path):
    few = fake.changed(["multi_elevation"], thesis.settings)
    few["learning"]["experiments"]["multi_elevation"]["models"] = ["lr", "knn"]
    page = thesis.anew(tmp_path, few)
    assert page.absent["Fig. 4.12"] == "SVM in experiment `multi_elevation`, split at random"
    assert "Fig. 5.7" not in page.absent and "Fig. 4.7" in page.absent
    assert len(list(page.folder.glob("*.png"))) == 4  # Figs. 4.9, 4.12, 4.15 and 5.7
    check_links(page.folder)
    # No experiment at all; and a solver of radar cross-sections, which makes no image.
    nothing = fake.changed([], thesis.settings)
    single = fake.changed([], thesis.settings, radar={"frequencies": 1, "bandwidth": 0})
    for name, settings in (("nothing", nothing), ("single", single)):
        page = thesis.anew(tmp_path / name, settings)
        assert tuple(page.entries) == ITEMS and "This run has none of them." in page.head
        assert set(page.overview["as published"]) == {"–"}
        check_links(page.folder)
    # Experiments that are split otherwise are not the document's.
    settings = fake_thesis.settings()
    settings["learning"]["experiments"]["capsule_open"]["split"] = "sector"
    assert ("capsule_open", "capsule") not in networks_of(fake.results("nowhere", settings).runs)
    page = thesis.anew(tmp_path, settings)
    assert page.absent["Fig. 5.14"] == "capsule in experiment `capsule_open` in the open set, split at random"


def test_a_run_by_the_other_definition_shows_values_by_mean_power(tmp_path):
    experiments = ["multi_elevation", "fcnn_open", "capsule_open", "sector"]
    settings = fake.changed(experiments, fake_thesis.settings(), noise={"definition": "peak_3db"})
    fake_thesis.make(tmp_path / "fake", settings)
    page = ThesisPage(tmp_path / "fake", settings, tmp_path / "page")
    case = {"experiment": "multi_elevation", "model": "knn", "metric": "accuracy", "test_snr_db": 0}
    mean, peak = (page.scores(**case, snr_definition=of)["value"].item() for of in ("mean", "peak_3db"))
    assert f"{mean:.3f}" != f"{peak:.3f}"
    values = tables(page.entries["Fig. 4.12"])[-1].set_index("")
    assert values.loc["KNN, split at random", "0 dB"].startswith(f"{mean:.3f} [")
    assert tables(page.head)[-2].set_index("").loc["SNR by", "this run"] == "peak_3db"


def test_the_same_stores_make_the_same_page_and_are_those_that_the_rule_names(thesis, tmp_path, monkeypatch):
    taken, opened, images_read = set(), Results.images, images.read

    def images_in(self, target, store):
        taken.add((target, store))
        return opened(self, target, store)

    def read(stores, *arguments, **options):
        taken.update((images.target_of(store), store.stem) for store in stores)
        return images_read(stores, *arguments, **options)

    monkeypatch.setattr(Results, "images", images_in)
    monkeypatch.setattr(images, "read", read)
    other = thesis.anew(tmp_path, thesis.settings)
    for path in thesis.folder.iterdir():
        assert (other.folder / path.name).read_bytes() == path.read_bytes(), path.name
    assert taken == set(images_of(thesis.settings, thesis.results.runs))
    assert ("trihedral", "clean") not in taken and ("ufo", snr_label(24)) in taken
