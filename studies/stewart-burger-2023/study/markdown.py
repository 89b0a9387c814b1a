"""The page of the thesis as data and as Markdown: what it says and shows, sentences, tables, pictures."""

import re
from pathlib import Path
from typing import NamedTuple

import yaml

from isarflow.report.layout import to_png

NONE = "–"  # of a table's cell
PAGE = yaml.safe_load((Path(__file__).parents[1] / "page.yaml").read_text())  # its head says what it has


class Picture(NamedTuple):
    """A PNG file beside the page. name: the file's, without its suffix; alt: for those who cannot see it."""

    name: str
    png: bytes
    alt: str


class NotHere(Exception):
    """What a part needs is not part of the run, in words: the figure's other parts and its reasons are left out."""


def say(name, /, **values):
    """A sentence of the page, its {places} filled."""
    return PAGE["sentences"][name].format(**values)


def picture(name, drawing, alt):
    """The Picture of what was drawn on a canvas. name: the figure's, as "Fig. 4.7"."""
    return Picture(re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-"), to_png(drawing), alt)


def table(rows):
    """A table of rows, mappings of heading to text; nothing for no rows. A row may lack headings of others."""
    if not rows:
        return ""
    heads = list(dict.fromkeys(head for row in rows for head in row))
    cells = [heads, ["---"] * len(heads), *([str(row.get(head, NONE)) for head in heads] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


def bullets(lines):
    return "\n".join(f"- {line}" for line in lines if line)


def folded(summary, text):
    """Text that a reader unfolds, as HTML within Markdown."""
    return f"<details>\n<summary>{summary}</summary>\n\n{text}\n\n</details>"


def anchor(heading):
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def block(part):
    """A block of the page as Markdown. A Picture lies beside the page."""
    return f"![{part.alt}]({part.name}.png)" if isinstance(part, Picture) else part


def not_here(words):
    """What a reader is told instead of what a run does not have."""
    return f"**Not part of this run:** {words}."
