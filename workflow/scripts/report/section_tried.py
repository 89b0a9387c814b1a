"""Everything tried on the open set, beside the reference thesis's method: gains over it, and one table of all."""

import itertools

import numpy as np
import pandas as pd

from learning.experiments import REFERENCE
from report.draw_learning import draw_legend, signed, title
from report.layout import BLACK, PALETTE, Figure, Section, Table, canvas, model_style, style, to_svg
from report.section_open import PROTOCOLS, score_name

METHOD = ["split", "experiment", "model", "training", "score"]
MIDDLE = (-12, 12)  # dB: the SNRs by which methods are ranked
SOLVED = 0.98  # weighted F1 of the thesis's method from which on there is nothing to gain
BEST = 3  # methods drawn for each split
SHOWN_SNRS = (-12, -6, 0, 6, 12, 24)  # dB, of the table
F1, GAIN = "f1_weighted", "f1_weighted_gain"


def section(results):
    scores = results.scores
    scores = scores[
        (scores["elevation"] == "all") & scores["threshold"].isin(PROTOCOLS) & scores["metric"].isin([F1, GAIN])
    ]
    ranks = ranked(scores)
    compared = (
        " Gains are against the reference thesis's method: its capsule network, trained without noise, with ZNCC."
    )
    return Section(
        id="tried",
        title="Everything tried on the open set",
        text=(
            f"Every model and known score of every open experiment, by its mean weighted F1 over {middle_text(scores)}"
            f" under the thesis protocol.{compared if ranks['gain'].notna().any() else ''}",
        ),
        figures=gain_figure(scores, ranks),
        tables=(tried_table(scores, ranks),),
    )


def middle(snrs):
    """The SNRs in dB by which methods are ranked: those from -12 to 12 dB; all where there is none of them."""
    snrs = sorted(set(snrs))
    return [snr for snr in snrs if MIDDLE[0] <= snr <= MIDDLE[1]] or snrs


def middle_text(scores):
    """The same in words."""
    snrs = middle(scores["test_snr_db"])
    return f"{snrs[0]:g} to {snrs[-1]:g} dB" if len(snrs) > 1 else f"{snrs[0]:g} dB"


def ranked(scores):
    """One row per method, the best first within each split: columns METHOD, mean, mean_blind, gain, gain_blind.

    Means over the middle SNRs of weighted F1 and of its gain, without suffix under the thesis protocol. gain is NaN
    where the thesis's method is not among them.
    """
    rows = scores[scores["test_snr_db"].isin(middle(scores["test_snr_db"]))]
    means = rows.groupby([*METHOD, "metric", "threshold"])["value"].mean().unstack(["metric", "threshold"])
    names = {
        (F1, "thesis"): "mean",
        (F1, "blind"): "mean_blind",
        (GAIN, "thesis"): "gain",
        (GAIN, "blind"): "gain_blind",
    }
    table = means.reindex(columns=list(names))
    table.columns = list(names.values())
    return table.reset_index().sort_values(["split", "mean", *METHOD[1:]], ascending=[True, False, *[True] * 4])


def best(ranks):
    """The rows of the best methods of each split, but the thesis's own; of one in several experiments the best one."""
    own = _are(ranks, ["model", "training", "score"], REFERENCE)
    found = ranks[~own & ranks["gain"].notna()].drop_duplicates(["split", "model", "training", "score"])
    return found.groupby("split", sort=True).head(BEST)


def _are(table, columns, values):
    """Which rows have these values in these columns."""
    return np.all([table[column] == value for column, value in zip(columns, values, strict=True)], axis=0)


def judged(curve):
    """The middle SNRs of one method under one protocol at which the thesis's method leaves something to gain.

    curve: columns test_snr_db, f1, gain, low, high (the gain's interval). Rows, with a column above: whether the
    interval lies above 0.
    """
    rows = curve[curve["test_snr_db"].isin(middle(curve["test_snr_db"])) & (curve["f1"] - curve["gain"] < SOLVED)]
    return rows.assign(above=rows["low"] > 0)


def _curve(scores, method, protocol):
    """What `judged` takes, of a row of `ranked`."""
    own = scores[_are(scores, [*METHOD, "threshold"], [*method[METHOD], protocol])]
    own = own.set_index("test_snr_db").sort_index()
    gain = own[own["metric"] == GAIN][["value", "low", "high"]].rename(columns={"value": "gain"})
    return gain.assign(f1=own[own["metric"] == F1]["value"]).reset_index()


def gain_figure(scores, ranks):
    """Weighted F1 of the best methods and of the thesis's, and their difference: a column per split and protocol."""
    picks = best(ranks)
    if not len(picks):
        return ()
    names = _labels(picks)
    colors = {name: PALETTE[place % len(PALETTE)] for place, name in enumerate(dict.fromkeys(names.values()))}
    markers = dict(zip(colors, itertools.cycle("os^Dv<"), strict=False))
    columns = list(itertools.product(picks["split"].unique(), PROTOCOLS))
    drawn, counts = [], []
    with style():
        figure = canvas(1 + 2.5 * len(columns), 5.6)
        grid = figure.subplots(2, len(columns), sharex=True, sharey="row", squeeze=False)
        for (upper, lower), (split, protocol) in zip(grid.T, columns, strict=True):
            lower.axhline(0, color=BLACK, lw=1)
            for place, (index, method) in enumerate(picks[picks["split"] == split].iterrows()):
                label, curve = names[index], _curve(scores, method, protocol)
                color, marker, snrs = colors[label], markers[label], curve["test_snr_db"]
                rows = judged(curve)
                if place == 0:
                    reference = {"color": BLACK, "ls": "--", "label": "the thesis's method: capsule, ZNCC"}
                    upper.plot(snrs, curve["f1"] - curve["gain"], **reference)
                    counts.append(f"{split}, {protocol} protocol: {_count(rows)} ({label})")
                upper.plot(snrs, curve["f1"], color=color, marker=marker, label=label)
                lower.plot(snrs, curve["gain"], color=color, lw=1)
                lower.plot(rows["test_snr_db"], rows["gain"], color=color, marker=marker, ls="")
                lower.fill_between(snrs, curve["low"], curve["high"], color=color, alpha=0.18, lw=0)
                drawn.append(curve.assign(threshold=protocol, **{name: method[name] for name in METHOD}))
            upper.set_title(f"{split}, {protocol}")
            lower.set_xlabel("test SNR [dB]")
        grid[0, 0].set_ylabel("weighted F1")
        grid[1, 0].set_ylabel("gain in weighted F1")
        draw_legend(figure, grid.flat)
        svg = to_svg(figure)
    return (
        Figure(
            name="best_gain",
            svg=svg,
            data=pd.concat(drawn),
            alt=(
                "Open-set weighted F1 of the best methods and of the reference thesis's against test SNR, and their "
                f"difference. The interval of the best one's gain lies above 0 under {'; '.join(counts)}."
            ),
            caption=(
                f"The methods with the largest mean weighted F1 over {middle_text(scores)}, by split, and their gain "
                "over the reference thesis's method on the same test images, with its 95 % interval from the same "
                f"resamples. Markers stand at the SNRs of that range at which the thesis's method is below {SOLVED:g}. "
                f"At these, the interval of the best method's gain lies above 0 under {'; '.join(counts)}."
            ),
            wide=True,
        ),
    )


def _count(rows):
    """At how many of the SNRs that `judged` gives the interval lies above 0, in words."""
    missed = ", ".join(f"{snr:g}" for snr in rows[~rows["above"]]["test_snr_db"])
    return f"at {rows['above'].sum()} of {len(rows)}{f', not at {missed} dB' if missed else ''}"


def _labels(picks):
    """A name for each of the rows of `ranked`: the model, the known score, and what it was trained at if need be."""
    several = picks.groupby("model")["training"].nunique() > 1
    names = {}
    for index, row in picks.iterrows():
        trained = f", training SNR {row['training']}" if several[row["model"]] else ""
        names[index] = f"{model_style(row['model'])[2]}, {score_name(row['score'])}{trained}"
    return names


def tried_table(scores, ranks):
    """Every method, the best first within each split."""
    f1 = scores[(scores["metric"] == F1) & (scores["threshold"] == "thesis")].set_index([*METHOD, "test_snr_db"])[
        "value"
    ]
    snrs = sorted(set(scores["test_snr_db"]))
    near = sorted({min(snrs, key=lambda snr: abs(snr - aim)) for aim in SHOWN_SNRS})
    shown = []
    for row in ranks.to_dict("records"):
        method = tuple(row[name] for name in METHOD)
        line = {
            "split": row["split"],
            "experiment": title(row["experiment"]),
            "model": model_style(row["model"])[2],
            "training SNR": row["training"],
            "known score": score_name(row["score"]),
        }
        line |= {f"{snr:g} dB": f"{f1[*method, snr]:.3f}" for snr in near}
        line |= {"mean": f"{row['mean']:.3f}", "mean, blind": f"{row['mean_blind']:.3f}"}
        for name, text in (("gain", "gain"), ("gain_blind", "gain, blind")):
            line[text] = signed(row[name]) if pd.notna(row[name]) else "–"
        shown.append(line)
    shown = pd.DataFrame(shown)
    if not ranks["gain"].notna().any():
        shown = shown.drop(columns=["gain", "gain, blind"])
    return Table(
        name="tried",
        shown=shown,
        data=scores,
        caption=(
            f"Weighted F1 of the open set under the thesis protocol at some SNRs, and its mean over "
            f"{middle_text(scores)} under both protocols; gain: the mean of what it is more than the reference "
            "thesis's method on the same test images. The CSV file holds all SNRs, both protocols and the 95 % "
            "intervals."
        ),
    )
