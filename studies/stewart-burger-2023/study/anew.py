"""Predictions judged as the thesis's program judged them: thresholds from test images, images that trained counted."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pandas as pd

from isarflow.core.sweep import snr_label
from isarflow.core.words import number, signed
from isarflow.learning import images, judge, thresholds
from isarflow.learning.classifier import OTHER
from isarflow.learning.metrics import metrics_of, metrics_of_labels
from isarflow.learning.model_folder import config_of, load
from isarflow.learning.predict import KNOWN, classify
from isarflow.report.published import CLASSES
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import F1, select
from study.markdown import NONE
from study.selection import HIGH_SNR


def plain(score, values):
    """Return values of a confidence score as they are shown: the MSE itself, not minus it."""
    return -values if score == "mse" else values


class Judged(NamedTuple):
    """The open set's test images by three thresholds of a confidence score.

    `validation` is chosen as always, on the validation images; `errors` has the fewest errors on the test images, and
    `best` the largest weighted F1 there.
    """

    thresholds: dict  # by these names
    metrics: dict  # of each a mapping as of `metrics_of`
    gain: str  # of weighted F1 by `errors` over that by `validation`, with its interval, which it may lack

    def cells(self, score):
        """Return two thresholds and what they make as cells of a table. score: the confidence score's name."""
        own, by_errors = (
            (number(plain(score, self.thresholds[name])), f"{self.metrics[name][F1]:.4f}")
            for name in ("validation", "errors")
        )
        cells = {"threshold from validation images": own[0], "weighted F1": own[1]}
        cells |= {"threshold from test images, by errors": by_errors[0], "its weighted F1": by_errors[1]}
        return cells | {"what that adds": self.gain}


@cache
def judged(results, run, model, score, snr):
    """Return the `Judged` predictions of a network at an SNR in dB."""
    table, column = results.predictions(run, model, snr), KNOWN + score
    test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
    scores, truth, predicted = test[column].to_numpy(float), test["truth"], test["predicted"]
    chosen = {
        "validation": thresholds.choose(table, column, "thesis"),
        "errors": fewest_errors(scores, (test["role"] == "known").to_numpy()),
        "best": thresholds.best(scores, truth, predicted),
    }
    labels = {name: thresholds.apply(scores, predicted, level).astype(str) for name, level in chosen.items()}
    metrics = {name: metrics_of_labels(truth, of) for name, of in labels.items()}
    decided = [judge.Decision(score, "", test, labels[name]) for name in ("errors", "validation")]
    value, low, high = (signed(one, 4) for one in judge.gain(*decided, results.settings["seed"])[:3])
    return Judged(chosen, metrics, value if NONE in (low, high) else f"{value} [{low}, {high}]")


def fewest_errors(scores, known):
    """Return the threshold with the fewest errors, known images below it and unknown ones above; the lowest of equals.

    scores: (n,), known: (n,) booleans. What the thesis's listing D.1 minimises on its test images (get_threshold), over
    all thresholds instead of a thousand: a known image above it counts as right, whatever its class.
    """
    levels = np.unique(scores)
    tried = np.concatenate([levels[:1], (levels[:-1] + levels[1:]) / 2, [np.nextafter(levels[-1], np.inf)]])
    rejected = np.searchsorted(np.sort(scores[known]), tried)
    kept = (~known).sum() - np.searchsorted(np.sort(scores[~known]), tried)
    return float(tried[np.argmin(rejected + kept)])


def nearest_snr(results, aim=HIGH_SNR):
    """Return the run's SNR in dB that is nearest to one of the thesis's."""
    return nearest(results.settings["noise"]["snr_db"], aim)


@cache
def _everywhere(results, run, model):
    """Return what a fitted network makes of all images of the open set at the high SNR, those that trained among them.

    A DataFrame: target, truth, predicted and known_<confidence score> of each image, all azimuths, elevations and
    realizations of the known and the unknown targets.
    """
    folder, snr, tables = results.folder / "learning" / "models" / run / model, nearest_snr(results), []
    network, own = load(folder), config_of(folder)["run"]
    for target in results.of_role("known") + results.of_role("unknown"):
        store = results.folder / "imaging" / target / f"{snr_label(snr)}.zarr"
        where = {target: images.azimuths(store)}
        pixels, origin = images.read([store], where, pixels=own["upsample"], channels=own["channels"])
        outcome = classify(network, pixels)
        known = {KNOWN + name: values for name, values in outcome.known.items()}
        truth = target if target in results.of_role("known") else OTHER
        tables.append(pd.DataFrame({"target": target, "truth": truth, "predicted": outcome.labels, **known}))
        print(f"{run}/{model}: {len(origin)} images of {target} at {snr:g} dB")
    return pd.concat(tables, ignore_index=True)


def at_all_azimuths(results, run, model, score):
    """Return target, truth and predicted of every image of the open set at the high SNR, by a fitted network.

    Below the threshold that is chosen as always an image is predicted OTHER.
    """
    rows = _everywhere(results, run, model)
    threshold = judged(results, run, model, score, nearest_snr(results)).thresholds["validation"]
    return rows.assign(predicted=thresholds.apply(rows[KNOWN + score], rows["predicted"], threshold))


def weighted_f1(rows):
    """Return the weighted F1 of rows with columns truth and predicted."""
    return metrics_of_labels(rows["truth"], rows["predicted"])[F1]


def printed_matrix(results, name):
    """Return a published confusion matrix (target, predicted), and the weighted F1 of what is printed there."""
    counts = select(results.published_confusion, model=name).set_index("true")[CLASSES]
    classes = counts.groupby(lambda target: target if target in CLASSES else OTHER).sum().loc[CLASSES]
    return counts, metrics_of(classes, CLASSES, CLASSES)[F1]
