"""The radar cross-section (RCS) of a run's targets: a CSV file of each, and one page for all."""

import numpy as np

from isarflow.report import rcs_compare, rcs_figures, section_run
from isarflow.report.layout import Section, style
from isarflow.report.page import Part, write_page
from isarflow.report.results import Results

RECEIVER = {"receiver_elevation": "receiver_elevation_deg", "receiver_azimuth": "receiver_azimuth_deg"}
COLUMNS = ("frequency_hz", "elevation_deg", "azimuth_deg", "polarization", "rcs_dbsm", "phase_deg")
CURVES = 5  # cuts in one plot at most
PERCENTS = (5, 25, 50, 75, 95)
BISTATIC = "Bistatic: each figure is over the receivers, its name has the transmitter's elevation and azimuth."


def write_rcs(folder, settings, page, tables, parts):
    """Write RCS of the targets in `folder` (results/<name>), whose config's sections are `settings`.

    page: the HTML file; tables: {target: CSV file}; parts: folders of the page's figures and tables.
    """
    results = Results(folder, settings, {"models": {}, "scores": {}})
    for name, path in tables.items():
        as_table(results.scattering(name)).to_csv(path, index=False, float_format="%.9g")
        print(f"{path}: RCS of {name}")
    with style():
        targets, sections = section_run.cards(results), [_section(results, name) for name in results.targets]
    made = Part("run", "The run", (section_run.section(results),))
    shown = {
        "facts": section_run.facts(results),
        "warnings": section_run.warned(results),
        "targets": targets,
        "parts": (Part("rcs", "Radar cross-section", tuple(sections)), made),
    }
    write_page(f"Radar cross-section: {settings['name']}", settings["name"], shown, page, *parts)


def as_table(dataset):
    """Return a store as a table of COLUMNS, a row for each polarization, frequency and direction.

    A bistatic one has the columns of RECEIVER besides, and a row for each receiver.
    """
    names = {"frequency": "frequency_hz", "elevation": "elevation_deg", "azimuth": "azimuth_deg"} | RECEIVER
    frame = dataset.field.to_dataframe().reset_index().rename(columns=names)
    field = frame["field"].to_numpy()
    frame["rcs_dbsm"], frame["phase_deg"] = rcs_figures.rcs_dbsm(field), np.degrees(np.angle(field))
    return frame[[*COLUMNS[:3], *(name for name in RECEIVER.values() if name in frame), *COLUMNS[3:]]]


def _section(results, name):
    dataset, reach = results.scattering(name).load(), results.reach(name)
    figures, tables, text = [], [_percentiles(name, dataset)], [BISTATIC] if "receiver" in dataset.sizes else []
    if reference := results.settings["targets"][name].get("reference"):
        compared = rcs_compare.compare(reference, dataset, reach)
        figures.append(rcs_compare.compare_figure(name, compared))
        tables.insert(0, rcs_compare.compare_table(name, compared))
    for title, part in rcs_figures.by_transmitter(name, dataset, CURVES):
        figures.append(rcs_figures.cut_figure(title, part, reach, CURVES))
        figures.append(rcs_figures.cut_figure(title, part, reach, CURVES, polar=True, name="rcs_polar"))
        figures += [rcs_figures.map_figure(title, part), rcs_figures.frequency_figure(title, part, CURVES)]
    text.append(f"Every sample with its phase: {name}.csv beside this page.")
    return Section(f"rcs-{name}", name, tuple(text), tuple(filter(None, figures)), tuple(tables))


def _percentiles(name, dataset):
    """Return percentiles and mean of RCS over all directions, for each polarization and frequency."""

    def measures(part):
        level = part["rcs_dbsm"].to_numpy()
        found = dict(zip([f"p{p}_dbsm" for p in PERCENTS], np.percentile(level, PERCENTS), strict=True))
        return found | {"mean_dbsm": 10 * np.log10(np.mean(10 ** (level / 10))), "max_dbsm": level.max()}

    heads = {f"{p} %": f"{{p{p}_dbsm:.1f}}" for p in PERCENTS}
    heads |= {"mean": "{mean_dbsm:.1f}", "largest": "{max_dbsm:.1f}"}
    caption = f"{name}: percentiles of RCS over all directions, its mean (of m²) and the largest, in dBsm."
    return rcs_figures.measures_table("rcs_percentiles", name, as_table(dataset), measures, heads, caption)
