"""What the thesis states beside the same of a run: curves and values at its conditions, and by the harder ones.

At its conditions: split at random, thresholds chosen with unknown targets (`thesis`), SNR by mean power. The harder
ones: split by sector, thresholds chosen without them (`blind`), SNR by mean power as well.
"""

import numpy as np

from isarflow.learning.classifier import OTHER
from isarflow.learning.experiments import training
from isarflow.report.plots import RELATIONS, holds
from isarflow.report.published import ADAPTATIONS, CLOSED, OPEN, value_at
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import ACCURACY, at_snrs, select, with_interval
from study import anew
from study.markdown import NONE, PAGE, table
from study.selection import HIGH_SNR, everywhere_networks, networks_of

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
ALIKE = ("elevation", "upsample", "channels")  # of two experiments that train on the same


def named(results, experiment):
    """Whether the config names an experiment. A table may still hold rows of one that it no longer does."""
    return results.learns and any(run["experiment"] == experiment for run in results.runs.values())


def own_run(results, experiment):
    """The run of an experiment that splits at random and trains once; None where there is none."""
    alike = [run for run in results.runs.values() if run["experiment"] == experiment] if results.learns else []
    return alike[0] if len(alike) == 1 and alike[0]["split"] in AT_RANDOM else None


def present(results, experiment, models, is_open=False):
    """Those of the models that an experiment has, split at random, and in words what is not part of this run.

    is_open: whether it must be tested on unknown targets, too.
    """
    run = own_run(results, experiment)
    if not run or (is_open and not run["open"]):
        return [], f"experiment `{experiment}`{' in the open set' if is_open else ''}, split at random"
    there = [model for model in models if model in run["models"]]
    absent = [results.names.model(model).label for model in models if model not in there]
    return there, f"{' and '.join(absent)} in experiment `{experiment}`" if absent else ""


def judged_anew(results, experiment, model):
    """Whether the page has the predictions of a network at the document's conditions."""
    return results.learns and (experiment, model) in networks_of(results.runs)


def high_snr(results):
    """The run's SNR in dB that is nearest to 24 dB."""
    return nearest(results.settings["noise"]["snr_db"], HIGH_SNR)


def ours(results, experiment, model, metric, score="", elevation="all", threshold="thesis"):
    """The rows of a model at the thesis's conditions, by SNR; score: of the open set, empty for the closed one."""
    case = {"experiment": experiment, "split": AT_RANDOM, "model": model, "metric": metric, "score": score}
    case |= {"elevation": elevation, "threshold": threshold if score else ""}
    rows = results.mean_scores if named(results, experiment) else results.mean_scores.iloc[:0]
    return select(rows, **case).sort_values("test_snr_db")


def by_sector(results, experiment, model, metric, score=""):
    """The rows of the same model by sector with blind thresholds: of the first experiment that trains on the same."""
    own, alike = own_run(results, experiment), []
    for run in results.runs.values() if own and own["elevation"] == "all" else ():
        same = training(run) == training(own) and all(run[key] == own[key] for key in ALIKE)
        if same and run["split"] == HARDER and model in run["models"] and (run["open"] or not score):
            alike.append(run["experiment"])
    case = {"model": model, "metric": metric, "score": score, "elevation": "all", "threshold": "blind" if score else ""}
    return select(results.mean_scores, experiment=sorted(alike)[:1], **case).sort_values("test_snr_db")


def open_cells(results, experiment, model, score):
    """Rows of confusion.csv of the open set at the document's conditions and the high SNR."""
    case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "threshold": PROTOCOLS[SPLIT]}
    return select(results.confusion, **case, elevation="all", test_snr_db=high_snr(results))


def judge(results, line):
    """A published statement with ours beside it. line: a row of `Results.published_scores`, as a mapping.

    Besides the statement's own columns: name and words, of what it is; score: the confidence score, empty in the closed
    set; published, its value as text; here, blind, sector: mappings as of `value_at`, or None, at the thesis's
    conditions, the same with blind thresholds, and by sector; holds: whether the statement does, None without ours;
    otherwise: the same of each reading of the page that this run has of it, as (reading, value, whether it holds).
    """
    model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
    found = {**line, "model": model, "score": score, "name": results.names.method(model, score)}
    found |= {"words": METRICS[line["metric"]][1], "published": f"{RELATIONS[line['relation']][0]} {line['value']}"}
    read = {name: _read(results, found, **reading).get("here") for name, reading in PAGE["readings"].items()}
    otherwise = [(name, here, kept(here, line)) for name, here in read.items() if here]
    found |= {"here": None, "blind": None, "sector": None} | READINGS[line["reading"]](results, found)
    return found | {"holds": kept(found["here"], line), "otherwise": otherwise}


def kept(here, line):
    """Whether our value, as of `value_at`, fulfils a statement; None without ours."""
    return bool(holds(here["ours"], line["relation"], line["value"], here["low"], here["high"])) if here else None


def _read(results, line, words, rows=None, judged=None):
    """What a reading of the page makes of a statement: as of READINGS, nothing where it is none of the statement's."""
    own = f"{line['experiment']}/{line['model']}"
    experiment, model = (rows or {own: own}).get(own, "/").split("/")
    line = line | {"experiment": experiment, "model": model}
    if judged is None:
        return READINGS[line["reading"]](results, line) if model else {}
    return JUDGED[judged](results, line) if line["score"] and judged_anew(results, experiment, model) else {}


def by_errors(results, line):
    """With the threshold that makes the fewest errors on the test images, at the SNR that the run has nearest."""
    snr, metric = nearest(results.settings["noise"]["snr_db"], line["snr_db"]), METRICS[line["metric"]][0]
    if not metric:
        return {}
    predictions = results.predictions(line["experiment"], line["model"], snr)
    value = anew.with_fewest_errors(predictions, line["score"])[metric]
    return {"here": _value(1 - value if line["reading"] == "wrong" else value, snr)}


def all_azimuths(results, line):
    """Of fully connected networks: on the images of all azimuths, those that trained among them."""
    if (line["experiment"], line["model"]) not in everywhere_networks(results.runs):
        return {}
    every = anew.at_all_azimuths(results, line["experiment"], line["model"], line["score"], high_snr(results))
    if line["reading"] != "rejected":
        return {"here": _value(anew.weighted_f1(every), high_snr(results))}
    return {"here": _value((select(every, target="ufo")["predicted"] == OTHER).mean(), high_snr(results))}


# What a reading makes of predictions: `judged` in page.yaml.
JUDGED = {"by_errors": by_errors, "all_azimuths": all_azimuths}


def on_curve(results, line):
    """Read off our curve at the statement's SNR, or at the SNR of its maximum; `wrong`: one less what it has there."""
    experiment, model, score, snr = (line[key] for key in ("experiment", "model", "score", "snr_db"))
    if not present(results, experiment, [model], bool(score))[0]:
        return {}
    case, elevation = (results, experiment, model, METRICS[line["metric"]][0], score), line["elevation"]
    curves = {"here": ours(*case, elevation), "sector": by_sector(*case)}
    curves |= {"blind": ours(*case, elevation, "blind")} if score else {}
    if line["reading"] == "maximum" and len(curves["here"]):
        snr = float(curves["here"].loc[curves["here"]["value"].idxmax(), "test_snr_db"])
    values = {key: value_at(results, curve, snr) for key, curve in curves.items()}
    if line["reading"] == "wrong":
        for value in filter(None, values.values()):
            value |= {"ours": 1 - value["ours"], "low": 1 - value["high"], "high": 1 - value["low"]}
    return values


def over_trainings(results, line):
    """The best of all training and test SNRs; or of the noisiest training that at the highest test SNR."""
    rows = ours(results, line["experiment"], line["model"], ACCURACY) if results.learns else ()
    if not len(rows):
        return {}
    if line["reading"] == "best training":
        row = rows.loc[rows["value"].idxmax()]
    else:
        noisiest = rows[rows["train_snr_db"] == rows["train_snr_db"].min()]
        row = noisiest.loc[noisiest["test_snr_db"].idxmax()]
    name = f"{line['name']} trained at {row['training']}"
    return {"name": name, "here": _value(row["value"], row["test_snr_db"], row["low"], row["high"])}


def last_epoch(results, line):
    """The accuracy on the training images in the last epoch."""
    curve = results.curves.get((line["experiment"], line["model"])) if results.learns else None
    return {} if curve is None else {"here": _value(curve["accuracy"].iloc[-1], line["snr_db"])}


def rejected(results, line):
    """The share of the UFO's images that are rejected at the high SNR."""
    if not named(results, line["experiment"]):
        return {}
    cells = open_cells(results, line["experiment"], line["model"], line["score"])
    counts = select(cells, target="ufo").groupby("predicted")["count"].sum()
    return {"here": _value(counts.get(OTHER, 0) / counts.sum(), high_snr(results))} if len(counts) else {}


def _value(value, snr, low=np.nan, high=np.nan):
    """A value as of `value_at`."""
    return {"ours": value, "low": low, "high": high, "here_at_snr_db": snr}


# How a statement is read off our results: column `reading` of thesis_results.csv.
READINGS = {
    **dict.fromkeys(("", "maximum", "wrong"), on_curve),
    **dict.fromkeys(("best training", "noisiest training"), over_trainings),
    "last epoch": last_epoch,
    "rejected": rejected,
}


def value_text(value, snr):
    """A value as of `value_at` with its interval, and its SNR where that is not the one asked for."""
    if value is None:
        return NONE
    other = f" (at {value['here_at_snr_db']:.3g} dB)" if value["here_at_snr_db"] != snr else ""
    return f"{with_interval(value | {'value': value['ours']})}{other}"


def trained_words(run):
    """What a run trained at, in words."""
    words = training(run)
    return "without noise" if words == "clean" else f"at {words}"


def values_table(curves, head=""):
    """Our values with their intervals at some SNRs. curves: (words, rows by SNR); head: of the words' column."""
    snrs = shown_snrs(snr for _, rows in curves for snr in rows["test_snr_db"])
    return table([{head: words} | at_snrs(rows, snrs, with_interval) for words, rows in curves if len(rows)])


def shown_snrs(every):
    """Those of the test SNRs that tables show, the nearest to those of the page."""
    every = sorted(set(every))
    asked = [snr for snr in PAGE["snrs"] if every[0] <= snr <= every[-1]] if every else []
    return list(dict.fromkeys(nearest(every, snr) for snr in asked)) or every[-1:]
