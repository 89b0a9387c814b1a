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
    listed,
    ranked,
    select,
    snr_axis,
    title,
    with_interval,
)

COLUMNS = 4  # models side by side
LOOKS_SNRS = 5  # lines of the figure of several looks
SEPARATION = {"auroc": "AUROC", "fpr95": "FPR at 95 % TPR", "oscr": "OSCR"}


def section(results):
    scores = select(results.scores[results.scores["score"] != ""], elevation="all")
    known, unknown, other = (" and ".join(results.of_role(role)) for role in ("known", "unknown", "other"))
    rejecting = " or ".join(f"{value:.3f}" for value in results.rejecting(results.opened))
    ours, kept = select(results.confusion, experiment="fcnn_open"), 100 * results.settings["learning"]["kept"]
    return Section(
        id="open",
        title="Open set",
        text=(
            f"The test images are those of {known} and of {unknown}, which no model has seen. An image whose "
            "confidence score is below a threshold is rejected as 'other'. Thresholds are chosen on the validation "
            "images, for each SNR by itself: for the largest weighted F1, under the thesis protocol with the unknown "
            "targets among these, under the blind protocol with the known ones and those of role other"
            f"{f' ({other})' if other else ''} alone; under the kept protocol so that {kept:g} % of the known ones are "
            "kept, whatever else there is. Every fold has thresholds of its own. Scores that put the images in the "
            "same order, as softmax, maximum logit and energy of a linear model of two classes do, lie on each other. "
            "OpenMax's score is its largest probability of a known class. Rejecting everything gives a weighted "
            f"F1 of {rejecting}: the dotted line.",
        ),
        figures=(
            *(open_figure(results, name, select(scores, experiment=name)) for name in results.opened),
            *looks_figure(results, scores),
            *confusion_figure(results, "published_confusion", ours, ADAPTATIONS),
        ),
        tables=(
            *(open_table(results, name, select(scores, experiment=name)) for name in results.opened),
            *statements_table(results, "published_open", OPEN),
        ),
    )


def open_figure(results, name, scores):
    """Weighted F1 of an experiment's open set against the test SNR: a panel per model, a colour per confidence score.

    scores: the experiment's rows.
    """
    names, part = results.names, select(scores, metric=F1)
    models = names.values(part, "model")
    columns = min(COLUMNS, len(models))
    rows = -(-len(models) // columns) * len(PROTOCOLS)
    drawing, grid = panels(rows, columns, max(1 + 2.6 * columns, 6), 1 + 2.2 * rows)
    for (place, model), (row, protocol) in itertools.product(enumerate(models), enumerate(PROTOCOLS)):
        axes = grid[row + len(PROTOCOLS) * (place // columns), place % columns]
        for (score, _), curve in names.groups(select(part, model=model, threshold=protocol), "score", "training"):
            look = names.score(score)
            draw_curve(axes, curve, look.color, look.marker, band=False, lw=1, label=look.label)
        draw_rejecting(axes, results.rejecting([name]))
        axes.set_title(f"{names.model(model).label}, {protocol}")
    finish(drawing, grid, snr_axis(results.definition), "weighted F1")
    snr, lead = part["test_snr_db"].max(), PROTOCOLS[0]
    case = {"experiment": name, "elevation": "all", "metric": F1, "threshold": lead, "test_snr_db": snr}
    top, held_out = (
        select(table, **case).set_index(["model", "training", "score"])["value"]
        for table in (scores, results.validation)
    )
    model, _, score = best = held_out.idxmax()
    caption = (
        f"{heading(name)}: weighted F1 over the classes and 'other', unknown targets among the "
        f"test images, with {listed(PROTOCOLS)} thresholds. Best at {snr:g} dB on the validation "
        f"images with {lead} thresholds: {names.model(model).label} with {names.score(score).label}, which has "
        f"{top[best]:.3f} on the test images.{conditions(results, part)}"
    )
    alt = f"Open-set weighted F1 of {title(name)} against test SNR, for each model, confidence score and threshold."
    return figure(f"open_{name}", drawing, scores, alt, caption, wide=True)


def looks_figure(results, scores):
    """Weighted F1 against the number of looks that are added up: a panel per method, a line per SNR.

    scores: rows of the open set. Nothing where no model has scores that add up. Of several confidence scores that which
    is best on the validation images of single looks.
    """
    rows = select(scores, threshold=PROTOCOLS[0])
    looks = rows["metric"].str.extract(rf"^{F1}_(\d+)_looks$")[0]
    together = rows.assign(looks=looks)[looks.notna()].astype({"looks": int})
    if not len(together):
        return ()
    best = ranked(select(results.validation, metric=F1, threshold=PROTOCOLS[0], elevation="all"))
    best = best.merge(together[METHOD].drop_duplicates(), on=METHOD).drop_duplicates(METHOD[:-1])[METHOD]
    drawn = pd.concat([select(rows, metric=F1).assign(looks=1), together]).merge(best, on=METHOD)
    methods = results.names.groups(drawn, *METHOD)
    snrs = evenly(drawn["test_snr_db"].unique().tolist(), LOOKS_SNRS)
    drawing, grid = panels(1, len(methods), max(1 + 3 * len(methods), 5), 3.4)
    for axes, ((split, experiment, model, _, score), curves) in zip(grid.flat, methods, strict=True):
        for color, snr in zip(PALETTE, snrs, strict=False):
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
    """Every model and confidence score of an experiment at the highest SNR: F1 by protocol, and separation.

    scores: the experiment's rows.
    """
    names, top, shown = results.names, at_highest(scores), []
    for (model, trained, score), rows in names.groups(top, "model", "training", "score"):
        rows = rows.set_index(["threshold", "metric"])
        line = {"model": names.model(model).label}
        if top["training"].nunique() > 1:
            line["training SNR"] = trained
        line["confidence score"] = names.score(score).label
        line |= {f"weighted F1, {protocol}": with_interval(rows.loc[(protocol, F1)]) for protocol in PROTOCOLS}
        line |= {text: f"{rows.loc['', metric]['value']:.3f}" for metric, text in SEPARATION.items()}
        shown.append(line)
    caption = (
        f"{heading(name)} at {top['test_snr_db'].max():g} dB: weighted F1 with its 95 % interval with "
        f"{listed(PROTOCOLS)} thresholds. AUROC: the probability that an image of a known target "
        "scores higher than one of an unknown target; FPR: the share of unknown images kept by the threshold that "
        "keeps 95 % of the known ones; OSCR: the area under correct classification against false positives; of several "
        f"folds these are means. The CSV file holds all SNRs.{conditions(results, top)}"
    )
    return table(f"open_{name}", scores, shown, caption)
