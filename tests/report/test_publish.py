"""What `make results` publishes: the page of the thesis with its pictures, and the scores that it is made of."""

import lzma
import os
import runpy
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from study.statements import kept
from thesis_pages import check_links, tables

from isarflow.report.published import ADAPTATIONS
from isarflow.report.vocabulary import select
from isarflow.setup.config import ROOT

# Metrics of scores.csv by what the thesis calls them; and what the page calls its models.
CURVES = {"accuracy": "accuracy", "f1": "f1_weighted", "weighted_f1": "f1_weighted", "error": "accuracy"}
NAMES = {"knn": "KNN", "svm": "SVM", "lr": "LR", "fcnn": "FCNN", "softmax_threshold": "FCNN, softmax"}
NAMES |= {"openmax": "FCNN, OpenMax", "other_class": "FCNN, other", "capsule": "capsule"}
NAMES |= {"capsule_mse": "capsule, MSE", "capsule_zncc": "capsule, ZNCC"}


@pytest.fixture
def publisher():
    return SimpleNamespace(**runpy.run_path(ROOT / "studies/stewart-burger-2023/publish.py"))


def test_a_page_is_published_with_its_pictures_and_scores(thesis_page, publisher, tmp_path):
    (tmp_path / "docs/img/results").mkdir(parents=True)
    (tmp_path / "docs/img/results/fig-9-9.png").touch()  # of an earlier page
    publisher.publish(thesis_page.parents[1], tmp_path)
    drawn = check_links(tmp_path / "docs", "results.md")
    assert sorted(drawn) == [f"img/results/{path.name}" for path in sorted(thesis_page.glob("*.png"))]
    assert len(list((tmp_path / "docs/img/results").iterdir())) == len(drawn)
    about = (tmp_path / "resources/results/README.md").read_text()
    for name in ("scores", "confusion", "validation"):
        table = (thesis_page.parents[1] / f"learning/{name}.csv").read_bytes()
        packed = (tmp_path / f"resources/results/{name}.csv.xz").read_bytes()
        assert lzma.decompress(packed) == table and len(packed) < len(table) / 4
        assert f"| `{name}.csv.xz` |" in about and f"| {table.count(bytes([10])) - 1:,} |" in about
    assert "| processor | A processor |" in about and "commit" in about
    scores = pd.read_csv(tmp_path / "resources/results/scores.csv.xz", keep_default_na=False)
    text = (tmp_path / "resources/results/README.md").read_text().split("## Weighted F1")[1]
    at_12 = scores.query("experiment == 'capsule_open' and metric == 'f1_weighted' and test_snr_db == 12")
    at_12 = at_12.query("model == 'capsule' and elevation == 'all' and score == '' and snr_definition == 'mean'")
    value, low, high = at_12[["value", "low", "high"]].astype(float).to_numpy()[0]
    closed = text.split("closed set, at random")[1].splitlines()[1].split(" | ")
    assert closed[0] == "| capsule network" and closed[5] == f"{value:.2f} ({low:.2f}\N{EN DASH}{high:.2f})"
    assert scores.equals(pd.read_csv(thesis_page.parents[1] / "learning/scores.csv", keep_default_na=False))


def test_nothing_is_published_of_a_run_without_a_page_or_with_an_older_one(thesis_page, publisher, tmp_path):
    with pytest.raises(SystemExit, match=r"There is no .*README.md; make it: snakemake --cores 2 thesis_page"):
        publisher.publish(tmp_path, tmp_path)
    readme = thesis_page / "README.md"
    times = readme.stat()
    os.utime(readme, (times.st_atime, 0))
    try:
        with pytest.raises(SystemExit, match="is older than the run's scores"):
            publisher.publish(thesis_page.parents[1], tmp_path)
    finally:
        os.utime(readme, (times.st_atime, times.st_mtime))
    assert not (tmp_path / "docs").exists()


def test_the_table_beside_the_committed_scores_is_of_them(publisher):
    committed = ROOT / "resources/results/scores.csv.xz"
    table = (committed.parent / "README.md").read_text()
    assert publisher.scores_table(pd.read_csv(committed, keep_default_na=False)) in table


def test_the_page_s_verdicts_are_those_of_the_committed_scores(tmp_path):
    """Every statement that is read off scores, again by the thesis's conditions from the committed table."""
    committed, page = ROOT / "resources/results/scores.csv.xz", ROOT / "docs/results.md"
    scores = pd.read_csv(committed, dtype={"fold": str}, keep_default_na=False)
    scores = scores.query("split == 'random' and fold == '' and snr_definition == 'mean'")
    stated = pd.read_csv(ROOT / "resources/reference/thesis_results.csv", dtype=str, keep_default_na=False)
    stated = stated[stated["metric"].isin(CURVES) & stated["reading"].isin(["", "wrong"])]
    overview = next(table for table in tables(page.read_text()) if "as published" in table and "" in table)
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
        assert printed["here"] == "{value:.3f} [{low:.3f}, {high:.3f}]".format(**here), line
        holds = kept({"ours": here["value"], **here}, line)
        assert printed["as published"] == ("yes" if holds else "no"), line


def test_nothing_made_up_is_committed():
    assert not (ROOT / "docs/results.md").exists() or "`fake`" not in (ROOT / "docs/results.md").read_text()


def test_the_tables_of_recognition_are_of_the_committed_scores(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "resources/results")
    published = SimpleNamespace(**runpy.run_path(ROOT / "resources/results/recognition.py"))
    table, page = published.whole(ROOT / "resources/results/recognition/scores.csv.xz"), ROOT / "docs/recognition.md"
    for mark, metric, threshold in (("f1", "f1_weighted", "kept"), ("auroc", "auroc", "")):
        made = published.by_split(table, published.METHODS, metric, threshold)
        assert published.between(page, mark)[1] == made and "()" not in made
        assert all(
            line.count("\N{EN DASH}") == len(published.SNRS) for line in made.splitlines()[2:] if "**" not in line
        )
    assert published.between(page, "looks")[1] == published.looks(table)
    assert set(published.SHOWN) <= set(published.METHODS)
