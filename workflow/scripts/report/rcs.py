"""The radar cross-section (RCS) of a run's targets: a CSV file of each, and one page for all."""

import numpy as np
import pandas as pd

from isarflow.report import rcs_compare, rcs_figures, section_run
from isarflow.report.layout import Section, style, table
from isarflow.report.page import Part, write_page
from isarflow.report.rcs_figures import rcs_dbsm
from isarflow.report.results import Results

RECEIVER = {"receiver_elevation": "receiver_elevation_deg", "receiver_azimuth": "receiver_azimuth_deg"}
COLUMNS = ("frequency_hz", "elevation_deg", "azimuth_deg", "polarization", "rcs_dbsm", "phase_deg")
CURVES = 5  # cuts in one plot at most
PERCENTS = (5, 25, 50, 75, 95)


def write_rcs(folder, settings, page, tables, parts):
    """Write RCS of the targets in `folder` (results/<name>), whose config's sections are `settings`.

    page: the HTML file; tables: {target: CSV file}; parts: folders of the page's figures and tables.
    """
    results = Results(folder, settings, {"models": {}, "scores": {}})
    for name, path in tables.items():
        as_table(results.scattering(name)).to_csv(path, index=False, float_format="%.9g")
        print(f"{path}: RCS of {name}")
    with style():
        thumbnails = {name: section_run.thumbnail(name, surface) for name, surface in results.surfaces.items()}
        sections = [_section(results, name) for name in results.targets]
    parts_of_page = (
        Part("rcs", "Radar cross-section", sections=tuple(sections)),
        Part("run", "The run", sections=(section_run.section(results),)),
    )
    shown = {
        "facts": [pair for pair in section_run.facts(results) if pair[0] in ("Run", "Radar", "Aspect", "Made with")],
        "warnings": section_run.meshes_warned(results),
        "thumbnails": thumbnails,
        "targets": section_run.cards(results, thumbnails),
        "parts": parts_of_page,
    }
    write_page(f"Radar cross-section: {settings['name']}", settings["name"], shown, page, *parts)


def as_table(dataset):
    """A store as a table of COLUMNS, a row for each polarization, frequency and direction.

    A bistatic one has the columns of RECEIVER besides, and a row for each receiver.
    """
    names = {"frequency": "frequency_hz", "elevation": "elevation_deg", "azimuth": "azimuth_deg"} | RECEIVER
    frame = dataset.field.to_dataframe().reset_index().rename(columns=names)
    field = frame["field"].to_numpy()
    frame["rcs_dbsm"], frame["phase_deg"] = rcs_dbsm(field), np.degrees(np.angle(field))
    return frame[[*COLUMNS[:3], *(name for name in RECEIVER.values() if name in frame), *COLUMNS[3:]]]


def _section(results, name):
    dataset = results.scattering(name).load()
    reach = results.reach(name)
    figures, text = [], []
    for title, part in rcs_figures.by_transmitter(name, dataset, CURVES):
        figures += [
            rcs_figures.cut_figure(title, part, reach, CURVES),
            rcs_figures.polar_figure(title, part, reach, CURVES),
            rcs_figures.map_figure(title, part),
            rcs_figures.frequency_figure(title, part, CURVES),
        ]
    figures.append(rcs_figures.distribution_figure(name, dataset))
    tables = [_percentiles(name, dataset)]
    if "receiver" in dataset.sizes:
        text.append(
            "Bistatic: each figure is over the receivers, its name has the transmitter's elevation and azimuth."
        )
    reference = results.settings["targets"][name].get("reference")
    if reference is not None:
        compared = rcs_compare.compare(reference, dataset, reach)
        figures.insert(0, rcs_compare.compare_figure(name, compared))
        tables.insert(0, rcs_compare.compare_table(name, compared))
        text.append(rcs_compare.sentence(name, compared, reference))
    return Section(
        id=f"rcs-{name}",
        title=name,
        text=(*text, f"Every sample with its phase: {name}.csv beside this page."),
        figures=tuple(figure for figure in figures if figure is not None),
        tables=tuple(tables),
    )


def _percentiles(name, dataset):
    """Percentiles and mean of RCS over all directions, for each polarization and frequency."""
    level = rcs_dbsm(dataset.field.values).reshape(*dataset.field.shape[:2], -1)
    rows = []
    for polarization, of_frequencies in zip(dataset.polarization.values, level, strict=True):
        for frequency, values in zip(dataset.frequency.values, of_frequencies, strict=True):
            percentiles = dict(
                zip([f"p{p}_dbsm" for p in PERCENTS], np.percentile(values, PERCENTS).tolist(), strict=True)
            )
            mean = 10 * np.log10(np.mean(10 ** (values / 10)))
            row = {"target": name, "polarization": polarization, "frequency_hz": frequency}
            rows.append(row | percentiles | {"mean_dbsm": mean, "max_dbsm": values.max()})
    shown = {"polarization": "{polarization}", "frequency": lambda row: f"{row['frequency_hz'] / 1e9:.4g} GHz"}
    shown |= {f"{p} %": f"{{p{p}_dbsm:.1f}}" for p in PERCENTS}
    shown |= {"mean": "{mean_dbsm:.1f}", "largest": "{max_dbsm:.1f}"}
    caption = f"{name}: percentiles of RCS over all directions, its mean (of m²) and the largest, in dBsm."
    return table(f"rcs_percentiles_{name}", pd.DataFrame(rows), shown, caption)
