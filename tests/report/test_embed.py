"""Files within a page: put together to the letter, whether they are held by columns or as they are."""

from pages import unpacked

from isarflow.report.page import embedded


def test_what_is_held_is_put_together_to_the_letter(tmp_path):
    letter = '<path id="DejaVuSans-41" d="M 1 2\nL 3 4\nz\n" transform="scale(0.015625)"/>'
    files = {
        "figures/a.svg": f'<svg>{letter}<path id="m1" d="M 0 0"/></svg>',
        "figures/b.svg": f"<svg><g>{letter}</g></svg>",
        "tables/a.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/same.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/one.csv": "a\n1\n",
        "tables/empty.csv": "a,b\n,\n,2\n",
        "tables/none.csv": "a,b\n",
        "tables/lines.csv": 'a,b\n"of two\nlines",1\n',
    }
    data = embedded(files, {"live": {"x": [1, 2]}})
    assert set(data) == {*list(files)[:2], "tables/a.csv tables/same.csv", *list(files)[4:], "live.json", "glyphs.json"}
    html = "".join(f'<script type="text/plain" data-file="{names}">{text}</script>\n' for names, text in data.items())
    (tmp_path / "index.html").write_text(html)
    held = unpacked(tmp_path / "index.html")
    assert held.pop("live.json") == b'{"x":[1,2]}' and held.pop("glyphs.json")
    assert {name: text.encode() for name, text in files.items()} == held
