"""The page's one vocabulary of scores: which rows are meant, what they are called, in what order, which are best.

Tables are those of the learning stage (see learning/scores.py): scores, validation and confusion.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from isarflow.learning.experiments import snrs_in_words, training
from isarflow.report.layout import (
    BLACK,
    BLUE,
    CRIMSON,
    GREEN,
    GREY,
    INDIGO,
    OLIVE,
    ORANGE,
    PALETTE,
    PURPLE,
    SKY,
    TEAL,
    VERMILION,
)

ACCURACY, F1, GAIN = "accuracy", "f1_weighted", "f1_weighted_gain"  # metrics
# First the standard case, a view between those that train; then the limit, aspects far from them; then the thesis's.
SPLITS = {"elevation": "split by elevation", "sector": "split by sector", "random": "split at random"}
SPLITS["shuffled"] = "split at random, mirror images apart"
ELEVATIONS = {"all": "all elevations", "trained": "trained elevations"}  # that are tested
PROTOCOLS = ("blind", "thesis", "kept")  # of thresholds; the first is the one that methods are chosen by
DRAWN = PROTOCOLS[:2]  # in figures of which each takes much room or ink
# What tells one thing tried from another.
METHOD = ["split", "experiment", "model", "training", "score"]
MIDDLE = (-12, 12)  # dB: the SNRs by which methods are ranked
POWERS = {"mean": "mean power", "peak_3db": "peak_3db power"}  # by definition of SNR
PROPER = {"fcnn": "FCNN", "openmax": "OpenMax", "svm": "SVM", "knn": "KNN", "lr": "LR", "mse": "MSE", "zncc": "ZNCC"}
# By the places that models and confidence scores state.
MODEL_COLORS = (BLUE, INDIGO, VERMILION, GREEN, BLACK, PURPLE, ORANGE, CRIMSON, TEAL, OLIVE, SKY, GREY)
MODEL_MARKERS, SCORE_MARKERS = "oosDx^vPXph+", "osD^v<>x+*PXphd8"


def select(table, **columns):
    """The rows of a table whose columns have these values; for a column that may have several, a list or tuple."""
    for column, value in columns.items():
        several = isinstance(value, list | tuple)
        table = table[table[column].isin(value) if several else table[column] == value]
    return table


def of_run(table, run, model):
    """The rows of one run of a model. run: what `experiments.runs` gives."""
    return select(table, experiment=run["experiment"], training=training(run), model=model)


def at_highest(table):
    """The rows at the highest test SNR."""
    return table[table["test_snr_db"] == table["test_snr_db"].max()]


@dataclass(frozen=True)
class Look:
    """How a model or a confidence score appears on the page, everywhere alike."""

    place: tuple  # sorting key
    label: str
    words: str  # the same within a sentence
    color: str
    marker: str


class Names:
    """What models and confidence scores are called, how they are drawn, and in what order they come.

    stated: what the files of models say of themselves (see `core.kinds.page_names`): `models`, a mapping of a model's
    name to its label, words for a sentence and place, and `scores`, of a confidence score's to its label and place.
    Those that state nothing come last, under their own name. models: names of all of the run, so that each has a
    colour of its own, as far as there are enough.
    """

    def __init__(self, stated, models=()):
        self.stated = stated
        taken = {stated["models"][name][-1] for name in models if name in stated["models"]}
        free = [place for place in range(len(MODEL_COLORS)) if place not in taken] or [*range(len(MODEL_COLORS))]
        own = sorted(name for name in models if name not in stated["models"])
        self.own = {name: free[number % len(free)] for number, name in enumerate(own)}

    def model(self, name):
        label, words, *place = self.stated["models"].get(name, (name, title(name)))
        return self._look(name, label, words, place, MODEL_COLORS, MODEL_MARKERS, self.own.get(name))

    def score(self, name):
        label, *place = self.stated["scores"].get(name, [name.replace("_", " ")])
        return self._look(name, label, label, place, PALETTE, SCORE_MARKERS)

    @staticmethod
    def _look(name, label, words, place, colors, markers, index=None):
        # The same in every figure of the run; of what neither states a place nor was given one, of every run.
        index = place[0] if place else sum(name.encode()) if index is None else index
        return Look(
            (*(place or [np.inf]), name), label, words, colors[index % len(colors)], markers[index % len(markers)]
        )

    def method(self, model, score):
        """A model, and the confidence score with which it rejects, in words."""
        return f"{self.model(model).label}{f', {self.score(score).label}' if score else ''}"

    def groups(self, table, *columns):
        """The rows for each combination of values of these columns: (values, rows) in the order of the page."""
        groups = table.groupby(list(columns))
        return sorted(groups, key=lambda group: [self._place(column, group[1].iloc[0]) for column in columns])

    def values(self, table, column):
        """The values of a column in the order of the page."""
        return [value for (value,), _ in self.groups(table, column)]

    def _place(self, column, row):
        if column == "split":
            return split_place(row["split"])
        if column == "experiment":
            return split_place(row["split"]), row["experiment"]
        if column == "training":  # by its SNR; without noise, and several SNRs, last
            return np.inf if np.isnan(row["train_snr_db"]) else row["train_snr_db"], row["training"]
        if column in ("model", "score"):
            return getattr(self, column)(row[column]).place
        return row[column]


def title(name):
    """An experiment's or model's name in words."""
    return " ".join(PROPER.get(word, word) for word in name.split("_"))


def heading(name):
    """The same at the head of a sentence."""
    return title(name)[0].upper() + title(name)[1:]


def split_text(split):
    """A split in words."""
    return SPLITS[split]


def listed(words):
    """'a, b and c' of words."""
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


def split_place(split):
    """A split's place among SPLITS, to sort by."""
    return [*SPLITS].index(split)


def run_title(run, fold=False):
    """A run in words, without its fold, or with it where it has one. run: what `experiments.runs` gives."""
    number = run["division"]["fold"]
    words = title(run["name"].removesuffix(f"_fold{number}"))
    return f"{words}, fold {number}" if fold and number else words


def snr_axis(definition):
    """The label of an axis of test SNRs."""
    return f"test SNR by {POWERS[definition]} [dB]"


def with_interval(row):
    """A value with its interval, which it may lack. row: its value, low and high, by these names."""
    words = f"{row['value']:.3f}"
    return words if pd.isna(row["low"]) else f"{words} [{row['low']:.3f}, {row['high']:.3f}]"


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


def at_snrs(curve, snrs, text):
    """Cells of a table, one for each of the SNRs: {heading: text}; a dash where the curve has no row.

    curve: rows by SNR; text: a function of a row.
    """
    rows = {row["test_snr_db"]: row for row in curve.to_dict("records")}
    return {f"{snr:g} dB": text(rows[snr]) if snr in rows else "–" for snr in snrs}


def middle(snrs):
    """The SNRs in dB by which methods are ranked: those from -12 to 12 dB; all where there is none of them."""
    snrs = sorted(set(snrs))
    return [snr for snr in snrs if MIDDLE[0] <= snr <= MIDDLE[1]] or snrs


def middle_text(table):
    """The same in words."""
    snrs = middle(table["test_snr_db"])
    return f"{snrs[0]:g} to {snrs[-1]:g} dB" if len(snrs) > 1 else f"{snrs[0]:g} dB"


def ranked(validation):
    """The mean weighted F1 of each method over the middle SNRs on the validation images, the best first.

    validation: rows of weighted F1 of one set of images and one protocol. Columns METHOD and value; in the order of
    SPLITS. What is best is chosen by this, never by the test images.
    """
    rows = validation[validation["test_snr_db"].isin(middle(validation["test_snr_db"]))]
    means = rows.groupby(METHOD)["value"].mean().reset_index()
    order = pd.DataFrame({"split": means["split"].map(split_place), "value": -means["value"]})
    order = order.join(means[METHOD[1:]])
    return means.loc[order.sort_values(list(order)).index]
