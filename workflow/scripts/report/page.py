"""Put the page together: one self-contained HTML file, and its figures (SVG) and tables (CSV) beside it."""

from pathlib import Path

import jinja2
from markupsafe import Markup

from report import (
    section_capsule,
    section_explore,
    section_headline,
    section_images,
    section_learning,
    section_mesh,
    section_open,
    section_run,
    section_scattering,
    section_split,
    section_times,
    section_tried,
)
from report.layout import style
from report.results import Results

HERE = Path(__file__).parent


def write_report(folder, settings, stated, page, figures, tables):
    """Write the report of the results in `folder` (results/<name>).

    settings: the config's sections. stated: what the models' files say of themselves (see `vocabulary.Names`). page:
    the HTML file; figures, tables: the folders for one SVG per figure and one CSV per figure or table. All three have
    the same content for the same inputs, but for the code's commit and package versions that the page names.
    """
    results = Results(folder, settings, stated)
    with style():
        parts = _parts(results)
    write_page(f"Radar target recognition: {settings['name']}", parts, page, figures, tables)


def write_page(title, parts, page, figures, tables):
    """Write a page of these parts, all that the template shows by its names for them; the rest as in `write_report`."""
    parts = {"headline": None, "comparison": None, "explorer": None} | parts
    html = _environment().get_template("template.html").render(title=title, **parts)
    drawn = [*parts["thumbnails"].values(), *([parts["headline"]] if parts["headline"] else [])]
    drawn += [figure for section in parts["sections"] for figure in section.figures]
    listed = [table for section in parts["sections"] for table in section.tables]
    print(f"writing {len(parts['sections'])} sections, {len(drawn)} figures and {len(listed)} tables")
    _write_files(drawn, listed, Path(figures), Path(tables))
    # Last: whoever finds the page finds its files too.
    Path(page).parent.mkdir(parents=True, exist_ok=True)
    Path(page).write_text(html)


def _parts(results):
    """All that the template shows, by the names that it has there."""
    print("drawing meshes and scattering")
    thumbnails = {name: section_run.thumbnail(name, surface) for name, surface in results.surfaces.items()}
    sections = [section_mesh.section(results), section_scattering.section(results)]
    if results.images_are_made:
        print("drawing images")
        sections.append(section_images.section(results))
    if results.learns:
        print("drawing what was learned")
        sections.append(section_learning.section(results))
        if results.opened:
            opened = section_open.section(results), *section_capsule.section(results), section_tried.section(results)
            sections += opened
        sections += [*section_split.section(results), section_times.section(results)]
    return {
        "facts": section_run.facts(results),
        "warnings": section_run.warned(results),
        "thumbnails": thumbnails,
        "targets": section_run.cards(results, thumbnails),
        "headline": section_headline.headline(results) if results.learns else None,
        "comparison": section_headline.comparison(results) if results.learns else None,
        "explorer": section_explore.explorer(results) if results.images_are_made else None,
        "sections": [*sections, section_run.section(results)],
    }


def _environment():
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals["zip"] = zip
    # Not escaped: they are ours, and quotes are part of them.
    environment.globals["stylesheet"] = Markup((HERE / "style.css").read_text())
    environment.globals["scripts"] = {path.name: Markup(path.read_text()) for path in HERE.glob("*.js")}
    return environment


def _write_files(drawn, listed, figures, tables):
    for parts in (drawn, listed):
        assert len({part.name for part in parts}) == len(parts), "two of one name"
    for folder in (figures, tables):
        folder.mkdir(parents=True, exist_ok=True)
    for figure in drawn:
        (figures / f"{figure.name}.svg").write_bytes(figure.svg)
        figure.data.to_csv(tables / f"figure_{figure.name}.csv", index=False)
    for table in listed:
        table.data.to_csv(tables / f"{table.name}.csv", index=False)
