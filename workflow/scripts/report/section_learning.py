"""The classifiers: scores against SNR with intervals, beside published ones, and how their training went."""

import itertools

import pandas as pd
from matplotlib.ticker import MaxNLocator

from isarflow.report.conditions import conditions, meaning
from isarflow.report.layout import Section, duration, figure, number, table
from isarflow.report.plots import draw_curve, draw_matrix, draw_published, draw_trainings, finish, matrix, panels
from isarflow.report.published import CLOSED, beside, statements_table
from isarflow.report.selection import TABLE_SNRS, evenly
from isarflow.report.vocabulary import (
    ACCURACY,
    ELEVATIONS,
    at_highest,
    at_snrs,
    heading,
    run_title,
    select,
    snr_axis,
    title,
    training_noise,
    with_interval,
)

DASHES = {"solid": "-", "dashed": "--", "dotted": ":", "dash-dot": "-."}  # a class each
MATRICES = 4  # confusion matrices side by side
WIDE = 3  # more than so many side by side take the whole width of the page


def section(results):
    scores, validation, confusion = (
        select(rows, score="") for rows in (results.scores, results.validation, results.confusion)
    )
    train = results.settings["learning"]["experiments"]
    pictures, matrices = [], []
    for name in results.names.values(scores, "experiment"):
        part, held_out = select(scores, experiment=name), select(validation, experiment=name, elevation="all")
        how = f"{heading(name)}: {_training(train[name])}"
        held_out = select(held_out, metric=ACCURACY)
        if part["training"].nunique() > 1:
            pictures.append(training_snr_figure(results, name, how, part, held_out))
        else:
            pictures.append(experiment_figure(results, name, how, part, held_out))
            matrices.append(confusion_figure(results, name, select(confusion, experiment=name)))
    return Section(
        id="learning",
        title="Learning",
        text=(
            "Each model learns the known targets from its experiment's training images and is tested at every SNR on "
            "aspects that it was not trained at: here on the known targets alone (the closed set). Bands and brackets "
            "are 95 % intervals, from resampling blocks of test images: by sector the folds, else arcs as long as an "
            f"aperture. {meaning(scores['split'])}",
        ),
        figures=(*pictures, *matrices, *curves_figure(results)),
        tables=(
            accuracy_table(results.names, select(scores, metric=ACCURACY)),
            *statements_table(results, "published", CLOSED),
            *search_tables(results),
        ),
    )


def training_snr_figure(results, name, how, scores, validation):
    """An experiment that trains at several SNRs: accuracy against the test SNR, a panel per model, a line for each.

    how: what it is, in words; scores, validation: its rows, the latter of accuracy alone.
    """
    names, scores = results.names, select(scores, elevation="all")
    accuracy = select(scores, metric=ACCURACY)
    trained, models = names.values(accuracy, "training"), names.groups(accuracy, "model")
    drawing, grid = panels(1, len(models), 1 + 4.4 * len(models), 3.8)
    best = []
    for axes, ((model,), rows) in zip(grid.flat, models, strict=True):
        axes.set_title(names.model(model).label)
        draw_trainings(axes, [(train, curve) for (train,), curve in names.groups(rows, "training")], trained)
        chosen = select(validation, model=model).groupby("training")["value"].mean().idxmax()
        mean = select(rows, training=chosen)["value"].mean()
        best.append(f"{names.model(model).label} with training SNR {chosen} ({mean:.3f})")
    finish(drawing, grid, snr_axis(results.definition), "accuracy")
    caption = (
        f"{how}, tested at all elevations. Best on average over the SNRs on the validation images, with its accuracy "
        f"on the test images: {', '.join(best)}.{conditions(results, scores)}"
    )
    alt = f"Experiment {title(name)}: accuracy against test SNR for each training SNR and model."
    return figure(f"learning_{name}", drawing, scores, alt, caption, wide=True)


def experiment_figure(results, name, how, scores, validation):
    """An experiment: accuracy with the published statements as markers, then recall and precision of each class.

    how, scores, validation: as of `training_snr_figure`.
    """
    names, whole = results.names, select(scores, elevation="all")
    classes = [metric.removeprefix("recall_") for metric in scores["metric"].unique() if metric.startswith("recall_")]
    looks = {model: names.model(model) for model in names.values(scores, "model")}
    statements = select(results.published_scores, experiment=name, metric="accuracy", model=list(looks))
    accuracy, statements, definition, marks = beside(results, select(scores, metric=ACCURACY), statements)
    elevations = [key for key in ELEVATIONS if (accuracy["elevation"] == key).any()]
    drawing, grid = panels(1, len(elevations) + 2, 10.8, 3.4)

    def draw(axes, rows, dash="-", band=True):
        for model, look in looks.items():
            draw_curve(axes, select(rows, model=model), look.color, look.marker, band, ls=dash, label=look.label)

    for axes, elevation in zip(grid.flat, elevations, strict=False):
        draw(axes, select(accuracy, elevation=elevation))
        colors = {model: look.color for model, look in looks.items()}
        draw_published(axes, select(statements, elevation=elevation), colors)
        axes.set(title=f"tested at {ELEVATIONS[elevation]}", ylabel="accuracy", xlabel=snr_axis(definition))
    dashes = list(zip(classes, itertools.cycle(DASHES), strict=False))
    for axes, metric in zip(grid[0, -2:], ("recall", "precision"), strict=True):
        for target, dash in dashes:
            draw(axes, select(whole, metric=f"{metric}_{target}"), DASHES[dash], band=False)
        axes.set(title=", ".join(map(" ".join, dashes)), ylabel=f"{metric} of each class")
    finish(drawing, grid, snr_axis(results.definition))
    drawn = scores if definition == results.definition else pd.concat([accuracy, scores])
    best = _most_accurate(looks, select(whole, metric=ACCURACY), validation)
    unnamed = whole[whole["metric"].str.startswith("precision_")]["value"].isna().any()
    gaps = " Where a model takes no image for a class, its precision is undefined and not drawn." if unnamed else ""
    caption = f"{how}. {best}{gaps}{marks}{conditions(results, scores, definition, results.definition)}"
    alt = f"Experiment {title(name)}: accuracy, and recall and precision of {', '.join(classes)}, against test SNR."
    return figure(f"learning_{name}", drawing, drawn, alt, caption, wide=True)


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


def _training(experiment):
    """What an experiment trains on, in words."""
    train, only = experiment["train"], experiment.get("channels")
    noise = training_noise(train["snr_db"]) + (f" on {', '.join(only)} alone" if only else "")
    if train["elevation"] == "all":
        return f"trained {noise}, at all elevations"
    return f"trained {noise}, at elevation {', '.join(f'{angle:g}' for angle in train['elevation'])}°"


def confusion_figure(results, name, confusion):
    """How often each true class was taken for which, at a middle SNR and at the highest; a column per model."""
    part = select(confusion, elevation="all")
    snrs = evenly(part["test_snr_db"].unique().tolist(), 3)[-2:]
    part = select(part, test_snr_db=snrs)
    models = results.names.groups(part, "model")
    columns = min(MATRICES, len(models))
    rows = len(snrs) * -(-len(models) // columns)
    drawing, grid = panels(rows, columns, 0.6 + 2.3 * columns, 0.4 + 2.1 * rows, sharex=False, sharey=False)
    for (row, snr), (place, ((model,), cells)) in itertools.product(enumerate(snrs), enumerate(models)):
        axes = grid[len(snrs) * (place // columns) + row, place % columns]
        text = f"{results.names.model(model).label} at {snr:g} dB"
        draw_matrix(axes, matrix(select(cells, test_snr_db=snr)), text)
    finish(drawing, grid, "predicted class", "true class", legend=False)
    alt = f"Confusion matrices of {title(name)} at test SNRs of {' and '.join(f'{snr:g}' for snr in snrs)} dB."
    caption = (
        f"{heading(name)}: test images at all elevations, true class (row) against predicted class; share of the row "
        f"and number.{conditions(results, part)}"
    )
    return figure(f"confusion_{name}", drawing, part, alt, caption, wide=columns > WIDE)


def curves_figure(results):
    """Training curves: loss, accuracy and learning rate over the epochs, a line per network and experiment.

    Nothing where no model has epochs.
    """
    curves = results.curves
    if not curves:
        return ()
    drawing, grid = panels(1, 3, 12, 3.2 + 0.1 * len(curves), sharex=False, sharey=False)  # with the legend
    dashes, tables, ends, every = {}, [], [], results.settings["learning"]["models"]
    for (run, model), curve in curves.items():
        look, words = results.names.model(model), run_title(results.runs[run], fold=True)
        kind, label = next(dashes.setdefault(model, itertools.cycle(DASHES.values()))), f"{look.label}, {words}"
        thin = {"color": look.color, "lw": 0.7}
        for axes, column in zip(grid.flat, ("loss", "accuracy"), strict=False):
            axes.plot(curve["epoch"], curve[column], kind, color=look.color, label=label)
            axes.plot(curve["epoch"], curve[f"validation_{column}"], kind, marker=look.marker, **thin)
            axes.set_ylabel(column)
        if "learning_rate" in curve:  # a model of one's own may keep none
            grid[0, 2].plot(curve["epoch"], curve["learning_rate"], kind, **thin)
        ends.append(f"{look.label} in {words} {training_end(curve, every[model].get('epochs'))}")
        tables.append(curve.assign(run=run, model=model))
    for axes in grid.flat:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    grid[0, 0].set_yscale("log")
    grid[0, 2].set_ylim(bottom=0)
    grid[0, 2].set_ylabel("learning rate")
    finish(drawing, grid, "epoch")
    folded = any(len(results.folds[results.runs[run]["experiment"]]) > 1 for run, _ in curves)
    first = " Of an experiment with several folds they are those of its first." if folded else ""
    caption = (
        "Training curves of the networks: thick lines are on the training images, thin lines with markers on the "
        "validation images. The loss is what each descends: cross-entropy, or of a capsule network the "
        f"margin loss and the error of the reconstruction.{first} Training ended: {'; '.join(ends)}."
    )
    alt = "Loss, accuracy and learning rate of the networks over the epochs of their training."
    return (figure("training_curves", drawing, pd.concat(tables), alt, caption, wide=True),)


def training_end(curve, planned):
    """How a training ended, in words. planned: how many epochs it may have at most, where that is one number."""
    last = curve.iloc[-1]
    words = [f"after {last['epoch']:g}{f' of {planned}' if isinstance(planned, int) else ''} epochs"]
    if "learning_rate" in curve:
        words.append(f"at {number(last['learning_rate'] / curve['learning_rate'].max(), 2)} of its learning rate")
    if "seconds" in curve:
        words.append(f"in {duration(last['seconds'])}")
    return " ".join(words)


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
        rows.append(head | at_snrs(curve, snrs, with_interval))
    caption = "Accuracy at some test SNRs with its 95 % interval. The CSV file holds all SNRs."
    return table("accuracy", scores, rows, caption)


def search_tables(results):
    """The settings tried of each model that had a choice, and their accuracy on the validation images."""
    tried = {}
    for (run, model), search in results.searches.items():
        # The first of equals, as in training.
        chosen = search.index == search["validation_accuracy"].idxmax()
        search = search.assign(run=run, experiment=run_title(results.runs[run]), chosen=chosen)
        tried.setdefault(model, []).append(search)
    return tuple(search_table(results, model, pd.concat(parts)) for model, parts in tried.items())


def search_table(results, model, tried):
    """A row for each of a model's settings, a column for each experiment. tried: of all runs; chosen, a boolean."""
    own, shown = results.settings["learning"]["models"][model], []
    choices = [name for name, value in own.items() if isinstance(value, list)]
    for values, rows in tried.groupby(choices, sort=False, dropna=False):
        line = {name: str(value).removesuffix(".0") for name, value in zip(choices, values, strict=True)}
        for experiment, folds in rows.groupby("experiment", sort=False):
            among = f" in {folds['chosen'].sum()} of {len(folds)} folds" if len(folds) > 1 else ""
            mark = f" ✓{among}" if folds["chosen"].any() else ""
            line[experiment] = f"{folds['validation_accuracy'].mean():.3f}{mark}"
        shown.append(line)
    caption = (
        f"Settings tried for {results.names.model(model).words}: accuracy on the validation images of each experiment, "
        "by which one is chosen (✓); of several folds the mean, as each fold chooses for itself."
    )
    return table(f"search_{model}", tried, shown, caption)
