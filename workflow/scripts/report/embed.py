"""Files within the page: what they share stands there once, compressed, as text; the reader's browser unpacks them when
they are asked for (`text` in page.js), to the letter."""

import base64
import gzip
import json
import re

GLYPH = re.compile(r'<path id="(DejaVuSans[^"]*)" d="[^"]*" transform="[^"]*"/>')  # a letter's outline, see layout.py
FIELD = re.compile(r'("(?:[^"]|"")*"|[^,"]*),')
COLUMN = "\x1e"  # stands between columns
GLYPHS = "glyphs.json"


def embedded(files, live):
    """What the page holds, by the paths that it has with blanks between: many a figure shows what its table lists.

    files: contents (text, or an SVG's bytes) by path. live: what the page's scripts read, by name.
    """
    paths, glyphs = {}, {}
    for path, content in files.items():
        paths.setdefault(content, []).append(path)
    data = {}
    for content, same in paths.items():
        if isinstance(content, bytes):
            content = content.decode()
            glyphs |= {glyph[1]: glyph[0] for glyph in GLYPH.finditer(content)}
            content = GLYPH.sub(r'<path id="\1"/>', content)
        else:
            content = columns(content)
        data[" ".join(same)] = packed(content)
    parts = {f"{name}.json": part for name, part in live.items()} | {GLYPHS: glyphs}
    return data | {
        name: packed(json.dumps(part, separators=(",", ":"), allow_nan=False)) for name, part in parts.items()
    }


def columns(csv):
    """A CSV's columns one after the other, compressed half as large; as it is where a field breaks lines."""
    lines = csv.removesuffix("\n").split("\n")
    rows = [FIELD.findall(line + ",") if '"' in line else line.split(",") for line in lines]
    whole = [",".join(row) for row in rows] == lines and len({len(row) for row in rows}) == 1
    return COLUMN.join("\n".join(column) for column in zip(*rows, strict=True)) if whole and len(rows[0]) > 1 else csv


def packed(text):
    """Text as it stands in the page: base 85 of its gzip, the same every time."""
    return base64.b85encode(gzip.compress(text.encode(), compresslevel=9, mtime=0)).decode()
