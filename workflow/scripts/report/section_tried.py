"""Everything tried on the open set, beside the reference thesis's method: gains over it, and one table of all."""

import itertools

import numpy as np
import pandas as pd

from learning.experiments import REFERENCE
from report import thesis
from report.draw_learning import SPLITS, draw_legend, draw_rejecting, signed, split_text, title
from report.layout import BLACK, PALETTE, Figure, Section, Table, canvas, model_style, style, to_svg
from report.section_open import PROTOCOLS, rejecting, score_name

METHOD = ["split", "experiment", "model", "training", "score"]
MIDDLE = (-12, 12)  # dB: the SNRs by which methods are ranked
SOLVED = 0.98  # weighted F1 of the thesis's method from which on there is nothing to gain
BEST = 3  # methods drawn for each split
SHOWN_SNRS = (-12, -6, 0, 6, 12, 24)  # dB, of the table
F1, GAIN = "f1_weighted", "f1_weighted_gain"


def section(results):
    scores, validation = (
        table[(table["elevation"] == "all") & table["threshold"].isin(PROTOCOLS) & table["metric"].isin([F1, GAIN])]
        for table in (results.scores, results.validation)
    )
    ranks, reference = ranked(scores, validation), thesis.network(REFERENCE[0], results.settings)
    gains = ranks[f"gain_{PROTOCOLS[0]}"].notna().any()
    compared = f" Gains are against {reference}, trained without noise, with ZNCC."
    return Section(
        id="tried",
        title="Everything tried on the open set",
        text=(
            "Every model and known score of every open experiment, split by sector first, in the order of its mean "
            f"weighted F1 over {middle_text(scores)} on the validation images with blind thresholds. All figures are "
            f"of the test images.{compared if gains else ''}",
        ),
        figures=gain_figure(scores, ranks, reference, rejecting(results)),
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


def validation_means(validation):
    """The mean weighted F1 of each method over the middle SNRs on the validation images, the best first.

    validation: rows of weighted F1 of one set (see `section_headline.of_set`). Columns METHOD and value; split by
    sector first.
    """
    rows = validation[validation["test_snr_db"].isin(middle(validation["test_snr_db"]))]
    means = rows.groupby(METHOD)["value"].mean().reset_index()
    return means.sort_values(
        ["split", "value", *METHOD[1:]],
        ascending=[True, False, *[True] * len(METHOD[1:])],
        key=lambda column: column.map(SPLITS.index) if column.name == "split" else column,
    )


def ranked(scores, validation):
    """One row per method, the best first within each split: columns METHOD, validation, mean_<p>, gain_<p>.

    Means over the middle SNRs of weighted F1 and of its gain on the test images under each protocol <p>; validation is
    that of weighted F1 on the validation images under the first of them, which decides what is best. gain_<p> is NaN
    where the thesis's method is not among them.
    """
    rows = scores[scores["test_snr_db"].isin(middle(scores["test_snr_db"]))]
    means = rows.groupby([*METHOD, "metric", "threshold"])["value"].mean().unstack(["metric", "threshold"])
    names = {
        (metric, protocol): f"{name}_{protocol}"
        for metric, name in ((F1, "mean"), (GAIN, "gain"))
        for protocol in PROTOCOLS
    }
    table = means.reindex(columns=list(names))
    table.columns = list(names.values())
    lead = validation[(validation["metric"] == F1) & (validation["threshold"] == PROTOCOLS[0])]
    order = validation_means(lead).rename(columns={"value": "validation"})
    return order.merge(table.reset_index(), on=METHOD, validate="one_to_one")


def best(ranks):
    """The rows of the best methods of each split, but the thesis's own; of one in several experiments the best one."""
    own = _are(ranks, ["model", "training", "score"], REFERENCE)
    found = ranks[~own & ranks[f"gain_{PROTOCOLS[0]}"].notna()]
    return found.drop_duplicates(["split", "model", "training", "score"]).groupby("split").head(BEST)


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


def gain_figure(scores, ranks, reference, rejected):
    """Weighted F1 of the best methods and of the thesis's, and their difference: a column per split and protocol.

    reference: the thesis's method in words; rejected: the weighted F1 of rejecting everything, by split.
    """
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
                    label_of_theirs = f"{reference.removeprefix('the ')}, ZNCC"
                    upper.plot(snrs, curve["f1"] - curve["gain"], color=BLACK, ls="--", label=label_of_theirs)
                    counts.append(f"{split_text(split)}, {protocol} thresholds: {_count(rows)} ({label})")
                    draw_rejecting(upper, [rejected[split]])
                upper.plot(snrs, curve["f1"], color=color, marker=marker, label=label)
                lower.plot(snrs, curve["gain"], color=color, lw=1)
                lower.plot(rows["test_snr_db"], rows["gain"], color=color, marker=marker, ls="")
                lower.fill_between(snrs, curve["low"], curve["high"], color=color, alpha=0.18, lw=0)
                drawn.append(curve.assign(threshold=protocol, **{name: method[name] for name in METHOD}))
            upper.set_title(f"{split_text(split)},\n{protocol} thresholds")
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
                f"Open-set weighted F1 of the best methods and of {reference} against test SNR, and their "
                f"difference. The interval of the best one's gain lies above 0 under {'; '.join(counts)}."
            ),
            caption=(
                f"The {BEST} methods of each split with the largest mean weighted F1 over {middle_text(scores)} on the "
                f"validation images with {PROTOCOLS[0]} thresholds, here on the test images, and their gain over "
                f"{reference} on the same images, with its 95 % interval from the same resamples. Markers stand at the "
                f"SNRs of that range at which the latter is below {SOLVED:g}. At these, the interval of the best "
                f"method's gain lies above 0 under {'; '.join(counts)}."
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
    lead, other = PROTOCOLS
    f1 = scores[(scores["metric"] == F1) & (scores["threshold"] == lead)].set_index([*METHOD, "test_snr_db"])["value"]
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
            "validation mean": f"{row['validation']:.3f}",
        }
        line |= {f"{snr:g} dB": f"{f1[*method, snr]:.3f}" for snr in near}
        line |= {"mean": f"{row[f'mean_{lead}']:.3f}", f"mean, {other}": f"{row[f'mean_{other}']:.3f}"}
        for name, text in ((f"gain_{lead}", "gain"), (f"gain_{other}", f"gain, {other}")):
            line[text] = signed(row[name]) if pd.notna(row[name]) else "–"
        shown.append(line)
    shown = pd.DataFrame(shown)
    if not ranks[f"gain_{lead}"].notna().any():
        shown = shown.drop(columns=["gain", f"gain, {other}"])
    return Table(
        name="tried",
        shown=shown,
        data=scores,
        caption=(
            f"Weighted F1 of the open set with {lead} thresholds at some SNRs, and its mean over {middle_text(scores)} "
            f"with {lead} and with {other} thresholds, all on the test images; validation mean: the same mean on the "
            "validation images, by which the rows are in order; gain: the mean of what it is more than that of the "
            "network named above, on the same test images. The CSV file holds all SNRs, both protocols and the 95 % "
            "intervals."
        ),
    )
