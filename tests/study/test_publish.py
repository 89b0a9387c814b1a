"""What `make results` publishes: the page of the thesis with its pictures, and the scores that it is made of."""

import lzma
import os
import runpy
import shutil
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from study.selection import PAGE as SELECTED
from thesis_pages import check_links, interval, tables

from isarflow.report.published import ADAPTATIONS, holds
from isarflow.report.results import read_learned
from isarflow.report.vocabulary import select
from isarflow.setup.config import ROOT
from isarflow.setup.yaml_file import read_yaml

# Metrics of scores.csv by what the thesis calls them; and what the page calls its models.
CURVES = {"accuracy": "accuracy", "f1": "f1_weighted", "weighted_f1": "f1_weighted", "error": "accuracy"}
NAMES = {"knn": "KNN", "svm": "SVM", "lr": "LR", "fcnn": "FCNN", "softmax_threshold": "FCNN, softmax"}
NAMES |= {"openmax": "FCNN, OpenMax", "other_class": "FCNN, other", "capsule": "capsule"}
NAMES |= {"capsule_mse": "capsule, MSE", "capsule_zncc": "capsule, ZNCC"}
PUBLISHER = SimpleNamespace(**runpy.run_path(ROOT / "studies/stewart-burger-2023/publish.py"))
COMMITTED, PAGE = ROOT / "resources/results/scores.csv.xz", ROOT / "docs/results.md"


def test_a_page_is_published_with_its_pictures_and_scores(thesis, tmp_path):
    pictures, published = tmp_path / "docs/img/results", tmp_path / "resources/results"
    pictures.mkdir(parents=True)
    (pictures / "fig-9-9.png").touch()  # of an earlier page
    PUBLISHER.publish(thesis.run, tmp_path)
    drawn = check_links(tmp_path / "docs", "results.md")
    assert sorted(drawn) == [f"img/results/{path.name}" for path in sorted(thesis.folder.glob("*.png"))]
    assert len(list(pictures.iterdir())) == len(drawn)
    about = (published / "README.md").read_text()
    for name in ("scores", "confusion", "validation"):
        table = (thesis.run / f"learning/{name}.csv").read_bytes()
        packed = (published / f"{name}.csv.xz").read_bytes()
        assert lzma.decompress(packed) == table and len(packed) < len(table) / 4
        assert f"| `{name}.csv.xz` |" in about and f"| {table.count(bytes([10])) - 1:,} |" in about
    assert "| processor | A processor |" in about and "commit" in about
    case = {"experiment": "capsule_open", "model": "capsule", "metric": "f1_weighted", "test_snr_db": 12}
    at_12 = thesis.scores(**case, elevation="all", score="").iloc[0]
    rows = next(table for table in tables(about) if "method" in table).set_index(["images", "method"])
    assert rows.loc[("closed set, at random", "capsule network"), "12 dB"] == interval(at_12)


def test_nothing_is_published_of_a_run_without_a_page_or_with_an_older_one(thesis, tmp_path):
    with pytest.raises(SystemExit, match=r"There is no .*README.md; make it: snakemake --cores 2 thesis_page"):
        PUBLISHER.publish(tmp_path, tmp_path)
    shutil.copytree(thesis.run, tmp_path / "run", ignore=shutil.ignore_patterns("*.zarr"))
    os.utime(tmp_path / "run/report/thesis/README.md", (0, 0))
    with pytest.raises(SystemExit, match="is older than the run's scores"):
        PUBLISHER.publish(tmp_path / "run", tmp_path)
    assert not (tmp_path / "docs").exists()


def test_the_published_verdicts_are_those_of_the_committed_scores():
    """Every statement that is read off scores, again by the thesis's conditions from the committed table."""
    scores = pd.read_csv(COMMITTED, dtype={"fold": str}, keep_default_na=False)
    # The table beside the scores is of them, and nothing is made up.
    assert PUBLISHER.scores_table(read_learned(COMMITTED)) in (COMMITTED.parent / "README.md").read_text()
    assert "`fake`" not in PAGE.read_text()
    scores = scores.query("split == 'random' and fold == '' and snr_definition == 'mean'")
    stated = pd.read_csv(ROOT / "resources/reference/thesis_results.csv", dtype=str, keep_default_na=False)
    stated = stated[stated["metric"].isin(CURVES) & stated["reading"].isin(["", "wrong"])]
    overview = next(table for table in tables(PAGE.read_text()) if "as published" in table and "" in table)
    shown = overview.set_index(overview[""].str.extract(r"\[([^],]*)")[0] + "/" + overview["stated"])
    assert len(stated) > 15
    for line in stated.to_dict("records"):
        model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
        case = {"experiment": line["experiment"], "model": model, "score": score, "elevation": line["elevation"]}
        case |= {"threshold": "thesis" if score else "", "metric": CURVES[line["metric"]]}
        rows = select(scores, **case).sort_values("test_snr_db")
        snr = min(float(line["snr_db"]), rows["test_snr_db"].max())
        here = {key: np.interp(snr, rows["test_snr_db"], rows[key].astype(float)) for key in ("value", "low", "high")}
        if line["reading"] == "wrong":
            here = {"value": 1 - here["value"], "low": 1 - here["high"], "high": 1 - here["low"]}
        printed = shown.loc[[f"{line['figure']}/{line['stated']}"]]
        printed = printed[printed["published"].str.split().str[1] == line["value"]]
        printed = printed[printed["what"].str.startswith(NAMES[line["model"]])].iloc[0]
        assert printed["here"] == interval(here), line
        is_kept = holds({"ours": here["value"], **here}, line)
        assert printed["as published"] == ("yes" if is_kept else "no"), line


def test_the_published_training_of_the_capsule_network_is_that_of_the_committed_table():
    """The sentence of page.yaml, its places filled from the table."""
    table, sentence = (
        pd.read_csv(COMMITTED.with_name("capsule_training.csv")),
        SELECTED["sentences"]["capsule_training"],
    )
    found = {}
    for place, case in sentence["values"].items():
        rows = table[(table["reading"] == case["reading"]) & (table["epoch"] == case["epoch"])]
        found[place] = rows[rows["snr_db"] == case["snr_db"]][case["column"]].item()
    assert len(found) == 10 and sentence["says"].format(**found) in PAGE.read_text()


def test_the_published_verdicts_with_other_models_are_those_of_the_committed_scores():
    """Every value that the page has of other models, again from the table of the pairs."""
    table = pd.read_csv(COMMITTED.with_name("models.csv.xz"), keep_default_na=False)
    of_pairs = table.groupby(["drone", "missile"])
    config = read_yaml(ROOT / "config/models.yaml")
    asked = config["learning"]["experiments"]
    models = {name: set(of["models"]) for name, of in asked.items() if of and name != "capsule_listing"}
    assert len(of_pairs) == 9
    for _, rows in of_pairs:
        assert set(rows["test_snr_db"]) == set(config["noise"]["snr_db"])
        assert all(set(select(rows, experiment=name)["model"]) == own for name, own in models.items())
    overview = next(table for table in tables(PAGE.read_text()) if "read otherwise" in table)
    readings = {name: reading for name, reading in SELECTED["readings"].items() if "models" in reading}
    stated = pd.read_csv(ROOT / "resources/reference/thesis_results.csv", dtype=str, keep_default_na=False)
    compared = 0
    for line in stated[stated["metric"].isin(CURVES) & (stated["reading"] == "")].to_dict("records"):
        model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
        shown = overview[(overview["stated"] == line["stated"]) & overview["what"].str.startswith(NAMES[line["model"]])]
        shown = shown[shown["published"].str.split().str[1] == line["value"]]
        shown = next((text for text in shown["read otherwise"] if text), "")
        for name, reading in readings.items():
            own = f"{line['experiment']}/{model}"
            experiment, _, judged = reading.get("rows", {own: own}).get(own, "").partition("/")
            case = dict(zip(("drone", "missile"), reading["models"], strict=True)) | {"experiment": experiment}
            case |= {"model": judged, "score": score, "metric": CURVES[line["metric"]], "elevation": line["elevation"]}
            rows = select(table, **case, threshold="thesis" if score else "").sort_values("test_snr_db")
            if not shown or rows.empty:
                assert f"{name} 0" not in shown and f"{name} 1" not in shown
                continue
            snr = float(line["snr_db"])
            here = {
                key: np.interp(snr, rows["test_snr_db"], rows[key].astype(float)) for key in ("value", "low", "high")
            }
            text = f"{name} {interval(here)}"
            assert (f"**{text}**" if holds({"ours": here["value"], **here}, line) else text) in shown.split("; "), line
            compared += 1
    assert compared >= 10


def test_the_tables_of_kinds_are_of_the_committed_scores(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "resources/results")
    monkeypatch.syspath_prepend(ROOT / "resources/cad")
    published = SimpleNamespace(**runpy.run_path(ROOT / "resources/results/kinds.py"))
    table, page = published.whole(ROOT / "resources/results/kinds/scores.csv.xz"), ROOT / "docs/kinds.md"
    for snr in (12, 6):
        made = published.by_split(table[table["test_snr_db"] == snr])
        shown = page.read_text().partition(f"<!-- {snr} dB -->\n")[2].partition(f"<!-- end of {snr} dB")[0]
        assert shown == made and made.count("| cnn |") == 2 and "nan" not in made


def test_the_tables_of_recognition_are_of_the_committed_scores(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "resources/results")
    published = SimpleNamespace(**runpy.run_path(ROOT / "resources/results/recognition.py"))
    table, page = published.whole(ROOT / "resources/results/recognition/scores.csv.xz"), ROOT / "docs/recognition.md"
    for mark, metric, threshold in (("f1", "f1_weighted", "kept"), ("auroc", "auroc", "")):
        made = published.by_split(table, published.METHODS, metric, threshold)
        assert published.between(page, mark)[1] == made and "()" not in made
        rows = [line for line in made.splitlines()[2:] if "**" not in line]
        assert {row.count("\N{EN DASH}") for row in rows} == {len(published.SNRS)}
    assert published.between(page, "looks")[1] == published.looks(table)
    assert set(published.SHOWN) <= set(published.METHODS)
