"""What one adds to the page is declared at one place: a section, a metric, a model."""

import pandas as pd

from isarflow import report
from isarflow.core import kinds
from isarflow.report import page, section_open
from isarflow.report.vocabulary import Names, select

SECTION = (
    "from isarflow.report.layout import Section\nPLACE, NEEDS = ('recognition', 2.5), 'learns'\n"
    "def section(results):\n    return Section('mine', 'My own', (f'{len(results.targets)} targets',))\n"
)
MODEL = "class Model:\n    LABELS = {'mine': ('Mine', 'my model', 1)}\n    SCORES = {'mine': ('my score', 1)}\n"


def test_a_section_is_one_file(results, tmp_path, monkeypatch):
    (tmp_path / "section_mine.py").write_text(SECTION)
    before = page._outline(results)["recognition"]
    monkeypatch.setattr(report, "__path__", [*report.__path__, str(tmp_path)])
    after = page._outline(results)["recognition"]
    place = before.index(section_open.section) + 1
    assert [*after[:place], *after[place + 1 :]] == before
    (section,) = page._drawn(after[place], results)
    assert section.title == "My own" and section.text == ("3 targets",)


def test_a_metric_is_one_line(results, monkeypatch):
    area = select(results.scores, metric="auroc").assign(metric="area", value=0.4321)
    scores = select(pd.concat([results.scores, area]).query("score != ''"), elevation="all")
    monkeypatch.setitem(section_open.SEPARATION, "area", "my area")
    ranks = section_open.summary(scores, select(results.validation, elevation="all"))
    assert set(section_open.tried_table(results, scores, ranks).shown["my area"]) == {"0.432"}


def test_a_model_is_one_file(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(MODEL)
    monkeypatch.setattr(kinds, "MODELS", kinds.MODELS._replace(folder=str(tmp_path)))
    names = Names(kinds.page_names({"mine": {}}), {"mine"})
    assert (names.model("mine").label, names.model("mine").words) == ("Mine", "my model")
    assert names.method("mine", "mine") == "Mine, my score"
