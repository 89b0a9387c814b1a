"""The classifiers: scores against SNR with intervals, beside published ones, and how their training went."""

import itertools

import pandas as pd
from matplotlib.ticker import MaxNLocator

from isarflow.report.conditions import conditions, meaning
from isarflow.report.layout import Section, duration, figure, number, table
from isarflow.report.plots import draw_curve, draw_matrices, draw_published, draw_trainings, finish, matrix, panels
from isarflow.report.published import CLOSED, beside, statements_table
from isarflow.report.selection import TABLE_SNRS, evenly
from isarflow.report.vocabulary import (
    ACCURACY,
    ELEVATIONS,
    at_snrs,
    heading,
    run_title,
    select,
    snr_axis,
    title,
    training_noise,
    with_interval,
)

PLACE, NEEDS = ("recognition", 1), "learns"  # on the page, see page.py
DASHES = {"solid": "-", "dashed": "--", "dotted": ":", "dash-dot": "-."}  # a class each


def section(results):
    """Return the section: figures of each experiment in the closed set, training curves, accuracy, settings tried."""
    scores, pictures, matrices = select(results.scores, score=""), [], []
    for name in results.names.values(scores, "experiment"):
        part = select(scores, experiment=name)
        if part["training"].nunique() > 1:
            pictures.append(training_snr_figure(results, name, part))
        else:
            pictures.append(experiment_figure(results, name, part))
            matrices.append(confusion_figure(results, name))
    text = (
        "Each model learns the known targets from its experiment's training images and is tested at every SNR on "
        "aspects that it was not trained at: here on the known targets alone (the closed set). Bands and brackets "
        "are 95 % intervals, from resampling blocks of test images: by sector the folds, else arcs as long as an "
        f"aperture. {meaning(scores['split'])}"
    )
    accuracy = accuracy_table(results.names, select(scores, metric=ACCURACY))
    tables = accuracy, *statements_table(results, "published", CLOSED), *search_tables(results)
    return Section("learning", "Learning", (text,), (*pictures, *matrices, *curves_figure(results)), tables)


def training_snr_figure(results, name, scores):
    """Draw an experiment's scores, accuracy against the test SNR: a panel per model, a line per training SNR."""
    names, scores = results.names, select(scores, elevation="all")
    accuracy = select(scores, metric=ACCURACY)
    trained, models = names.values(accuracy, "training"), names.groups(accuracy, "model")
    drawing, grid = panels(1, len(models), 1 + 4.4 * len(models), 3.8)
    for axes, ((model,), rows) in zip(grid.flat, models, strict=True):
        axes.set_title(names.model(model).label)
        draw_trainings(axes, [(train, curve) for (train,), curve in names.groups(rows, "training")], trained)
    finish(drawing, grid, snr_axis(results.definition), "accuracy")
    caption = f"{_trained(results, name)}; accuracy at all elevations.{conditions(results, scores)}"
    alt = f"Experiment {title(name)}: accuracy against test SNR for each training SNR and model."
    return figure(f"learning_{name}", drawing, scores, alt, caption, wide=True)


def experiment_figure(results, name, scores):
    """Draw an experiment's scores: accuracy with published statements as markers, each class's recall and precision."""
    classes = [metric.removeprefix("recall_") for metric in scores["metric"].unique() if metric.startswith("recall_")]
    looks = {model: results.names.model(model) for model in results.names.values(scores, "model")}
    statements = select(results.published_scores, experiment=name, metric="accuracy", model=list(looks))
    accuracy, statements, definition, marks = beside(results, select(scores, metric=ACCURACY), statements)
    elevations = [key for key in ELEVATIONS if (accuracy["elevation"] == key).any()]
    drawing, grid = panels(1, len(elevations) + 2, 10.8, 3.4)
    for axes, elevation in zip(grid.flat, elevations, strict=False):
        for model, look in looks.items():
            case = {"model": model, "elevation": elevation}
            draw_curve(axes, select(accuracy, **case), look.color, look.marker, label=look.label)
            draw_published(axes, select(statements, **case), look.color)
        axes.set(title=f"tested at {ELEVATIONS[elevation]}", ylabel="accuracy", xlabel=snr_axis(definition))
    dashes = list(zip(classes, itertools.cycle(DASHES), strict=False))
    for axes, metric in zip(grid[0, -2:], ("recall", "precision"), strict=True):
        for (target, dash), (model, look) in itertools.product(dashes, looks.items()):
            curve = select(scores, elevation="all", metric=f"{metric}_{target}", model=model)
            draw_curve(axes, curve, look.color, look.marker, band=False, ls=DASHES[dash], label=look.label)
        axes.set(title=", ".join(map(" ".join, dashes)), ylabel=f"{metric} of each class")
    finish(drawing, grid, snr_axis(results.definition))
    drawn = scores if definition == results.definition else pd.concat([accuracy, scores])
    caption = (
        f"{_trained(results, name)}; accuracy, and of each class recall and precision at all elevations. Where a model "
        "takes no image for a class, its precision is undefined and not drawn."
        f"{marks}{conditions(results, scores, definition, results.definition)}"
    )
    alt = f"Experiment {title(name)}: accuracy, and recall and precision of {', '.join(classes)}, against test SNR."
    return figure(f"learning_{name}", drawing, drawn, alt, caption, wide=True)


def _trained(results, name):
    """Return an experiment's name and what it trains on, in words."""
    experiment = results.settings["learning"]["experiments"][name]
    train, channels = experiment["train"], experiment.get("channels")
    noise = training_noise(train["snr_db"]) + (f" on {', '.join(channels)} alone" if channels else "")
    if train["elevation"] == "all":
        return f"{heading(name)}: trained {noise}, at all elevations"
    return f"{heading(name)}: trained {noise}, at elevation {', '.join(f'{angle:g}' for angle in train['elevation'])}°"


def confusion_figure(results, name):
    """Draw how often an experiment's models took each class for which, at a middle SNR and at the highest."""
    part = select(results.confusion, score="", experiment=name, elevation="all")
    snrs = evenly(part["test_snr_db"].unique(), 3)[-2:]
    part = select(part, test_snr_db=snrs)
    shown = [
        (f"{results.names.model(model).label} at {snr:g} dB", matrix(select(cells, test_snr_db=snr)))
        for ((model,), cells), snr in itertools.product(results.names.groups(part, "model"), snrs)
    ]
    drawing, columns = draw_matrices(shown, "true class")
    caption = (
        f"{heading(name)}: test images at all elevations, true class (row) against predicted class; share of the row "
        f"and number.{conditions(results, part)}"
    )
    alt = f"Confusion matrices of {title(name)} at two test SNRs."
    return figure(f"confusion_{name}", drawing, part, alt, caption, wide=columns > 2)


def curves_figure(results):
    """Draw loss, accuracy and learning rate over the epochs, a line per network and experiment, where there are any."""
    if not results.curves:
        return ()
    drawing, grid = panels(1, 3, 12, 3.2 + 0.1 * len(results.curves), sharex=False, sharey=False)  # with the legend
    dashes, tables = {}, []
    for (run, model), curve in results.curves.items():
        look, dash = results.names.model(model), next(dashes.setdefault(model, itertools.cycle(DASHES.values())))
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


def training_end(curve, planned):
    """Return in words how a training ended. planned: how many epochs it may have at most, where that is one number."""
    last = curve.iloc[-1]
    words = [f"after {last['epoch']:g}{f' of {planned}' if isinstance(planned, int) else ''} epochs"]
    if "learning_rate" in curve:
        words.append(f"at {number(last['learning_rate'] / curve['learning_rate'].max(), 2)} of its learning rate")
    if "seconds" in curve:
        words.append(f"in {duration(last['seconds'])}")
    return " ".join(words)


def accuracy_table(names, scores):
    """Return accuracy with its interval at some SNRs: a row per experiment, model and set of test elevations."""
    snrs, shown = evenly(scores["test_snr_db"].unique(), TABLE_SNRS), []
    columns = "split", "experiment", "model", "training", "elevation"
    for (split, experiment, model, trained, elevation), curve in names.groups(scores, *columns):
        row = {"split": split, "experiment": title(experiment), "model": names.model(model).label}
        row |= {"training SNR": trained, "tested at": ELEVATIONS.get(elevation, elevation)}
        shown.append(row | at_snrs(curve, snrs, with_interval))
    caption = "Accuracy at some test SNRs with its 95 % interval. The CSV file holds all SNRs."
    return table("accuracy", scores, shown, caption)


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
