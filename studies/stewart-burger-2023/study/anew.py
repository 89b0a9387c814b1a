"""Predictions judged as the thesis's program judged them: thresholds from test images, images that trained counted."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pandas as pd

from isarflow.core.sweep import snr_label
from isarflow.core.words import signed
from isarflow.learning.classifier import OTHER, config_of, load_classifier
from isarflow.learning.data import images
from isarflow.learning.evaluation import judge, thresholds
from isarflow.learning.evaluation.metrics import metrics_of_labels
from isarflow.learning.predict import classify
from isarflow.learning.tables import KNOWN
from isarflow.report.selection import nearest
from study.markdown import NONE
from study.selection import HIGH_SNR


def plain(score, values):
    """Return values of a confidence score as they are shown: the MSE itself, not minus it."""
    return -values if score == "mse" else values


@cache
def judged(results, run, model, score, snr):
    """Return the open set's test images at an SNR in dB by three thresholds of a confidence score.

    thresholds and metrics by name: `validation` is chosen as always, on the validation images; `errors` has the fewest
    errors on the test images, and `best` the largest weighted F1 there. gain: of weighted F1 by `errors` over that by
    `validation`, with its interval, which it may lack.
    """
    table, column = results.predictions(run, model, snr), KNOWN + score
    test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
    scores, truth, predicted = test[column].to_numpy(float), test["truth"], test["predicted"]
    chosen = {
        "validation": thresholds.choose(table, column, "thesis"),
        "best": thresholds.best(scores, truth, predicted),
        "errors": fewest_errors(scores, (test["role"] == "known").to_numpy()),
    }
    labels = {name: thresholds.apply(scores, predicted, level).astype(str) for name, level in chosen.items()}
    metrics = {name: metrics_of_labels(truth, of) for name, of in labels.items()}
    decided = [judge.Decision(score, "", test, labels[name]) for name in ("errors", "validation")]
    value, low, high = (signed(one, 4) for one in judge.gain(*decided, results.settings["seed"])[:3])
    gain = value if NONE in (low, high) else f"{value} [{low}, {high}]"
    return SimpleNamespace(thresholds=chosen, metrics=metrics, gain=gain)


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
def everywhere(results, run, model):
    """Return target, truth, predicted and known_<score> of all images of the open set at the high SNR, by a network."""
    folder, snr, tables = results.folder / "learning" / "models" / run / model, nearest_snr(results), []
    network, own = load_classifier(folder), config_of(folder)["run"]
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
