"""What the sections on learning draw and say in common: curves over the SNR, confusion matrices, words."""

import numpy as np
from matplotlib import colormaps

from learning.experiments import snrs_in_words
from report.layout import GREY, MODELS, model_order, model_style

PROPER = {"fcnn": "FCNN", "openmax": "OpenMax", "svm": "SVM", "knn": "KNN", "lr": "LR", "mse": "MSE", "zncc": "ZNCC"}
MARKERS = "os^Dv<>"
# How a published statement is written, and the marker that stands for it.
RELATIONS = {">=": ("≥", "^"), ">": (">", "^"), "<=": ("≤", "v"), "<": ("<", "v"), "=": ("=", "o")}
SPLITS = ("sector", "random")  # the harder first
SPLIT_TEXT = {"sector": "split by sector", "random": "split at random"}
REJECTING = {"color": GREY, "ls": ":", "lw": 1.6, "label": "everything rejected"}
LETTER, LINE = 0.075, 0.6  # inches


def draw_curves(axes, scores, dash="-", band=True):
    """One line per model over the test SNR, coloured by the model; or by the training, if there are several."""
    trained = scores.sort_values(["train_snr_db", "training"])["training"].unique().tolist()
    for (model, train), curve in fitted(scores):
        color, marker, label = model_style(model)
        curve = curve.dropna(subset="test_snr_db").sort_values("test_snr_db")
        if len(trained) > 1:
            place = trained.index(train)
            color, marker = colormaps["viridis"](0.9 * place / (len(trained) - 1)), MARKERS[place % len(MARKERS)]
            label = f"training SNR: {train}"
        axes.plot(curve["test_snr_db"], curve["value"], dash, color=color, marker=marker, label=label)
        if band:
            axes.fill_between(curve["test_snr_db"], curve["low"], curve["high"], color=color, alpha=0.18, lw=0)


def draw_published(axes, rows, color=None):
    """Published statements as open markers, coloured by their model unless a colour is given."""
    for row in rows.itertuples():
        edge, marker = color or model_style(row.model)[0], RELATIONS[row.relation][1]
        axes.plot(row.snr_db, float(row.value), marker, ms=8, mfc="white", mec=edge, mew=1.5, zorder=3)


def draw_rejecting(axes, values):
    """The weighted F1 of rejecting every image of the open set: a line for each of the values."""
    for value in sorted({round(value, 4) for value in values}):
        axes.axhline(value, **REJECTING)


def split_text(split):
    """A split in words."""
    return SPLIT_TEXT.get(split, split)


def draw_legend(figure, axes):
    """One legend for all axes above them, each entry once, in the order of the models."""
    entries = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    names = [name for _, _, name in MODELS.values()]
    labels = sorted(entries, key=lambda label: names.index(label) if label in names else len(names))
    if labels:
        handles = [entries[label] for label in labels]
        # A column is as wide as its longest entry: letters, and the line before them.
        columns = int(figure.get_figwidth() / (LETTER * max(map(len, labels)) + LINE))
        figure.legend(handles, labels, loc="outside upper center", ncols=min(len(labels), max(columns, 1)))


def draw_confusion(axes, counts):
    """One confusion matrix: colour is the share of the row, text the share and the number of images."""
    share = counts / counts.sum(axis=1).to_numpy()[:, None]
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1.15, aspect="auto")
    axes.grid(False)
    axes.set_xticks(range(len(counts.columns)), counts.columns)
    axes.set_yticks(range(len(counts.index)), counts.index, rotation=90, va="center")
    for (row, column), value in np.ndenumerate(share.to_numpy()):
        text = f"{100 * value:.1f} %\n{counts.iloc[row, column]:,.0f}"
        axes.text(column, row, text, ha="center", va="center", color="white" if value > 0.6 else "black")


def training_order(rows):
    """Sorting key of rows of scores.csv of one training: by its one SNR, without noise and several SNRs last."""
    snr, words = rows[["train_snr_db", "training"]].iloc[0]
    return (np.inf if np.isnan(snr) else snr, words)


def fitted(scores):
    """The (model, training) of the scores and their rows, in the order of the models."""
    groups = scores.groupby(["model", "training"], sort=True)
    return sorted(groups, key=lambda group: (model_order(group[0][0]), training_order(group[1])))


def experiments(scores):
    """The experiments' names, those split by sector first."""
    found = scores[["split", "experiment"]].drop_duplicates().itertuples(index=False, name=None)
    return [name for _, name in sorted(found, key=lambda one: (SPLITS.index(one[0]), one[1]))]


def title(name):
    """An experiment's or model's name in words."""
    return " ".join(PROPER.get(word, word) for word in name.split("_"))


def heading(name):
    """The same at the head of a sentence."""
    return title(name)[0].upper() + title(name)[1:]


def signed(value):
    """A difference with its sign, and three decimals."""
    return f"{value:+.3f}".replace("-", "−")


def interval_text(row):
    return f"{row['value']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"


def training_noise(snr_db):
    """The training SNRs of an experiment's config, in words."""
    if isinstance(snr_db, dict):
        kind, values = next(iter(snr_db.items()))
        several = snrs_in_words(values)
        if kind == "each":
            return f"at each of several SNRs, a model for each ({several})"
        return f"at an SNR drawn for each batch ({several})"
    if isinstance(snr_db, list):
        return f"at several SNRs at once ({snrs_in_words(snr_db)})"
    return "without noise" if snr_db == "clean" else f"at an SNR of {snr_db:g} dB"


def holds(ours, relation, value):
    """Whether our value fulfils a printed statement, to the decimals it was printed with."""
    rounded, printed = round(ours, len(value.partition(".")[2])), float(value)
    return {
        ">=": rounded >= printed,
        "<=": rounded <= printed,
        "=": rounded == printed,
        ">": ours > printed,
        "<": ours < printed,
    }[relation]
