"""A report's page, parsed and checked for what holds for every one."""

import base64
import gzip
import itertools
import re
from html import unescape
from html.parser import HTMLParser

import pandas as pd

VOID = {"meta", "link", "img", "br", "input"}
MOST_SENTENCES = 3  # of a caption


class Page(HTMLParser):
    """Parses a page and keeps its tags; raises when an element is closed that is not the innermost open one."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.text, self.open, self.html = [], [], [], path.read_text()
        self.feed(self.html)
        assert not self.open
        self.words = " ".join(" ".join(self.text).split())
        self.figures = {attrs["id"].removeprefix("figure-") for attrs in self.attributes("figure")}

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        # What a page holds packed, its scripts and its style say nothing to a reader.
        if self.open and self.open[-1] not in ("script", "style"):
            self.text.append(data)

    def attributes(self, *names):
        return [attrs for tag, attrs in self.tags if tag in names]

    def headings(self):
        """The anchors of its parts and sections, in order."""
        return [attrs["id"] for attrs in self.attributes("h2", "h3")]

    def caption(self, name):
        """The caption of a figure, without its links."""
        figure = self.html[self.html.index(f'id="figure-{name}"') :]
        return unescape(re.search(r"<figcaption>(.*?) <a ", figure, re.DOTALL)[1])

    def captions(self):
        """The captions of all figures and tables as text, without their links."""
        found = re.findall(r'<(figcaption|p class="caption")[^>]*>(.*?)</(?:figcaption|p)>', self.html, re.DOTALL)
        texts = [unescape(re.sub(r"<a .*?</a>,?|<[^>]+>", "", text, flags=re.DOTALL)) for _, text in found]
        return [" ".join(text.split()) for text in texts if text]

    def table(self, label):
        """The cells of a table as text, row by row, the heading first."""
        table = self.html[self.html.index(f'aria-labelledby="{label}">\n<thead>') :].partition("</table>")[0]
        rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in table.split("<tr>")]
        return [row for row in rows if row]


def check_whole(report):
    """What holds for every report; returns the parsed page."""
    page, held = Page(report / "index.html"), unpacked(report / "index.html")
    pictures = [attrs for attrs in page.attributes("img") if "data-file" in attrs]
    assert all(attrs["alt"].strip() and attrs["src"].startswith("data:") for attrs in pictures)
    # Without scripts what the page holds packed cannot be drawn: then the files beside it are.
    beside = [attrs["src"] for attrs in page.attributes("img") if "data-file" not in attrs]
    assert all((report / path).exists() for path in beside)
    assert [path for path in held if path[-5:] != ".json" and held[path] != (report / path).read_bytes()] == []
    for attrs in page.attributes("script", "iframe", "object", "embed", "video", "audio", "source"):
        assert "src" not in attrs and "data" not in attrs
    assert all(attrs["href"].startswith("data:") for attrs in page.attributes("link"))
    assert "@import" not in page.words and "url(" not in page.words
    ids = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    for attrs in page.attributes("a"):
        target = attrs["href"]
        assert target[1:] in ids if target.startswith("#") else held[target] and "download" in attrs
    captions = page.captions()
    assert len(captions) >= len(page.figures) + page.html.count("<table aria-labelledby")
    # A full stop within a number or a file's name ends none.
    assert [text for text in captions if len(re.findall(r"[.!?…]”?(?=\s|$)", text)) > MOST_SENTENCES] == []
    levels = [int(tag[1]) for tag, _ in page.tags if tag in ("h1", "h2", "h3")]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    figures = list((report / "figures").iterdir())
    assert len(figures) == len(pictures)
    for path in figures:
        svg = path.read_text()
        assert ("<path" in svg or "<image" in svg) and "<dc:date>" not in svg, path
        assert len(pd.read_csv(report / "tables" / f"figure_{path.stem}.csv")) > 0
    return page


def unpacked(path):
    """The files that a page holds, by their path from it, put together as its scripts do."""
    packed = re.findall(r'<script type="text/plain" data-file="([^"]+)">(.+?)</script>', path.read_text())
    held = {names: gzip.decompress(base64.b64decode(content)).decode() for names, content in packed}
    return {name: _whole(text).encode() for names, text in held.items() for name in names.split()}


def _whole(text):
    _, *columns = [column.split("\n") for column in text.split("\x1e")]
    return "".join(f"{','.join(row)}\n" for row in zip(*columns, strict=True)) if columns else text
