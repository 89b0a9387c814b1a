"""How far the random split flatters, and how far the folds of the other splits are from each other."""

import numpy as np
import pandas as pd

from isarflow.report.conditions import conditions
from isarflow.report.layout import BLACK, GREY, Section, figure, signed, table
from isarflow.report.plots import draw_rejecting, finish, panels
from isarflow.report.selection import TABLE_SNRS, evenly
from isarflow.report.vocabulary import (
    ACCURACY,
    DRAWN,
    F1,
    METHOD,
    PROTOCOLS,
    SPLITS,
    at_highest,
    at_snrs,
    select,
    title,
    with_interval,
)

KEYS = ["images", "model", "training", "train_snr_db", "elevation", "metric", "score", "threshold", "test_snr_db"]
OWN = ["experiment", "value", "low", "high", "validation"]
OTHERS = [split for split in SPLITS if split not in ("random", "shuffled")]
# The panels of the folds' figure: threshold, metric, and what is drawn.
PANELS = (
    ("", ACCURACY, "closed set: accuracy"),
    *((protocol, F1, f"open set, {protocol} thresholds:\nweighted F1") for protocol in DRAWN),
)


def section(results):
    """What the splits are, the comparison, and the folds; nothing for runs that only split at random."""
    pairs, figures = select(paired(results), elevation="all"), folds_figure(results)
    if not len(pairs) and not figures:
        return ()
    accuracy = select(pairs, metric=ACCURACY, score="")
    opened = select(pairs, metric=F1, threshold=PROTOCOLS)
    compared = [f"{_images(results, accuracy)} {plainly(results.names, accuracy)}"] if len(pairs) else []
    return (
        Section(
            id="splits",
            title="How far the random split flatters" if len(pairs) else "How far the folds differ",
            text=(what_splits_are(results), *compared),
            figures=figures,
            tables=(
                *([open_table(results.names, opened)] if len(opened) else []),
                *([accuracy_table(results.names, accuracy)] if len(accuracy) else []),
            ),
        ),
    )


def what_splits_are(results):
    """How aspects are divided, and what scores and their intervals are, in sentences."""
    split, aperture = results.settings["learning"]["split"], results.settings["imaging"]["aperture"]
    used = {run["split"] for run in results.runs.values()}
    guard = f", {split['spacing']:g}° or more from those that train" if split["spacing"] else ""
    words = {
        "elevation": "Split by elevation, every second elevation trains, at all azimuths, and those between validate "
        f"and test by turns{guard}, in two folds: the standard case, a view between those of a library, as radar "
        "benchmarks test at another depression angle.",
        "sector": f"Split by sector, the aspects are cut into {split['folds']} arcs. In each fold one of them tests, "
        "another arc validates, and the rest trains a model of the fold's own, but for guards: any two sides are an "
        f"aperture apart, {aperture} azimuth steps, so that no test image shares a sample with one that trained or "
        "validated: the limit, aspects that a library lacks.",
        "random": "Neighbouring azimuths share most of their aperture: split at random, as in the reference thesis, "
        "test images have near-copies among the training images.",
        "shuffled": "Shuffled as by the thesis's program, a view and its mirror image may fall on two sides.",
    }
    return (
        "A view and its mirror image in a target's mirror planes are one, and fall on the same side. "
        f"{' '.join(text for name, text in words.items() if name in used)} Scores are of the test images of all folds "
        "together, each judged by the model of its fold. Intervals come from resampling blocks, by sector the folds "
        "and else arcs of an aperture, and are widened where blocks are few; one fold alone has none by sector."
    )


def folds_figure(results):
    """Each fold's score at the highest SNR beside that of all folds with its interval: a row for each model.

    Of an open set with the model's confidence score that is best on the validation images. Nothing where no experiment
    has several folds.
    """
    drawn = fold_values(results)
    if not len(drawn):
        return ()
    rows = results.names.groups(drawn, "experiment", "model", "training")
    shown = [panel for panel in PANELS if len(select(drawn, threshold=panel[0]))]
    drawing, grid = panels(1, len(shown), 3 + 2.8 * len(shown), 1.2 + 0.36 * len(rows), sharex=False)
    labels = []
    for place, ((experiment, model, training), row) in enumerate(rows):
        several = drawn[drawn["experiment"] == experiment]["training"].nunique() > 1
        look = results.names.model(model)
        labels.append(f"{look.label}, {title(experiment)}{f', {training}' if several else ''}")
        for axes, (threshold, _, _) in zip(grid.flat, shown, strict=True):
            values = select(row, threshold=threshold)
            alone, together = values[values["fold"] != ""], values[values["fold"] == ""]
            # Side by side, the first fold uppermost.
            beside = place + np.linspace(-0.3, 0.3, len(alone))
            axes.plot(alone["value"], beside, "o", color=GREY, ms=3.5, zorder=3, label="one fold")
            for one in together.itertuples():
                reach = [[one.value - one.low], [one.high - one.value]]
                axes.errorbar(one.value, place, xerr=reach, fmt="D", color=look.color, ms=4.5, lw=1.4, capsize=3)
    for axes, (threshold, _, words) in zip(grid.flat, shown, strict=True):
        axes.set_title(words)
        if threshold:
            draw_rejecting(axes, results.rejecting(select(drawn, threshold=threshold)["experiment"]), upright=True)
    grid[0, 0].set_yticks(range(len(rows)), labels)
    grid[0, 0].set_ylim(len(rows) - 0.5, -0.5)
    grid[0, -1].plot([], [], "D", color=BLACK, ms=4.5, label="all folds, with the 95 % interval")
    finish(drawing, grid, "")
    snr = drawn["test_snr_db"].max()
    caption = (
        f"How far the folds differ at {snr:g} dB: each fold's test images alone, and all together, of an open set with "
        f"each model's confidence score that is best on the validation images. {_widest(drawn, rows, labels)}"
        f"{conditions(results, drawn)}"
    )
    alt = f"Accuracy and open-set weighted F1 of each fold and of all at {snr:g} dB, for each model that has folds."
    return (figure("folds", drawing, drawn, alt, caption, wide=True),)


def fold_values(results):
    """What `folds_figure` draws: rows of scores at the highest SNR, of each fold and, with fold empty, of all."""
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


def _widest(drawn, rows, labels):
    """The model of whom the folds differ most in the closed set, in a sentence."""
    values = [select(row[row["fold"] != ""], threshold="").set_index("fold")["value"] for _, row in rows]
    label, values = max(zip(labels, values, strict=True), key=lambda pair: np.ptp(pair[1]))
    return (
        f"Farthest apart in the closed set: {label}, from {values.min():.3f} in fold {values.idxmin()} to "
        f"{values.max():.3f} in fold {values.idxmax()}."
    )


def paired(results):
    """Rows split at random with those of the same model, training images and metric under other splits beside them.

    Columns KEYS and, with each split's name, experiment, value, low, high and validation, the same on the validation
    images; NaN where a split has no such row. Rows of the random split alone are left out.
    """
    images = {
        run["experiment"]: repr((run["elevation"], run["upsample"], run["channels"])) for run in results.runs.values()
    }
    same = [*METHOD, "train_snr_db", "elevation", "metric", "threshold", "test_snr_db"]
    held_out = results.validation.rename(columns={"value": "validation"})[[*same, "validation"]]
    scores = results.scores.merge(held_out, how="left", on=same)
    scores["images"] = scores["experiment"].map(images)
    # An experiment tested on the open set has the closed set's rows too: any of several is as good.
    own = {
        split: select(scores, split=split).drop_duplicates(KEYS).set_index(KEYS)[OWN] for split in (*OTHERS, "random")
    }
    others = [split for split in OTHERS if len(own[split])]
    table = own["random"].add_suffix("_random").join([own[split].add_suffix(f"_{split}") for split in others])
    return table.dropna(how="all", subset=[f"value_{split}" for split in others]).reset_index()


def _compared(rows):
    """(split, rows that it has) of every split but the random one that the rows of `paired` have."""
    for split in (split for split in OTHERS if f"value_{split}" in rows):
        own = rows.dropna(subset=f"value_{split}")
        if len(own):
            yield split, own


def _gain(row, split):
    return row["value_random"] - row[f"value_{split}"]


def _groups(names, rows):
    """The rows of each model and kind of training images, in the order of the page, after what the page calls it."""
    several = rows.groupby("model")[["images", "training"]].nunique().max(axis=1) > 1
    for (model, trained, _), group in names.groups(rows, "model", "training", "images"):
        yield f"{names.model(model).label}{f', training SNR {trained}' if several[model] else ''}", group


def _images(results, accuracy):
    """How many images train under each split, of several folds in the first, in a sentence."""
    times, said = select(results.times, model=list(accuracy["model"])), []
    for split, rows in [*_compared(accuracy), ("random", accuracy)]:
        number = select(times, experiment=list(rows[f"experiment_{split}"]))["training_observations"].min()
        said.append(f"{'at' if split == 'random' else 'by'} {split} {number:,}")
    by, *rest = said
    return f"{by[:1].upper()}{by[1:]} images train in the first fold, {', '.join(rest)}."


def plainly(names, accuracy):
    """By how much the accuracy of each model differs at the highest SNR, and where most of all, in sentences."""
    said = []
    for split, rows in _compared(accuracy):
        top, most = at_highest(rows), rows.loc[_gain(rows, split).idxmax()]
        parts = [f"{name} {signed(_gain(group.iloc[0], split))}" for name, group in _groups(names, top)]
        said.append(
            f"Accuracy at {top['test_snr_db'].max():g} dB under the random split less that under {split}: "
            f"{'; '.join(parts)}."
        )
        if _gain(most, split) > 0:
            said.append(
                f"The random split flatters most {names.model(most['model']).label} at {most['test_snr_db']:g} dB, by "
                f"{_gain(most, split):.3f}."
            )
    return " ".join(said)


def accuracy_table(names, rows):
    """Accuracy under all splits at some SNRs: a row for each split of each model, and for each difference."""
    snrs, compared = evenly(rows["test_snr_db"].unique().tolist(), TABLE_SNRS), [split for split, _ in _compared(rows)]
    kinds = {split: lambda row, split=split: f"{row[f'value_{split}']:.3f}" for split in (*compared, "random")}
    for split in compared:
        kinds[f"random − {split}"] = lambda row, split=split: signed(_gain(row, split))
    shown = [
        {"model": name, "split": kind} | at_snrs(curve, snrs, text)
        for name, curve in _groups(names, rows)
        for kind, text in kinds.items()
        if kind == "random" or curve[f"value_{kind.rpartition(' ')[2]}"].notna().all()
    ]
    caption = "Accuracy on the known targets at some test SNRs. The CSV file holds all SNRs, and the 95 % intervals."
    return table("split_accuracy", rows, shown, caption)


def open_table(names, rows):
    """Open-set weighted F1 under all splits at the highest SNR, with each model's best confidence score by protocol.

    Best is which has the largest weighted F1 on the validation images at that SNR, under the first split that it has.
    """
    top, shown = at_highest(rows), []
    compared = [split for split, _ in _compared(top)]
    for protocol in PROTOCOLS:
        for name, group in _groups(names, select(top, threshold=protocol)):
            first, _ = next(_compared(group))
            row = group.loc[group[f"validation_{first}"].idxmax()]
            line = {"model": name, "thresholds": protocol, "confidence score": names.score(row["score"]).label}
            own = [split for split in (*compared, "random") if pd.notna(row[f"value_{split}"])]
            line |= dict.fromkeys((*compared, "random", *(f"random − {split}" for split in compared)), "–")
            for split in own:
                line[split] = with_interval({key: row[f"{key}_{split}"] for key in ("value", "low", "high")})
            shown.append(line | {f"random − {split}": signed(_gain(row, split)) for split in own if split != "random"})
    caption = (
        f"Open-set weighted F1 at {top['test_snr_db'].max():g} dB with its 95 % interval, for each model with the "
        "confidence score that does best on the validation images, not those split at random."
    )
    return table("split_open", rows, shown, caption)
