"""The headline, weighted F1 of the open and the closed set against SNR, and what the page compares all curves with."""

import itertools

import pandas as pd
from matplotlib.lines import Line2D

from isarflow.learning.experiments import CLEAN, REFERENCE
from isarflow.report import thesis
from isarflow.report.conditions import conditions, meaning
from isarflow.report.layout import BLACK, figure
from isarflow.report.plots import draw_curve, draw_published, draw_rejecting, finish, panels
from isarflow.report.published import FULL_SIZE, beside
from isarflow.report.vocabulary import (
    DRAWN,
    F1,
    METHOD,
    PROTOCOLS,
    SPLITS,
    middle_text,
    ranked,
    select,
    snr_axis,
    split_text,
    title,
)

# The sets of test images, as the page calls them, and the threshold in scores.csv.
SETS = {**{f"open set, {protocol} thresholds": protocol for protocol in PROTOCOLS}, "closed set": ""}
# What the reference thesis states of its own method in each: model and metric of the published table.
PUBLISHED = {"closed set": ("capsule", "f1"), "open set, thesis thresholds": ("capsule_zncc", "weighted_f1")}
THESIS_PROTOCOL = {"ls": (0, (4, 2)), "lw": 1}
DASHES = {"solid": "", "dashed": "6 4", "dash-dotted": "8 3 2 3"}  # of curves by split, as SVG has them


def sets_of(tables):
    """(name, rows of weighted F1, the same on validation images) of each set that was tested.

    tables: whatever has `scores` and `validation`, as `Results`.
    """
    for name, threshold in SETS.items():
        scores, validation = (
            select(table, metric=F1, elevation="all", threshold=threshold)
            for table in (tables.scores, tables.validation)
        )
        if len(scores):
            yield name, scores, validation


def lead(tables, names, network):
    """The curves of the best method and of the thesis's: rows by SNR with columns set, curve and theirs.

    network: the thesis's, in words; theirs: whether the curve is its.
    """
    return pd.concat(
        curve.assign(set=name, curve=label, theirs=theirs)
        for name, part, validation in sets_of(tables)
        if SETS[name] in ("", *DRAWN)
        for label, curve, theirs in curves(part, validation, names, network)
    )


def headline(results):
    """The best method of this run and the reference thesis's: a row for open and closed set, a column per split."""
    network = thesis.network(REFERENCE[0], results)
    drawn = lead(results, results.names, network)
    red = list(drawn[drawn["theirs"]]["set"].unique())
    printed = [
        select(results.published_scores, model=model, metric=metric).assign(set=name)
        for name, (model, metric) in PUBLISHED.items()
        if name in red
    ]
    statements = pd.concat(printed or [results.published_scores.iloc[:0].assign(set="")])
    drawn, statements, definition, words = beside(results, drawn, statements, FULL_SIZE)
    splits = [split for split in SPLITS if split in set(drawn["split"])]
    rows = [row for row in ("open set", "closed set") if drawn["set"].str.startswith(row).any()]
    drawing, grid = panels(len(rows), len(splits), 0.9 + 2.9 * len(splits), 1.1 + 2.0 * len(rows))
    for (row, kind), (column, split) in itertools.product(enumerate(rows), enumerate(splits)):
        axes, here = grid[row, column], select(drawn[drawn["set"].str.startswith(kind)], split=split)
        for (name, _, theirs), curve in here.groupby(["set", "curve", "theirs"], sort=False):
            look = results.names.model(curve["model"].iloc[0])
            dash = THESIS_PROTOCOL if SETS[name] == PROTOCOLS[1] else {}
            label = f"{look.label}, as in the thesis" if theirs else f"best: {look.label}"
            face = {"mfc": "white"} if theirs else {}
            draw_curve(axes, curve, look.color, "s" if theirs else "o", not dash, label=label, **face, **dash)
        level = results.rejecting if kind == "open set" else results.guessing
        draw_rejecting(axes, level(here["experiment"].unique()), label="all rejected, or named alike")
        if split == "random":
            for name in here["set"].unique():
                color = results.names.model(REFERENCE[0]).color
                draw_published(axes, select(statements, set=name), color, "thesis, full size")
        axes.set_title(f"{kind}, {split_text(split)}")
    grid[0, 0].set_ylim(0, 1.03)  # of all panels
    broken = Line2D([], [], color=BLACK, label=f"{PROTOCOLS[1]} thresholds", **THESIS_PROTOCOL)
    finish(drawing, grid, snr_axis(definition), "weighted F1", more=[broken] if "open set" in rows else ())
    whose = f", and, with squares, of {network}, trained without noise, with ZNCC" if red else ""
    broken = "Broken lines: thresholds chosen with images of unknown targets, as in the thesis. "
    caption = (
        f"Weighted F1 on the test images, with 95 % intervals, of the method that is best on the validation images "
        f"by its mean over {middle_text(results.validation)}{whose}. {broken if 'open set' in rows else ''}Dotted: "
        f"rejecting every image, or naming one class for all. {meaning(drawn['split'])}{words}"
        f"{conditions(results, drawn, definition)}"
    )
    alt = f"Weighted F1 against test SNR of the best method{' and of the thesis’s' if red else ''}, by set and split."
    return figure("headline", drawing, drawn, alt, caption, wide=True)


def curves(part, validation, names, network):
    """What is drawn of one set, the best method and the thesis's by split: (label, rows by SNR, whether the thesis's).

    part: rows of weighted F1 on the test images; validation: on the validation images, by whose mean over the middle
    SNRs the best one is chosen; names: of the page; network: the thesis's, in words.
    """
    means = ranked(validation)
    model, trained, score = REFERENCE
    theirs = select(means, model=model, training=trained, score=["", score])
    splits = [split for split in SPLITS if split in set(part["split"])]
    others = select(means.drop(theirs.index), split=splits[0])
    lines = []
    for chosen, is_theirs in ((others.head(1), False), (theirs.head(1), True)):
        for row in chosen.itertuples():
            name = f"best: {names.method(row.model, row.score)}"
            if is_theirs:
                name = f"{network}{f', {names.score(row.score).label}' if row.score else ''}"
            same = select(means, model=row.model, training=row.training, score=row.score)
            for split in splits:
                curve = part.merge(select(same, split=split).head(1)[METHOD], on=METHOD).sort_values("test_snr_db")
                if len(curve):
                    lines.append((f"{name} ({split})", curve, is_theirs))
    return lines


def comparison(results):
    """All curves of weighted F1 for the page's own plot: a mapping that is written into it as JSON.

    Each curve has the set it belongs to, its experiment, model and words for both, a colour, whether it stands in the
    headline, whether its confidence score is its model's best on the validation images, and [SNR, value, low, high] by
    SNR. rejecting: the weighted F1 of rejecting all test images, in each set where one may. axis: its label; lines:
    what a line's dashes say; caption: the conditions under which all hold.
    """
    names, listed, lines, parts = results.names, [], {}, list(sets_of(results))
    used = {run["split"] for run in results.runs.values()}
    dashes = dict(zip([split for split in SPLITS if split in used], DASHES.items(), strict=False))
    for name, part, validation in parts:
        shown = {tuple(curve[METHOD].iloc[0]) for _, curve, _ in curves(part, validation, names, "")}
        # Of each model the best confidence score: the others are drawn when asked for.
        best = set(ranked(validation).drop_duplicates(METHOD[:-1])[METHOD].itertuples(index=False, name=None))
        if SETS[name]:
            lines[name] = [round(value, 4) for value in results.rejecting(part["experiment"].unique())]
        for method, curve in names.groups(part, *METHOD):
            split, experiment, model, snrs, score = method
            trained = "trained without noise" if snrs == CLEAN else f"training SNR: {snrs}"
            points = curve.sort_values("test_snr_db")[["test_snr_db", "value", "low", "high"]].round(4).astype(object)
            listed.append(
                {
                    "set": name,
                    "experiment": title(experiment),
                    "model": names.model(model).label,
                    "words": f"{names.method(model, score)}: {title(experiment)} ({split}), {trained}",
                    "color": names.model(model).color,
                    "dashes": dashes[split][1],
                    "shown": method in shown,
                    "best": method in best,
                    "points": points.where(points.notna(), None).to_numpy().tolist(),  # JSON knows no NaN
                }
            )
    return {
        "curves": listed,
        "rejecting": lines,
        "axis": snr_axis(results.definition),
        "lines": "; ".join(f"{look} lines: {split_text(split)}" for split, (look, _) in dashes.items()),
        "caption": conditions(results, pd.concat(part for _, part, _ in parts)).strip(),
    }
