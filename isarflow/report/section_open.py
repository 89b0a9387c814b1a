"""The open set: unknown targets among the test images, and what each model and confidence score makes of them."""

import pandas as pd

from isarflow.core.words import signed
from isarflow.learning.experiments import REFERENCE
from isarflow.report.conditions import conditions
from isarflow.report.layout import BLACK, PALETTE, Section, figure, table
from isarflow.report.plots import draw_scores, finish, panels
from isarflow.report.published import ADAPTATIONS, FULL_SIZE, OPEN, beside, statements_table
from isarflow.report.selection import evenly, nearest
from isarflow.report.vocabulary import (
    F1,
    LEAD,
    METHOD,
    PROTOCOLS,
    at_snrs,
    comparable,
    heading,
    ranked,
    select,
    span_text,
    title,
)

PLACE, NEEDS = ("recognition", 2), "opened"  # on the page, see page.py
LOOKS_SNRS = 5  # lines of the figure of several looks
# Of its thresholds: those kept by single images may follow from training views, which are never several looks.
LOOKS_PROTOCOL = "blind"
SHOWN_SNRS = (-12, -6, 0, 6, 12, 24)  # dB, of the table
GAIN = f"{F1}_gain"  # a metric
# Metrics of the open set without a threshold, as in scores.csv, and the headings of their columns.
SEPARATION = {"auroc": "AUROC", "fpr95": "FPR at 95 % TPR", "oscr": "OSCR"}


def section(results):
    scores = select(results.scores[results.scores["score"] != ""], elevation="all")
    known, unknown, other = (" and ".join(results.of_role(role)) for role in ("known", "unknown", "other"))
    other = f"those of role other{f' ({other})' if other else ''}"
    rejecting = " or ".join(f"{value:.3f}" for value in results.rejecting(results.opened))
    kept = 100 * results.settings["learning"]["kept"]
    text = (
        f"The test images are those of {known} and of {unknown}, which no model has seen. An image whose confidence "
        "score is below a threshold is rejected as 'other'. Thresholds are chosen on the validation images, for each "
        f"SNR and fold: under the kept protocol so that {kept:g} % of the known ones are kept; for the largest "
        f"weighted F1 under the blind protocol with the known ones and {other} alone, under the thesis protocol with "
        f"the unknown targets among them. Rejecting everything gives a weighted F1 of {rejecting}: the dotted line."
    )
    figures = *(open_figure(results, name) for name in results.opened), *looks_figure(results, scores)
    ranks = summary(scores, select(results.validation, elevation="all"))
    tables = tried_table(results, scores, ranks), *statements_table(results, "published_open", OPEN)
    return Section("open", "Open set", (text,), figures, tables)


def open_figure(results, name):
    """Draw an experiment's weighted F1: a row per model, a column per protocol, a line per confidence score."""
    names, shown = results.names, {}
    rows = select(results.scores, experiment=name, metric=F1, elevation="all")
    statements = select(results.published_scores, experiment=name, metric=["f1", "weighted_f1"], elevation="all")
    here = set(zip(rows["model"], rows["score"], strict=True))
    same = {model: ADAPTATIONS.get(model, (model, "")) for model in statements["model"]}
    same = {model: of for model, of in same.items() if of in here}
    rows, statements, words = beside(results, rows, select(statements, model=[*same]), FULL_SIZE)
    for (model,), of in names.groups(rows, "model"):
        shown |= {f"{names.model(model).label}, {kind}": select(of, threshold=["", kind]) for kind in PROTOCOLS}

    def look(row):
        own = {"color": BLACK, "ls": "--", "label": "closed set"}
        return (names.score(row["score"]).curve if row["score"] else own) | {"band": False, "lw": 1}

    published = statements.assign(panel=[f"{names.model(same[of][0]).label}, thesis" for of in statements["model"]])
    colors = {model: names.score(score).color if score else BLACK for model, (_, score) in same.items()}
    columns, line = len(PROTOCOLS), ("score", "training")
    size = 9, 1 + 2.2 * len(shown) / columns
    drawing = draw_scores(results, shown, columns, size, line, look, published, colors)
    caption = (
        f"{heading(name)}: weighted F1 over the classes and 'other', unknown targets among the test images, a line for "
        f"each confidence score; dashed: on the known targets alone.{words}{conditions(results, rows)}"
    )
    return figure(f"open_{name}", drawing, rows, caption, wide=True)


def looks_figure(results, scores):
    """Draw weighted F1 against the number of looks that are added up, where a model has scores that add up.

    scores: rows of the open set, of which those by each model's main confidence score are drawn.
    """
    rows = select(scores, threshold=LOOKS_PROTOCOL)
    rows = rows.assign(looks=rows["metric"].str.extract(rf"^{F1}_(\d+)_looks$")[0])
    together = rows.dropna(subset="looks").astype({"looks": int})
    if together.empty:
        return ()
    together = results.names.by_main_score(together)
    single = select(rows, metric=F1).merge(together[METHOD].drop_duplicates(), on=METHOD).assign(looks=1)
    drawn = pd.concat([single, together])
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
    return (figure("looks", drawing, drawn, caption, wide=len(methods) > 1),)


def summary(scores, validation):
    """Return one row per method, the best first within each split: columns METHOD, validation, mean_<p>, gain_<p>.

    Means over the middle SNRs: of weighted F1 on the validation images, which decides what is best, and, under each
    protocol <p>, on the test images; gain_<p> is NaN, or left out, where no network of the thesis compares.
    """
    ranks = ranked(select(validation, metric=F1, threshold=LEAD)).rename(columns={"value": "validation"})
    rows = select(comparable(scores), metric=[F1, GAIN])
    rows = rows.assign(kind=rows["metric"].map({F1: "mean_", GAIN: "gain_"}) + rows["threshold"])
    return ranks.merge(rows.pivot_table("value", METHOD, "kind").reset_index(), how="left", on=METHOD)


def tried_table(results, scores, ranks):
    """Return the table of every method, the best first within each split; without gains where no method has one."""
    names, scores, shown = results.names, select(scores, metric=[F1, GAIN, *SEPARATION]), []
    snrs = sorted({nearest(scores["test_snr_db"], aim) for aim in SHOWN_SNRS})
    heads = {protocol: "" if protocol == LEAD else f", {protocol}" for protocol in PROTOCOLS}
    heads = {protocol: words for protocol, words in heads.items() if f"mean_{protocol}" in ranks}  # by family not all
    for row in ranks.to_dict("records"):
        own = select(scores, **{column: row[column] for column in METHOD})
        line = names.cells(row, *METHOD) | {"validation mean": f"{row['validation']:.3f}"}
        line |= at_snrs(select(own, metric=F1, threshold=LEAD), snrs)
        line |= {f"mean{words}": f"{row[f'mean_{protocol}']:.3f}" for protocol, words in heads.items()}
        if f"gain_{LEAD}" in row:
            line |= {f"gain{words}": signed(row[f"gain_{protocol}"]) for protocol, words in heads.items()}
        top = select(own, test_snr_db=snrs[-1]).set_index("metric")["value"]
        shown.append(
            line | {text: f"{top[metric]:.3f}" if metric in top else "–" for metric, text in SEPARATION.items()}
        )
    caption = (
        f"Everything tried: weighted F1 with {LEAD} thresholds and its 95 % interval at some SNRs, and its mean over "
        f"{span_text(scores)}; in order, split by split, of the same mean on the validation images. Gains are over "
        f"{names.method(REFERENCE[0], REFERENCE[2])}, trained at the same SNRs; the last columns are of {snrs[-1]:g} "
        f"dB; the CSV file holds all SNRs, protocols and intervals.{conditions(results, scores)}"
    )
    return table("tried", scores, shown, caption)
