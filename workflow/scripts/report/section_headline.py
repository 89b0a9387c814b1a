"""The headline, weighted F1 of the open and the closed set against SNR, and what the page compares all curves with."""

import re

import pandas as pd
from matplotlib.lines import Line2D

from learning.experiments import CLEAN, REFERENCE
from report import thesis
from report.conditions import conditions, meaning
from report.layout import BLACK, BLUE, VERMILION, figure
from report.plots import REJECTING, draw_curve, draw_published, draw_rejecting, finish, panels
from report.published import FULL_SIZE, beside
from report.vocabulary import F1, METHOD, PROTOCOLS, SPLITS, middle_text, ranked, select, snr_axis, split_text, title

# The sets of test images, as the page calls them, and the threshold in scores.csv.
SETS = {**{f"open set, {protocol} thresholds": protocol for protocol in PROTOCOLS}, "closed set": ""}
# What the reference thesis states of its own method in each: model and metric of the published table.
PUBLISHED = {"closed set": ("capsule", "f1"), "open set, thesis thresholds": ("capsule_zncc", "weighted_f1")}
DASHES = {"sector": {"ls": "-", "marker": "o"}, "random": {"ls": "--", "marker": ""}}


def sets_of(results):
    """(name, rows of weighted F1, the same on validation images) of each set that was tested."""
    for name, threshold in SETS.items():
        scores, validation = (
            select(table, metric=F1, elevation="all", threshold=threshold)
            for table in (results.scores, results.validation)
        )
        if len(scores):
            yield name, scores, validation


def headline(results):
    """The best method of this run and the reference thesis's, in the open and in the closed set."""
    parts, network = list(sets_of(results)), thesis.network(REFERENCE[0], results)
    lines = {name: curves(part, validation, results.names, network) for name, part, validation in parts}
    drawn = pd.concat(curve.assign(set=name, curve=label) for name, every in lines.items() for label, curve, _ in every)
    red = [name for name, every in lines.items() if any(look["color"] == VERMILION for _, _, look in every)]
    printed = [
        select(results.published_scores, model=model, metric=metric).assign(set=name)
        for name, (model, metric) in PUBLISHED.items()
        if name in red
    ]
    statements = pd.concat(printed or [results.published_scores.iloc[:0].assign(set="")])
    drawn, statements, definition, words = beside(results, drawn, statements, FULL_SIZE)
    rows = len(parts) // 2 + 1
    drawing, grid = panels(rows, 2, 5.9, 3.1 * rows)
    said = []
    for axes, (name, every) in zip(grid.flat, lines.items(), strict=False):
        shown = select(drawn, set=name)
        every = [(label, select(shown, curve=label), look) for label, _, look in every]
        for _, curve, look in every:
            draw_curve(axes, curve, **look)
        if SETS[name]:
            draw_rejecting(axes, results.rejecting(shown["experiment"]))
        if name in red:
            draw_published(axes, select(statements, set=name), VERMILION)
        best = [curve.iloc[0] for _, curve, look in every if look["color"] == BLUE]
        named = f"\nbest: {results.names.method(best[0]['model'], best[0]['score'])}" if best else ""
        axes.set_title(f"{name}{named}")
        axes.tick_params(labelbottom=True)
        said.append(f"{name.capitalize()}, {_values(every)}")
    finish(drawing, grid, snr_axis(definition), "weighted F1", legend=False)
    grid[0, 0].set_ylim(top=1.03)  # of all panels
    _legend(grid.flat[-1], drawn, network if red else "", len(statements))
    whose = f", in blue, and in red of {network}, trained without noise, with ZNCC" if red else ""
    caption = (
        f"Weighted F1 on the test images, with 95 % intervals, of the method that is best on the validation images "
        f"by its mean over {middle_text(parts[0][1])}{whose}. {'. '.join(said)}. {meaning(drawn['split'])}{words}"
        f"{conditions(results, drawn, definition)}"
    )
    return figure("headline", drawing, drawn, f"Weighted F1 against test SNR. {'; '.join(said)}.", caption, wide=True)


def _legend(axes, data, network, marked):
    """What colours, dashes and markers mean, in a panel of its own. network: the thesis's in words, if it is drawn."""
    entries = [Line2D([], [], color=BLUE, label="best on validation images")]
    if network:
        words = network.removeprefix("the ").replace(" (", "\n(")
        entries.append(Line2D([], [], color=VERMILION, label=f"{words},\nopen set: with ZNCC"))
    for split in SPLITS:
        if split in set(data["split"]):
            entries.append(Line2D([], [], color=BLACK, **DASHES[split], label=split_text(split)))
    if data["threshold"].any():
        entries.append(Line2D([], [], **REJECTING))
    if marked:
        words = FULL_SIZE.replace(", 5", ",\n5")
        entries.append(Line2D([], [], ls="", marker="^", mfc="white", mec=VERMILION, ms=8, mew=1.5, label=words))
    axes.legend(handles=entries, loc="center", fontsize=8, handlelength=2.4, labelspacing=0.9)


def curves(part, validation, names, network):
    """What is drawn of one set: (label, rows by SNR, look) of the best method and of the thesis's, by split.

    part: rows of weighted F1 on the test images; validation: on the validation images, by whose mean over the middle
    SNRs the best one is chosen; names: of the page; network: the thesis's, in words.
    """
    means = ranked(validation)
    model, trained, score = REFERENCE
    theirs = select(means, model=model, training=trained, score=["", score])
    splits = [split for split in SPLITS if split in set(part["split"])]
    others = select(means.drop(theirs.index), split=splits[0])
    lines = []
    for chosen, color in ((others.head(1), BLUE), (theirs.head(1), VERMILION)):
        for row in chosen.itertuples():
            name = f"best: {names.method(row.model, row.score)}"
            if color == VERMILION:
                name = f"{network}{f', {names.score(row.score).label}' if row.score else ''}"
            same = select(means, model=row.model, training=row.training, score=row.score)
            for split in splits:
                curve = part.merge(select(same, split=split).head(1)[METHOD], on=METHOD).sort_values("test_snr_db")
                if len(curve):
                    lines.append((f"{name} ({split})", curve, {"color": color, **DASHES[split]}))
    return lines


def _values(lines):
    """Scores of the curves at the SNR nearest 0 dB and at the highest, in words, by split; sizes stand elsewhere."""
    words = {}
    for label, curve, _ in lines:
        values, split = curve.set_index("test_snr_db")["value"], curve["split"].iloc[0]
        near = min(values.index, key=abs)
        at = " and ".join(f"{values[snr]:.2f} at {snr:g} dB" for snr in dict.fromkeys((near, values.index.max())))
        name = re.sub(r" \([^)]*\)", "", label).removeprefix("best: ")
        words.setdefault(split, []).append(f"{name} {at}")
    return "; ".join(f"{split_text(split)}: {', '.join(parts)}" for split, parts in words.items())


def comparison(results):
    """All curves of weighted F1 for the page's own plot: a mapping that is written into it as JSON.

    Each curve has the set it belongs to, its experiment, model and words for both, a colour, whether it stands in the
    headline, whether its confidence score is its model's best on the validation images, and [SNR, value, low, high] by
    SNR. rejecting: the weighted F1 of rejecting all test images, in each set where one may. axis: its label; caption:
    the conditions under which all hold.
    """
    names, listed, lines, parts = results.names, [], {}, list(sets_of(results))
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
                    "dashed": split != SPLITS[0],
                    "shown": method in shown,
                    "best": method in best,
                    "points": points.where(points.notna(), None).to_numpy().tolist(),  # JSON knows no NaN
                }
            )
    return {
        "curves": listed,
        "rejecting": lines,
        "axis": snr_axis(results.definition),
        "caption": conditions(results, pd.concat(part for _, part, _ in parts)).strip(),
    }
