"""What the page is made of, as Markdown: sentences of page.yaml, tables, lists, and pictures beside it."""

import io
import re
from typing import NamedTuple

from study.selection import PAGE

DPI = 120  # of pictures
NONE = "–"  # of a table's cell


class Picture(NamedTuple):
    """A PNG file beside the page. name: the file's, without its suffix; alt: for those who cannot see it."""

    name: str
    png: bytes
    alt: str

    def __str__(self):
        return f"![{self.alt}]({self.name}.png)"


def say(name, /, **values):
    """Return a sentence of the page, its {places} filled."""
    return PAGE["sentences"][name].format(**values)


def picture(name, drawing, alt):
    """Return the Picture of what was drawn on a canvas, the same bytes every time. name: as "Fig. 4.7"."""
    buffer = io.BytesIO()
    drawing.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return Picture(re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-"), buffer.getvalue(), alt)


def table(rows):
    """Return a table of rows, mappings of heading to text; nothing for no rows. A row may lack headings of others."""
    heads = list(dict.fromkeys(head for row in rows for head in row))
    cells = [heads, ["---"] * len(heads), *([str(row.get(head, NONE)) for head in heads] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells) if rows else ""


def bullets(lines):
    return "\n".join(f"- {line}" for line in lines if line)


def folded(summary, text):
    """Return text that a reader unfolds, as HTML within Markdown."""
    return f"<details>\n<summary>{summary}</summary>\n\n{text}\n\n</details>"


def anchor(heading):
    """Return the anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
