"""Everything tried on the open set, beside the reference thesis's method: gains over it, and one table of all."""

import itertools

import numpy as np
import pandas as pd

from isarflow.learning.experiments import REFERENCE
from isarflow.report import thesis
from isarflow.report.conditions import conditions
from isarflow.report.layout import BLACK, Section, figure, signed, table
from isarflow.report.plots import draw_curve, draw_rejecting, finish, panels
from isarflow.report.vocabulary import (
    DRAWN,
    F1,
    GAIN,
    METHOD,
    PROTOCOLS,
    at_snrs,
    listed,
    middle,
    middle_text,
    ranked,
    select,
    snr_axis,
    split_text,
    title,
)

SOLVED = 0.98  # weighted F1 of the thesis's method from which on there is nothing to gain
BEST = 3  # methods drawn for each split
SHOWN_SNRS = (-12, -6, 0, 6, 12, 24)  # dB, of the table
LEAD, *OTHERS = PROTOCOLS
DASHES = ((0, (5, 2)), "-.", (0, (3, 1, 1, 1, 1, 1)))  # of the thesis's method by what it is trained at


def section(results):
    scores, validation = (
        select(table, elevation="all", threshold=PROTOCOLS, metric=[F1, GAIN])
        for table in (results.scores, results.validation)
    )
    ranks, reference = summary(scores, validation), thesis.network(REFERENCE[0], results)
    gains = ranks[f"gain_{LEAD}"].notna().any()
    compared = f" Gains are over {reference} with ZNCC, trained at the same SNRs."
    return Section(
        id="tried",
        title="Everything tried on the open set",
        text=(
            "Every model and confidence score of every open experiment, split by split, in the order of its "
            f"mean weighted F1 over {middle_text(scores)} on the validation images with blind thresholds. All numbers "
            f"are of the test images.{compared if gains else ''}{conditions(results, scores)}",
        ),
        figures=gain_figure(results, scores, ranks, reference),
        tables=(tried_table(results.names, scores, ranks, reference if gains else ""),),
    )


def summary(scores, validation):
    """One row per method, the best first within each split: columns METHOD, validation, mean_<p>, gain_<p>.

    Means over the middle SNRs of weighted F1 and of its gain on the test images under each protocol <p>; validation is
    that of weighted F1 on the validation images under the first of them, which decides what is best. gain_<p> is NaN
    where no network of the thesis is trained at the same SNRs.
    """
    rows = select(scores, test_snr_db=middle(scores["test_snr_db"]))
    means = rows.groupby([*METHOD, "metric", "threshold"])["value"].mean().unstack(["metric", "threshold"])
    names = {(F1, protocol): f"mean_{protocol}" for protocol in PROTOCOLS}
    names |= {(GAIN, protocol): f"gain_{protocol}" for protocol in PROTOCOLS}
    means = means.reindex(columns=list(names)).set_axis(list(names.values()), axis="columns").reset_index()
    order = ranked(select(validation, metric=F1, threshold=LEAD)).rename(columns={"value": "validation"})
    return order.merge(means, on=METHOD, validate="one_to_one")


def best(ranks):
    """The rows of the best methods of each split that have a gain, but the thesis's own; of one in several experiments
    the best one.
    """
    model, _, score = REFERENCE
    others = ranks.drop(select(ranks, model=model, score=score).index).dropna(subset=f"gain_{LEAD}")
    return others.drop_duplicates(["split", "model", "training", "score"]).groupby("split").head(BEST)


def judged(curve):
    """The middle SNRs of one method under one protocol at which the thesis's method leaves something to gain.

    curve: columns test_snr_db, f1, reference (the thesis's), gain, low, high (the gain's interval). Rows, with a column
    above: whether the interval lies above 0.
    """
    rows = curve[curve["test_snr_db"].isin(middle(curve["test_snr_db"])) & (curve["reference"] < SOLVED)]
    return rows.assign(above=rows["low"] > 0)


def _curve(scores, method, protocol):
    """What `judged` takes, of a row of `summary`."""
    rows = select(scores, threshold=protocol, split=method["split"], training=method["training"])
    own = select(rows, **{name: method[name] for name in METHOD}).set_index("test_snr_db").sort_index()
    theirs = select(rows, metric=F1, model=REFERENCE[0], score=REFERENCE[2])
    theirs = select(theirs, experiment=theirs["experiment"].min()).set_index("test_snr_db")
    gain = select(own, metric=GAIN)[["value", "low", "high"]].rename(columns={"value": "gain"})
    return gain.assign(f1=select(own, metric=F1)["value"], reference=theirs["value"]).reset_index()


def gain_figure(results, scores, ranks, reference):
    """Weighted F1 of the best methods and of the thesis's, and their difference: a column per split and protocol.

    reference: the thesis's method in words.
    """
    picks = best(ranks)
    if not len(picks):
        return ()
    labels = _labels(results.names, picks)
    markers = dict(zip(dict.fromkeys(labels), itertools.cycle("os^Dv<"), strict=False))
    theirs_color = results.names.model(REFERENCE[0]).color
    dashes = dict(zip(picks["training"].unique(), itertools.cycle(DASHES), strict=False))
    methods = list(zip(labels, picks.to_dict("records"), strict=True))
    columns = list(itertools.product(picks["split"].unique(), DRAWN))
    drawing, grid = panels(2, len(columns), 1 + 2.5 * len(columns), 5.6, sharey="row")
    drawn, counts = [], []
    for (upper, lower), (split, protocol) in zip(grid.T, columns, strict=True):
        upper.set_title(f"{split_text(split)},\n{protocol} thresholds")
        lower.axhline(0, color=BLACK, lw=1)
        here = [(label, method) for label, method in methods if method["split"] == split]
        left = {method["training"] for _, method in here}
        curves = [_curve(scores, method, protocol) for _, method in here]
        counts.append(f"{split_text(split)}, {protocol} thresholds: {_count(judged(curves[0]))} ({here[0][0]})")
        draw_rejecting(upper, results.rejecting(method["experiment"] for _, method in here))
        for curve, (label, method) in zip(curves, here, strict=True):
            color, marker = results.names.model(method["model"]).color, markers[label]
            rows, training = judged(curve), method["training"]
            if training in left:  # once in each panel
                left.remove(training)
                theirs = f"{results.names.method(REFERENCE[0], REFERENCE[2])}, training SNR {training}"
                upper.plot(
                    curve["test_snr_db"], curve["reference"], color=theirs_color, ls=dashes[training], label=theirs
                )
            draw_curve(upper, curve.assign(value=curve["f1"]), color, marker, band=False, label=label)
            draw_curve(lower, curve.assign(value=curve["gain"]), color, lw=1)
            lower.plot(rows["test_snr_db"], rows["gain"], color=color, marker=marker, ls="")
            drawn.append(curve.assign(threshold=protocol, **{name: method[name] for name in METHOD}))
    grid[1, 0].set_ylabel("gain in weighted F1")
    finish(drawing, grid, snr_axis(results.definition), "weighted F1")
    counts, data = "; ".join(counts), pd.concat(drawn)
    alt = (
        f"Open-set weighted F1 of the best methods and of {reference} against test SNR, and their difference. The "
        f"interval of the best one's gain lies above 0 under {counts}."
    )
    caption = (
        f"The {BEST} methods of each split with the largest mean weighted F1 over {middle_text(scores)} on the "
        f"validation images with {LEAD} thresholds, of those at whose training SNRs {reference} is trained, too: here "
        "on the test images, and their gain over that network, with ZNCC, on the folds that both have, with its 95 % "
        "interval from the same resamples. Markers stand at the SNRs of that range at which the latter is below "
        f"{SOLVED:g}. At how many of these the interval of the best method's gain lies above 0: {counts}."
        f"{conditions(results, data)}"
    )
    return (figure("best_gain", drawing, data, alt, caption, wide=True),)


def _count(rows):
    """At how many of the SNRs that `judged` gives the interval lies above 0, in words."""
    if len(rows) and rows["low"].isna().all():
        return "at none, as one fold has no interval"
    missed = ", ".join(f"{snr:g}" for snr in rows[~rows["above"]]["test_snr_db"]) if rows["above"].any() else ""
    return f"at {rows['above'].sum()} of {len(rows)}{f', not at {missed} dB' if missed else ''}"


def _labels(names, picks):
    """A name for each of the rows: the model, the confidence score, and what it was trained at if need be."""
    several = picks.groupby("model")["training"].transform("nunique") > 1
    trained = np.where(several, ", training SNR " + picks["training"], "")
    return [names.method(row.model, row.score) + at for row, at in zip(picks.itertuples(), trained, strict=True)]


def tried_table(names, scores, ranks, reference):
    """Every method, the best first within each split.

    reference: the network in words that gains are over; empty where there are none.
    """
    curves = dict(list(select(scores, metric=F1, threshold=LEAD).groupby(METHOD)))
    snrs = sorted(set(scores["test_snr_db"]))
    near = sorted({min(snrs, key=lambda snr: abs(snr - aim)) for aim in SHOWN_SNRS})
    shown = []
    for row in ranks.to_dict("records"):
        line = {
            "split": row["split"],
            "experiment": title(row["experiment"]),
            "model": names.model(row["model"]).label,
            "training SNR": row["training"],
            "confidence score": names.score(row["score"]).label,
            "validation mean": f"{row['validation']:.3f}",
            **at_snrs(curves[tuple(row[name] for name in METHOD)], near, lambda row: f"{row['value']:.3f}"),
            "mean": f"{row[f'mean_{LEAD}']:.3f}",
            **{f"mean, {other}": f"{row[f'mean_{other}']:.3f}" for other in OTHERS},
        }
        if reference:
            line["gain"] = signed(row[f"gain_{LEAD}"])
            line |= {f"gain, {other}": signed(row[f"gain_{other}"]) for other in OTHERS}
        shown.append(line)
    gain = f"; gain: the mean of what it is more than that of {reference} trained at the same SNRs, with ZNCC"
    caption = (
        f"Weighted F1 of the open set with {LEAD} thresholds at some SNRs, and its mean over {middle_text(scores)} "
        f"with {listed(PROTOCOLS)} thresholds, all on the test images; validation mean: the same mean on the "
        f"validation images, by which the rows are in order{gain if reference else ''}. The CSV file holds all SNRs, "
        "all protocols and the 95 % intervals."
    )
    return table("tried", scores, shown, caption)
