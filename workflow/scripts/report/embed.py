"""Files within the page: what they share stands there once, compressed, as text; the reader's browser unpacks them when
they are asked for (`text` in page.js), to the letter."""

import base64
import gzip
import json
import re

GLYPH = re.compile(r'<path id="(DejaVuSans[^"]*)" d="[^"]*" transform="[^"]*"/>')  # a letter's outline, see layout.py
COLUMN = "\x1e"  # stands before each column


def embedded(files, live):
    """Return what the page holds, by its paths with blanks between: many a figure shows what its table lists.

    files: texts by path. live: what the page's scripts read, by name.
    """
    paths, glyphs, data = {}, {}, {}
    for path, text in files.items():
        paths.setdefault(text, []).append(path)
    for text, same in paths.items():
        held = GLYPH.sub(r'<path id="\1"/>', text)
        glyphs |= {glyph[1]: glyph[0] for glyph in GLYPH.finditer(text)}
        if '"' not in text:  # no field holds a comma; by columns it takes half the room
            rows = [line.split(",") for line in text.removesuffix("\n").split("\n")]
            held = "".join(COLUMN + "\n".join(column) for column in zip(*rows, strict=True))
        data[" ".join(same)] = held
    for name, part in (*live.items(), ("glyphs", glyphs)):
        data[f"{name}.json"] = json.dumps(part, separators=(",", ":"), allow_nan=False)
    # The same bytes every time.
    return {name: base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode() for name, text in data.items()}
