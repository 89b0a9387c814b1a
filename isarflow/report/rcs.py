"""The radar cross-section (RCS) of a run's targets: a CSV file of each, and one page for all."""

from pathlib import Path

from isarflow.report import rcs_figures, section_run
from isarflow.report.layout import Section, figure, style, table
from isarflow.report.page import Part, write_page
from isarflow.report.results import Results
from isarflow.report.section_scattering import origin
from isarflow.scattering.fields.compared import compare, differences, worst_cut
from isarflow.scattering.fields.cuts import LABELS, Curve, by_transmitter, in_words
from isarflow.scattering.fields.rcs import PERCENTS, as_table, percentiles
from isarflow.scattering.fields.reference import WANTED

CURVES = 5  # cuts in one plot at most
BISTATIC = "Bistatic: each figure is over the receivers, its name has the transmitter's elevation and azimuth."


def write_rcs(folder, settings, page):
    """Write RCS of the targets in `folder` (results/<name>), of a config's sections: a page and CSV files beside it."""
    results = Results(folder, settings, {"models": {}, "scores": {}})
    for name in settings["targets"]:
        path = Path(page).with_name(f"{name}.csv")
        as_table(results.scattering(name)).to_csv(path, index=False, float_format="%.9g")
        print(f"{path}: RCS of {name}")
    with style():
        targets, sections = section_run.cards(results), [_section(results, name) for name in results.drawn]
    made = Part("run", "The run", (section_run.section(results),))
    shown = {"facts": list(section_run.facts(results)), "warnings": section_run.warned(results), "targets": targets}
    shown["parts"] = (Part("rcs", "Radar cross-section", tuple(sections)), made)
    write_page(f"Radar cross-section: {settings['name']}", settings["name"], shown, page)


def _section(results, name):
    dataset, reach = results.scattering(name).load(), results.reach(name)
    figures, tables, text = [], [_percentiles(name, dataset)], [BISTATIC] if "receiver" in dataset.sizes else []
    if reference := results.settings["targets"][name].get("reference"):
        compared = compare(reference, dataset, reach)
        figures.append(compare_figure(name, compared))
        tables.insert(0, compare_table(name, compared))
    for title, part in by_transmitter(name, dataset, CURVES):
        figures.append(rcs_figures.cut_figure(title, part, reach, CURVES))
        figures.append(rcs_figures.cut_figure(title, part, reach, CURVES, polar=True, name="rcs_polar"))
        figures += [rcs_figures.map_figure(title, part), rcs_figures.frequency_figure(title, part, CURVES)]
    text.append(origin(name, dataset.attrs, name in results.meshed))
    text.append(f"Every sample with its phase: {name}.csv beside this page.")
    return Section(f"rcs-{name}", name, tuple(text), tuple(filter(None, figures)), tuple(tables))


def _by_frequency(name, data, heads, caption):
    """Return a table of measures at each polarization and frequency. heads: how these are shown, by heading."""
    shown = {"polarization": "{polarization}", "frequency": lambda row: in_words("frequency", row["frequency_hz"])}
    return table(name, data, shown | heads, caption)


def _percentiles(target, dataset):
    heads = {f"{p} %": f"{{p{p}_dbsm:.1f}}" for p in PERCENTS}
    heads |= {"mean": "{mean_dbsm:.1f}", "largest": "{max_dbsm:.1f}"}
    caption = f"{target}: percentiles of RCS over all directions, its mean (of m²) and the largest, in dBsm."
    return _by_frequency(f"rcs_percentiles_{target}", percentiles(target, as_table(dataset)), heads, caption)


def compare_table(target, compared):
    heads = {"samples": "{samples}", "mean difference [dB]": "{mean_db:.2f}", "worst [dB]": "{worst_db:.2f}"}
    heads["computed less reference [dB]"] = "{bias_db:+.2f}"
    caption = f"{target}: by how much the computed RCS differs from the reference, without its sign."
    return _by_frequency(f"rcs_compared_{target}", differences(target, compared), heads, caption)


def compare_figure(target, compared):
    """Draw the computed RCS and the reference over it, along the axis with most samples, where they differ most."""
    across, place, part = worst_cut(compared)
    curves = []
    for polarization, rows in part.groupby("polarization"):
        x = rows[across].to_numpy() / (1e9 if across == "frequency_hz" else 1)
        for name, column in {"computed": "computed_dbsm", "reference": "rcs_dbsm"}.items():
            levels = rows[column].to_numpy()
            curves.append(Curve(name, polarization, x, levels, x, levels, name == "computed"))
    at = ", ".join(in_words(WANTED[name], value) for name, value in place.items())
    caption = (
        f"{target} beside {compared.attrs['reference']}: computed, and the reference with its samples, at {at}, where "
        f"they differ most. The CSV holds all samples compared; {compared.attrs['left_out']} more have no level, or no "
        "frequency, direction or polarization of this run."
    )
    drawing = rcs_figures.draw_curves(curves, LABELS[WANTED[across]])
    return figure(f"rcs_compared_{target}", drawing, compared.assign(target=target), caption)
