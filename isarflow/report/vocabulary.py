"""The page's one vocabulary of the learning stage's tables: which rows are meant, called what, in what order, best."""

from collections import namedtuple

import numpy as np
import pandas as pd

from isarflow.learning.experiments import MOVED
from isarflow.report import layout

ACCURACY, F1 = "accuracy", "f1_weighted"  # metrics
MEASURES = {ACCURACY: "accuracy", F1: "weighted F1"}  # as axes call them
# First the standard case, a view between those that train; then the limit, aspects far from them; then the thesis's.
SCHEMES = {"elevation": "split by elevation", "sector": "split by sector", "random": "split at random"}
SCHEMES["family, novel others"] = "split by model, other things of new kinds"
SCHEMES["family, seen others"] = "split by model, other things of known kinds"
SCHEMES["shuffled"] = "split at random, mirror images apart"
# As tables name them (`experiments.split_of`): each on a turntable, and with targets that move.
SPLITS = {
    f"{scheme}{moved}": words + (", targets that move" if moved else "")
    for scheme, words in SCHEMES.items()
    for moved in ("", MOVED)
}
ELEVATIONS = {"all": "all elevations", "trained": "trained elevations"}  # that are tested
# Of thresholds, by what they ask for: validation images of known targets alone, also of targets of role other, also of
# unknown ones. By the one that asks for least methods are chosen, and shown first.
PROTOCOLS = ("kept", "blind", "thesis")
LEAD, *_, THESIS = PROTOCOLS
# What tells one thing tried from another.
METHOD = ["split", "experiment", "model", "training", "score"]
HEADINGS = {"training": "training SNR", "score": "confidence score", "elevation": "tested at"}  # in tables
MIDDLE = (-12, 12)  # dB: the SNRs by which methods are ranked
POWERS = {"mean": "mean power", "peak_3db": "peak_3db power"}  # by definition of SNR
PROPER = {"fcnn": "FCNN", "openmax": "OpenMax", "svm": "SVM", "knn": "KNN", "lr": "LR", "mse": "MSE", "zncc": "ZNCC"}
# By the places that models and confidence scores state.
MODEL_COLORS = (layout.BLUE, layout.INDIGO, layout.VERMILION, layout.GREEN, layout.BLACK, layout.PURPLE)
MODEL_COLORS += (layout.ORANGE, layout.CRIMSON, layout.TEAL, layout.OLIVE, layout.SKY, layout.GREY)
MODEL_MARKERS, SCORE_MARKERS = "oosDx^vPXph+", "osD^v<>x+*PXphd8"


def select(table, **columns):
    """Return the rows whose columns have these values; for a column that may have several, a list or tuple."""
    for column, value in columns.items():
        table = table[table[column].isin(value if isinstance(value, list | tuple) else [value])]
    return table


# How a model or a confidence score appears, everywhere alike: its place is a sorting key, its words stand in sentences,
# with `curve` it is drawn.
Look = namedtuple("Look", "place label words color marker curve")


class Names:
    """What models and confidence scores are called, how they are drawn, and in what order they come.

    stated: what the files of models state (see `core.kinds.page_names`); those that state nothing come last, under
    their own name, and their main confidence score is the first in a table. models: names of all of the run, so that
    each has a colour of its own.
    """

    def __init__(self, stated, models=()):
        self.stated = stated
        taken = {stated["models"][name][-1] for name in models if name in stated["models"]}
        free = [place for place in range(len(MODEL_COLORS)) if place not in taken] or [*range(len(MODEL_COLORS))]
        own = sorted(name for name in models if name not in stated["models"])
        self.own = {name: free[number % len(free)] for number, name in enumerate(own)}

    def model(self, name):
        label, words, *place = self.stated["models"].get(name, (name, title(name)))
        return self._look(name, label, words, place, MODEL_COLORS, MODEL_MARKERS)

    def score(self, name):
        label, *place = self.stated["scores"].get(name, [name.replace("_", " ")])
        return self._look(name, label, label, place, layout.PALETTE, SCORE_MARKERS)

    def _look(self, name, label, words, place, colors, markers):
        # The same in every figure; of a name that neither states a place nor was given one, in every run.
        index = place[0] if place else self.own.get(name, sum(name.encode()))
        color, marker = colors[index % len(colors)], markers[index % len(markers)]
        curve = {"color": color, "marker": marker, "label": label}
        return Look((*(place or [np.inf]), name), label, words, color, marker, curve)

    def method(self, model, score):
        """Return a model, and the confidence score with which it rejects unless it is called alike, in words."""
        return ", ".join(dict.fromkeys([self.model(model).label, *([self.score(score).label] if score else [])]))

    def by_main_score(self, rows):
        """Return the rows of each model's main confidence score, and those of the closed set, which has none.

        rows: of scores.csv, validation.csv or confusion.csv.
        """
        main = {}
        for model, scores in rows[rows["score"] != ""].groupby("model")["score"]:
            stated = self.stated["main"].get(model)
            main[model] = stated if stated in set(scores) else scores.iloc[0]
        return rows[(rows["score"] == "") | (rows["score"] == rows["model"].map(main))]

    def cells(self, row, *columns):
        """Return what a row has in these columns as cells of a table: {heading: text}."""
        words = {"experiment": title, "elevation": lambda key: ELEVATIONS.get(key, key)}
        words |= {"model": lambda name: self.model(name).label, "score": lambda name: self.score(name).label}
        return {HEADINGS.get(column, column): words.get(column, str)(row[column]) for column in columns}

    def groups(self, table, *columns):
        """Return (values, rows) for each combination of values of these columns, in the order of the page."""
        groups = table.groupby(list(columns))
        return sorted(groups, key=lambda group: [self._place(column, group[1].iloc[0]) for column in columns])

    def values(self, table, column):
        return [value for (value,), _ in self.groups(table, column)]

    def _place(self, column, row):
        value = row[column]
        if column in ("split", "experiment"):
            return split_place(row["split"]), value
        if column == "training":  # by its SNR; without noise, and several SNRs, last
            return np.nan_to_num(row["train_snr_db"], nan=np.inf), value
        return getattr(self, column)(value).place if column in ("model", "score") else value


def title(name):
    return " ".join(PROPER.get(word, word) for word in name.split("_"))


def heading(name):
    return title(name)[0].upper() + title(name)[1:]


def listed(words):
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


split_place = [*SPLITS].index  # to sort by


def run_title(run, fold=False):
    """Return a run in words, without its fold, or with it where it has one. run: what `experiments.runs` gives."""
    number = run["division"]["fold"]
    words = title(run["name"].removesuffix(f"_fold{number}"))
    return f"{words}, fold {number}" if fold and number else words


def snr_axis(definition):
    return f"test SNR by {POWERS[definition]} [dB]"


def with_interval(row):
    """Return a value with its interval, which it may lack. row: its value, low and high, by these names."""
    words = f"{row['value']:.3f}"
    return words if pd.isna(row["low"]) else f"{words} [{row['low']:.3f}, {row['high']:.3f}]"


def at_snrs(curve, snrs, text=with_interval):
    """Return a curve's cells at these SNRs, {heading: text}, by a function of a row; a dash where it has none."""
    rows = {row["test_snr_db"]: row for row in curve.to_dict("records")}
    return {f"{snr:g} dB": text(rows[snr]) if snr in rows else "–" for snr in snrs}


def middle(snrs):
    """Return the SNRs in dB by which methods are ranked: those from -12 to 12 dB; all where there is none of them."""
    snrs = sorted(set(snrs))
    return [snr for snr in snrs if MIDDLE[0] <= snr <= MIDDLE[1]] or snrs


def span_text(table):
    """Return those of a table in words."""
    first, *_, last = middle(table["test_snr_db"]) * 2
    return f"{first:g} dB" if first == last else f"{first:g} to {last:g} dB"


def comparable(table):
    """Return the rows of a table at the middle SNRs, in each split at those that all its methods were tested at."""
    rows, parts = select(table, test_snr_db=middle(table["test_snr_db"])), []
    for _, part in rows.groupby("split", sort=False):
        shared = set.intersection(*(set(method["test_snr_db"]) for _, method in part.groupby(METHOD)))
        parts.append(select(part, test_snr_db=[*shared]) if shared else part)
    return pd.concat(parts or [rows])


def ranked(validation):
    """Return the mean weighted F1 of each METHOD over the middle SNRs, split by split, the best first.

    validation: rows of one set of images and protocol. What is best is chosen by them, never by the test images.
    """
    means = comparable(validation).groupby(METHOD)["value"].mean().reset_index()
    order = means.assign(place=means["split"].map(split_place), least=-means["value"])
    return means.loc[order.sort_values(["place", "least", *METHOD[1:]]).index]
