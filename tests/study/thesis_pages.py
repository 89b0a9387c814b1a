"""A page of the thesis, written and taken apart: entries, tables, links."""

import re

import fake
import numpy as np
import pandas as pd
from PIL import Image
from study.markdown import anchor
from study.page import write_page

from isarflow.report.vocabulary import select


class ThesisPage:
    """A page that is written to `folder` of the results in `run` (results/<name>), by these settings.

    head: the text before the first entry; entries: the text of each, by its names; absent: what the head says is not
    part of the run, words by entry; overview: the table of all published scores.
    """

    def __init__(self, run, settings, folder):
        self.run, self.settings, self.folder = run, settings, folder
        self.results = fake.results(run, settings)
        write_page(run, settings, fake.names(settings), folder)
        pieces = re.split(r"^### (.*)$", (folder / "README.md").read_text(), flags=re.MULTILINE)
        self.head, heads, texts = pieces[0], pieces[1::2], pieces[2::2]
        self.entries = {head.partition(": ")[0]: text for head, text in zip(heads, texts, strict=True)}
        self.absent = dict(re.findall(r"^- \[([^\]]*)\]\(#[^)]*\): (.*)$", self.head, re.MULTILINE))
        self.overview = next(table for table in tables(self.head) if "as published" in table)

    def scores(self, **case):
        """The rows of scores.csv of all folds together with these values, by mean power if they do not say."""
        numbers = {"low": [""], "high": [""]}
        path = self.run / "learning" / "scores.csv"
        rows = pd.read_csv(path, dtype={"fold": str}, keep_default_na=False, na_values=numbers)
        return select(rows, **{"fold": "", "snr_definition": "mean"} | case)

    def predictions(self, run, model, snr="24dB"):
        return pd.read_csv(self.run / f"learning/predictions/{run}/{model}/snr_{snr}.csv", keep_default_na=False)

    def anew(self, folder, settings):
        """A page of the same results by other settings."""
        return ThesisPage(self.run, settings, folder / "page")


def interval(row):
    """A row of scores.csv as the page shows it."""
    return f"{row['value']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"


def tables(text):
    """All tables of a text: DataFrames of cells as text."""
    found = []
    for block in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        lines = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in block.splitlines()]
        found.append(pd.DataFrame(lines[2:], columns=lines[0]))
    return found


def check_links(folder, page="README.md"):
    """Every link of a page leads to a heading, or to a picture that shows something; gives the pictures."""
    text = (folder / page).read_text()
    anchors = [anchor(heading) for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)]
    assert len(set(anchors)) == len(anchors)
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    drawn = [link for link in links if not link.startswith("#")]
    assert {link[1:] for link in links if link.startswith("#")} <= set(anchors)
    for link in drawn:
        with Image.open(folder / link) as picture:
            assert picture.format == "PNG" and min(picture.size) > 60
            levels = np.asarray(picture.convert("L"))
        assert levels.std() > 5 and len(np.unique(levels)) > 10, link
    assert len(set(drawn)) == len(drawn)
    return drawn
