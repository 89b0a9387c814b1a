"""What the thesis states beside the same of a run, under the text's reading and under the others of page.yaml.

At the thesis's conditions: split at random, thresholds chosen with unknown targets (`thesis`), SNR by mean power. The
harder ones: split by sector, thresholds chosen without them (`blind`), SNR by mean power as well.
"""

import numpy as np
import pandas as pd

from isarflow.learning.classifier import OTHER
from isarflow.learning.evaluation import thresholds
from isarflow.learning.evaluation.metrics import metrics_of_labels
from isarflow.report.plots import RELATIONS, matrix
from isarflow.report.published import ADAPTATIONS, CLOSED, OPEN, holds, value_at
from isarflow.report.vocabulary import ACCURACY, F1, METHOD, select
from study import anew, pairs
from study.selection import PAGE, networks_of

# What a published metric is called in scores.csv and on the page.
METRICS = {
    **CLOSED,
    **OPEN,
    "training_accuracy": (ACCURACY, "accuracy on training images"),
    "error": (ACCURACY, "share of wrong images"),
    "recall_ufo": ("", "share of the UFO's images rejected"),
}
SPLIT, HARDER = "random", "sector"
AT_RANDOM = [SPLIT, "shuffled"]  # of the readings
COLUMNS = [*METHOD, *("elevation", "threshold", "metric", "test_snr_db", "target", "predicted", "count")]


def rows(results, name, **case):
    """Return the rows of a table of `Results` with these values, of what the config names: it may hold others."""
    named = [(run["experiment"], run["split"], model) for run in results.runs.values() for model in run["models"]]
    named = pd.DataFrame(named, columns=["experiment", "split", "model"]).drop_duplicates()
    table = getattr(results, name) if len(named) else pd.DataFrame(columns=COLUMNS)
    return select(table, **case).merge(named)


def ours(results, experiment, model, metric, score="", elevation="all", threshold="thesis", split=AT_RANDOM):
    """Return the rows of a model at the thesis's conditions, by SNR; score: of the open set, empty for the closed."""
    case = {"experiment": experiment, "split": split, "model": model, "metric": metric, "score": score}
    case |= {"elevation": elevation, "threshold": threshold if score else ""}
    return rows(results, "mean_scores", **case).sort_values("test_snr_db")


def by_sector(results, experiment, model, metric, score="", elevation="all"):
    """Return the rows of the same model by sector with blind thresholds; at trained elevations alone there are none."""
    return ours(results, PAGE["by_sector"].get(experiment), model, metric, score, elevation, "blind", HARDER)


def open_counts(results, experiment, model, score):
    """Return confusion counts (target, predicted) of the open set at the document's conditions and the high SNR."""
    case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "threshold": "thesis"}
    return matrix(rows(results, "confusion", **case, elevation="all", test_snr_db=anew.nearest_snr(results)))


def judge(results, line):
    """Return a published statement with ours beside it. line: a row of `Results.published_scores`, as a mapping.

    Besides its columns: name and words, of what it is; score, empty in the closed set; published, its value as text;
    here, blind, sector: as of `value_at`, or None, at the thesis's conditions, with blind thresholds, and by sector;
    holds: whether it does, None without ours; otherwise: (reading, value, whether it holds) of each that this run has.
    """
    model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
    metric, words = METRICS[line["metric"]]
    line = line | {"model": model, "score": score, "metric": metric, "words": words}
    line |= {"elevation": line["elevation"] or "all", "name": results.names.method(model, score)}
    line |= {"published": f"{RELATIONS[line['relation']][0]} {line['value']}", "here": read(results, line, {})}
    if line["here"] and line["reading"].endswith("training"):
        line["name"] += f" trained at {line['here']['training']}"
    case = results, line["experiment"], model, metric, score
    curves = {"blind": ours(*case, line["elevation"], "blind"), "sector": by_sector(*case)}
    line |= {name: _stated(line, value_at(results, curve, line["snr_db"])) for name, curve in curves.items()}
    # Runs with other models say nothing of a statement that this run cannot judge.
    readings = {name: own for name, own in PAGE["readings"].items() if line["here"] or "models" not in own}
    others = {name: read(results, line, reading) for name, reading in readings.items()}
    otherwise = [(name, here, holds(here, line)) for name, here in others.items() if here]
    return line | {"holds": line["here"] and holds(line["here"], line), "otherwise": otherwise}


def read(results, line, reading):
    """Return what a reading of page.yaml, {} for the text's, makes of a statement, as of `value_at`; None for none."""
    own = f"{line['experiment']}/{line['model']}"
    experiment, _, model = reading.get("rows", {own: own}).get(own, "").partition("/")
    line = line | {"experiment": experiment, "model": model}
    if "models" in reading:  # of which there are scores alone
        results = pairs.results(*reading["models"])
        return None if line["reading"] == "rejected" else _stated(line, READINGS[line["reading"]](results, line))
    if "judged" in reading:
        is_judged = line["score"] and (experiment, model) in networks_of(results.runs)
        return _stated(line, JUDGED[reading["judged"]](results, line)) if is_judged else None
    return _stated(line, READINGS[line["reading"]](results, line)) if model else None


def _stated(line, value):
    """Return a value as of `value_at` as the statement has it: of `wrong` one less it."""
    if line["reading"] != "wrong" or value is None:
        return value
    return _value(1 - value["ours"], value["here_at_snr_db"], 1 - value["high"], 1 - value["low"])


def by_errors(results, line):
    """Judge with the threshold that makes the fewest errors on the test images, at the run's nearest SNR."""
    snr = anew.nearest_snr(results, line["snr_db"])
    found = anew.judged(results, line["experiment"], line["model"], line["score"], snr)
    value = found.metrics["errors"].get(line["metric"])
    return None if value is None else _value(value, snr)


def all_azimuths(results, line):
    """Judge fully connected networks on the images of all azimuths, those that trained among them."""
    network, score, snr = (line["experiment"], line["model"]), line["score"], anew.nearest_snr(results)
    if not line["model"].startswith("fcnn"):
        return None
    every = anew.everywhere(results, *network)
    threshold = anew.judged(results, *network, score, snr).thresholds["validation"]
    predicted = thresholds.apply(every[anew.KNOWN + score], every["predicted"], threshold)
    is_rejected = predicted[every["target"] == "ufo"] == OTHER
    f1 = metrics_of_labels(every["truth"], predicted)[F1]
    return _value(f1 if line["metric"] else is_rejected.mean(), snr)


# What a reading makes of predictions: `judged` in page.yaml.
JUDGED = {"by_errors": by_errors, "all_azimuths": all_azimuths}


def on_curve(results, line):
    """Read our curve at the statement's SNR, or where it states a maximum, the maximum; see READINGS."""
    every = ours(results, *(line[key] for key in ("experiment", "model", "metric", "score", "elevation")))
    if every.empty:
        return None
    if line["reading"] in ("", "wrong"):
        return value_at(results, every, line["snr_db"])
    if line["reading"] == "noisiest training":
        every = select(every, train_snr_db=every["train_snr_db"].min()).tail(1)
    row = every.loc[every["value"].idxmax()]
    return _value(row["value"], row["test_snr_db"], row["low"], row["high"]) | {"training": row["training"]}


def last_epoch(results, line):
    """Take the accuracy on the training images in the last epoch."""
    curve = results.curves.get((line["experiment"], line["model"]))
    return None if curve is None else _value(curve["accuracy"].iloc[-1], line["snr_db"])


def rejected(results, line):
    """Take the share of the UFO's images that are rejected at the high SNR."""
    counts = open_counts(results, line["experiment"], line["model"], line["score"])
    own = counts.loc[counts.index == "ufo"].sum()
    return _value(own.get(OTHER, 0) / own.sum(), anew.nearest_snr(results)) if own.sum() else None


def _value(value, snr, low=np.nan, high=np.nan):
    """Return a value as of `value_at`."""
    return {"ours": value, "low": low, "high": high, "here_at_snr_db": snr}


# How a statement is read off our results: column `reading` of thesis_results.csv.
READINGS = {
    **dict.fromkeys(("", "wrong", "maximum", "best training", "noisiest training"), on_curve),
    "last epoch": last_epoch,
    "rejected": rejected,
}
