"""The classifiers: scores against SNR with intervals, beside published ones, and prediction times."""

import itertools

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from report import thesis
from report.draw_learning import (
    RELATIONS,
    draw_confusion,
    draw_curves,
    draw_legend,
    draw_published,
    experiments,
    fitted,
    heading,
    holds,
    interval_text,
    split_text,
    title,
    training_noise,
    training_order,
)
from report.layout import Figure, Section, Table, canvas, duration, model_order, model_style, style, to_svg
from report.selection import TABLE_SNRS, evenly

METRICS = {"accuracy": "accuracy", "f1_weighted": "weighted F1", "f1_macro": "macro F1"}
ELEVATIONS = {"all": "all elevations", "trained": "trained elevations"}
# What a published condition is called in scores.csv.
CONDITIONS = {"test at elevation 0": "trained", "test at all elevations": "all", "": "all"}
# What a published metric of the closed set is called there.
PUBLISHED_METRICS = {"accuracy": "accuracy", "f1": "f1_weighted"}
DASHES = {"solid": "-", "dashed": "--", "dotted": ":", "dash-dot": "-."}  # a class each
DASH_LIST = list(DASHES.values())
MATRICES = 4  # confusion matrices side by side
WIDE = 3  # more than so many side by side take the whole width of the page


def closed(table):
    """The rows of scores or confusion counts of the closed set."""
    return table[table["score"] == ""]


def open_experiments(scores):
    """Names of the experiments that are tested on unknown targets too."""
    return sorted(scores[scores["score"] != ""]["experiment"].unique())


def section(results):
    scores, validation = closed(results.scores), closed(results.validation)
    shift, published = thesis.offset(results, ("known",)), thesis.statements(results, ("known",))
    confusion = closed(results.confusion)
    train = results.settings["learning"]["experiments"]
    return Section(
        id="learning",
        title="Learning",
        text=(
            "Each model learns the known targets from its experiment's training images and is tested at every SNR on "
            "azimuths that it was not trained at: here on the known targets alone (the closed set). Bands and brackets "
            "are 95 % intervals, from resampling whole azimuths. Split by sector, these azimuths are far from those "
            "trained at; split at random, they have near copies among them.",
        ),
        figures=(
            *(
                training_snr_figure(name, train[name]["train"], scores, validation)
                if _several(name, scores)
                else experiment_figure(name, train[name]["train"], scores, validation, published, shift)
                for name in experiments(scores)
            ),
            *(confusion_figure(name, confusion) for name in experiments(scores) if not _several(name, scores)),
            *curves_figure(results.curves),
        ),
        tables=(accuracy_table(scores), *published_table(scores, published, results.settings)),
    )


def _several(name, scores):
    """Whether an experiment trains models at several SNRs, one at each."""
    return scores[scores["experiment"] == name]["training"].nunique() > 1


def training_snr_figure(name, train, scores, validation):
    """One experiment that trains at several SNRs: accuracy against the test SNR, a panel per model, a line for each."""
    part = scores[(scores["experiment"] == name) & (scores["elevation"] == "all")]
    accuracy = part[part["metric"] == "accuracy"]
    models = sorted(accuracy["model"].unique(), key=model_order)
    with style():
        figure = canvas(1 + 4.4 * len(models), 3.8)
        panels = figure.subplots(1, len(models), sharex=True, sharey=True, squeeze=False)[0]
        for axes, model in zip(panels, models, strict=True):
            draw_curves(axes, accuracy[accuracy["model"] == model], band=False)
            axes.set(title=model_style(model)[2], xlabel="test SNR [dB]", ylabel="accuracy")
        draw_legend(figure, panels)
        svg = to_svg(figure)
    return Figure(
        name=f"learning_{name}",
        svg=svg,
        data=part,
        alt=f"Experiment {title(name)}: accuracy against test SNR for each training SNR and model.",
        caption=(
            f"{heading(name)}, {split_text(part['split'].iloc[0])}: {_training(train)}, tested at all elevations. "
            f"{_best_training(accuracy, _accuracy(validation, name))}"
        ),
        wide=True,
    )


def _accuracy(scores, name):
    """The rows of one experiment's accuracy at all elevations and SNRs."""
    rows = (scores["experiment"] == name) & (scores["metric"] == "accuracy") & (scores["elevation"] == "all")
    return scores[rows & scores["test_snr_db"].notna()]


def _best_training(accuracy, validation):
    """At which training SNR each model does best on the validation images over all SNRs, in one sentence."""
    means, held_out = (rows.groupby(["model", "training"])["value"].mean() for rows in (accuracy, validation))
    parts = []
    for model in sorted(accuracy["model"].unique(), key=model_order):
        best = held_out[model].idxmax()
        parts.append(f"{model_style(model)[2]} with training SNR {best} ({means[model][best]:.3f})")
    parts = ", ".join(parts)
    return f"Best on average over the SNRs on the validation images, with its accuracy on the test images: {parts}."


def curves_figure(curves):
    """Training curves: loss and accuracy over the epochs, a line per run; nothing where no model has epochs."""
    if not curves:
        return ()
    with style():
        figure = canvas(9, 3.2 + 0.1 * len(curves))  # with what the legend needs
        panels = figure.subplots(1, 2, sharex=True)
        for place, ((run, model), curve) in enumerate(curves.items()):
            color, marker, label = model_style(model)
            before = [other for _, other in list(curves)[:place]].count(model)
            kind = DASH_LIST[before % len(DASH_LIST)]
            for axes, column in zip(panels, ("loss", "accuracy"), strict=True):
                axes.plot(curve["epoch"], curve[column], kind, color=color, label=f"{label}, {title(run)}")
                axes.plot(curve["epoch"], curve[f"validation_{column}"], kind, color=color, marker=marker, lw=0.7)
        panels[0].xaxis.set_major_locator(MaxNLocator(integer=True))
        panels[0].set(xlabel="epoch", ylabel="loss", yscale="log")
        panels[1].set(xlabel="epoch", ylabel="accuracy")
        draw_legend(figure, panels)
        svg = to_svg(figure)
    tables = [curve.assign(run=run, model=model) for (run, model), curve in curves.items()]
    return (
        Figure(
            name="training_curves",
            svg=svg,
            data=pd.concat(tables),
            alt="Loss and accuracy of the networks over the epochs of their training.",
            caption=(
                "Training of the networks: thick lines are on the training images, thin lines with markers on those at "
                "the validation azimuths. The loss is what each descends: cross-entropy, or of a capsule network the "
                f"margin loss and the error of the reconstruction.{_training_times(curves)}"
            ),
            wide=True,
        ),
    )


def _training_times(curves):
    """How long each training took, in a sentence for the caption."""
    parts = [
        f"{model_style(model)[2]} in {title(run)} {duration(curve['seconds'].iloc[-1])}"
        for (run, model), curve in curves.items()
        if "seconds" in curve
    ]
    return f" Training took: {'; '.join(parts)}." if parts else ""


def experiment_figure(name, train, scores, validation, published, shift):
    """One experiment: accuracy with the published statements as markers, then recall and precision of each class.

    train: that part of the experiment's config; scores, validation, published: of all experiments, on the test images,
    on the validation images, and by `thesis.statements`, moved by `shift` dB.
    """
    part = scores[scores["experiment"] == name]
    classes = [metric.removeprefix("recall_") for metric in part["metric"].unique() if metric.startswith("recall_")]
    published = published[
        (published["experiment"] == name) & (published["metric"] == "accuracy") & published["model"].isin(part["model"])
    ]
    accuracy, whole = part[part["metric"] == "accuracy"], part[part["elevation"] == "all"]
    elevations = [key for key in ELEVATIONS if (accuracy["elevation"] == key).any()]
    with style():
        figure = canvas(10.8, 3.4)
        panels = figure.subplots(1, len(elevations) + 2, sharex=True, sharey=True)
        for axes, elevation in zip(panels, elevations, strict=False):
            draw_curves(axes, accuracy[accuracy["elevation"] == elevation])
            draw_published(axes, published[published["condition"].map(CONDITIONS) == elevation])
            axes.set(title=f"tested at {ELEVATIONS[elevation]}", ylabel="accuracy")
        for axes, metric in zip(panels[-2:], ("recall", "precision"), strict=True):
            for target, dash in zip(classes, DASH_LIST * len(classes), strict=False):
                draw_curves(axes, whole[whole["metric"] == f"{metric}_{target}"], dash, band=False)
            axes.set(title=_dashes(classes), ylabel=f"{metric} of each class")
        for axes in panels:
            axes.set_xlabel("test SNR [dB]")
        draw_legend(figure, panels)
        svg = to_svg(figure)
    return Figure(
        name=f"learning_{name}",
        svg=svg,
        data=part,
        alt=f"Experiment {title(name)}: accuracy, and recall and precision of {', '.join(classes)}, against test SNR.",
        caption=(
            f"{heading(name)}, {split_text(part['split'].iloc[0])}: {_training(train)}. "
            f"{_summary(_accuracy(scores, name), _accuracy(validation, name))}"
            f"{thesis.marked({'': shift}, len(published))}"
        ),
        wide=True,
    )


def confusion_figure(name, confusion):
    """How often each true class was taken for which, at a middle SNR and at the highest; a column per model."""
    part = confusion[(confusion["experiment"] == name) & (confusion["elevation"] == "all")]
    snrs = evenly(part["test_snr_db"].unique().tolist(), 3)[-2:]
    part = part[part["test_snr_db"].isin(snrs)]
    runs = [run for run, _ in fitted(part)]
    columns = min(MATRICES, len(runs))
    rows = -(-len(runs) // columns)
    with style():
        figure = canvas(0.6 + 2.3 * columns, 0.4 + 2.1 * len(snrs) * rows)
        grid = figure.subplots(len(snrs) * rows, columns, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for (row, snr), (place, run) in itertools.product(enumerate(snrs), enumerate(runs)):
            row, column = len(snrs) * (place // columns) + row, place % columns
            axes = grid[row, column]
            axes.set_axis_on()
            cells = part[(part["test_snr_db"] == snr) & (part["model"] == run[0]) & (part["training"] == run[1])]
            draw_confusion(axes, cells.pivot(index="target", columns="predicted", values="count").fillna(0))
            axes.set_title(f"{model_style(run[0])[2]} at {snr:g} dB")
            axes.set_ylabel("true class" if column == 0 else "")
            axes.set_xlabel("predicted class" if row == len(snrs) * rows - 1 else "")
        svg = to_svg(figure)
    return Figure(
        name=f"confusion_{name}",
        svg=svg,
        data=part,
        alt=f"Confusion matrices of {title(name)} at test SNRs of {' and '.join(f'{snr:g}' for snr in snrs)} dB.",
        caption=(
            f"{heading(name)}, {split_text(part['split'].iloc[0])}: test images at all elevations, true class (row) "
            "against predicted class; share of the row and number."
        ),
        wide=columns > WIDE,
    )


def accuracy_table(scores):
    """Accuracy with its interval at some SNRs: a row per experiment, model and set of test elevations."""
    rows = scores[scores["metric"] == "accuracy"]
    snrs = evenly(rows["test_snr_db"].dropna().unique().tolist(), TABLE_SNRS)
    shown = []
    order = experiments(rows)
    groups = rows.groupby(["experiment", "model", "training", "elevation"])
    for (experiment, model, train, elevation), curve in sorted(
        groups,
        key=lambda group: (order.index(group[0][0]), model_order(group[0][1]), training_order(group[1]), group[0][3]),
    ):
        line = {
            "split": curve["split"].iloc[0],
            "experiment": title(experiment),
            "model": model_style(model)[2],
            "training SNR": train,
            "tested at": ELEVATIONS.get(elevation, elevation),
        }
        curve = curve.set_index("test_snr_db")
        for snr in snrs:
            line[f"{snr:g} dB"] = interval_text(curve.loc[snr]) if snr in curve.index else "–"
        shown.append(line)
    return Table(
        name="accuracy",
        shown=pd.DataFrame(shown),
        data=rows,
        caption="Accuracy at some test SNRs with its 95 % interval. The CSV file holds all SNRs.",
    )


def published_table(scores, published, settings):
    """Published statements with our value at the same noise beside them; nothing where no experiment has a counterpart.

    published: by `thesis.statements`. Between two test SNRs our value is interpolated; beyond the last it is that one.
    """
    rows, shown = [], []
    for line in published[published["metric"].isin(PUBLISHED_METRICS)].itertuples():
        ours = scores[
            (scores["metric"] == PUBLISHED_METRICS[line.metric])
            & (scores["experiment"] == line.experiment)
            & (scores["model"] == line.model)
            & (scores["elevation"] == CONDITIONS.get(line.condition))
        ].sort_values("test_snr_db")
        snrs = ours["test_snr_db"]
        if not len(ours) or not snrs.is_unique or not snrs.min() <= line.printed_snr_db <= snrs.max():
            continue
        at = min(line.snr_db, snrs.max())
        ours = {name: float(np.interp(at, snrs, ours[name])) for name in ("value", "low", "high")}
        kept = holds(ours["value"], line.relation, line.value)
        table = {
            **line._asdict(),
            "here_at_snr_db": at,
            "ours": ours["value"],
            "low": ours["low"],
            "high": ours["high"],
        }
        rows.append({**table, "holds": kept})
        reduced = "" if thesis.full_size(line.model, settings) else " (here reduced)"
        shown.append(
            {
                "experiment": title(line.experiment),
                "model": f"{model_style(line.model)[2]}{reduced}",
                "tested at": ELEVATIONS[CONDITIONS[line.condition]],
                "its SNR [dB]": f"{line.printed_snr_db:g}",
                "figure": METRICS[PUBLISHED_METRICS[line.metric]],
                f"thesis, {thesis.CENTER_FREQUENCY / 1e9:g} GHz": f"{RELATIONS[line.relation][0]} {line.value}",
                "SNR here [dB]": f"{at:.3g}",
                "here": interval_text(ours),
                "as published": "yes" if kept else "no",
                "source": line.source,
            }
        )
    if not rows:
        return ()
    return (
        Table(
            name="published",
            shown=pd.DataFrame(shown),
            data=pd.DataFrame(rows).drop(columns="Index"),
            caption=(
                "What the reference thesis states of the closed set, split at random, and the same here. Its networks "
                "are full-size ones, its targets other models of the same kinds, and its frequency may differ from "
                "this run's, so agreement is expected in kind only. Values here are at the same noise, which has "
                "another SNR where the definitions differ: interpolated between test SNRs, or at the highest. “As "
                "published” rounds to the printed decimals."
            ),
        ),
    )


def _training(train):
    """What an experiment trains on, in words."""
    noise = training_noise(train["snr_db"])
    if train["elevation"] == "all":
        return f"trained {noise}, at all elevations"
    return f"trained {noise}, at elevation {', '.join(f'{angle:g}' for angle in train['elevation'])}°"


def _dashes(classes):
    """Which class has which dashes, for a title."""
    names = list(DASHES) * len(classes)
    return ", ".join(f"{target} {dash}" for target, dash in zip(classes, names, strict=False))


def _summary(accuracy, validation):
    """Which model is best on the validation images at the highest SNR, and its accuracy on the test images."""
    snr = accuracy["test_snr_db"].max()
    held_out = validation[validation["test_snr_db"] == snr].set_index("model")["value"]
    values = accuracy[accuracy["test_snr_db"] == snr].set_index("model")["value"]
    best = sorted(held_out.index[held_out == held_out.max()], key=model_order)
    if len(best) == len(held_out) > 1:
        parts = ", ".join(f"{model_style(model)[2]} {values[model]:.3f}" for model in best)
        return f"All are alike on the validation images at {snr:g} dB; on the test images: {parts}."
    parts = " and ".join(f"{model_style(model)[2]} ({values[model]:.3f} on the test images)" for model in best)
    return f"Most accurate on the validation images at {snr:g} dB: {parts}."
