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
from report.results import REFERENCE, Results

HERE = Path(__file__).parent


def write_report(folder, settings, page, figures, tables, reference=REFERENCE):
    """Write the report of the results in `folder` (results/<name>).

    settings: the config's sections. page: the HTML file; figures, tables: the folders for one SVG per figure and one
    CSV per figure or table. All three have the same content for the same inputs, but for the code's commit and
    package versions that the page names.
    """
    results = Results(folder, settings, reference)
    print("drawing meshes and scattering")
    thumbnails = [section_mesh.thumbnail(name, results.surfaces[name]) for name in results.meshed]
    headline = section_headline.headline(results) if results.learns else None
    sections = [section_mesh.section(results), section_scattering.section(results)]
    if results.images_are_made:
        print("drawing images")
        sections.append(section_images.section(results))
    if results.learns:
        print("drawing what was learned")
        sections.append(section_learning.section(results))
        if section_learning.open_experiments(results.scores):
            sections += [
                section_open.section(results),
                *section_capsule.section(results),
                section_tried.section(results),
            ]
        sections += [*section_split.section(results), section_times.section(results)]
    sections.append(section_run.section(results))

    html = (
        _environment()
        .get_template("template.html")
        .render(
            name=settings["name"],
            facts=section_run.facts(results),
            networks=section_run.networks(settings) if results.learns else [],
            warnings=section_run.warned(results),
            targets=section_run.cards(results, thumbnails),
            headline=headline,
            comparison=section_headline.comparison(results) if results.learns else None,
            explorer=section_explore.explorer(results) if results.images_are_made else None,
            sections=sections,
        )
    )
    drawn = [*thumbnails, *([headline] if headline else []), *(one for part in sections for one in part.figures)]
    listed = [one for part in sections for one in part.tables]
    print(f"writing {len(sections)} sections, {len(drawn)} figures and {len(listed)} tables")
    _write_files(drawn, listed, Path(figures), Path(tables))
    # Last: whoever finds the page finds its files too.
    Path(page).parent.mkdir(parents=True, exist_ok=True)
    Path(page).write_text(html)


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
        assert len({one.name for one in parts}) == len(parts), "two of one name"
    for folder in (figures, tables):
        folder.mkdir(parents=True, exist_ok=True)
    for figure in drawn:
        (figures / f"{figure.name}.svg").write_bytes(figure.svg)
        figure.data.to_csv(tables / f"figure_{figure.name}.csv", index=False)
    for table in listed:
        table.data.to_csv(tables / f"{table.name}.csv", index=False)
