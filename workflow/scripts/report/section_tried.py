"""Everything tried on the open set, beside the reference thesis's method: gains over it, and one table of all."""

import itertools

import numpy as np
import pandas as pd

from learning.experiments import REFERENCE
from report import thesis
from report.layout import BLACK, PALETTE, Section, figure, signed, table
from report.plots import draw_curve, draw_rejecting, finish, panels
from report.vocabulary import (
    F1,
    GAIN,
    METHOD,
    PROTOCOLS,
    at_snrs,
    middle,
    middle_text,
    ranked,
    select,
    split_text,
    title,
)

SOLVED = 0.98  # weighted F1 of the thesis's method from which on there is nothing to gain
BEST = 3  # methods drawn for each split
SHOWN_SNRS = (-12, -6, 0, 6, 12, 24)  # dB, of the table
LEAD, OTHER = PROTOCOLS


def section(results):
    scores, validation = (
        select(table, elevation="all", threshold=PROTOCOLS, metric=[F1, GAIN])
        for table in (results.scores, results.validation)
    )
    ranks, reference = summary(scores, validation), thesis.network(REFERENCE[0], results)
    gains = ranks[f"gain_{LEAD}"].notna().any()
    compared = f" Gains are against {reference}, trained without noise, with ZNCC."
    return Section(
        id="tried",
        title="Everything tried on the open set",
        text=(
            "Every model and confidence score of every open experiment, split by sector first, in the order of its "
            f"mean weighted F1 over {middle_text(scores)} on the validation images with blind thresholds. All numbers "
            f"are of the test images.{compared if gains else ''}",
        ),
        figures=gain_figure(results, scores, ranks, reference),
        tables=(tried_table(results.names, scores, ranks, gains),),
    )


def summary(scores, validation):
    """One row per method, the best first within each split: columns METHOD, validation, mean_<p>, gain_<p>.

    Means over the middle SNRs of weighted F1 and of its gain on the test images under each protocol <p>; validation is
    that of weighted F1 on the validation images under the first of them, which decides what is best. gain_<p> is NaN
    where the thesis's method is not among them.
    """
    rows = select(scores, test_snr_db=middle(scores["test_snr_db"]))
    means = rows.groupby([*METHOD, "metric", "threshold"])["value"].mean().unstack(["metric", "threshold"])
    names = {(F1, protocol): f"mean_{protocol}" for protocol in PROTOCOLS}
    names |= {(GAIN, protocol): f"gain_{protocol}" for protocol in PROTOCOLS}
    means = means.reindex(columns=list(names)).set_axis(list(names.values()), axis="columns").reset_index()
    order = ranked(select(validation, metric=F1, threshold=LEAD)).rename(columns={"value": "validation"})
    return order.merge(means, on=METHOD, validate="one_to_one")


def best(ranks):
    """The rows of the best methods of each split, but the thesis's own; of one in several experiments the best one."""
    model, trained, score = REFERENCE
    others = ranks.drop(select(ranks, model=model, training=trained, score=score).index).dropna(subset=f"gain_{LEAD}")
    return others.drop_duplicates(["split", "model", "training", "score"]).groupby("split").head(BEST)


def judged(curve):
    """The middle SNRs of one method under one protocol at which the thesis's method leaves something to gain.

    curve: columns test_snr_db, f1, gain, low, high (the gain's interval). Rows, with a column above: whether the
    interval lies above 0.
    """
    rows = curve[curve["test_snr_db"].isin(middle(curve["test_snr_db"])) & (curve["f1"] - curve["gain"] < SOLVED)]
    return rows.assign(above=rows["low"] > 0)


def _curve(scores, method, protocol):
    """What `judged` takes, of a row of `summary`."""
    rows = (
        select(scores, threshold=protocol, **{name: method[name] for name in METHOD})
        .set_index("test_snr_db")
        .sort_index()
    )
    gain = select(rows, metric=GAIN)[["value", "low", "high"]].rename(columns={"value": "gain"})
    return gain.assign(f1=select(rows, metric=F1)["value"]).reset_index()


def gain_figure(results, scores, ranks, reference):
    """Weighted F1 of the best methods and of the thesis's, and their difference: a column per split and protocol.

    reference: the thesis's method in words.
    """
    picks = best(ranks)
    if not len(picks):
        return ()
    labels = _labels(results.names, picks)
    looks = zip(itertools.cycle(PALETTE), itertools.cycle("os^Dv<"))
    looks = dict(zip(dict.fromkeys(labels), looks, strict=False))
    columns = list(itertools.product(picks["split"].unique(), PROTOCOLS))
    drawing, grid = panels(2, len(columns), 1 + 2.5 * len(columns), 5.6, sharey="row")
    drawn, counts = [], []
    for (upper, lower), (split, protocol) in zip(grid.T, columns, strict=True):
        upper.set_title(f"{split_text(split)},\n{protocol} thresholds")
        lower.axhline(0, color=BLACK, lw=1)
        theirs = {"color": BLACK, "ls": "--", "label": f"{reference.removeprefix('the ')}, ZNCC"}
        for label, method in zip(labels, picks.to_dict("records"), strict=True):
            if method["split"] != split:
                continue
            curve, (color, marker) = _curve(scores, method, protocol), looks[label]
            rows, snrs = judged(curve), curve["test_snr_db"]
            if theirs:  # the first, which is the best
                upper.plot(snrs, curve["f1"] - curve["gain"], **theirs)
                theirs = {}
                counts.append(f"{split_text(split)}, {protocol} thresholds: {_count(rows)} ({label})")
                draw_rejecting(upper, [results.rejecting[split]])
            draw_curve(upper, curve.assign(value=curve["f1"]), color, marker, band=False, label=label)
            draw_curve(lower, curve.assign(value=curve["gain"]), color, lw=1)
            lower.plot(rows["test_snr_db"], rows["gain"], color=color, marker=marker, ls="")
            drawn.append(curve.assign(threshold=protocol, **{name: method[name] for name in METHOD}))
    grid[1, 0].set_ylabel("gain in weighted F1")
    finish(drawing, grid, ylabel="weighted F1")
    counts = "; ".join(counts)
    alt = (
        f"Open-set weighted F1 of the best methods and of {reference} against test SNR, and their difference. The "
        f"interval of the best one's gain lies above 0 under {counts}."
    )
    caption = (
        f"The {BEST} methods of each split with the largest mean weighted F1 over {middle_text(scores)} on the "
        f"validation images with {LEAD} thresholds, here on the test images, and their gain over {reference} on the "
        "same images, with its 95 % interval from the same resamples. Markers stand at the SNRs of that range at which "
        f"the latter is below {SOLVED:g}. At these, the interval of the best method's gain lies above 0 under {counts}."
    )
    return (figure("best_gain", drawing, pd.concat(drawn), alt, caption, wide=True),)


def _count(rows):
    """At how many of the SNRs that `judged` gives the interval lies above 0, in words."""
    missed = ", ".join(f"{snr:g}" for snr in rows[~rows["above"]]["test_snr_db"])
    return f"at {rows['above'].sum()} of {len(rows)}{f', not at {missed} dB' if missed else ''}"


def _labels(names, picks):
    """A name for each of the rows: the model, the confidence score, and what it was trained at if need be."""
    several = picks.groupby("model")["training"].transform("nunique") > 1
    trained = np.where(several, ", training SNR " + picks["training"], "")
    return [names.method(row.model, row.score) + at for row, at in zip(picks.itertuples(), trained, strict=True)]


def tried_table(names, scores, ranks, gains):
    """Every method, the best first within each split. gains: whether the thesis's method is among them."""
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
            f"mean, {OTHER}": f"{row[f'mean_{OTHER}']:.3f}",
        }
        if gains:
            line |= {"gain": signed(row[f"gain_{LEAD}"]), f"gain, {OTHER}": signed(row[f"gain_{OTHER}"])}
        shown.append(line)
    caption = (
        f"Weighted F1 of the open set with {LEAD} thresholds at some SNRs, and its mean over {middle_text(scores)} "
        f"with {LEAD} and with {OTHER} thresholds, all on the test images; validation mean: the same mean on the "
        "validation images, by which the rows are in order; gain: the mean of what it is more than that of the "
        "network named above, on the same test images. The CSV file holds all SNRs, both protocols and the 95 % "
        "intervals."
    )
    return table("tried", scores, shown, caption)
