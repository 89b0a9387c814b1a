"""Predictions judged as the thesis's program judged them: thresholds from test images, images that trained counted."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pandas as pd

from isarflow.core.sweep import snr_label
from isarflow.learning import images, thresholds
from isarflow.learning.classifier import OTHER
from isarflow.learning.judge import Decision, gain
from isarflow.learning.metrics import metrics_of_labels
from isarflow.learning.model_folder import config_of, load
from isarflow.learning.predict import KNOWN, classify

PROTOCOL = "thesis"  # of the thresholds that are compared with


class Effect(NamedTuple):
    """What a threshold from the test images changes: thresholds, weighted F1 on the test images, and what is gained."""

    chosen: float  # on the validation images
    by_errors: float  # on the test images
    f1: float
    f1_by_errors: float
    largest: float  # of all thresholds on the test images
    gain: tuple  # value, low, high


def fewest_errors(scores, known):
    """The threshold with the fewest errors, known images below it and unknown ones above; the lowest of equals.

    scores: (n,), known: (n,) booleans. What the thesis's listing D.1 minimises on its test images (get_threshold), over
    all thresholds instead of a thousand: a known image above it counts as right, whatever its class.
    """
    levels = np.unique(scores)
    tried = np.concatenate([levels[:1], (levels[:-1] + levels[1:]) / 2, [np.nextafter(levels[-1], np.inf)]])
    rejected = np.searchsorted(np.sort(scores[known]), tried)
    kept = (~known).sum() - np.searchsorted(np.sort(scores[~known]), tried)
    return float(tried[np.argmin(rejected + kept)])


def chosen(table, score):
    """The threshold of a confidence score that the validation images of a prediction table choose."""
    return thresholds.choose(table, KNOWN + score, PROTOCOL)


def effect(table, score, seed):
    """The `Effect` of a prediction table at one SNR, of one confidence score. seed: the config's, for the interval."""
    column, honest = KNOWN + score, chosen(table, score)
    test, fewest = _by_errors(table, score)
    best = thresholds.best(test[column].to_numpy(float), test["truth"], test["predicted"])
    decided = [
        Decision(score, "", test, np.asarray(thresholds.apply(test[column], test["predicted"], threshold), str))
        for threshold in (fewest, honest, best)
    ]
    by_errors, f1, largest = (metrics_of_labels(test["truth"], one.predicted)["f1_weighted"] for one in decided)
    return Effect(honest, fewest, f1, by_errors, largest, gain(*decided[:2], seed)[:3])


def _by_errors(table, score):
    """The rows of a prediction table that are the open set's test images, and the threshold with the fewest errors."""
    test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
    return test, fewest_errors(test[KNOWN + score].to_numpy(float), (test["role"] == "known").to_numpy())


def with_fewest_errors(table, score):
    """The metrics of the open set with the threshold that has the fewest errors there."""
    test, threshold = _by_errors(table, score)
    return metrics_of_labels(test["truth"], thresholds.apply(test[KNOWN + score], test["predicted"], threshold))


@cache
def everywhere(results, run, model, snr):
    """What a fitted network makes of all images of the open set at an SNR in dB, those that trained among them.

    A DataFrame: target, truth, predicted and known_<confidence score> of each image, all azimuths, elevations and
    realizations of the known and the unknown targets.
    """
    folder = results.folder / "learning" / "models" / run / model
    network, own, tables = load(folder), config_of(folder)["run"], []
    seen = {"pixels": own["upsample"], "channels": own["channels"]}
    for role in ("known", "unknown"):
        for target in results.of_role(role):
            store = results.folder / "imaging" / target / f"{snr_label(snr)}.zarr"
            pixels, origin = images.read([store], {target: images.azimuths(store)}, **seen)
            outcome = classify(network, pixels)
            known = {KNOWN + name: values for name, values in outcome.known.items()}
            truth = target if role == "known" else OTHER
            tables.append(pd.DataFrame({"target": target, "truth": truth, "predicted": outcome.labels, **known}))
            print(f"{run}/{model}: {len(origin)} images of {target} at {snr:g} dB")
    return pd.concat(tables, ignore_index=True)


def rejecting(rows, score, threshold):
    """Rows as of `everywhere`, with those below a threshold predicted OTHER."""
    return rows.assign(predicted=thresholds.apply(rows[KNOWN + score], rows["predicted"], threshold))


def at_all_azimuths(results, run, model, score, snr):
    """Every image of the open set, predicted by a fitted network and rejected below the threshold chosen as always."""
    return rejecting(everywhere(results, run, model, snr), score, chosen(results.predictions(run, model, snr), score))


def weighted_f1(rows):
    """The weighted F1 of rows with columns truth and predicted."""
    return metrics_of_labels(rows["truth"], rows["predicted"])["f1_weighted"]


def counts(rows):
    """Confusion counts (target, predicted) of rows."""
    return pd.crosstab(rows["target"], rows["predicted"])


def printed_f1(counts):
    """The weighted F1 of a printed confusion matrix: of counts (target, predicted), where OTHER is a column."""
    cells = counts.rename_axis("target").reset_index().melt("target", var_name="predicted", value_name="count")
    truth = cells["target"].where(cells["target"].isin(counts.columns), OTHER)
    return metrics_of_labels(truth, cells["predicted"], cells["count"].to_numpy(float))["f1_weighted"]
