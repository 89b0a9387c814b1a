"""Put the page together: one self-contained HTML file, and its figures (SVG) and tables (CSV) beside it."""

import base64
import gzip
import json
import re
from collections import namedtuple
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import jinja2
from joblib import Parallel, delayed, parallel_config
from tqdm import tqdm

from isarflow import report
from isarflow.report import section_headline, section_run
from isarflow.report.conditions import glossary
from isarflow.report.layout import Section, style
from isarflow.report.results import Results

# The parts of the page. A section is a file section_<name>.py here: `section`, a function of the Results, gives a
# Section or several; PLACE is the part that it is in and its place there; NEEDS is what the Results must have.
PARTS = {"look": "Look around", "fields": "Meshes and fields", "imaging": "ISAR images"}
PARTS |= {"recognition": "Recognition", "run": "The run"}
Part = namedtuple("Part", "id title sections")  # foldable
COLUMN = "\x1e"  # stands before each column
# What a page may show besides its parts.
BARE = dict.fromkeys(("summary", "checks", "warnings", "targets", "headline", "facts"), ())


def write_report(folder, settings, stated, page, threads=1):
    """Write the report of the results in `folder` (results/<name>): an HTML file, `page`, and figures/, tables/ beside.

    settings: the config's sections. stated: of `vocabulary.Names`. threads: how many sections are drawn at a time. The
    same inputs give the same bytes, but for the commit and versions that the page names.
    """
    results = Results(folder, settings, stated)
    warnings = section_run.warned(results)
    with style():
        shown = {
            "summary": section_run.sentences(results),
            "checks": section_run.checks(results, warnings),
            "warnings": warnings,
            "targets": section_run.cards(results),
            "headline": section_headline.headline(results) if results.learns else None,
            "facts": list(section_run.facts(results)),
        }
    shown["parts"] = _parts(results, threads)
    write_page(f"Radar target recognition: {settings['name']}", settings["name"], shown, page)


def write_page(title, name, shown, page, alone=False):
    """Write an HTML file with a title and a run's name; beside it, unless it comes alone, its figures and tables.

    shown: its `parts`, and what it has of BARE.
    """
    shown = {**BARE, **shown, "title": title, "name": name, "alone": alone}
    sections = [section for part in shown["parts"] for section in part.sections]
    drawn = [picture for _, picture, _ in shown["targets"] if picture]
    drawn += [shown["headline"]] if shown["headline"] else []
    drawn += [figure for section in sections for figure in section.figures]
    listed = [table for section in sections for table in section.tables]
    print(f"writing {len(sections)} sections, {len(drawn)} figures and {len(listed)} tables")
    files = {f"figures/{figure.name}.svg": figure.svg.decode() for figure in drawn}
    files |= {f"tables/figure_{figure.name}.csv": _csv(figure) for figure in drawn}
    files |= {f"tables/{table.name}.csv": _csv(table) for table in listed}
    assert len(files) == 2 * len(drawn) + len(listed), "two of one name"
    for folder in () if alone else ("figures", "tables"):
        Path(page).with_name(folder).mkdir(parents=True, exist_ok=True)
    for path, text in () if alone else files.items():
        Path(page).parent.joinpath(path).write_text(text)
    kept = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True, "undefined": jinja2.StrictUndefined}
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    template = jinja2.Environment(loader=loader, **kept).get_template("template.html")
    words = _spoken(template.render(shown, glossary={}, data={}))
    data = embedded(files, {section.id: section.live for section in sections if section.live})
    # Last: whoever finds the page finds its files too.
    Path(page).write_text(template.render(shown, glossary=words, data=data))


def _parts(results, threads):
    """Return the parts of the page that have sections, which are drawn side by side."""
    modules, sections = _modules(results), {id: () for id in PARTS}
    # The same on every machine: the last bits of a product depend on how many threads BLAS uses.
    with parallel_config("loky", n_jobs=threads, inner_max_num_threads=1):
        drawn = Parallel(return_as="generator", batch_size=1)(delayed(_drawn)(of.section, results) for of in modules)
        drawn = tqdm(drawn, "drawing", len(modules), unit="section", leave=False)
        for module, made in zip(modules, drawn, strict=True):
            sections[module.PLACE[0]] += tuple(made)
    return [Part(id, PARTS[id], of_part) for id, of_part in sections.items() if of_part]


def _modules(results):
    """Return the files of the sections that the page has, those of a part in its order."""
    names = [module.name for module in iter_modules(report.__path__) if module.name.startswith("section_")]
    modules = [import_module(f"isarflow.report.{name}") for name in names]
    return sorted((module for module in modules if getattr(results, module.NEEDS)), key=lambda module: module.PLACE)


def _drawn(maker, results):
    with style():
        made = maker(results)
    return (made,) if isinstance(made, Section) else made


def _spoken(html):
    """Return the words of the glossary that a page has, with their meaning; those of code and of the config aside."""
    text = re.sub(r"<(style|script|pre)\b.*?</\1>", "", html, flags=re.DOTALL)
    return {term: meaning for term, meaning in glossary().items() if re.search(rf"(?<![\w-]){term}(?![\w-])", text)}


def _csv(part):
    """Return the numbers of a figure or table; scores with six decimals, as all of theirs are half of the page."""
    return part.data.round(dict.fromkeys(("value", "low", "high"), 6)).to_csv(index=False)


def embedded(files, live):
    """Return what the page holds, compressed, by its paths with blanks between: many a figure shows what a table lists.

    files: texts by path. live: what scripts read, by name. `text` in page.js gives each to the letter.
    """
    paths, data = {}, {}
    for path, text in files.items():
        paths.setdefault(text, []).append(path)
    for text, same in paths.items():
        if '"' not in text:  # no field holds a comma; by columns it takes half the room
            rows = [line.split(",") for line in text.removesuffix("\n").split("\n")]
            text = "".join(COLUMN + "\n".join(column) for column in zip(*rows, strict=True))
        data[" ".join(same)] = text
    data |= {f"{name}.json": json.dumps(part, separators=(",", ":"), allow_nan=False) for name, part in live.items()}
    # The same bytes every time.
    return {name: base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode() for name, text in data.items()}
