"""Targets whose place and motion are not known: weighted F1 against displacement and drift."""

import pandas as pd

from isarflow.imaging.geometry import planned
from isarflow.report.conditions import conditions
from isarflow.report.layout import PALETTE, Section, figure
from isarflow.report.plots import finish, panels
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import F1, LEAD, select

PLACE, NEEDS = ("recognition", 3), "moved"  # on the page, see page.py
SNRS = (0, 12)  # dB
AXES = {"place": "largest displacement / resolution cells", "drift": "largest drift / wavelengths"}

LINE = ["alike", "model", "score"]
# What experiments of one line have in common.
ALIKE = "split", "elevation", "channels", "upsample", "snrs", "random_snr", "without"


def section(results):
    rows = limited(results)
    drawing, grid = panels(1, 2, 7, 3.4, sharex=False)
    cell = planned(results.settings)["range_resolution"]
    methods = rows[LINE].drop_duplicates().itertuples(index=False)
    for color, method in zip(PALETTE, methods, strict=False):
        named = select(rows, **method._asdict())
        for style, snr in zip(("--", "-"), sorted({nearest(rows["test_snr_db"], aim) for aim in SNRS}), strict=False):
            for axes, name in zip(grid.flat, AXES, strict=True):
                line = along(select(named, test_snr_db=snr), name)
                label = f"{results.names.method(method.model, method.score)}, {snr:g} dB"
                at = line[name] / (cell if name == "place" else 1)
                axes.plot(at, line["value"], f"o{style}", color=color, ms=4, label=label)
                axes.set_xlabel(AXES[name])
    finish(drawing, grid, "", "weighted F1")
    caption = (
        "Weighted F1 of the open set against the limits of what the radar does not know: left of the place, in range "
        f"and in cross-range, in cells of {cell:.3f} m; right of the drift, a quadratic range error, with the largest "
        f"place that has one.{conditions(results, rows)}"
    )
    text = "On a turntable the target's place is known. Here each noisy image is drawn with errors of its own."
    return Section("motion", "Targets that move", (text,), (figure("motion", drawing, rows, caption, True),))


def limited(results):
    """Return the rows of weighted F1 of experiments that differ from a moved one in their motion alone.

    Columns are added: AXES, the largest of each limit, and `alike`, the same for experiments of one line.
    """
    runs = {run["experiment"]: run for run in results.runs.values()}
    every = [
        {"experiment": name, **dict.fromkeys(AXES, 0.0), **limits, "alike": repr([run[key] for key in ALIKE])}
        for name, run in runs.items()
        if {*(limits := run["motion"].get("limits", {}))} <= {*AXES}
    ]
    rows = results.names.by_main_score(select(results.scores, metric=F1, threshold=LEAD, elevation="all"))
    rows = rows.merge(pd.DataFrame(every), on="experiment")
    moved = rows[rows[[*AXES]].any(axis=1)]
    return rows.merge(moved[LINE].drop_duplicates(), on=LINE)


def along(rows, name):
    """Return a line's rows in the order of a limit: in which it alone is not known, or, of drift, the place too."""
    if name == "drift":
        rows = rows[rows["place"] == rows.loc[rows["drift"] > 0, "place"].max()]
    else:
        rows = rows[rows["drift"] == 0]
    return rows.drop_duplicates(name).sort_values(name)
