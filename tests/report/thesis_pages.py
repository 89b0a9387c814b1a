"""A page of the thesis taken apart: entries, tables, links; and pages of the same results by other settings."""

import copy
import re

import fake
import numpy as np
import pandas as pd
from PIL import Image
from study.markdown import anchor
from study.page import write_page


def parts(folder):
    """The text of each entry of a page, by its names; the rest before the first stands under an empty name."""
    text = (folder / "README.md").read_text()
    pieces = re.split(r"^### (.*)$", text, flags=re.MULTILINE)
    return {"": pieces[0]} | {
        head.partition(": ")[0]: body for head, body in zip(pieces[1::2], pieces[2::2], strict=True)
    }


def tables(text):
    """All tables of a text: DataFrames of cells as text."""
    found = []
    for block in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        lines = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in block.splitlines()]
        found.append(pd.DataFrame(lines[2:], columns=lines[0]))
    return found


def anew(tmp_path, folder, settings):
    """A page of the results of another one, by other settings."""
    write_page(folder, settings, fake.names(settings), tmp_path / "page")
    return tmp_path / "page"


def without(settings, *experiments):
    settings = copy.deepcopy(settings)
    for name in experiments:
        del settings["learning"]["experiments"][name]
    return settings


def missing(folder):
    """What the list at the head of a page says is not part of the run: words by entry."""
    return dict(re.findall(r"^- \[([^\]]*)\]\(#[^)]*\): (.*)$", parts(folder)[""], re.MULTILINE))


def check_links(folder, page="README.md"):
    """Every link of a page leads to a heading, or to a picture that shows something; gives the pictures."""
    text = (folder / page).read_text()
    anchors = [anchor(heading) for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)]
    assert len(set(anchors)) == len(anchors)
    drawn = []
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if link.startswith("#"):
            assert link[1:] in anchors, link
        else:
            with Image.open(folder / link) as picture:
                assert picture.format == "PNG" and min(picture.size) > 60
                levels = np.asarray(picture.convert("L"))
            assert levels.std() > 5 and len(np.unique(levels)) > 10, link
            drawn.append(link)
    assert len(set(drawn)) == len(drawn)
    return drawn
