"""The headline, weighted F1 of the closed and the open set against SNR, and what the page compares all curves with."""

import pandas as pd

from learning.experiments import CLEAN, REFERENCE
from report.draw_learning import PUBLISHED_MARKERS, draw_published, title
from report.layout import BLUE, VERMILION, Figure, canvas, model_order, model_style, style, to_svg
from report.section_open import PROTOCOLS, known_scores, score_name
from report.section_tried import METHOD, middle, middle_text

F1 = "f1_weighted"
# The sets of test images, as the page calls them, and the threshold in scores.csv.
SETS = {"closed set": "", "open set": "thesis"}
# What the reference thesis states of its own method in each: model and metric of the published table.
PUBLISHED = {"closed set": ("capsule", "f1"), "open set": ("capsule_zncc", "weighted_f1")}


def f1_scores(results):
    """The rows of weighted F1 at all elevations and noisy test images."""
    scores = results.scores
    return scores[(scores["metric"] == F1) & (scores["elevation"] == "all") & scores["test_snr_db"].notna()]


def of_set(scores, threshold):
    """The rows of one set: of the closed one (threshold '') or of the open one under a protocol."""
    return scores[(scores["threshold"] == threshold) & ((scores["score"] == "") == (threshold == ""))]


def headline(results):
    """The best method of this run and the reference thesis's, in the closed and in the open set."""
    scores = f1_scores(results)
    parts = {name: of_set(scores, threshold) for name, threshold in SETS.items()}
    parts = {name: part for name, part in parts.items() if len(part)}
    drawn, said, marked = [], [], False
    with style():
        figure = canvas(5.8, 4.1)
        panels = figure.subplots(1, len(parts), sharex=True, sharey=True, squeeze=False)[0]
        for axes, (name, part) in zip(panels, parts.items(), strict=True):
            lines = curves(part)
            for label, curve, look in lines:
                axes.plot(curve["test_snr_db"], curve["value"], **look, label=label)
                axes.fill_between(
                    curve["test_snr_db"], curve["low"], curve["high"], color=look["color"], alpha=0.15, lw=0
                )
                drawn.append(curve.assign(set=name, curve=label))
            model, metric = PUBLISHED[name]
            published = results.published_scores
            published = published[(published["model"] == model) & (published["metric"] == metric)]
            if any(look["color"] == VERMILION for _, _, look in lines):
                draw_published(axes, published, VERMILION)
                marked = True
            axes.set(title=name, xlabel="test SNR [dB]")
            # Below the panel: each has curves of its own.
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), fontsize=8, handlelength=1.8)
            said.append(f"{name.capitalize()}: {_values(lines)}")
        panels[0].set_ylabel("weighted F1")
        panels[0].set_ylim(top=1.03)  # of all panels
        svg = to_svg(figure)
    data = pd.concat(drawn)
    theirs = " and of the reference thesis's, run here on the same images" if marked else ""
    split = ""
    if data["split"].nunique() > 1:
        split = " Random: test azimuths have near copies among those trained at; sector: they have none."
    return Figure(
        name="headline",
        svg=svg,
        data=data,
        alt=f"Weighted F1 against test SNR. {'; '.join(said)}.",
        caption=(
            f"Weighted F1 of the best method of this run{theirs}, with 95 % intervals. Best is which has the largest "
            f"mean over {middle_text(scores)} on these test images.{split} {'; '.join(said)}."
            f"{PUBLISHED_MARKERS if marked else ''}"
        ),
        wide=True,
    )


def curves(part):
    """What is drawn of one set: (label, rows by SNR, look) of the best method and of the thesis's, by split."""
    means = _means(part).reset_index()
    means = means.sort_values(["value", *METHOD], ascending=[False, *[True] * len(METHOD)])
    model, train, score = REFERENCE
    theirs = (means["model"] == model) & (means["training"] == train) & means["score"].isin(["", score])
    splits = sorted(set(means["split"]))
    best = means[~theirs & (means["split"] == splits[0])].head(1)
    lines = []
    for row, words, color in (
        *((row, "best here: ", BLUE) for row in best.itertuples()),
        *((row, "thesis's: ", VERMILION) for row in means[theirs & (means["split"] == splits[0])].head(1).itertuples()),
    ):
        same = means[
            (means["model"] == row.model) & (means["training"] == row.training) & (means["score"] == row.score)
        ]
        for split, dash in zip(splits, ("-", "--"), strict=False):
            method = same[same["split"] == split].head(1)
            if not len(method):
                continue
            curve = part.merge(method[METHOD], on=METHOD).sort_values("test_snr_db")
            label = f"{words}{method_name(row.model, row.score)} ({split})"
            lines.append((label, curve, {"color": color, "ls": dash, "marker": "o" if dash == "-" else ""}))
    return lines


def _means(part):
    """The mean of each method over the middle SNRs."""
    return part[part["test_snr_db"].isin(middle(part["test_snr_db"]))].groupby(METHOD)["value"].mean()


def method_name(model, score):
    """A model, and the known score with which it rejects, in words."""
    return f"{model_style(model)[2]}{f', {score_name(score)}' if score else ''}"


def _values(lines):
    """Scores of the first split's curves at the middle SNR nearest 0 dB and at the highest, in words."""
    found = []
    for _, curve, look in lines:
        if look["ls"] != "-":
            continue
        snrs = sorted(curve["test_snr_db"])
        near = min(snrs, key=abs)
        values = curve.set_index("test_snr_db")["value"]
        at = " and ".join(f"{values[snr]:.2f} at {snr:g} dB" for snr in dict.fromkeys((near, snrs[-1])))
        found.append(f"{method_name(*curve[['model', 'score']].iloc[0])} {at}")
    return ", ".join(found)


def comparison(results):
    """All curves of weighted F1 for the page's own plot: a mapping that is written into it as JSON.

    Each curve has the set it belongs to, its experiment, model and words for both, a colour, whether it stands in the
    headline, whether it is its model's best there, and [SNR, value, low, high] by SNR.
    """
    scores = f1_scores(results)
    sets = {"closed set": "", **{f"open set, {protocol} protocol": protocol for protocol in PROTOCOLS}}
    found = []
    for name, threshold in sets.items():
        part = of_set(scores, threshold)
        if not len(part):
            continue
        shown = {tuple(curve[METHOD].iloc[0]) for _, curve, _ in curves(part)}
        order = known_scores(part["score"])
        # Of each model the known score with the largest mean: the others are drawn when asked for.
        best = _means(part).unstack("score").idxmax(axis=1)
        for method, curve in sorted(
            part.groupby(METHOD), key=lambda one: (one[0][0], one[0][1], model_order(one[0][2]), order.index(one[0][4]))
        ):
            split, experiment, model, train, score = method
            trained = "trained without noise" if train == CLEAN else f"training SNR: {train}"
            found.append(
                {
                    "set": name,
                    "experiment": title(experiment),
                    "model": model_style(model)[2],
                    "words": f"{method_name(model, score)}: {title(experiment)} ({split}), {trained}",
                    "color": model_style(model)[0],
                    "dashed": split != "random",
                    "shown": method in shown,
                    "best": score == best[split, experiment, model, train],
                    "points": curve.sort_values("test_snr_db")[["test_snr_db", "value", "low", "high"]]
                    .round(4)
                    .to_numpy()
                    .tolist(),
                }
            )
    return {"curves": found}
