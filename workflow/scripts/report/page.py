"""Put the page together: one self-contained HTML file, and its figures (SVG) and tables (CSV) beside it."""

import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import jinja2
from joblib import Parallel, delayed, parallel_config
from markupsafe import Markup
from tqdm import tqdm

from isarflow import report
from isarflow.report import section_confusion, section_explore, section_headline, section_run, section_summary
from isarflow.report.embed import embedded
from isarflow.report.glossary import GLOSSARY
from isarflow.report.layout import Section, style
from isarflow.report.results import Results

HERE = Path(__file__).parent
MANY = 2  # sections of a part, above which each folds by itself
LEAD = 150  # letters of a caption that are shown at least
# The parts of the page. A section is a file section_<name>.py here with a function `section` of the Results, which
# gives a Section or several; PLACE, the part that it is in and its place there; NEEDS, what the Results must have.
PARTS = {
    "look": "Look around",
    "fields": "Meshes and fields",
    "imaging": "ISAR images",
    "recognition": "Recognition",
    "run": "The run",
}
# What scripts draw, by the name of its template: the part, what the Results must have, and what makes its data.
LIVE = {
    "explore": ("look", "images_are_made", section_explore.explorer),
    "compare": ("recognition", "learns", section_headline.comparison),
    "matrices": ("recognition", "learns", section_confusion.matrices),
}
SCRIPTS = ("page.js", "imaging.js", "explore.js", "compare.js", "matrices.js")


@dataclass(frozen=True)
class Part:
    """One of the page's foldable parts: live: names of its live pieces (template and script); sections: below them."""

    id: str
    title: str
    live: tuple = ()
    sections: tuple = ()


def write_report(folder, settings, stated, page, figures, tables, threads=1):
    """Write the report of the results in `folder` (results/<name>).

    settings: the config's sections. stated: what the models' files say of themselves (see `vocabulary.Names`). page:
    the HTML file; figures, tables: the folders for one SVG per figure and one CSV per figure or table. All three have
    the same content for the same inputs, but for the code's commit and package versions that the page names. threads:
    how many sections are drawn at a time.
    """
    results = Results(folder, settings, stated)
    title = f"Radar target recognition: {settings['name']}"
    write_page(title, settings["name"], _shown(results, threads), page, figures, tables)


def write_page(title, name, shown, page, figures, tables):
    """Write a page with a title, a run's name, and what the template shows, by name; the rest as in `write_report`."""
    bare = {"summary": (), "checks": (), "headline": None, "full_size": (), "live": {}, "comparison": None}
    shown = bare | shown
    sections = [section for part in shown["parts"] for section in part.sections]
    drawn = [*shown["thumbnails"].values(), *([shown["headline"]] if shown["headline"] else [])]
    drawn += [figure for section in sections for figure in section.figures]
    listed = [*shown["full_size"], *(table for section in sections for table in section.tables)]
    print(f"writing {len(sections)} sections, {len(drawn)} figures and {len(listed)} tables")
    files = _files(drawn, listed)
    _write_files(files, Path(figures), Path(tables))
    data = {paths: Markup(text) for paths, text in embedded(files, shown.pop("live")).items()}
    template, shown = _environment().get_template("template.html"), shown | {"title": title, "name": name}
    said = template.render(**shown, glossary={}, data={}).partition("<script")[0]
    html = template.render(**shown, glossary=_spoken(said), data=data)
    # Last: whoever finds the page finds its files too.
    Path(page).parent.mkdir(parents=True, exist_ok=True)
    Path(page).write_text(html)


def _shown(results, threads):
    """All that the template shows, by the names that it has there."""
    with style():
        thumbnails = {name: section_run.thumbnail(name, surface) for name, surface in results.surfaces.items()}
        headline = section_headline.headline(results) if results.learns else None
    warnings, outline = section_run.warned(results), _outline(results)
    makers = [maker for _, _, live, sections in outline for maker in (*live.values(), *sections)]
    # The same on every machine: the last bits of a product depend on how many threads BLAS uses.
    with parallel_config("loky", n_jobs=threads, inner_max_num_threads=1):
        drawn = Parallel(return_as="generator", batch_size=1)(delayed(_drawn)(maker, results) for maker in makers)
        made = dict(zip(makers, tqdm(drawn, "drawing", len(makers), unit="section", leave=False), strict=True))
    live = {name: made[maker] for _, _, pieces, _ in outline for name, maker in pieces.items()}
    parts = [
        Part(id, title, tuple(pieces), tuple(section for maker in sections for section in made[maker]))
        for id, title, pieces, sections in outline
    ]
    return {
        "summary": section_summary.sentences(results),
        "checks": section_summary.checks(results, warnings),
        "facts": section_run.facts(results),
        "warnings": warnings,
        "thumbnails": thumbnails,
        "targets": section_run.cards(results, thumbnails),
        "headline": headline,
        "full_size": section_summary.full_size_table(results),
        "live": live,
        "comparison": live.get("compare"),
        "parts": [part for part in parts if part.live or part.sections],
    }


def _outline(results):
    """Return of each `Part` its id, its title, what makes its live pieces, by name, and what makes its sections."""
    live = {id: {} for id in PARTS}
    for name, (id, needs, maker) in LIVE.items():
        if getattr(results, needs):
            live[id][name] = maker
    names = [module.name for module in iter_modules(report.__path__) if module.name.startswith("section_")]
    modules = [import_module(f"isarflow.report.{name}") for name in names]
    placed = sorted((module for module in modules if hasattr(module, "PLACE")), key=lambda module: module.PLACE)
    sections = [(module.PLACE[0], module.section) for module in placed if getattr(results, module.NEEDS)]
    return [(id, title, live[id], [section for part, section in sections if part == id]) for id, title in PARTS.items()]


def _drawn(maker, results):
    """What `maker` makes of the results: a live piece as it is, sections as a tuple."""
    with style():
        made = maker(results)
    return (made,) if isinstance(made, Section) else made


def _environment():
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals |= {"zip": zip, "MANY": MANY}
    environment.filters["in_two"] = _in_two
    # Not escaped: they are ours, and quotes are part of them.
    environment.globals["stylesheet"] = Markup((HERE / "style.css").read_text())
    environment.globals["scripts"] = [Markup((HERE / name).read_text()) for name in SCRIPTS]
    return environment


def _spoken(text):
    """The words of the glossary that a page has, with their meaning; those of its style and of the config aside."""
    text = re.sub(r"<(style|pre)\b.*?</\1>", "", text, flags=re.DOTALL)
    return {term: meaning for term, meaning in GLOSSARY.items() if re.search(rf"(?<![\w-]){term}(?![\w-])", text)}


def _in_two(caption):
    """A caption's first sentences, and the rest of a long one, which the page folds away."""
    sentences = caption.split(". ")
    shown = next(n for n in range(1, len(sentences) + 1) if n == len(sentences) or len(". ".join(sentences[:n])) > LEAD)
    rest = ". ".join(sentences[shown:])
    return (caption, "") if len(rest) < LEAD else (f"{'. '.join(sentences[:shown])}.", rest)


def _files(drawn, listed):
    """The content of every file beside the page, by its path from there."""
    for parts in (drawn, listed):
        assert len({part.name for part in parts}) == len(parts), "two of one name"
    files = {f"figures/{figure.name}.svg": figure.svg for figure in drawn}
    files |= {f"tables/figure_{figure.name}.csv": _csv(figure) for figure in drawn}
    return files | {f"tables/{table.name}.csv": _csv(table) for table in listed}


def _csv(part):
    """The numbers of a figure or table; scores with six decimals, as all of theirs are half of the page."""
    return part.data.round(dict.fromkeys(("value", "low", "high"), 6)).to_csv(index=False)


def _write_files(files, figures, tables):
    for folder in (figures, tables):
        folder.mkdir(parents=True, exist_ok=True)
    for path, content in files.items():
        kind, name = path.split("/")
        content = content if isinstance(content, bytes) else content.encode()
        ({"figures": figures, "tables": tables}[kind] / name).write_bytes(content)
