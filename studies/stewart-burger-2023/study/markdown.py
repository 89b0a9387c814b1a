"""What the page is made of, as Markdown: tables, lists, and pictures beside it."""

import re

NONE = "–"  # of a table's cell


def picture(figure, drawing, alt):
    """Write what was drawn on a canvas as a PNG beside the page, and return its link. alt: what it shows, in words."""
    name = re.sub(r"[^a-z0-9]+", "-", figure.picture.lower()).strip("-")
    drawing.savefig(figure.folder / f"{name}.png", dpi=120, metadata={"Software": None})  # the same bytes every time
    return f"![{figure.picture} here: {alt}]({name}.png)"


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
