"""What the reference thesis published, beside the same here: markers in figures, a table, confusion matrices."""

import numpy as np
import pandas as pd

from isarflow.report import thesis
from isarflow.report.conditions import conditions
from isarflow.report.layout import figure, table
from isarflow.report.plots import MEANT, RELATIONS, draw_matrix, finish, holds, matrix, panels
from isarflow.report.vocabulary import ACCURACY, ELEVATIONS, F1, METHOD, POWERS, heading, select, title, with_interval

MARKERS = ", ".join(f"{sign} {words}" for sign, words in zip("▲▼●", MEANT.values(), strict=True))
FREQUENCY = f"{thesis.CENTER_FREQUENCY / 1e9:g} GHz"
FULL_SIZE = f"thesis, full-size network, {FREQUENCY}"
CLASSES = ["drone", "missile", "other"]  # of its confusion matrices
# What a published metric is called in scores.csv, and on the page: of the closed set and of the open one.
CLOSED = {"accuracy": (ACCURACY, "accuracy"), "f1": (F1, "weighted F1")}
OPEN = {"weighted_f1": (F1, "weighted F1")}
# The thesis's adaptations of its networks to the open set: the model and confidence score here that are the same.
ADAPTATIONS = {
    "softmax_threshold": ("fcnn", "softmax"),
    "openmax": ("fcnn", "openmax"),
    "other_class": ("fcnn_other", "softmax"),
    "capsule_mse": ("capsule", "mse"),
    "capsule_zncc": ("capsule", "zncc"),
}
CURVE = [*METHOD, "elevation", "threshold", "metric"]  # what tells one curve from another
POINT = ["test_snr_db", "value", "low", "high", "n", "snr_definition"]


def by_mean(results, rows):
    """Curves by the thesis's definition of SNR instead of the run's; None where one of them has no row by it.

    rows: of `Results.scores`; columns that are not in there are kept.
    """
    curves = rows.drop(columns=POINT).drop_duplicates()
    same = curves.merge(results.mean_scores[[*CURVE, *POINT]], on=CURVE, how="left")
    return None if same["value"].isna().any() else same


def beside(results, rows, statements, whose=f"thesis, {FREQUENCY}"):
    """What a figure draws of its curves and of the published statements that have a place in it.

    rows: the curves, of `Results.scores`; statements: of `Results.published_scores`; whose: who published them, in
    words. Gives the curves, with statements by their definition of SNR; the statements, none where a curve has no row
    by it; the definition; and a sentence for the caption.
    """
    if not len(statements):
        return rows, statements, results.definition, ""
    same = by_mean(results, rows)
    if same is None:
        words = " Published values are left out: their SNR is by mean power, by which this run has no scores."
        return rows, statements.iloc[:0], results.definition, words
    words = f" Open markers: {whose} ({MARKERS}), at SNRs by mean power like the curves beside them."
    return same, statements, thesis.DEFINITION, words


def value_at(results, curve, snr):
    """A curve's value at an SNR in dB: a mapping of ours, low, high and here_at_snr_db.

    curve: rows of `Results.mean_scores`. Between two test SNRs it is interpolated; beyond the last at which all images
    have one it is that one. None for an SNR that this run does not reach, and where a curve is none or several.
    """
    curve = curve.sort_values("test_snr_db")
    snrs, highest = curve["test_snr_db"], max(results.settings["noise"]["snr_db"])
    if not len(curve) or not snrs.is_unique or not snrs.min() <= snr <= highest:
        return None
    at = min(snr, snrs.max())
    value, low, high = (float(np.interp(at, snrs, curve[column])) for column in ("value", "low", "high"))
    return {"ours": value, "low": low, "high": high, "here_at_snr_db": at}


def statements_table(results, name, metrics):
    """Published statements with our value at the same SNR beside them; nothing where no experiment has a counterpart.

    metrics: CLOSED or OPEN. Between two test SNRs our value is interpolated; beyond the last it is that one.
    """
    data, shown = [], []
    for line in select(results.published_scores, metric=list(metrics)).to_dict("records"):
        model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
        metric, measure = metrics[line["metric"]]
        case = {"experiment": line["experiment"], "model": model, "score": score, "metric": metric}
        case |= {"threshold": "thesis" if score else "", "elevation": line["elevation"]}
        here = value_at(results, select(results.mean_scores, **case), line["snr_db"])
        if here is None:
            continue
        here["holds"] = holds(here["ours"], line["relation"], line["value"], here["low"], here["high"])
        data.append({**line, "model": model, "score": score, **here})
        reduced = "" if thesis.full_size(model, results.settings) else " (here reduced)"
        row = {"experiment": title(line["experiment"]), "model": f"{results.names.method(model, score)}{reduced}"}
        row |= {"tested at": ELEVATIONS[line["elevation"]], "measure": measure, "its SNR [dB]": f"{line['snr_db']:g}"}
        row[f"thesis, {FREQUENCY}"] = f"{RELATIONS[line['relation']][0]} {line['value']}"
        row["SNR here [dB]"] = f"{here['here_at_snr_db']:.3g}"
        row["here"] = with_interval(here | {"value": here["ours"]})
        shown.append(row | {"as published": "yes" if here["holds"] else "no", "source": line["source"]})
    if not data:
        return ()
    images = "of the closed set" if metrics is CLOSED else "of the open set, with thesis thresholds"
    caption = (
        f"What the reference thesis states {images}, split at random, and the same here. Its networks are full-size "
        "ones, its targets other models of the same kinds, and its frequency may differ from this run's, so agreement "
        "is expected in kind only. All SNRs are by mean power, each image's own; values here are interpolated between "
        "test SNRs, or those at the highest at which all images have one. “As published” rounds to the printed "
        "decimals; an equality holds if the published value lies in the interval, too."
    )
    data = pd.DataFrame(data).drop(columns=["elevation", "figure", "reading"])
    return (table(name, data, shown, caption),)


def confusion_figure(results, name, ours, adaptations):
    """The thesis's confusion matrices of its networks on the open set, beside ours at the nearest SNR.

    name: the figure's; ours: rows of confusion.csv of one experiment. adaptations: what the thesis calls its networks,
    and the model and confidence score here that are the same. Nothing where nothing here is the same, or where the
    experiment trains each model several times.
    """
    theirs = select(results.published_confusion, model=list(adaptations))
    ours = select(ours, elevation="all", threshold="thesis")
    if not len(ours):
        return ()
    shift = _offset(results)
    aim = theirs["snr_db"].iloc[0] + shift if len(theirs) else ours["test_snr_db"].max()
    ours = select(ours, test_snr_db=min(ours["test_snr_db"], key=lambda snr: abs(snr - aim)))
    place = results.targets.index
    names, shown = [], []
    for adaptation, (model, score) in adaptations.items():
        cells = select(ours, model=model, score=score)
        if cells["training"].nunique() != 1:
            continue
        names.append(adaptation)
        shown.append((f"{heading(adaptation)}, here", matrix(cells).sort_index(key=lambda index: index.map(place))))
        printed = select(theirs, model=adaptation).set_index("true")[CLASSES]
        if len(printed):
            order = sorted(printed.index, key=lambda target: place(target) if target in results.targets else -1)
            shown.append((f"{heading(adaptation)}, thesis, full size", printed.loc[order]))
    if not names:
        return ()
    snr = ours["test_snr_db"].iloc[0]
    # Below each other where each of ours has a published one.
    rows = 2 if len(shown) == 2 * len(names) else 1
    columns = len(shown) // rows
    drawing, grid = panels(rows, columns, 0.6 + 3 * columns, 3.5 * rows, sharex=False, sharey=False)
    for axes, (text, counts) in zip(grid.T.flat, shown, strict=True):
        draw_matrix(axes, counts, text)
    finish(drawing, grid, "predicted class", "target", legend=False)
    words, note = ", ".join(map(title, names)), ""
    if len(shown) > len(names):
        printed = theirs["snr_db"].iloc[0]
        here = f", {printed + shift:.1f} dB by {POWERS[results.definition]} on average over the images" if shift else ""
        note = (
            f" Beside ours, those of the thesis, of a full-size network at {FREQUENCY} and {printed:g} dB by mean "
            f"power{here}, to which ours are the nearest; its targets are other models of the same kinds, so agreement "
            "is expected in kind only."
        )
    caption = f"{heading(words)} at {snr:g} dB: share of each target's images and their number."
    caption += f"{note}{conditions(results, ours)}"
    alt = f"Confusion matrices of {words} at {snr:g} dB, with those that were published."
    return (figure(name, drawing, ours, alt, caption, wide=columns > 2),)


def _offset(results):
    """By how many dB an image's SNR is higher by this run's definition than by the thesis's: the mean of the open set.

    One number serves where only the nearest test SNR is sought; no curve is moved by it.
    """
    if results.definition == thesis.DEFINITION:
        return 0.0
    targets = results.of_role("known") + results.of_role("unknown")
    return float(np.mean([results.images(name, "clean").attrs["snr_definition_offset_db"] for name in targets]))
