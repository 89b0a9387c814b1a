"""How far the random split flatters, and how far the folds of the other splits are from each other."""

import numpy as np
import pandas as pd

from isarflow.report.conditions import conditions, meaning
from isarflow.report.layout import BLACK, GREY, Section, figure, signed, table
from isarflow.report.plots import draw_rejecting, finish, panels
from isarflow.report.selection import TABLE_SNRS, evenly
from isarflow.report.vocabulary import ACCURACY, DRAWN, F1, METHOD, PROTOCOLS, at_highest, select, title, with_interval

PLACE, NEEDS = ("recognition", 6), "learns"  # on the page, see page.py
SAME = ["model", "training", "train_snr_db", "elevation", "metric", "score", "threshold", "test_snr_db"]
KEYS = ["images", *SAME]
OWN = ["experiment", "value", "low", "high", "validation"]
OTHERS = ("elevation", "sector")  # splits that the random one is compared with
# The panels of the folds' figure: threshold, metric, and what is drawn.
PANELS = (
    ("", ACCURACY, "closed set: accuracy"),
    *((protocol, F1, f"open set, {protocol} thresholds:\nweighted F1") for protocol in DRAWN),
)


def section(results):
    """Return what the splits are, their comparison, and the folds; nothing for runs that only split at random."""
    pairs, figures = select(paired(results), elevation="all"), folds_figure(results)
    if not len(pairs) and not figures:
        return ()
    text = (
        "A view and its mirror image in a target's mirror planes are one, and fall on the same side. "
        f"{meaning({run['split'] for run in results.runs.values()})} Scores are of the test images of all folds "
        "together, each judged by the model of its fold. Intervals come from resampling blocks, by sector the folds "
        "and else arcs of an aperture, and are widened where blocks are few; one fold alone has none by sector."
    )
    accuracy, opened = select(pairs, metric=ACCURACY, score=""), select(pairs, metric=F1, threshold=PROTOCOLS)
    tables = [open_table(results.names, opened)] if len(opened) else []
    tables += [accuracy_table(results.names, accuracy)] if len(accuracy) else []
    return (Section("splits", "How far splits and folds differ", (text,), figures, tuple(tables)),)


def folds_figure(results):
    """Draw each fold's score at the highest SNR beside that of all folds with its interval: a row for each model.

    Nothing where no experiment has several folds.
    """
    drawn = fold_values(results)
    if not len(drawn):
        return ()
    rows = results.names.groups(drawn, "experiment", "model", "training")
    shown = [panel for panel in PANELS if panel[0] in set(drawn["threshold"])]
    drawing, grid = panels(1, len(shown), 3 + 2.8 * len(shown), 1.2 + 0.36 * len(rows), sharex=False)
    for axes, (threshold, _, words) in zip(grid.flat, shown, strict=True):
        axes.set_title(words)
        for place, ((_, model, _), row) in enumerate(rows):
            values = select(row, threshold=threshold)
            alone, together = values[values["fold"] != ""], values[values["fold"] == ""]
            # Side by side, the first fold uppermost.
            beside = place + np.linspace(-0.3, 0.3, len(alone))
            axes.plot(alone["value"], beside, "o", color=GREY, ms=3.5, zorder=3, label="one fold")
            reach = [together["value"] - together["low"], together["high"] - together["value"]]
            look = {"fmt": "D", "color": results.names.model(model).color, "ms": 4.5, "lw": 1.4, "capsize": 3}
            axes.errorbar(together["value"], [place] * len(together), xerr=reach, **look)
        if threshold:
            draw_rejecting(axes, results.rejecting(select(drawn, threshold=threshold)["experiment"]), upright=True)
    labels = [f"{results.names.model(model).label}, {title(experiment)}" for (experiment, model, _), _ in rows]
    grid[0, 0].set_yticks(range(len(rows)), labels)
    grid[0, 0].set_ylim(len(rows) - 0.5, -0.5)
    grid[0, -1].plot([], [], "D", color=BLACK, ms=4.5, label="all folds, with the 95 % interval")
    finish(drawing, grid, "")
    caption = (
        f"How far the folds differ at {drawn['test_snr_db'].max():g} dB: each fold's test images alone, and all "
        "together, of an open set with each model's confidence score that is best on the validation images."
        f"{conditions(results, drawn)}"
    )
    alt = "Accuracy and open-set weighted F1 of each fold and of all folds together, for each model that has folds."
    return (figure("folds", drawing, drawn, alt, caption, wide=True),)


def fold_values(results):
    """Return what `folds_figure` draws: rows of scores at the highest SNR, of each fold and, with fold empty, of all.

    Of an open set with the confidence score that is best on the validation images.
    """
    parts = []
    for threshold, metric, _ in PANELS:
        case = {"elevation": "all", "threshold": threshold, "metric": metric}
        alone, together, held_out = (
            at_highest(select(table, **case)) for table in (results.fold_scores, results.scores, results.validation)
        )
        best = held_out.sort_values("value", ascending=False, kind="stable").drop_duplicates(METHOD[:-1])[METHOD]
        folded = alone[METHOD].drop_duplicates().merge(best, on=METHOD)  # without experiments of one fold
        parts += [table.merge(folded, on=METHOD) for table in (together, alone)]
    return pd.concat(parts)


def paired(results):
    """Return scores under the random split with those of the same model and training images under other splits.

    Columns KEYS and, with each split's name, OWN: experiment, value, low, high and validation, the value on the
    validation images; NaN where a split has no such row. Rows of the random split alone are left out.
    """
    images = {
        run["experiment"]: repr((run["elevation"], run["upsample"], run["channels"])) for run in results.runs.values()
    }
    same = ["split", "experiment", *SAME]
    held_out = results.validation.rename(columns={"value": "validation"})[[*same, "validation"]]
    scores = results.scores.merge(held_out, how="left", on=same)
    # An experiment tested on the open set has the closed set's rows too: any of several is as good.
    scores = scores.assign(images=scores["experiment"].map(images)).drop_duplicates(["split", *KEYS])
    others = [split for split in OTHERS if split in set(scores["split"])]
    random, *own = (
        select(scores, split=split).set_index(KEYS)[OWN].add_suffix(f"_{split}") for split in ("random", *others)
    )
    return random.join(own).dropna(how="all", subset=[f"value_{split}" for split in others]).reset_index()


def _compared(rows):
    """Return the splits but the random one of which rows of `paired` have values."""
    return [split for split in OTHERS if f"value_{split}" in rows and rows[f"value_{split}"].notna().any()]


def accuracy_table(names, rows):
    """Make the table of accuracy at some SNRs: a row for each split of each model, and for each difference."""
    snrs, shown = evenly(rows["test_snr_db"].unique(), TABLE_SNRS), []
    for (model, training, _), curve in names.groups(rows, "model", "training", "images"):
        compared, curve = _compared(curve), curve.set_index("test_snr_db").loc[snrs]
        lines = {split: curve[f"value_{split}"].map("{:.3f}".format) for split in (*compared, "random")}
        for split in compared:
            lines[f"random − {split}"] = (curve["value_random"] - curve[f"value_{split}"]).map(signed)
        for split, values in lines.items():
            line = {"model": names.model(model).label, "training SNR": training, "split": split}
            shown.append(line | {f"{snr:g} dB": value for snr, value in values.items()})
    caption = "Accuracy on the known targets at some test SNRs. The CSV file holds all SNRs, and the 95 % intervals."
    return table("split_accuracy", rows, shown, caption)


def open_table(names, rows):
    """Make the table of open-set weighted F1 at the highest SNR, with each model's best confidence score by protocol.

    Best is which has the largest weighted F1 on the validation images at that SNR, under the first split that it has.
    """
    top, shown = at_highest(rows), []
    compared = _compared(top)
    for protocol in PROTOCOLS:
        for (model, training, _), group in names.groups(select(top, threshold=protocol), "model", "training", "images"):
            row = group.loc[group[f"validation_{_compared(group)[0]}"].idxmax()]
            line = {"model": names.model(model).label, "training SNR": training, "thresholds": protocol}
            line["confidence score"] = names.score(row["score"]).label
            for split in (*compared, "random"):
                own = {key: row[f"{key}_{split}"] for key in ("value", "low", "high")}
                line[split] = "–" if pd.isna(own["value"]) else with_interval(own)
            line |= {f"random − {split}": signed(row["value_random"] - row[f"value_{split}"]) for split in compared}
            shown.append(line)
    caption = (
        f"Open-set weighted F1 at {top['test_snr_db'].max():g} dB with its 95 % interval, for each model with the "
        "confidence score that does best on the validation images, not those split at random."
    )
    return table("split_open", rows, shown, caption)
