"""The classifiers: scores against SNR with intervals, beside published ones, and how their training went."""

import itertools

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.ticker import MaxNLocator

from report import thesis
from report.layout import Section, duration, figure, table
from report.plots import RELATIONS, draw_curve, draw_matrix, draw_published, finish, holds, matrix, panels
from report.selection import TABLE_SNRS, evenly
from report.vocabulary import (
    ACCURACY,
    F1,
    INTERVAL,
    at_highest,
    at_snrs,
    heading,
    select,
    split_text,
    title,
    training_noise,
)

ELEVATIONS = {"all": "all elevations", "trained": "trained elevations"}
# What a published condition is called in scores.csv.
CONDITIONS = {"test at elevation 0": "trained", "test at all elevations": "all", "": "all"}
# What a published metric of the closed set is called there, and on the page.
PUBLISHED_METRICS = {"accuracy": (ACCURACY, "accuracy"), "f1": (F1, "weighted F1")}
DASHES = {"solid": "-", "dashed": "--", "dotted": ":", "dash-dot": "-."}  # a class each
MARKERS = "os^Dv<>"
MATRICES = 4  # confusion matrices side by side
WIDE = 3  # more than so many side by side take the whole width of the page


def section(results):
    scores, validation, confusion = (
        select(rows, score="") for rows in (results.scores, results.validation, results.confusion)
    )
    train, published = results.settings["learning"]["experiments"], thesis.statements(results, False)
    pictures, matrices = [], []
    for name in results.names.values(scores, "experiment"):
        part, held_out = select(scores, experiment=name), select(validation, experiment=name, elevation="all")
        words = f"{heading(name)}, {split_text(part['split'].iloc[0])}"
        how = f"{words}: {_training(train[name]['train'])}"
        held_out = select(held_out, metric=ACCURACY)
        if part["training"].nunique() > 1:
            pictures.append(training_snr_figure(results.names, name, how, part, held_out))
        else:
            pictures.append(experiment_figure(results, name, how, part, held_out, published))
            matrices.append(confusion_figure(results.names, name, words, select(confusion, experiment=name)))
    return Section(
        id="learning",
        title="Learning",
        text=(
            "Each model learns the known targets from its experiment's training images and is tested at every SNR on "
            "azimuths that it was not trained at: here on the known targets alone (the closed set). Bands and brackets "
            "are 95 % intervals, from resampling whole azimuths. Split by sector, these azimuths are far from those "
            "trained at; split at random, they have near copies among them.",
        ),
        figures=(*pictures, *matrices, *curves_figure(results)),
        tables=(accuracy_table(results.names, select(scores, metric=ACCURACY)), *published_table(results, published)),
    )


def training_snr_figure(names, name, how, scores, validation):
    """An experiment that trains at several SNRs: accuracy against the test SNR, a panel per model, a line for each.

    how: what it is, in words; scores, validation: its rows, the latter of accuracy alone.
    """
    scores = select(scores, elevation="all")
    accuracy = select(scores, metric=ACCURACY)
    trained, models = names.values(accuracy, "training"), names.groups(accuracy, "model")
    drawing, grid = panels(1, len(models), 1 + 4.4 * len(models), 3.8)
    best = []
    for axes, ((model,), rows) in zip(grid.flat, models, strict=True):
        axes.set_title(names.model(model).label)
        for (train,), curve in names.groups(rows, "training"):
            place = trained.index(train)
            color, marker = colormaps["viridis"](0.9 * place / (len(trained) - 1)), MARKERS[place % len(MARKERS)]
            draw_curve(axes, curve, color, marker, band=False, label=f"training SNR: {train}")
        chosen = select(validation, model=model).groupby("training")["value"].mean().idxmax()
        mean = select(rows, training=chosen)["value"].mean()
        best.append(f"{names.model(model).label} with training SNR {chosen} ({mean:.3f})")
    finish(drawing, grid, ylabel="accuracy")
    caption = (
        f"{how}, tested at all elevations. Best on average over the SNRs on the validation images, with its accuracy "
        f"on the test images: {', '.join(best)}."
    )
    alt = f"Experiment {title(name)}: accuracy against test SNR for each training SNR and model."
    return figure(f"learning_{name}", drawing, scores, alt, caption, wide=True)


def experiment_figure(results, name, how, scores, validation, published):
    """An experiment: accuracy with the published statements as markers, then recall and precision of each class.

    how, scores, validation: as of `training_snr_figure`; published: by `thesis.statements`.
    """
    names, accuracy, whole = results.names, select(scores, metric=ACCURACY), select(scores, elevation="all")
    classes = [metric.removeprefix("recall_") for metric in scores["metric"].unique() if metric.startswith("recall_")]
    looks = {model: names.model(model) for model in names.values(scores, "model")}
    published = select(published, experiment=name, metric="accuracy", model=list(looks))
    elevations = [key for key in ELEVATIONS if (accuracy["elevation"] == key).any()]
    drawing, grid = panels(1, len(elevations) + 2, 10.8, 3.4)

    def draw(axes, rows, dash="-", band=True):
        for model, look in looks.items():
            draw_curve(axes, select(rows, model=model), look.color, look.marker, band, ls=dash, label=look.label)

    for axes, elevation in zip(grid.flat, elevations, strict=False):
        draw(axes, select(accuracy, elevation=elevation))
        colors = {model: look.color for model, look in looks.items()}
        draw_published(axes, published[published["condition"].map(CONDITIONS) == elevation], colors)
        axes.set(title=f"tested at {ELEVATIONS[elevation]}", ylabel="accuracy")
    dashes = list(zip(classes, itertools.cycle(DASHES), strict=False))
    for axes, metric in zip(grid[0, -2:], ("recall", "precision"), strict=True):
        for target, dash in dashes:
            draw(axes, select(whole, metric=f"{metric}_{target}"), DASHES[dash], band=False)
        axes.set(title=", ".join(map(" ".join, dashes)), ylabel=f"{metric} of each class")
    finish(drawing, grid)
    marks = thesis.marked({"": thesis.offset(results, False)}, len(published))
    caption = f"{how}. {_most_accurate(looks, select(whole, metric=ACCURACY), validation)}{marks}"
    alt = f"Experiment {title(name)}: accuracy, and recall and precision of {', '.join(classes)}, against test SNR."
    return figure(f"learning_{name}", drawing, scores, alt, caption, wide=True)


def _most_accurate(looks, accuracy, validation):
    """Which model is best on the validation images at the highest SNR, and its accuracy on the test images."""
    held_out, values = (at_highest(rows).set_index("model")["value"] for rows in (validation, accuracy))
    snr = accuracy["test_snr_db"].max()
    best = [model for model in looks if held_out[model] == held_out.max()]
    if len(best) == len(held_out) > 1:
        parts = ", ".join(f"{looks[model].label} {values[model]:.3f}" for model in best)
        return f"All are alike on the validation images at {snr:g} dB; on the test images: {parts}."
    parts = " and ".join(f"{looks[model].label} ({values[model]:.3f} on the test images)" for model in best)
    return f"Most accurate on the validation images at {snr:g} dB: {parts}."


def _training(train):
    """What an experiment trains on, in words."""
    noise = training_noise(train["snr_db"])
    if train["elevation"] == "all":
        return f"trained {noise}, at all elevations"
    return f"trained {noise}, at elevation {', '.join(f'{angle:g}' for angle in train['elevation'])}°"


def confusion_figure(names, name, words, confusion):
    """How often each true class was taken for which, at a middle SNR and at the highest; a column per model."""
    part = select(confusion, elevation="all")
    snrs = evenly(part["test_snr_db"].unique().tolist(), 3)[-2:]
    part = select(part, test_snr_db=snrs)
    models = names.groups(part, "model")
    columns = min(MATRICES, len(models))
    rows = len(snrs) * -(-len(models) // columns)
    drawing, grid = panels(rows, columns, 0.6 + 2.3 * columns, 0.4 + 2.1 * rows, sharex=False, sharey=False)
    for (row, snr), (place, ((model,), cells)) in itertools.product(enumerate(snrs), enumerate(models)):
        axes = grid[len(snrs) * (place // columns) + row, place % columns]
        text = f"{names.model(model).label} at {snr:g} dB"
        draw_matrix(axes, matrix(select(cells, test_snr_db=snr)), text)
    finish(drawing, grid, "predicted class", "true class", legend=False)
    alt = f"Confusion matrices of {title(name)} at test SNRs of {' and '.join(f'{snr:g}' for snr in snrs)} dB."
    caption = (
        f"{words}: test images at all elevations, true class (row) against predicted class; share of the row and "
        "number."
    )
    return figure(f"confusion_{name}", drawing, part, alt, caption, wide=columns > WIDE)


def curves_figure(results):
    """Training curves: loss and accuracy over the epochs, a line per run; nothing where no model has epochs."""
    curves = results.curves
    if not curves:
        return ()
    drawing, grid = panels(1, 2, 9, 3.2 + 0.1 * len(curves), sharex=False, sharey=False)  # with what the legend needs
    dashes, tables, times = {}, [], []
    for (run, model), curve in curves.items():
        look = results.names.model(model)
        kind, label = next(dashes.setdefault(model, itertools.cycle(DASHES.values()))), f"{look.label}, {title(run)}"
        for axes, column in zip(grid.flat, ("loss", "accuracy"), strict=True):
            axes.plot(curve["epoch"], curve[column], kind, color=look.color, label=label)
            thin = {"color": look.color, "marker": look.marker, "lw": 0.7}
            axes.plot(curve["epoch"], curve[f"validation_{column}"], kind, **thin)
            axes.set_ylabel(column)
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        tables.append(curve.assign(run=run, model=model))
        if "seconds" in curve:
            times.append(f"{look.label} in {title(run)} {duration(curve['seconds'].iloc[-1])}")
    grid[0, 0].set_yscale("log")
    finish(drawing, grid, "epoch")
    took = f" Training took: {'; '.join(times)}." if times else ""
    caption = (
        "Training of the networks: thick lines are on the training images, thin lines with markers on those at "
        "the validation azimuths. The loss is what each descends: cross-entropy, or of a capsule network the "
        f"margin loss and the error of the reconstruction.{took}"
    )
    alt = "Loss and accuracy of the networks over the epochs of their training."
    return (figure("training_curves", drawing, pd.concat(tables), alt, caption, wide=True),)


def accuracy_table(names, scores):
    """Accuracy with its interval at some SNRs: a row per experiment, model and set of test elevations."""
    snrs = evenly(scores["test_snr_db"].unique().tolist(), TABLE_SNRS)
    rows = []
    for (experiment, model, trained, elevation), curve in names.groups(
        scores, "experiment", "model", "training", "elevation"
    ):
        head = {
            "split": curve["split"].iloc[0],
            "experiment": title(experiment),
            "model": names.model(model).label,
            "training SNR": trained,
            "tested at": ELEVATIONS.get(elevation, elevation),
        }
        rows.append(head | at_snrs(curve, snrs, lambda row: INTERVAL.format(**row)))
    caption = "Accuracy at some test SNRs with its 95 % interval. The CSV file holds all SNRs."
    return table("accuracy", scores, rows, caption)


def published_table(results, published):
    """Published statements with our value at the same noise beside them; nothing where no experiment has a counterpart.

    published: by `thesis.statements`. Between two test SNRs our value is interpolated; beyond the last it is that one.
    """
    rows = []
    for line in select(published, metric=list(PUBLISHED_METRICS)).to_dict("records"):
        same = {key: line[key] for key in ("experiment", "model")} | {"score": ""}
        metric, elevation = PUBLISHED_METRICS[line["metric"]][0], CONDITIONS.get(line["condition"])
        ours = select(results.scores, metric=metric, elevation=elevation, **same).sort_values("test_snr_db")
        snrs = ours["test_snr_db"]
        if not len(ours) or not snrs.is_unique or not snrs.min() <= line["printed_snr_db"] <= snrs.max():
            continue
        at = min(line["snr_db"], snrs.max())
        value, low, high = (float(np.interp(at, snrs, ours[name])) for name in ("value", "low", "high"))
        kept = holds(value, line["relation"], line["value"])
        rows.append({**line, "here_at_snr_db": at, "ours": value, "low": low, "high": high, "holds": kept})
    if not rows:
        return ()

    def model(row):
        reduced = "" if thesis.full_size(row["model"], results.settings) else " (here reduced)"
        return f"{results.names.model(row['model']).label}{reduced}"

    columns = {
        "experiment": lambda row: title(row["experiment"]),
        "model": model,
        "tested at": lambda row: ELEVATIONS[CONDITIONS[row["condition"]]],
        "its SNR [dB]": "{printed_snr_db:g}",
        "measure": lambda row: PUBLISHED_METRICS[row["metric"]][1],
        f"thesis, {thesis.CENTER_FREQUENCY / 1e9:g} GHz": lambda row: f"{RELATIONS[row['relation']][0]} {row['value']}",
        "SNR here [dB]": "{here_at_snr_db:.3g}",
        "here": INTERVAL.replace("value", "ours"),
        "as published": lambda row: "yes" if row["holds"] else "no",
        "source": "{source}",
    }
    caption = (
        "What the reference thesis states of the closed set, split at random, and the same here. Its networks are "
        "full-size ones, its targets other models of the same kinds, and its frequency may differ from this run's, so "
        "agreement is expected in kind only. Values here are at the same noise, which has another SNR where the "
        "definitions differ: interpolated between test SNRs, or at the highest. “As published” rounds to the printed "
        "decimals."
    )
    return (table("published", pd.DataFrame(rows), columns, caption),)
