"""How far the random split flatters, and how far the folds of the split by sector are from each other."""

import numpy as np
import pandas as pd

from report.conditions import conditions
from report.layout import BLACK, GREY, Section, figure, signed, table
from report.plots import draw_rejecting, finish, panels
from report.selection import TABLE_SNRS, evenly
from report.vocabulary import (
    ACCURACY,
    F1,
    METHOD,
    PROTOCOLS,
    SPLITS,
    at_highest,
    at_snrs,
    select,
    title,
    with_interval,
)

KEYS = ["images", "model", "training", "train_snr_db", "elevation", "metric", "score", "threshold", "test_snr_db"]
# The panels of the folds' figure: threshold, metric, and what is drawn.
PANELS = (
    ("", ACCURACY, "closed set: accuracy"),
    *((protocol, F1, f"open set, {protocol} thresholds:\nweighted F1") for protocol in PROTOCOLS),
)


def section(results):
    """What the splits are, the comparison, and the folds; nothing for runs that only split at random."""
    pairs, figures = select(paired(results), elevation="all"), folds_figure(results)
    if not len(pairs) and not figures:
        return ()
    accuracy = select(pairs, metric=ACCURACY, score="")
    opened = select(pairs, metric=F1, threshold=PROTOCOLS)
    compared = [_images(results, accuracy), plainly(results.names, accuracy)] if len(pairs) else []
    return (
        Section(
            id="splits",
            title="How far the random split flatters" if len(pairs) else "How far the folds differ",
            text=(what_splits_are(results), *([" ".join(compared)] if compared else [])),
            figures=figures,
            tables=(
                *([open_table(results, opened)] if len(opened) else []),
                *([accuracy_table(results.names, accuracy)] if len(accuracy) else []),
            ),
        ),
    )


def what_splits_are(results):
    """How aspects are divided, and what scores and their intervals are, in sentences."""
    folds, aperture = results.settings["learning"]["split"]["folds"], results.settings["imaging"]["aperture"]
    return (
        "What is divided are aspects: a view and its mirror image in a target's mirror planes are one, and fall on the "
        "same side. Neighbouring azimuths share most of their aperture: split at random, test images have near-copies "
        f"among the training images. Split by sector, the aspects are cut into {folds} arcs. In each fold one of them "
        "tests, another arc validates, and the rest trains a model of the fold's own, but for guards: any two sides "
        f"are an aperture apart, {aperture} azimuth steps, so that no test image shares a sample with one that trained "
        "or validated. Scores are of the test images of all folds together, each judged by the model of its fold. "
        "Intervals come from resampling blocks, by sector the folds and at random arcs of an aperture, and are widened "
        "where blocks are few; one fold alone has none."
    )


def folds_figure(results):
    """Each fold's score at the highest SNR beside that of all folds with its interval: a row for each model.

    Of an open set with the model's confidence score that is best on the validation images. Nothing where no experiment
    has several folds.
    """
    drawn = fold_values(results)
    if not len(drawn):
        return ()
    rows = results.names.groups(drawn, "experiment", "model", "training")
    shown = [panel for panel in PANELS if len(select(drawn, threshold=panel[0]))]
    drawing, grid = panels(1, len(shown), 3 + 2.8 * len(shown), 1.2 + 0.36 * len(rows), sharex=False)
    labels = []
    for place, ((experiment, model, training), row) in enumerate(rows):
        several = drawn[drawn["experiment"] == experiment]["training"].nunique() > 1
        look = results.names.model(model)
        labels.append(f"{look.label}, {title(experiment)}{f', {training}' if several else ''}")
        for axes, (threshold, _, _) in zip(grid.flat, shown, strict=True):
            values = select(row, threshold=threshold)
            alone, together = values[values["fold"] != ""], values[values["fold"] == ""]
            # Side by side, the first fold uppermost.
            beside = place + np.linspace(-0.3, 0.3, len(alone))
            axes.plot(alone["value"], beside, "o", color=GREY, ms=3.5, zorder=3, label="one fold")
            for one in together.itertuples():
                reach = [[one.value - one.low], [one.high - one.value]]
                axes.errorbar(one.value, place, xerr=reach, fmt="D", color=look.color, ms=4.5, lw=1.4, capsize=3)
    for axes, (threshold, _, words) in zip(grid.flat, shown, strict=True):
        axes.set_title(words)
        if threshold:
            draw_rejecting(axes, results.rejecting(select(drawn, threshold=threshold)["experiment"]), upright=True)
    grid[0, 0].set_yticks(range(len(rows)), labels)
    grid[0, 0].set_ylim(len(rows) - 0.5, -0.5)
    grid[0, -1].plot([], [], "D", color=BLACK, ms=4.5, label="all folds, with the 95 % interval")
    finish(drawing, grid, "")
    snr = drawn["test_snr_db"].max()
    caption = (
        f"How far the folds differ at {snr:g} dB: each fold's test images alone, and all together, of an open set with "
        f"each model's confidence score that is best on the validation images. {_widest(drawn, rows, labels)}"
        f"{conditions(results, drawn)}"
    )
    alt = f"Accuracy and open-set weighted F1 of each fold and of all at {snr:g} dB, for each model split by sector."
    return (figure("folds", drawing, drawn, alt, caption, wide=True),)


def fold_values(results):
    """What `folds_figure` draws: rows of scores at the highest SNR, of each fold and, with fold empty, of all."""
    parts = []
    for threshold, metric, _ in PANELS:
        case = {"split": "sector", "elevation": "all", "threshold": threshold, "metric": metric}
        alone, together, held_out = (
            at_highest(select(table, **case)) for table in (results.fold_scores, results.scores, results.validation)
        )
        best = held_out.sort_values("value", ascending=False, kind="stable").drop_duplicates(METHOD[:-1])[METHOD]
        folded = alone[METHOD].drop_duplicates().merge(best, on=METHOD)  # without experiments of one fold
        parts += [table.merge(folded, on=METHOD) for table in (together, alone)]
    return pd.concat(parts)


def _widest(drawn, rows, labels):
    """The model of whom the folds differ most in the closed set, in a sentence."""
    values = [select(row[row["fold"] != ""], threshold="").set_index("fold")["value"] for _, row in rows]
    label, values = max(zip(labels, values, strict=True), key=lambda pair: np.ptp(pair[1]))
    return (
        f"Farthest apart in the closed set: {label}, from {values.min():.3f} in fold {values.idxmin()} to "
        f"{values.max():.3f} in fold {values.idxmax()}."
    )


def paired(results):
    """Rows of the same model, training images and metric under both splits, side by side, and their difference."""
    images = {
        run["experiment"]: repr((run["elevation"], run["upsample"], run["channels"])) for run in results.runs.values()
    }
    scores = results.scores.assign(images=results.scores["experiment"].map(images))
    # An experiment tested on the open set has the closed set's rows too: any of several is as good.
    sector, random = (
        select(scores, split=split).drop_duplicates(KEYS)[[*KEYS, "experiment", "value", "low", "high"]]
        for split in SPLITS
    )
    return sector.merge(random, on=KEYS, suffixes=[f"_{split}" for split in SPLITS])


def _gain(row):
    return row["value_random"] - row["value_sector"]


def _groups(names, rows):
    """The rows of each model and kind of training images, in the order of the page, after what the page calls it."""
    several = rows.groupby("model")[["images", "training"]].nunique().max(axis=1) > 1
    for (model, trained, _), group in names.groups(rows, "model", "training", "images"):
        yield f"{names.model(model).label}{f', training SNR {trained}' if several[model] else ''}", group


def _images(results, accuracy):
    """How many images train on either side, of several folds in the first, in a sentence."""
    times = select(results.times, model=list(accuracy["model"]))
    sector, random = (
        select(times, experiment=list(accuracy[f"experiment_{split}"]))["training_observations"].min()
        for split in SPLITS
    )
    return f"By sector {sector:,} images train in the first fold, at random {random:,}."


def plainly(names, accuracy):
    """By how much the accuracy of each model differs at the highest SNR, and where most of all, in sentences."""
    top = at_highest(accuracy)
    parts = [f"{name} {signed(_gain(rows.iloc[0]))}" for name, rows in _groups(names, top)]
    most = accuracy.loc[_gain(accuracy).idxmax()]
    return (
        f"Accuracy at {top['test_snr_db'].max():g} dB under the random split less that under sector: "
        f"{'; '.join(parts)}. The random split flatters most {names.model(most['model']).label} at "
        f"{most['test_snr_db']:g} dB, by {_gain(most):.3f}."
    )


def accuracy_table(names, rows):
    """Accuracy under both splits at some SNRs: three rows for each model."""
    snrs = evenly(rows["test_snr_db"].unique().tolist(), TABLE_SNRS)
    kinds = {split: lambda row, split=split: f"{row[f'value_{split}']:.3f}" for split in SPLITS}
    kinds["random − sector"] = lambda row: signed(_gain(row))
    shown = [
        {"model": name, "split": kind} | at_snrs(curve, snrs, text)
        for name, curve in _groups(names, rows)
        for kind, text in kinds.items()
    ]
    caption = "Accuracy on the known targets at some test SNRs. The CSV file holds all SNRs, and the 95 % intervals."
    return table("split_accuracy", rows, shown, caption)


def open_table(results, rows):
    """Open-set weighted F1 under both splits at the highest SNR, with each model's best confidence score by protocol.

    Best is which has the largest weighted F1 by sector on the validation images at that SNR.
    """
    names, top = results.names, at_highest(rows)
    keys = ["experiment_sector", "model", "training", "score", "threshold", "test_snr_db"]
    held_out = select(results.validation, metric=F1, elevation="all")
    held_out = held_out.rename(columns={"experiment": "experiment_sector", "value": "validation"})
    top = top.merge(held_out[[*keys, "validation"]], on=keys)
    shown = []
    for protocol in PROTOCOLS:
        for name, group in _groups(names, select(top, threshold=protocol)):
            row = group.loc[group["validation"].idxmax()]
            line = {"model": name, "thresholds": protocol, "confidence score": names.score(row["score"]).label}
            for split in SPLITS:
                line[split] = with_interval({key: row[f"{key}_{split}"] for key in ("value", "low", "high")})
            shown.append(line | {"random − sector": signed(_gain(row))})
    caption = (
        f"Open-set weighted F1 at {top['test_snr_db'].max():g} dB with its 95 % interval, for each model with the "
        "confidence score that does best by sector on the validation images."
    )
    return table("split_open", rows, shown, caption)
