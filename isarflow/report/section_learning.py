"""The classifiers: accuracy against SNR with intervals, beside the published one, and how their training went."""

import itertools

import pandas as pd
from matplotlib.ticker import MaxNLocator

from isarflow.core.words import number, several
from isarflow.learning.experiments import training_noise
from isarflow.report.conditions import conditions, meaning
from isarflow.report.layout import Section, figure, table
from isarflow.report.plots import draw_scores, finish, panels, training_look
from isarflow.report.published import CLOSED, beside, statements_table
from isarflow.report.selection import TABLE_SNRS, evenly
from isarflow.report.vocabulary import ACCURACY, ELEVATIONS, METHOD, at_snrs, heading, run_title, select

PLACE, NEEDS = ("recognition", 1), "learns"  # on the page, see page.py
DASHES = "-", "--", ":", "-."  # of a model's training curves


def section(results):
    scores, names = select(results.scores, score="", metric=ACCURACY), results.names
    figures = [learning_figure(results, *of) for of in names.groups(scores, "experiment")]
    text = (
        "Each model learns the known targets from its experiment's training images and is tested at every SNR on other "
        f"aspects: here on the closed set. A view and its mirror image share a side. {meaning(scores['split'])} "
        "Scores are of the test images of all folds together, bands and brackets 95 % intervals; of one fold none."
    )
    snrs, columns = evenly(scores["test_snr_db"].unique(), TABLE_SNRS), [*METHOD[:-1], "elevation"]
    curves = [curve for _, curve in names.groups(scores, *columns)]
    shown = [names.cells(curve.iloc[0], *columns) | at_snrs(curve, snrs) for curve in curves]
    caption = "Accuracy at some test SNRs with its 95 % interval. The CSV file holds all SNRs."
    tables = [table("accuracy", scores, shown, caption), *statements_table(results, "published", CLOSED)]
    tables += [*search_tables(results), times_table(results)]
    figures += curves_figure(results)
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
    caption = f"{heading(name)}: trained {training_noise(train['snr_db'])}{only}, at {where}; accuracy.{words}"
    return figure(f"learning_{name}", drawing, rows, caption + conditions(results, rows), wide=len(shown) > 1)


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
        "Training curves of the networks, of several folds the first one's: thick lines are on the training images, "
        "thin lines with markers on the validation images. The loss is what each descends: cross-entropy, or of a "
        "capsule network a margin loss and the error of the reconstruction."
    )
    return (figure("training_curves", drawing, pd.concat(tables), caption, wide=True),)


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
    """Return the prediction times per image."""
    shown = {
        "run": lambda row: run_title(results.runs[row["run"]]),
        "model": lambda row: results.names.model(row["model"]).label,
        "training images": "{training_observations:,}",
        "one at a time [ms]": lambda row: number(row["single_ms"]),
        "in batches [ms]": lambda row: number(row["batch_ms"]),
    }
    caption = (
        f"Prediction time per image, from complex image to class. Here: {results.times['machine'].iloc[0]}, "
        f"{several(results.times['threads'].iloc[0], 'thread')}, in batches of {results.times['batch_size'].max()}."
    )
    return table("prediction_times", results.times, shown, caption)
