"""The page of the thesis as Markdown: entries of text, tables and pictures, and how they are written."""

import re
from typing import NamedTuple

from report.layout import to_png

NONE = "–"  # of a table's cell


class Picture(NamedTuple):
    """A PNG file beside the page. name: the file's, without its suffix; alt: for those who cannot see it."""

    name: str
    png: bytes
    alt: str


class Entry(NamedTuple):
    """One figure or table of the thesis, or some that belong together.

    names: as "Fig. 4.7"; title: what it shows; did: what the document did, in a line. judged: what it states in numbers
    (see `thesis_compare.judged`). missing: what of it this run does not have, in words; empty where all is there.
    blocks: Markdown text and Pictures, in order; why: sentences on why values may differ.
    """

    names: tuple
    title: str
    did: str
    judged: tuple = ()
    missing: str = ""
    blocks: tuple = ()
    why: tuple = ()

    @property
    def heading(self):
        return ": ".join(text for text in (", ".join(self.names), self.title) if text)

    @property
    def link(self):
        return f"[{', '.join(self.names)}](#{anchor(self.heading)})"


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


def anchor(heading):
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def block(part):
    """A block of an Entry as Markdown. A Picture lies beside the page."""
    return f"![{part.alt}]({part.name}.png)" if isinstance(part, Picture) else part


def pictures(entries):
    return [part for entry in entries for part in entry.blocks if isinstance(part, Picture)]


def not_here(words):
    """What a reader is told instead of what a run does not have."""
    return f"**Not part of this run:** {words}."
