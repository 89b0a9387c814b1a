"""Everything tried on the open set, beside the reference thesis's method: gains over it, and one table of all."""

import itertools

import pandas as pd

from isarflow.learning.experiments import REFERENCE
from isarflow.report import thesis
from isarflow.report.conditions import conditions
from isarflow.report.layout import BLACK, Section, figure, signed, table
from isarflow.report.plots import draw_curve, draw_rejecting, finish, panels
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import (
    DRAWN,
    F1,
    GAIN,
    METHOD,
    PROTOCOLS,
    middle,
    middle_text,
    ranked,
    select,
    snr_axis,
    split_text,
    title,
)

PLACE, NEEDS = ("recognition", 4), "opened"  # on the page, see page.py
SOLVED = 0.98  # weighted F1 of the thesis's method from which on there is nothing to gain
BEST = 3  # methods drawn for each split
SHOWN_SNRS = (-12, -6, 0, 6, 12, 24)  # dB, of the table
LEAD = PROTOCOLS[0]
DASHES = ((0, (5, 2)), "-.", (0, (3, 1, 1, 1, 1, 1)))  # of the thesis's method by what it is trained at


def section(results):
    """Return the figure of the best methods' gains, and the table of all methods."""
    scores = select(results.scores, elevation="all", threshold=PROTOCOLS, metric=[F1, GAIN])
    ranks = summary(scores, select(results.validation, elevation="all"))
    text = (
        "Every model and confidence score of every open experiment, split by split, in the order of its mean weighted "
        f"F1 over {middle_text(scores)} on the validation images with {LEAD} thresholds. All numbers are of the test "
        f"images. Gains are over {thesis.network(REFERENCE[0], results)} with ZNCC, trained at the same SNRs."
        f"{conditions(results, scores)}"
    )
    figures, tables = gain_figure(results, scores, ranks), (tried_table(results.names, scores, ranks),)
    return Section("tried", "Everything tried on the open set", (text,), figures, tables)


def summary(scores, validation):
    """Return one row per method, the best first within each split: columns METHOD, validation, mean_<p>, gain_<p>.

    Means over the middle SNRs of weighted F1 and of its gain on the test images under each protocol <p>; validation is
    that of weighted F1 on the validation images under the first of them, which decides what is best. gain_<p> is NaN
    where no network of the thesis is trained at the same SNRs.
    """
    ranks = ranked(select(validation, metric=F1, threshold=LEAD)).rename(columns={"value": "validation"})
    rows = select(scores, test_snr_db=middle(scores["test_snr_db"]))
    for (kind, metric), protocol in itertools.product((("mean", F1), ("gain", GAIN)), PROTOCOLS):
        means = select(rows, metric=metric, threshold=protocol).groupby(METHOD)["value"].mean()
        ranks = ranks.merge(means.rename(f"{kind}_{protocol}"), how="left", on=METHOD)
    return ranks


def best(ranks):
    """Return the rows of the best methods of each split that have a gain, but the thesis's own; each method once."""
    model, _, score = REFERENCE
    others = ranks.drop(select(ranks, model=model, score=score).index).dropna(subset=f"gain_{LEAD}")
    return others.drop_duplicates(["split", "model", "training", "score"]).groupby("split").head(BEST)


def judged(curve):
    """Return the rows of a `_curve` at the middle SNRs at which the thesis's method leaves something to gain."""
    return curve[curve["test_snr_db"].isin(middle(curve["test_snr_db"])) & (curve["reference"] < SOLVED)]


def _curve(scores, method, protocol):
    """Return one method under one protocol by SNR: columns test_snr_db, gain, low, high, f1 and reference.

    f1 and reference are the weighted F1 of the method and of the thesis's; low and high the interval of the gain.
    """
    rows = select(scores, threshold=protocol, split=method["split"], training=method["training"])
    own = select(rows, **{name: method[name] for name in METHOD}).set_index("test_snr_db").sort_index()
    theirs = select(rows, metric=F1, model=REFERENCE[0], score=REFERENCE[2])
    theirs = select(theirs, experiment=theirs["experiment"].min()).set_index("test_snr_db")
    gain = select(own, metric=GAIN)[["value", "low", "high"]].rename(columns={"value": "gain"})
    return gain.assign(f1=select(own, metric=F1)["value"], reference=theirs["value"]).reset_index()


def gain_figure(results, scores, ranks):
    """Draw weighted F1 of the best methods and of the thesis's, and the gain: a column per split and protocol."""
    picks = best(ranks)
    if not len(picks):
        return ()
    names, theirs = results.names, results.names.method(REFERENCE[0], REFERENCE[2])
    several = picks.groupby("model")["training"].transform("nunique") > 1
    trained = (", training SNR " + picks["training"]).where(several, "")
    picks["label"] = [names.method(row.model, row.score) for row in picks.itertuples()] + trained
    markers = dict(zip(picks["label"].unique(), itertools.cycle("os^Dv<"), strict=False))
    dashes = dict(zip(picks["training"].unique(), itertools.cycle(DASHES), strict=False))
    columns = list(itertools.product(picks["split"].unique(), DRAWN))
    drawing, grid = panels(2, len(columns), 1 + 2.5 * len(columns), 5.6, sharey="row")
    drawn = []
    for (upper, lower), (split, protocol) in zip(grid.T, columns, strict=True):
        upper.set_title(f"{split_text(split)},\n{protocol} thresholds")
        lower.axhline(0, color=BLACK, lw=1)
        here = select(picks, split=split)
        draw_rejecting(upper, results.rejecting(here["experiment"]))
        for method in here.to_dict("records"):
            curve, training, label = _curve(scores, method, protocol), method["training"], method["label"]
            look = {"color": names.model(REFERENCE[0]).color, "ls": dashes[training]}
            upper.plot(curve["test_snr_db"], curve["reference"], label=f"{theirs}, training SNR {training}", **look)
            look, rows = {"color": names.model(method["model"]).color, "marker": markers[label]}, judged(curve)
            draw_curve(upper, curve.assign(value=curve["f1"]), **look, band=False, label=label)
            draw_curve(lower, curve.assign(value=curve["gain"]), look["color"], lw=1)
            lower.plot(rows["test_snr_db"], rows["gain"], ls="", **look)
            drawn.append(curve.assign(threshold=protocol, **{name: method[name] for name in METHOD}))
    grid[1, 0].set_ylabel("gain in weighted F1")
    finish(drawing, grid, snr_axis(results.definition), "weighted F1")
    data, reference = pd.concat(drawn), thesis.network(REFERENCE[0], results)
    caption = (
        f"The {BEST} methods of each split with the largest mean weighted F1 over {middle_text(scores)} on the "
        f"validation images with {LEAD} thresholds, of those at whose training SNRs {reference} is trained, too: on "
        "the test images, and their gain over that network, with ZNCC, on the folds that both have, with its 95 % "
        "interval from the same resamples. Markers stand at the SNRs of that range at which that network is below "
        f"{SOLVED:g}.{conditions(results, data)}"
    )
    alt = "Open-set weighted F1 of the best methods and of the thesis's method against test SNR, and their difference."
    return (figure("best_gain", drawing, data, alt, caption, wide=True),)


def tried_table(names, scores, ranks):
    """Make the table of every method, the best first within each split; without gains where no method has one."""
    snrs = sorted({nearest(scores["test_snr_db"], aim) for aim in SHOWN_SNRS})
    curves = select(scores, metric=F1, threshold=LEAD).pivot_table("value", METHOD, "test_snr_db")[snrs]
    kinds = {protocol: "" if protocol == LEAD else f", {protocol}" for protocol in PROTOCOLS}
    shown = []
    for row in ranks.to_dict("records"):
        line = {
            "split": row["split"],
            "experiment": title(row["experiment"]),
            "model": names.model(row["model"]).label,
            "training SNR": row["training"],
            "confidence score": names.score(row["score"]).label,
            "validation mean": f"{row['validation']:.3f}",
            **{f"{snr:g} dB": f"{value:.3f}" for snr, value in curves.loc[*(row[name] for name in METHOD)].items()},
            **{f"mean{words}": f"{row[f'mean_{protocol}']:.3f}" for protocol, words in kinds.items()},
        }
        if ranks[f"gain_{LEAD}"].notna().any():
            line |= {f"gain{words}": signed(row[f"gain_{protocol}"]) for protocol, words in kinds.items()}
        shown.append(line)
    caption = (
        f"Weighted F1 of the open set with {LEAD} thresholds at some SNRs, and its mean over {middle_text(scores)}; "
        "validation mean: the same mean on the validation images, by which the rows are in order. The CSV file holds "
        "all SNRs, all protocols and the 95 % intervals."
    )
    return table("tried", scores, shown, caption)
