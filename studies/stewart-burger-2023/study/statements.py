"""What the thesis states beside the same of a run: curves and values at its conditions, and by the harder ones.

At its conditions: split at random, thresholds chosen with unknown targets (`thesis`), SNR by mean power. The harder
ones: split by sector, thresholds chosen without them (`blind`), SNR by mean power as well.
"""

import numpy as np
import pandas as pd

from isarflow.learning.classifier import OTHER
from isarflow.learning.experiments import training
from isarflow.report.plots import RELATIONS, holds, matrix
from isarflow.report.published import ADAPTATIONS, CLOSED, OPEN, value_at
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import ACCURACY, METHOD, at_snrs, select, with_interval
from study import anew
from study.markdown import NONE, table
from study.selection import PAGE, at_highest, everywhere_networks, networks_of

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
WORDS = {"random": "split at random", "sector": "split by sector"}
PROTOCOLS = {"random": "thesis", "sector": "blind"}  # of thresholds, by split
KEPT = {None: NONE, True: "yes", False: "no"}  # whether a statement holds, in words
COLUMNS = [*METHOD, *("elevation", "threshold", "metric", "test_snr_db", "target", "predicted", "count")]
ALIKE = ("elevation", "upsample", "channels")  # of two experiments that train on the same


def rows(results, name, **case):
    """Return the rows of a table of `Results` with these values, of the experiments and models that the config names.

    A table may still hold rows of others. Of a run that learns nothing there are none.
    """
    if not results.runs:
        return pd.DataFrame(columns=COLUMNS)
    named = [(run["experiment"], run["split"], model) for run in results.runs.values() for model in run["models"]]
    named = pd.DataFrame(named, columns=["experiment", "split", "model"]).drop_duplicates()
    return select(getattr(results, name), **case).merge(named)


def own_run(results, experiment):
    """Return the run of an experiment that splits at random and trains once; None where there is none."""
    alike = [run for run in results.runs.values() if run["experiment"] == experiment]
    return alike[0] if len(alike) == 1 and alike[0]["split"] in AT_RANDOM else None


def judged_anew(results, experiment, model):
    """Return whether the page has the predictions of a network at the document's conditions."""
    return (experiment, model) in networks_of(results.runs)


def ours(results, experiment, model, metric, score="", elevation="all", threshold="thesis"):
    """Return the rows of a model at the thesis's conditions, by SNR; score: of the open set, empty for the closed."""
    case = {"experiment": experiment, "split": AT_RANDOM, "model": model, "metric": metric, "score": score}
    case |= {"elevation": elevation, "threshold": threshold if score else ""}
    return rows(results, "mean_scores", **case).sort_values("test_snr_db")


def by_sector(results, experiment, model, metric, score=""):
    """Return the rows of the same model by sector with blind thresholds: of the first experiment that trains alike."""
    own, alike = own_run(results, experiment), []
    for run in results.runs.values() if own and own["elevation"] == "all" else ():
        same = training(run) == training(own) and all(run[key] == own[key] for key in ALIKE)
        if same and run["split"] == HARDER and model in run["models"] and (run["open"] or not score):
            alike.append(run["experiment"])
    case = {"model": model, "metric": metric, "score": score, "elevation": "all", "threshold": "blind" if score else ""}
    return rows(results, "mean_scores", experiment=sorted(alike)[:1], **case).sort_values("test_snr_db")


def open_counts(results, experiment, model, score):
    """Return confusion counts (target, predicted) of the open set at the document's conditions and the high SNR."""
    case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "threshold": PROTOCOLS[SPLIT]}
    return matrix(rows(results, "confusion", **case, elevation="all", test_snr_db=anew.nearest_snr(results)))


def judge(results, line):
    """Return a published statement with ours beside it. line: a row of `Results.published_scores`, as a mapping.

    Besides the statement's own columns: name and words, of what it is; score: the confidence score, empty in the closed
    set; published, its value as text; here, blind, sector: mappings as of `value_at`, or None, at the thesis's
    conditions, the same with blind thresholds, and by sector; holds: whether the statement does, None without ours;
    otherwise: the same of each reading of the page that this run has of it, as (reading, value, whether it holds).
    """
    model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
    metric, words = METRICS[line["metric"]]
    line = line | {"model": model, "score": score, "metric": metric, "words": words}
    line |= {"published": f"{RELATIONS[line['relation']][0]} {line['value']}"}
    line |= {"here": READINGS[line["reading"]](results, line), "name": results.names.method(model, score)}
    if line["here"] and "training" in line["here"]:
        line["name"] += f" trained at {line['here']['training']}"
    case = results, line["experiment"], model, metric, score
    blind = ours(*case, line["elevation"], "blind") if score else ()
    line |= {"blind": on_curve(results, line, blind), "sector": on_curve(results, line, by_sector(*case))}
    read = {name: _read(results, line, reading) for name, reading in PAGE["readings"].items()}
    otherwise = [(name, here, kept(here, line)) for name, here in read.items() if here]
    return line | {"holds": kept(line["here"], line), "otherwise": otherwise}


def kept(here, line):
    """Return whether our value, as of `value_at`, fulfils a statement; None without ours."""
    return bool(holds(here["ours"], line["relation"], line["value"], here["low"], here["high"])) if here else None


def _read(results, line, reading):
    """Return what a reading of the page makes of a statement, as of `value_at`; None where it is none of its own."""
    own = f"{line['experiment']}/{line['model']}"
    experiment, _, model = reading.get("rows", {own: own}).get(own, "").partition("/")
    line = line | {"experiment": experiment, "model": model}
    if "judged" in reading:
        is_judged = line["score"] and judged_anew(results, experiment, model)
        return JUDGED[reading["judged"]](results, line) if is_judged else None
    return READINGS[line["reading"]](results, line) if model else None


def by_errors(results, line):
    """Judge with the threshold that makes the fewest errors on the test images, at the run's nearest SNR."""
    snr = anew.nearest_snr(results, line["snr_db"])
    found = anew.judged(results, line["experiment"], line["model"], line["score"], snr)
    value = found.metrics["errors"].get(line["metric"])
    return None if value is None else _value(1 - value if line["reading"] == "wrong" else value, snr)


def all_azimuths(results, line):
    """Judge fully connected networks on the images of all azimuths, those that trained among them."""
    network = line["experiment"], line["model"]
    if network not in everywhere_networks(results.runs):
        return None
    every = anew.at_all_azimuths(results, *network, line["score"])
    if line["metric"]:
        return _value(anew.weighted_f1(every), anew.nearest_snr(results))
    return _value((select(every, target="ufo")["predicted"] == OTHER).mean(), anew.nearest_snr(results))


# What a reading makes of predictions: `judged` in page.yaml.
JUDGED = {"by_errors": by_errors, "all_azimuths": all_azimuths}


def on_curve(results, line, curve=None):
    """Read off a curve at the statement's SNR, or at that of its maximum; `wrong`: one less what it has there.

    curve: rows by SNR; without one, ours at the thesis's conditions.
    """
    if curve is None:
        case = (line[key] for key in ("experiment", "model", "metric", "score", "elevation"))
        curve = ours(results, *case)
    if not len(curve):
        return None
    is_maximum = line["reading"] == "maximum"
    snr = float(curve.loc[curve["value"].idxmax(), "test_snr_db"]) if is_maximum else line["snr_db"]
    value = value_at(results, curve, snr)
    if value and line["reading"] == "wrong":
        return _value(1 - value["ours"], value["here_at_snr_db"], 1 - value["high"], 1 - value["low"])
    return value


def over_trainings(results, line):
    """Take the best of all training and test SNRs; or the noisiest training at the highest test SNR."""
    every = ours(results, line["experiment"], line["model"], ACCURACY)
    if not len(every):
        return None
    if line["reading"] == "noisiest training":
        every = at_highest(select(every, train_snr_db=every["train_snr_db"].min()))
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
    **dict.fromkeys(("", "maximum", "wrong"), on_curve),
    **dict.fromkeys(("best training", "noisiest training"), over_trainings),
    "last epoch": last_epoch,
    "rejected": rejected,
}


def value_text(value, snr):
    """Return a value as of `value_at` with its interval, and its SNR where that is not the one asked for."""
    if value is None:
        return NONE
    other = f" (at {value['here_at_snr_db']:.3g} dB)" if value["here_at_snr_db"] != snr else ""
    return f"{with_interval(value | {'value': value['ours']})}{other}"


def values_table(curves, head=""):
    """Return a table of our values with their intervals at some SNRs.

    curves: (words, rows by SNR); head: of the words' column.
    """
    snrs = shown_snrs(snr for _, of in curves for snr in of["test_snr_db"])
    return table([{head: words} | at_snrs(of, snrs, with_interval) for words, of in curves if len(of)])


def shown_snrs(every):
    """Return those of the test SNRs that tables show, the nearest to those of the page."""
    every = sorted(set(every))
    asked = [snr for snr in PAGE["snrs"] if every[0] <= snr <= every[-1]] if every else []
    return list(dict.fromkeys(nearest(every, snr) for snr in asked)) or every[-1:]
