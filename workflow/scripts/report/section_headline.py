"""The headline, weighted F1 of the open and the closed set against SNR, and what the page compares all curves with."""

import re

import pandas as pd
from matplotlib.lines import Line2D

from learning.experiments import CLEAN, REFERENCE
from report import thesis
from report.draw_learning import REJECTING, SPLITS, draw_published, draw_rejecting, split_text, title
from report.layout import BLACK, BLUE, VERMILION, Figure, canvas, model_order, model_style, style, to_svg
from report.section_open import COUNTED, PROTOCOLS, known_scores, rejecting, score_name
from report.section_tried import METHOD, middle_text, validation_means

F1 = "f1_weighted"
# The sets of test images, as the page calls them, and the threshold in scores.csv.
SETS = {**{f"open set, {protocol} thresholds": protocol for protocol in PROTOCOLS}, "closed set": ""}
# What the reference thesis states of its own method in each: model and metric of the published table.
PUBLISHED = {"closed set": ("capsule", "f1"), "open set, thesis thresholds": ("capsule_zncc", "weighted_f1")}
DASHES = dict(zip(SPLITS, ("-", "--"), strict=True))


def f1_rows(scores):
    """The rows of weighted F1 at all elevations and noisy images."""
    return scores[(scores["metric"] == F1) & (scores["elevation"] == "all") & scores["test_snr_db"].notna()]


def of_set(scores, threshold):
    """The rows of one set: of the closed one (threshold '') or of the open one under a protocol."""
    return scores[(scores["threshold"] == threshold) & ((scores["score"] == "") == (threshold == ""))]


def sets_of(results):
    """(name, rows of weighted F1, the same on validation images) of each set that was tested."""
    scores, validation = f1_rows(results.scores), f1_rows(results.validation)
    parts = [(name, of_set(scores, threshold), of_set(validation, threshold)) for name, threshold in SETS.items()]
    return [part for part in parts if len(part[1])]


def headline(results):
    """The best method of this run and the reference thesis's, in the open and in the closed set."""
    parts, network = sets_of(results), thesis.network(REFERENCE[0], results.settings)
    drawn, said, shifts, marked = [], [], {}, False
    with style():
        figure = canvas(5.9, 3.1 * (len(parts) // 2 + 1))
        grid = figure.subplots(len(parts) // 2 + 1, 2, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat[len(parts) :]:
            axes.set_axis_off()
        for axes, (name, part, validation) in zip(grid.flat, parts, strict=False):
            lines = curves(part, validation, network)
            for _, curve, look in lines:
                axes.plot(curve["test_snr_db"], curve["value"], **look)
                axes.fill_between(
                    curve["test_snr_db"], curve["low"], curve["high"], color=look["color"], alpha=0.15, lw=0
                )
            drawn += [curve.assign(set=name, curve=label) for label, curve, _ in lines]
            if SETS[name]:
                draw_rejecting(axes, [rejecting(results)[split] for split in part["split"].unique()])
            published = _published(results, name)
            if published is not None and any(look["color"] == VERMILION for _, _, look in lines):
                draw_published(axes, published, VERMILION)
                shifts[name.partition(",")[0]] = thesis.offset(results, COUNTED[SETS[name] != ""])
                marked = marked or len(published) > 0
            best = next((curve for _, curve, look in lines if look["color"] == BLUE), None)
            named = f"\nbest: {method_name(*best[['model', 'score']].iloc[0])}" if best is not None else ""
            axes.set_title(f"{name}{named}")
            axes.tick_params(labelbottom=True)
            axes.set_xlabel("test SNR [dB]")
            said.append(f"{name.capitalize()}, {_values(lines)}")
        for axes in grid[:, 0]:
            axes.set_ylabel("weighted F1")
        grid[0, 0].set_ylim(top=1.03)  # of all panels
        _legend(grid.flat[-1], drawn, network, marked)
        svg = to_svg(figure)
    return Figure(
        name="headline",
        svg=svg,
        data=pd.concat(drawn),
        alt=f"Weighted F1 against test SNR. {'; '.join(said)}.",
        caption=(
            f"Weighted F1 on the test images, with 95 % intervals, of the method that is best on the validation images "
            f"by its mean over {middle_text(part)}{_theirs(drawn, network)}. {'. '.join(said)}."
            f"{_splits(pd.concat(drawn))}{thesis.marked(shifts, marked, network=True)}"
        ),
        wide=True,
    )


def _theirs(drawn, network):
    """What the red curves are, in words."""
    if not any(curve["curve"].iloc[0].startswith(network) for curve in drawn):
        return ""
    return f", in blue, and in red of {network}, trained without noise, with ZNCC"


def _splits(data):
    if data["split"].nunique() < 2:
        return ""
    return " By sector, test azimuths are far from those trained at; at random, they have near copies among them."


def _published(results, name):
    """Published statements on the thesis's method in a set; None for a set that it does not have."""
    if name not in PUBLISHED:
        return None
    model, metric = PUBLISHED[name]
    published = thesis.statements(results, COUNTED[SETS[name] != ""])
    return published[(published["model"] == model) & (published["metric"] == metric)]


def _legend(axes, drawn, network, marked):
    """What colours, dashes and markers mean, in a panel of its own."""
    data = pd.concat(drawn)
    theirs = any(curve["curve"].iloc[0].startswith(network) for curve in drawn)
    entries = [Line2D([], [], color=BLUE, label="best on validation images")]
    if theirs:
        words = network.removeprefix("the ").replace(" (", "\n(")
        entries.append(Line2D([], [], color=VERMILION, label=f"{words},\nopen set: with ZNCC"))
    for split in SPLITS:
        if split in set(data["split"]):
            entries.append(Line2D([], [], color=BLACK, **_dash(split), label=split_text(split)))
    if data["threshold"].any():
        entries.append(Line2D([], [], **REJECTING))
    if marked:
        words = thesis.FULL_SIZE.replace(", 5", ",\n5")
        entries.append(Line2D([], [], ls="", marker="^", mfc="white", mec=VERMILION, ms=8, mew=1.5, label=words))
    axes.legend(handles=entries, loc="center", fontsize=8, handlelength=2.4, labelspacing=0.9)


def curves(part, validation, network="the capsule network"):
    """What is drawn of one set: (label, rows by SNR, look) of the best method and of the thesis's, by split.

    part: rows of weighted F1 on the test images; validation: on the validation images, by whose mean over the middle
    SNRs the best one is chosen; network: the thesis's, in words.
    """
    means = validation_means(validation)
    model, trained, score = REFERENCE
    theirs = (means["model"] == model) & (means["training"] == trained) & means["score"].isin(["", score])
    splits = [split for split in SPLITS if split in set(part["split"])]
    first = means["split"] == splits[0]
    lines = []
    for row, words, color in (
        *((row, "best: ", BLUE) for row in means[~theirs & first].head(1).itertuples()),
        *((row, "", VERMILION) for row in means[theirs].head(1).itertuples()),
    ):
        same = means[
            (means["model"] == row.model) & (means["training"] == row.training) & (means["score"] == row.score)
        ]
        for split in splits:
            method = same[same["split"] == split].head(1)
            if not len(method):
                continue
            curve = part.merge(method[METHOD], on=METHOD).sort_values("test_snr_db")
            name = method_name(row.model, row.score)
            if color == VERMILION:
                name = f"{network}{f', {score_name(score)}' if row.score else ''}"
            lines.append((f"{words}{name} ({split})", curve, {"color": color, **_dash(split)}))
    return lines


def _dash(split):
    """How the curves of a split are drawn."""
    return {"ls": DASHES[split], "marker": "o" if DASHES[split] == "-" else ""}


def method_name(model, score):
    """A model, and the known score with which it rejects, in words."""
    return f"{model_style(model)[2]}{f', {score_name(score)}' if score else ''}"


def _values(lines):
    """Scores of the curves at the SNR nearest 0 dB and at the highest, in words, by split; sizes stand elsewhere."""
    found = {}
    for label, curve, _ in lines:
        values = curve.set_index("test_snr_db")["value"]
        near = min(values.index, key=abs)
        at = " and ".join(f"{values[snr]:.2f} at {snr:g} dB" for snr in dict.fromkeys((near, values.index.max())))
        name = re.sub(r" \([^)]*\)", "", label).removeprefix("best: ")
        found.setdefault(curve["split"].iloc[0], []).append(f"{name} {at}")
    return "; ".join(f"{split_text(split)}: {', '.join(parts)}" for split, parts in found.items())


def comparison(results):
    """All curves of weighted F1 for the page's own plot: a mapping that is written into it as JSON.

    Each curve has the set it belongs to, its experiment, model and words for both, a colour, whether it stands in the
    headline, whether its known score is its model's best on the validation images, and [SNR, value, low, high] by SNR.
    rejecting: the weighted F1 of rejecting all test images, in each set where one may.
    """
    found, lines = [], {}
    for name, part, validation in sets_of(results):
        shown = {tuple(curve[METHOD].iloc[0]) for _, curve, _ in curves(part, validation)}
        order = known_scores(part["score"])
        # Of each model the best known score: the others are drawn when asked for.
        best = validation_means(validation).drop_duplicates(METHOD[:-1])
        best = set(best[METHOD].itertuples(index=False, name=None))
        if SETS[name]:
            lines[name] = sorted({round(rejecting(results)[split], 4) for split in part["split"]})
        for method, curve in sorted(
            part.groupby(METHOD),
            key=lambda one: (SPLITS.index(one[0][0]), one[0][1], model_order(one[0][2]), order.index(one[0][4])),
        ):
            split, experiment, model, snrs, score = method
            trained = "trained without noise" if snrs == CLEAN else f"training SNR: {snrs}"
            found.append(
                {
                    "set": name,
                    "experiment": title(experiment),
                    "model": model_style(model)[2],
                    "words": f"{method_name(model, score)}: {title(experiment)} ({split}), {trained}",
                    "color": model_style(model)[0],
                    "dashed": DASHES[split] != "-",
                    "shown": method in shown,
                    "best": method in best,
                    "points": curve.sort_values("test_snr_db")[["test_snr_db", "value", "low", "high"]]
                    .round(4)
                    .to_numpy()
                    .tolist(),
                }
            )
    return {"curves": found, "rejecting": lines}
