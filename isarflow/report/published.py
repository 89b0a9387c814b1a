"""What the reference thesis published, beside the same here: markers in figures and a table."""

import numpy as np
import pandas as pd

from isarflow.report import thesis
from isarflow.report.layout import table
from isarflow.report.plots import MEANT, RELATIONS
from isarflow.report.vocabulary import ACCURACY, ELEVATIONS, F1, select, title, with_interval

MARKERS = ", ".join(f"{sign} {words}" for sign, words in zip("▲▼●", MEANT.values(), strict=True))
FREQUENCY = f"{thesis.CENTER_FREQUENCY / 1e9:g} GHz"
FULL_SIZE = f"thesis, full-size network, {FREQUENCY}"
IN_KIND = f"Its networks are full-size ones at {FREQUENCY}, its targets other models: expect agreement in kind only."
# What a published metric is called in scores.csv, and on the page: of the closed set and of the open one.
CLOSED = {"accuracy": (ACCURACY, "accuracy"), "f1": (F1, "weighted F1")}
OPEN = {"weighted_f1": (F1, "weighted F1")}
# The thesis's adaptations of its networks to the open set: the model and confidence score here that are the same.
ADAPTATIONS = {"softmax_threshold": ("fcnn", "softmax"), "openmax": ("fcnn", "openmax")}
ADAPTATIONS |= {"other_class": ("fcnn_other", "softmax")}
ADAPTATIONS |= {f"capsule_{score}": ("capsule", score) for score in ("mse", "zncc")}
POINT = ["test_snr_db", "value", "low", "high", "n", "snr_definition"]  # the other columns of scores tell curves apart


def beside(results, rows, statements, whose=f"thesis, {FREQUENCY}"):
    """Return curves and published statements by one definition of SNR, and a sentence for the figure's caption.

    rows: of `Results.scores`; statements: of `Results.published_scores`; whose: who published them. Where this run
    lacks a curve by the statements' definition of SNR, all stay by its own, and no statement is left.
    """
    if statements.empty:
        return rows, statements, ""
    curves = rows.drop(columns=POINT).drop_duplicates()
    same = curves.merge(results.mean_scores, how="left")[[*curves, *POINT]]
    if same["value"].isna().any():
        words = " Published values are left out: their SNR is by mean power, by which this run has no scores."
        return rows, statements.iloc[:0], words
    return same, statements, f" Open markers: {whose} ({MARKERS}), at SNRs by mean power like the curves beside them."


def value_at(results, curve, snr):
    """Return a curve's value at an SNR in dB, interpolated: a mapping of ours, low, high and here_at_snr_db.

    Beyond the last SNR at which all images have a value it is that one. None for an SNR that this run does not reach,
    and where a curve is none or several. curve: rows of `Results.mean_scores`.
    """
    curve = curve.sort_values("test_snr_db")
    snrs, highest = curve["test_snr_db"], max(results.settings["noise"]["snr_db"])
    if not len(curve) or not snrs.is_unique or not snrs.min() <= snr <= highest:
        return None
    at = min(snr, snrs.max())
    value, low, high = (float(np.interp(at, snrs, curve[column])) for column in ("value", "low", "high"))
    return {"ours": value, "low": low, "high": high, "here_at_snr_db": at}


def holds(here, line):
    """Whether our value fulfils a printed statement to its decimals; an equality also if it lies in our interval."""
    ours, value, printed = here["ours"], line["value"], float(line["value"])
    rounded = round(ours, len(value.partition(".")[2]))
    kept = {">=": rounded >= printed, "<=": rounded <= printed, ">": ours > printed, "<": ours < printed}
    return bool((kept | {"=": rounded == printed or here["low"] <= printed <= here["high"]})[line["relation"]])


def statements_table(results, name, metrics):
    """Return published statements with our value beside each: one table, or none. metrics: CLOSED or OPEN."""
    data, shown = [], []
    for line in select(results.published_scores, metric=list(metrics)).to_dict("records"):
        model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
        metric, measure = metrics[line["metric"]]
        case = {"model": model, "score": score, "metric": metric, "threshold": "thesis" if score else ""}
        curve = select(results.mean_scores, **case, experiment=line["experiment"], elevation=line["elevation"])
        here = value_at(results, curve, line["snr_db"])
        if here is None:
            continue
        here["holds"] = holds(here, line)
        data.append(line | {"model": model, "score": score} | here)
        reduced = "" if thesis.full_size(model, results.settings) else " (here reduced)"
        row = {"experiment": title(line["experiment"]), "model": results.names.method(model, score) + reduced}
        row |= {"tested at": ELEVATIONS[line["elevation"]], "measure": measure, "its SNR [dB]": f"{line['snr_db']:g}"}
        row[f"thesis, {FREQUENCY}"] = f"{RELATIONS[line['relation']][0]} {line['value']}"
        row |= {"SNR here [dB]": f"{here['here_at_snr_db']:.3g}", "here": with_interval(here | {"value": here["ours"]})}
        shown.append(row | {"as published": "yes" if here["holds"] else "no", "source": line["source"]})
    caption = (
        "What the reference thesis states, split at random, and the same here, the open set with thesis thresholds. "
        f"{IN_KIND} SNRs are by mean power, values here interpolated between test SNRs, or those at the highest that "
        "all images have; “as published”: rounded to the printed decimals, or of an equality within the interval."
    )
    data = pd.DataFrame(data).drop(columns=["elevation", "figure", "reading"], errors="ignore")
    return (table(name, data, shown, caption),) if shown else ()
