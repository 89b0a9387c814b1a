"""The classifiers: accuracy against SNR with intervals, beside the published one, and how their training went."""

import itertools

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from isarflow.report import thesis
from isarflow.report.conditions import conditions, meaning
from isarflow.report.layout import BLACK, GREY, Section, figure, number, several, table
from isarflow.report.plots import draw_rejecting, draw_scores, finish, panels, training_look
from isarflow.report.published import CLOSED, beside, statements_table
from isarflow.report.selection import TABLE_SNRS, evenly
from isarflow.report.vocabulary import (
    ACCURACY,
    DRAWN,
    ELEVATIONS,
    F1,
    METHOD,
    at_highest,
    at_snrs,
    heading,
    run_title,
    select,
    title,
    training_noise,
)

PLACE, NEEDS = ("recognition", 1), "learns"  # on the page, see page.py
DASHES = "-", "--", ":", "-."  # of a model's training curves
# The panels of the folds by threshold: metric, and what is drawn.
PANELS = {"": (ACCURACY, "closed set: accuracy")}
PANELS |= {protocol: (F1, f"open set, {protocol} thresholds:\nweighted F1") for protocol in DRAWN}
# Columns of the published prediction times beside ours.
PUBLISHED = {"training_observations": "published_training_observations", "milliseconds_per_observation": "published_ms"}


def section(results):
    """Return the section: accuracy of each experiment in the closed set, folds, training curves, settings tried."""
    scores, names = select(results.scores, score="", metric=ACCURACY), results.names
    figures = [learning_figure(results, *of) for of in names.groups(scores, "experiment")]
    text = (
        "Each model learns the known targets from its experiment's training images and is tested at every SNR on other "
        "aspects: here on the known targets alone (the closed set). A view and its mirror image in a target's mirror "
        f"planes fall on the same side. {meaning(scores['split'])} Scores are of the test images of all folds "
        "together. Bands and brackets are 95 % intervals, which are widened where blocks of test images are few; one "
        "fold alone has none by sector."
    )
    snrs, columns = evenly(scores["test_snr_db"].unique(), TABLE_SNRS), [*METHOD[:-1], "elevation"]
    curves = [curve for _, curve in names.groups(scores, *columns)]
    shown = [names.cells(curve.iloc[0], *columns) | at_snrs(curve, snrs) for curve in curves]
    caption = "Accuracy at some test SNRs with its 95 % interval. The CSV file holds all SNRs."
    tables = [table("accuracy", scores, shown, caption), *statements_table(results, "published", CLOSED)]
    tables += [*search_tables(results), times_table(results)]
    figures += folds_figure(results) + curves_figure(results)
    return Section("learning", "Learning", (text,), tuple(figures), tuple(tables))


def learning_figure(results, name, rows):
    """Draw an experiment's accuracy: a panel per set of test elevations, or per model if training SNRs are several."""
    (name,), names, trained = name, results.names, results.names.values(rows, "training")
    case = {"experiment": name, "metric": "accuracy", "model": names.values(rows, "model")}
    statements = select(results.published_scores, **case, elevation=[*ELEVATIONS])
    rows, statements, words = beside(results, rows, statements)
    if len(trained) > 1:
        rows = select(rows, elevation="all")
        shown = {names.model(model).label: of for (model,), of in names.groups(rows, "model")}
    else:
        shown = {f"tested at {ELEVATIONS[of]}": select(rows, elevation=of) for of in sorted(set(rows["elevation"]))}

    def look(row):
        return names.model(row["model"]).curve if len(trained) == 1 else training_look(row["training"], trained)

    published = statements.assign(panel="tested at " + statements["elevation"].map(ELEVATIONS))
    colors = {model: names.model(model).color for model in names.values(rows, "model")}
    size = 1 + 4.4 * len(shown), 3.8
    drawing = draw_scores(results, shown, len(shown), size, ("model", "training"), look, published, colors)
    train, channels = (results.settings["learning"]["experiments"][name].get(key) for key in ("train", "channels"))
    only, angles = f" on {', '.join(channels)} alone" if channels else "", train["elevation"]
    where = "all elevations" if angles == "all" else f"elevation {', '.join(f'{angle:g}' for angle in angles)}°"
    caption = (
        f"{heading(name)}: trained {training_noise(train['snr_db'])}{only}, at {where}; accuracy.{words}"
        f"{conditions(results, rows)}"
    )
    alt = f"Experiment {title(name)}: accuracy against test SNR of each model."
    return figure(f"learning_{name}", drawing, rows, alt, caption, wide=len(shown) > 1)


def folds_figure(results):
    """Draw each fold's score at the highest SNR beside that of all folds: a row for each model that has several."""
    drawn = fold_values(results)
    if drawn.empty:
        return ()
    rows = results.names.groups(drawn, "experiment", "model", "training")
    shown = [threshold for threshold in PANELS if threshold in set(drawn["threshold"])]
    drawing, grid = panels(1, len(shown), 3 + 2.8 * len(shown), 1.2 + 0.36 * len(rows), sharex=False)
    for axes, threshold in zip(grid.flat, shown, strict=True):
        axes.set_title(PANELS[threshold][1])
        for place, ((_, model, _), row) in enumerate(rows):
            values = select(row, threshold=threshold)
            alone, together = values[values["fold"] != ""], values[values["fold"] == ""]
            # Side by side, the first fold uppermost.
            beside = place + np.linspace(-0.3, 0.3, len(alone))
            axes.plot(alone["value"], beside, "o", color=GREY, ms=3.5, zorder=3, label="one fold")
            reach = [together["value"] - together["low"], together["high"] - together["value"]]
            look = {"fmt": "D", "color": results.names.model(model).color, "ms": 4.5, "lw": 1.4, "capsize": 3}
            axes.errorbar(together["value"], [place] * len(together), xerr=reach, **look)
        if threshold:
            draw_rejecting(axes, results.rejecting(select(drawn, threshold=threshold)["experiment"]), upright=True)
    labels = [f"{results.names.model(model).label}, {title(experiment)}" for (experiment, model, _), _ in rows]
    grid[0, 0].set_yticks(range(len(rows)), labels)
    grid[0, 0].set_ylim(len(rows) - 0.5, -0.5)
    grid[0, -1].plot([], [], "D", color=BLACK, ms=4.5, label="all folds, with the 95 % interval")
    finish(drawing, grid, "")
    caption = (
        f"How far the folds differ at {drawn['test_snr_db'].max():g} dB: each fold's test images alone, and all "
        "together, of an open set with each model's confidence score that is best on the validation images."
        f"{conditions(results, drawn)}"
    )
    alt = "Accuracy and open-set weighted F1 of each fold and of all folds together, for each model that has folds."
    return (figure("folds", drawing, drawn, alt, caption, wide=True),)


def fold_values(results):
    """Return rows of scores at the highest SNR, of each fold and, with fold empty, of all together, where it has folds.

    Of an open set with the confidence score that is best on the validation images.
    """
    parts, every = [], results.every_score
    for threshold, (metric, _) in PANELS.items():
        case = {"elevation": "all", "threshold": threshold, "metric": metric}
        tables = every[every["fold"] != ""], results.scores, results.validation
        alone, together, held_out = (at_highest(select(table, **case)) for table in tables)
        best = held_out.sort_values("value", ascending=False, kind="stable").drop_duplicates(METHOD[:-1])[METHOD]
        folded = alone[METHOD].drop_duplicates().merge(best, on=METHOD)
        parts += [table.merge(folded, on=METHOD) for table in (together, alone)]
    return pd.concat(parts)


def curves_figure(results):
    """Draw loss, accuracy and learning rate over the epochs, a line per network and experiment, where there are any."""
    if not results.curves:
        return ()
    drawing, grid = panels(1, 3, 12, 3.2 + 0.1 * len(results.curves), sharex=False, sharey=False)  # with the legend
    dashes, tables = {}, []
    for (run, model), curve in results.curves.items():
        look, dash = results.names.model(model), next(dashes.setdefault(model, itertools.cycle(DASHES)))
        thin = {"color": look.color, "ls": dash, "lw": 0.7}
        label = f"{look.label}, {run_title(results.runs[run], fold=True)}"
        for axes, column in zip(grid.flat, ("loss", "accuracy"), strict=False):
            axes.plot(curve["epoch"], curve[column], dash, color=look.color, label=label)
            axes.plot(curve["epoch"], curve[f"validation_{column}"], marker=look.marker, **thin)
        if "learning_rate" in curve:  # a model of one's own may keep none
            grid[0, 2].plot(curve["epoch"], curve["learning_rate"], **thin)
        tables.append(curve.assign(run=run, model=model))
    for axes, text in zip(grid.flat, ("loss", "accuracy", "learning rate"), strict=True):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylabel(text)
    grid[0, 0].set_yscale("log")
    grid[0, 2].set_ylim(bottom=0)
    finish(drawing, grid, "epoch")
    caption = (
        "Training curves of the networks: thick lines are on the training images, thin lines with markers on the "
        "validation images. The loss is what each descends: cross-entropy, or of a capsule network the margin loss and "
        "the error of the reconstruction. Of an experiment with several folds they are those of its first."
    )
    alt = "Loss, accuracy and learning rate of the networks over the epochs of their training."
    return (figure("training_curves", drawing, pd.concat(tables), alt, caption, wide=True),)


def search_tables(results):
    """Return a table for each model with a choice of settings: a row for each of these, a column per experiment."""
    tried, tables = {}, []
    for (run, model), search in results.searches.items():
        chosen = search.index == search["validation_accuracy"].idxmax()  # the first of equals, as in training
        search = search.assign(run=run, experiment=run_title(results.runs[run]), chosen=chosen)
        tried.setdefault(model, []).append(search)
    for model, parts in tried.items():
        data, shown, own = pd.concat(parts), {}, results.settings["learning"]["models"][model]
        choices = [name for name, value in own.items() if isinstance(value, list)]
        for (*values, experiment), folds in data.groupby([*choices, "experiment"], sort=False, dropna=False):
            texts = [str(value).removesuffix(".0") for value in values]
            among = f" in {folds['chosen'].sum()} of {len(folds)} folds" if len(folds) > 1 else ""
            mark = f" ✓{among}" if folds["chosen"].any() else ""
            row = shown.setdefault(tuple(texts), dict(zip(choices, texts, strict=True)))
            row[experiment] = f"{folds['validation_accuracy'].mean():.3f}{mark}"
        caption = (
            f"Settings tried for {results.names.model(model).words}: accuracy on the validation images of each "
            "experiment, by which one is chosen (✓); of several folds the mean, as each fold chooses for itself."
        )
        tables.append(table(f"search_{model}", data, [*shown.values()], caption))
    return tables


def times_table(results):
    """Return prediction times per image beside the published ones of networks of the same size."""
    published = results.published_times.drop(columns=["source", "condition"]).rename(columns=PUBLISHED)
    published = published[[thesis.full_size(model, results.settings) for model in published["model"]]]
    data = results.times.merge(published, how="left", on=["model", "experiment"])
    shown = {
        "run": lambda row: run_title(results.runs[row["run"]]),
        "model": lambda row: results.names.model(row["model"]).label,
        "training images": "{training_observations:,}",
        "one at a time [ms]": lambda row: number(row["single_ms"]),
        "in batches [ms]": lambda row: number(row["batch_ms"]),
        "reference thesis [ms]": lambda row: number(row["published_ms"]),
        "its training images": lambda row: number(row["published_training_observations"], 6),
    }
    caption = (
        "Prediction time per image, from the complex image to its class, without its confidence scores. Here: "
        f"{data['machine'].iloc[0]}, {several(data['threads'].iloc[0], 'thread')}, in batches of "
        f"{data['batch_size'].max()}. The reference thesis: Intel i7-7700HQ, with other training sets, so only ratios "
        "between models compare; networks of another size than its have no published time."
    )
    return table("prediction_times", data, shown, caption)
