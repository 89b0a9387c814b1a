"""The open set: unknown targets among the test images, and what each confidence score and threshold makes of them."""

import itertools

import pandas as pd

from isarflow.report.conditions import conditions
from isarflow.report.layout import PALETTE, Section, figure, table
from isarflow.report.plots import draw_curve, draw_rejecting, finish, panels
from isarflow.report.published import ADAPTATIONS, OPEN, confusion_figure, statements_table
from isarflow.report.selection import evenly
from isarflow.report.vocabulary import (
    F1,
    METHOD,
    PROTOCOLS,
    at_highest,
    heading,
    ranked,
    select,
    snr_axis,
    title,
    with_interval,
)

PLACE, NEEDS = ("recognition", 2), "opened"  # on the page, see page.py
LOOKS_SNRS = 5  # lines of the figure of several looks
# Metrics of the open set without a threshold, as in scores.csv, and the headings of their columns.
SEPARATION = {"auroc": "AUROC", "fpr95": "FPR at 95 % TPR", "oscr": "OSCR"}


def section(results):
    """Return the section: a figure and a table of each open experiment, several looks, and what was published."""
    scores = select(results.scores[results.scores["score"] != ""], elevation="all")
    opened = [(name, select(scores, experiment=name)) for name in results.opened]
    known, unknown, other = (" and ".join(results.of_role(role)) for role in ("known", "unknown", "other"))
    rejecting = " or ".join(f"{value:.3f}" for value in results.rejecting(results.opened))
    ours, kept = select(results.confusion, experiment="fcnn_open"), 100 * results.settings["learning"]["kept"]
    text = (
        f"The test images are those of {known} and of {unknown}, which no model has seen. An image whose confidence "
        "score is below a threshold is rejected as 'other'. Thresholds are chosen on the validation images, for each "
        "SNR by itself: for the largest weighted F1, under the thesis protocol with the unknown targets among these, "
        f"under the blind protocol with the known ones and those of role other{f' ({other})' if other else ''} alone; "
        f"under the kept protocol so that {kept:g} % of the known ones are kept, whatever else there is. Every fold "
        "has thresholds of its own. Scores that put the images in the same order, as softmax, maximum logit and energy "
        "of a linear model of two classes do, lie on each other. OpenMax's score is its largest probability of a known "
        f"class. Rejecting everything gives a weighted F1 of {rejecting}: the dotted line."
    )
    figures = tuple(open_figure(results, name, rows) for name, rows in opened) + looks_figure(results, scores)
    figures += confusion_figure(results, "published_confusion", ours, ADAPTATIONS)
    tables = tuple(open_table(results, name, rows) for name, rows in opened)
    return Section("open", "Open set", (text,), figures, tables + statements_table(results, "published_open", OPEN))


def open_figure(results, name, scores):
    """Draw an experiment's scores against the test SNR: a row per model, a column per protocol, a line per score."""
    names, part = results.names, select(scores, metric=F1)
    models = names.values(part, "model")
    drawing, grid = panels(len(models), len(PROTOCOLS), 9, 1 + 2.2 * len(models))
    for axes, (model, protocol) in zip(grid.flat, itertools.product(models, PROTOCOLS), strict=True):
        for (score, _), curve in names.groups(select(part, model=model, threshold=protocol), "score", "training"):
            look = names.score(score)
            draw_curve(axes, curve, look.color, look.marker, band=False, lw=1, label=look.label)
        draw_rejecting(axes, results.rejecting([name]))
        axes.set_title(f"{names.model(model).label}, {protocol}")
    finish(drawing, grid, snr_axis(results.definition), "weighted F1")
    caption = (
        f"{heading(name)}: weighted F1 over the classes and 'other', unknown targets among the test images, a line for "
        f"each confidence score.{conditions(results, part)}"
    )
    alt = f"Open-set weighted F1 of {title(name)} against test SNR, for each model, confidence score and threshold."
    return figure(f"open_{name}", drawing, scores, alt, caption, wide=True)


def looks_figure(results, scores):
    """Draw weighted F1 against the number of looks that are added up: a panel per method, a line per SNR.

    scores: rows of the open set. Nothing where no model has scores that add up. Of several confidence scores that which
    is best on the validation images of single looks.
    """
    rows = select(scores, threshold=PROTOCOLS[0])
    rows = rows.assign(looks=rows["metric"].str.extract(rf"^{F1}_(\d+)_looks$")[0])
    together = rows.dropna(subset="looks").astype({"looks": int})
    if together.empty:
        return ()
    best = ranked(select(results.validation, metric=F1, threshold=PROTOCOLS[0], elevation="all"))
    best = best.merge(together[METHOD].drop_duplicates(), on=METHOD).drop_duplicates(METHOD[:-1])[METHOD]
    drawn = pd.concat([select(rows, metric=F1).assign(looks=1), together]).merge(best, on=METHOD)
    methods = results.names.groups(drawn, *METHOD)
    drawing, grid = panels(1, len(methods), max(1 + 3 * len(methods), 5), 3.4)
    for axes, ((split, experiment, model, _, score), curves) in zip(grid.flat, methods, strict=True):
        for color, snr in zip(PALETTE, evenly(drawn["test_snr_db"].unique(), LOOKS_SNRS), strict=False):
            line = select(curves, test_snr_db=snr).sort_values("looks")
            axes.plot(line["looks"], line["value"], "o-", color=color, ms=4, label=f"{snr:g} dB")
        axes.set_title(f"{results.names.method(model, score)},\n{title(experiment)} ({split})")
    finish(drawing, grid, "looks", "weighted F1")
    caption = (
        "Several looks at a target together: weighted F1 of the open set against how many images, each an aperture of "
        "azimuth from the one before, are judged as one by the sum of their scores, which are logarithms of "
        f"likelihoods. Thresholds are chosen on as many looks.{conditions(results, drawn)}"
    )
    alt = "Weighted F1 of the open set against the number of looks, at some SNRs."
    return (figure("looks", drawing, drawn, alt, caption, wide=len(methods) > 1),)


def open_table(results, name, scores):
    """Return a table of an experiment's scores at the highest SNR, a row per model and confidence score."""
    names, top, shown = results.names, at_highest(scores), []
    for (model, trained, score), rows in names.groups(top, "model", "training", "score"):
        value = rows.set_index(["threshold", "metric"])
        line = {"model": names.model(model).label, "training SNR": trained}
        line["confidence score"] = names.score(score).label
        line |= {f"weighted F1, {protocol}": with_interval(value.loc[(protocol, F1)]) for protocol in PROTOCOLS}
        shown.append(line | {text: f"{value.loc['', metric]['value']:.3f}" for metric, text in SEPARATION.items()})
    caption = (
        f"{heading(name)} at {top['test_snr_db'].max():g} dB: weighted F1 with its 95 % interval by protocol, and how "
        "well each confidence score tells known targets from unknown ones, of several folds their mean. The CSV file "
        f"holds all SNRs.{conditions(results, top)}"
    )
    return table(f"open_{name}", scores, shown, caption)
