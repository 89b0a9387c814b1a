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


def section(results):
    rows = limited(results)
    drawing, grid = panels(1, 2, 7, 3.4, sharex=False)
    cell = planned(results.settings)["range_resolution"]
    methods = rows[["split", "model", "score"]].drop_duplicates().itertuples(index=False)
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
        "Weighted F1 of the open set against the limits of what the radar does not know. Left: of the place, in range "
        f"and in cross-range, in cells of {cell:.3f} m, nothing else being unknown. Right: of the drift, a quadratic "
        f"range error, with the largest place that has one. {conditions(results, rows).strip()}"
    )
    text = "On a turntable the target's place is known. Here each noisy image is drawn with errors of its own."
    return Section("motion", "Targets that move", (text,), (figure("motion", drawing, rows, caption, True),))


def limited(results):
    """Return the rows of weighted F1 that are comparable with a moved one, with columns of their limits, AXES."""
    runs = {run["experiment"]: run for run in results.runs.values()}
    limits = {name: run["motion"].get("limits", {}) for name, run in runs.items()}
    rows = results.names.by_main_score(select(results.scores, metric=F1, threshold=LEAD, elevation="all"))
    of = pd.DataFrame([{"experiment": name, **dict.fromkeys(AXES, 0.0), **limit} for name, limit in limits.items()])
    others = of.drop(columns=["experiment", *AXES])
    rows = rows.merge(of[~others.fillna(0).any(axis=1)][["experiment", *AXES]], on="experiment")
    rows = rows.assign(split=rows["split"].str.split(",").str[0])
    moved = rows[rows[[*AXES]].any(axis=1)]
    return rows.merge(moved[["split", "model", "score"]].drop_duplicates(), on=["split", "model", "score"])


def along(rows, name):
    """Return a line's rows in the order of a limit: in which it alone is not known, or, of drift, the place too."""
    if name == "drift":
        rows = rows[rows["place"] == rows.loc[rows["drift"] > 0, "place"].max()]
    else:
        rows = rows[rows["drift"] == 0]
    return rows.drop_duplicates(name).sort_values(name)
