"""Files within a page: tables as columns, to the letter or as they are."""

import pytest
from pages import unpacked

from isarflow.report.embed import columns, embedded


@pytest.mark.parametrize(
    ("csv", "held"),
    [
        ('a,b\n1,"x, ""y"""\n,\n', 'a\n1\n\x1eb\n"x, ""y"""\n'),
        ("a\n1\n", "a\n1\n"),  # one column
        ('a,b\n"of two\nlines",1\n', 'a,b\n"of two\nlines",1\n'),
        ("a,b\n1\n", "a,b\n1\n"),
    ],
)
def test_a_table_is_held_by_columns_where_it_has_them(csv, held):
    assert columns(csv) == held


def test_what_is_held_is_put_together_to_the_letter(tmp_path):
    letter = '<path id="DejaVuSans-41" d="M 1 2\nL 3 4\nz\n" transform="scale(0.015625)"/>'
    files = {
        "figures/a.svg": f'<svg>{letter}<path id="m1" d="M 0 0"/></svg>'.encode(),
        "figures/b.svg": f"<svg><g>{letter}</g></svg>".encode(),
        "tables/a.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/same.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/one.csv": "a\n1\n",
        "tables/lines.csv": 'a,b\n"of two\nlines",1\n',
    }
    data = embedded(files, {"live": {"x": [1, 2]}})
    assert set(data) == {*list(files)[:2], "tables/a.csv tables/same.csv", *list(files)[4:], "live.json", "glyphs.json"}
    html = "".join(f'<script type="text/plain" data-file="{names}">{text}</script>\n' for names, text in data.items())
    (tmp_path / "index.html").write_text(html)
    held = unpacked(tmp_path / "index.html")
    assert held.pop("live.json") == b'{"x":[1,2]}' and held.pop("glyphs.json")
    assert {name: text.encode() if isinstance(text, str) else text for name, text in files.items()} == held
