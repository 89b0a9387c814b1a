"""The classifiers: scores against SNR with intervals, beside published ones, and prediction times."""

import itertools

import numpy as np
import pandas as pd

from report.layout import MODELS, Figure, Section, Table, canvas, model_order, model_style, style, to_svg
from report.selection import TABLE_SNRS, evenly

METRICS = {"accuracy": "accuracy", "f1_weighted": "weighted F1", "f1_macro": "macro F1"}
ELEVATIONS = {"all": "all elevations", "trained": "trained elevations"}
# What a published condition is called in scores.csv.
CONDITIONS = {"test at elevation 0": "trained", "test at all elevations": "all", "": "all"}
RELATIONS = {">=": ("≥", "^"), ">": (">", "^"), "<=": ("≤", "v"), "<": ("<", "v"), "=": ("=", "o")}
DASHES = {"solid": "-", "dashed": "--", "dotted": ":", "dash-dot": "-."}  # a class each
COLUMNS = 3  # experiments side by side in the headline


def headline(results):
    """Accuracy above weighted F1 against SNR at all elevations, a column per experiment; a single one side by side."""
    scores = results.scores[results.scores["elevation"] == "all"]
    names = _experiments(scores)
    metrics = ["accuracy", "f1_weighted"]
    columns = min(COLUMNS, len(names))
    blocks = -(-len(names) // columns)
    shape = (2 * blocks, columns) if len(names) > 1 else (1, 2)
    with style():
        figure = canvas(10.2 if columns > 2 else 9, 0.5 + 2.3 * shape[0])
        grid = figure.subplots(*shape, squeeze=False, sharex=True, sharey=True)
        for axes in grid.flat:
            axes.set_axis_off()
        for (place, name), (row, metric) in itertools.product(enumerate(names), enumerate(metrics)):
            block, column = divmod(place, columns)
            axes = grid[2 * block + row, column] if len(names) > 1 else grid[0, row]
            axes.set_axis_on()
            _curves(axes, scores[(scores["experiment"] == name) & (scores["metric"] == metric)])
            axes.set(ylabel=METRICS[metric], title=_title(name))
            if metric == metrics[-1] or len(names) == 1:
                axes.set_xlabel("test SNR [dB]")
                axes.tick_params(labelbottom=True)
        _legend(figure, grid.flat)
        svg = to_svg(figure)
    shown = scores[scores["metric"].isin(metrics)]
    return Figure(
        name="headline",
        svg=svg,
        data=shown,
        alt="Accuracy and weighted F1 against test SNR for each experiment and model. " + _summary(shown),
        caption=(
            "Accuracy and weighted F1 on test images at all elevations against their SNR; bands are "
            f"95 % intervals. {_summary(shown)}"
        ),
        wide=True,
    )


def section(results):
    scores, published = results.scores, results.published_scores
    train = results.settings["learning"]["experiments"]
    return Section(
        id="learning",
        title="Learning",
        text=(
            "Each model learns the known targets from its experiment's training images and is tested at every SNR on "
            "azimuths that it was not trained at. Bands and brackets are 95 % intervals, from resampling whole "
            "azimuths.",
        ),
        figures=(
            *(experiment_figure(name, train[name]["train"], scores, published) for name in _experiments(scores)),
            *(confusion_figure(name, results.confusion) for name in _experiments(scores)),
        ),
        tables=(accuracy_table(scores), *published_table(scores, published)),
    )


def experiment_figure(name, train, scores, published):
    """One experiment: accuracy with the published statements as markers, then recall and precision of each class.

    train: that part of the experiment's config; scores, published: of all experiments.
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
            _curves(axes, accuracy[accuracy["elevation"] == elevation])
            for row in published[published["condition"].map(CONDITIONS) == elevation].itertuples():
                color, marker = model_style(row.model)[0], RELATIONS[row.relation][1]
                axes.plot(row.snr_db, float(row.value), marker, ms=8, mfc="white", mec=color, mew=1.5, zorder=3)
            axes.set(title=f"tested at {ELEVATIONS[elevation]}", ylabel="accuracy")
        for axes, metric in zip(panels[-2:], ("recall", "precision"), strict=True):
            for target, dash in zip(classes, list(DASHES.values()) * len(classes), strict=False):
                _curves(axes, whole[whole["metric"] == f"{metric}_{target}"], dash, band=False)
            axes.set(title=_dashes(classes), ylabel=f"{metric} of each class")
        for axes in panels:
            axes.set_xlabel("test SNR [dB]")
        _legend(figure, panels)
        svg = to_svg(figure)
    markers = (
        " Open markers are statements of the reference thesis: ▲ at least, ▼ at most, ● equal to."
        if len(published)
        else ""
    )
    return Figure(
        name=f"learning_{name}",
        svg=svg,
        data=part,
        alt=f"Experiment {_title(name)}: accuracy, and recall and precision of {', '.join(classes)}, against test SNR.",
        caption=f"{_title(name).capitalize()}: {_training(train)}. {_summary(accuracy)}{markers}",
        wide=True,
    )


def confusion_figure(name, confusion):
    """How often each true class was taken for which, at a middle SNR and at the highest; a column per model."""
    part = confusion[(confusion["experiment"] == name) & (confusion["elevation"] == "all")]
    snrs = evenly(part["test_snr_db"].unique().tolist(), 3)[-2:]
    part = part[part["test_snr_db"].isin(snrs)]
    runs = [run for run, _ in _runs(part)]
    with style():
        figure = canvas(0.6 + 2.3 * len(runs), 0.4 + 2.1 * len(snrs))
        grid = figure.subplots(len(snrs), len(runs), squeeze=False)
        for (row, snr), (column, run) in itertools.product(enumerate(snrs), enumerate(runs)):
            axes = grid[row, column]
            cells = part[(part["test_snr_db"] == snr) & (part["model"] == run[0]) & (part["train_snr_db"] == run[1])]
            _confusion(axes, cells.pivot(index="truth", columns="predicted", values="count").fillna(0))
            axes.set_title(f"{model_style(run[0])[2]} at {snr:g} dB")
            axes.set_ylabel("true class" if column == 0 else "")
            axes.set_xlabel("predicted class" if row == len(snrs) - 1 else "")
        svg = to_svg(figure)
    return Figure(
        name=f"confusion_{name}",
        svg=svg,
        data=part,
        alt=f"Confusion matrices of {_title(name)} at test SNRs of {' and '.join(f'{snr:g}' for snr in snrs)} dB.",
        caption=(
            f"{_title(name).capitalize()}: test images at all elevations, true class (row) against predicted class; "
            "share of the row and number."
        ),
    )


def _confusion(axes, counts):
    """One confusion matrix: colour is the share of the row, text the share and the number of images."""
    share = counts / counts.sum(axis=1).to_numpy()[:, None]
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1.15, aspect="auto")
    axes.grid(False)
    axes.set_xticks(range(len(counts.columns)), counts.columns)
    axes.set_yticks(range(len(counts.index)), counts.index, rotation=90, va="center")
    for (row, column), value in np.ndenumerate(share.to_numpy()):
        text = f"{100 * value:.1f} %\n{counts.iloc[row, column]:,.0f}"
        axes.text(column, row, text, ha="center", va="center", color="white" if value > 0.6 else "black")


def accuracy_table(scores):
    """Accuracy with its interval at some SNRs: a row per experiment, model and set of test elevations."""
    rows = scores[scores["metric"] == "accuracy"]
    snrs = evenly(rows["test_snr_db"].dropna().unique().tolist(), TABLE_SNRS)
    shown = []
    groups = rows.groupby(["experiment", "model", "train_snr_db", "elevation"])
    for (experiment, model, train, elevation), curve in sorted(
        groups, key=lambda group: (group[0][0], model_order(group[0][1]), *group[0][2:])
    ):
        line = {
            "experiment": _title(experiment),
            "model": model_style(model)[2],
            "trained at": _noise(train),
            "tested at": ELEVATIONS.get(elevation, elevation),
        }
        curve = curve.set_index("test_snr_db")
        for snr in snrs:
            line[f"{snr:g} dB"] = _interval(curve.loc[snr]) if snr in curve.index else "–"
        shown.append(line)
    return Table(
        name="accuracy",
        shown=pd.DataFrame(shown),
        data=rows,
        caption="Accuracy at some test SNRs with its 95 % interval. The CSV file holds all SNRs.",
    )


def published_table(scores, published):
    """Published statements with our value beside them; nothing where no experiment has a counterpart."""
    rows, shown = [], []
    accuracy = scores[scores["metric"] == "accuracy"]
    for line in published[published["metric"] == "accuracy"].itertuples():
        ours = accuracy[
            (accuracy["experiment"] == line.experiment)
            & (accuracy["model"] == line.model)
            & (accuracy["elevation"] == CONDITIONS.get(line.condition))
            & (accuracy["test_snr_db"] == line.snr_db)
        ]
        if len(ours) != 1:
            continue
        ours = ours.iloc[0]
        holds = _holds(ours["value"], line.relation, line.value)
        rows.append({**line._asdict(), "ours": ours["value"], "low": ours["low"], "high": ours["high"], "holds": holds})
        shown.append(
            {
                "experiment": _title(line.experiment),
                "model": model_style(line.model)[2],
                "tested at": ELEVATIONS[CONDITIONS[line.condition]],
                "SNR [dB]": f"{line.snr_db:g}",
                "reference thesis": f"{RELATIONS[line.relation][0]} {line.value}",
                "here": _interval(ours),
                "as published": "yes" if holds else "no",
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
                "Accuracies that the reference thesis states, and the same ones here. Its targets are other models of "
                "the same kinds, and its frequency may differ from this run's, so agreement is expected in kind only. "
                "“As published” rounds to the printed decimals."
            ),
        ),
    )


def _holds(ours, relation, value):
    """Whether our value fulfils a printed statement, to the decimals it was printed with."""
    rounded, printed = round(ours, len(value.partition(".")[2])), float(value)
    return {
        ">=": rounded >= printed,
        "<=": rounded <= printed,
        "=": rounded == printed,
        ">": ours > printed,
        "<": ours < printed,
    }[relation]


def _training(train):
    """What an experiment trains on, in words."""
    noise = "without noise" if train["snr_db"] == "clean" else f"at an SNR of {train['snr_db']:g} dB"
    if train["elevation"] == "all":
        return f"trained {noise}, at all elevations"
    return f"trained {noise}, at elevation {', '.join(f'{angle:g}' for angle in train['elevation'])}°"


def _noise(train_snr_db):
    """The noise in the training images, as it stands in scores.csv, for tables and legends."""
    return "no noise" if train_snr_db == "clean" else f"{float(train_snr_db):g} dB"


def _dashes(classes):
    """Which class has which dashes, for a title."""
    names = list(DASHES) * len(classes)
    return ", ".join(f"{target} {dash}" for target, dash in zip(classes, names, strict=False))


def _runs(scores):
    """The (model, training SNR) of the scores and their rows, in the order of the models."""
    groups = scores.groupby(["model", "train_snr_db"], sort=True)
    return sorted(groups, key=lambda group: (model_order(group[0][0]), group[0][1]))


def _experiments(scores):
    return sorted(scores["experiment"].unique())


def _title(name):
    return name.replace("_", " ")


def _interval(row):
    return f"{row['value']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"


def _curves(axes, scores, dash="-", band=True):
    """One line per model (and per training SNR, if there are several) over the test SNR."""
    several = scores["train_snr_db"].nunique() > 1
    for (model, train), curve in _runs(scores):
        color, marker, label = model_style(model)
        curve = curve.dropna(subset="test_snr_db").sort_values("test_snr_db")
        label = f"{label}, trained at {_noise(train)}" if several else label
        axes.plot(curve["test_snr_db"], curve["value"], dash, color=color, marker=marker, label=label)
        if band:
            axes.fill_between(curve["test_snr_db"], curve["low"], curve["high"], color=color, alpha=0.18, lw=0)


def _legend(figure, axes):
    """One legend for all axes above them, each entry once, in the order of the models."""
    entries = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    names = [name for _, _, name in MODELS.values()]
    labels = sorted(entries, key=lambda label: [not label.startswith(name) for name in names])
    if labels:
        handles = [entries[label] for label in labels]
        figure.legend(handles, labels, loc="outside upper center", ncols=min(len(labels), 6))


def _summary(scores):
    """The best model at the highest SNR and all elevations, in one sentence for captions."""
    accuracy = scores[(scores["metric"] == "accuracy") & (scores["elevation"] == "all") & scores["test_snr_db"].notna()]
    top = accuracy[accuracy["test_snr_db"] == accuracy["test_snr_db"].max()]
    parts = []
    for name, rows in top.groupby("experiment", sort=True):
        best = rows[rows["value"] == rows["value"].max()]
        names = " and ".join(model_style(model)[2] for model in best["model"])
        where = f" in {_title(name)}" if top["experiment"].nunique() > 1 else ""
        parts.append(
            f"{names} {'are' if len(best) > 1 else 'is'} the most accurate at "
            f"{best['test_snr_db'].iloc[0]:g} dB{where}, with {best['value'].iloc[0]:.3f}"
        )
    return "; ".join(parts) + "."
