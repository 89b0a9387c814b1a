"""What the thesis states beside the same of a run: curves and values at its conditions, and by the harder ones.

At its conditions: split at random, thresholds chosen with unknown targets (`thesis`), SNR by mean power. The harder
ones: split by sector, thresholds chosen without them (`blind`), SNR by mean power as well.
"""

from typing import NamedTuple

import pandas as pd

from learning.experiments import training
from report import thesis
from report.plots import RELATIONS, draw_curve, draw_published, draw_rejecting, finish, holds, panels
from report.published import ADAPTATIONS, CLOSED, CONDITIONS, OPEN, value_at
from report.selection import nearest
from report.thesis_markdown import NONE, picture, table
from report.vocabulary import at_snrs, select, snr_axis, with_interval

SNRS = (-18, -12, -6, 0, 6, 12, 24)  # dB, columns of tables, where the run has them or near them
METRICS = CLOSED | OPEN
SPLIT, HARDER = "random", "sector"
WORDS = {"random": "split at random", "sector": "split by sector"}
PROTOCOLS = {"random": "thesis", "sector": "blind"}  # of thresholds, by split
MAXIMUM = "maximum"  # what the document states of a curve, not of an SNR
STATED = ["experiment", "model", "condition", "snr_db", "metric", "relation"]  # what tells statements apart


class Panel(NamedTuple):
    """A panel of a figure: (rows, look) of each curve; published statements and their colours; lines of rejecting."""

    title: str
    curves: list
    statements: pd.DataFrame | None = None
    colors: dict | None = None
    rejecting: tuple = ()


def named(results, experiment):
    """Whether the config names an experiment. A table may still hold rows of one that it no longer does."""
    return results.learns and any(run["experiment"] == experiment for run in results.runs.values())


def own_run(results, experiment):
    """The run of an experiment that splits at random and trains once; None where there is none."""
    alike = [run for run in results.runs.values() if run["experiment"] == experiment] if results.learns else []
    return alike[0] if len(alike) == 1 and alike[0]["split"] == SPLIT else None


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


def trained_words(run):
    """What a run trained at, in words."""
    words = training(run)
    return "without noise" if words == "clean" else f"at {words}"


def ours(results, experiment, model, metric, score="", elevation="all", threshold="thesis"):
    """The rows of a model at the thesis's conditions, by SNR; score: of the open set, empty for the closed one."""
    case = {"experiment": experiment, "split": SPLIT, "model": model, "metric": metric, "score": score}
    case |= {"elevation": elevation, "threshold": threshold if score else ""}
    rows = results.mean_scores if named(results, experiment) else results.mean_scores.iloc[:0]
    return select(rows, **case).sort_values("test_snr_db")


def by_sector(results, experiment, model, metric, score=""):
    """The rows of the same model by sector with blind thresholds: of the first experiment that trains on the same."""
    own = own_run(results, experiment)
    if not own or own["elevation"] != "all":
        return results.mean_scores.iloc[:0]

    def alike(run):
        same = training(run) == training(own) and all(
            run[key] == own[key] for key in ("elevation", "upsample", "channels")
        )
        return same and run["split"] == HARDER and model in run["models"] and (run["open"] or not score)

    experiments = sorted(run["experiment"] for run in results.runs.values() if alike(run))
    case = {"model": model, "metric": metric, "score": score, "elevation": "all", "threshold": "blind" if score else ""}
    return select(results.mean_scores, experiment=experiments[:1], **case).sort_values("test_snr_db")


def judged(results, lines, models):
    """Published statements, rows of `Results.published_scores`, with ours at the same SNR: a tuple of mappings.

    A maximum is sought over all SNRs. Besides the statement's own columns: name and words, of what it is; published,
    its value as text; here, blind, sector: mappings as of `value_at`, or None, at the thesis's conditions, the same
    with blind thresholds, and by sector; holds: whether the statement does, None without ours. models: those the run
    has.
    """
    found = []
    for line in lines.to_dict("records"):
        model, score = ADAPTATIONS.get(line["model"], (line["model"], ""))
        metric, words = METRICS[line["metric"]]
        values = dict.fromkeys(("here", "blind", "sector"))
        if model in models:
            case = results, line["experiment"], model, metric, score
            elevation, snr = CONDITIONS[line["condition"]], line["snr_db"]
            curve = ours(*case, elevation)
            if line["stated"] == MAXIMUM and len(curve):
                snr = float(curve.loc[curve["value"].idxmax(), "test_snr_db"])
            values["here"] = value_at(results, curve, snr)
            values["blind"] = value_at(results, ours(*case, elevation, "blind"), snr) if score else None
            values["sector"] = value_at(results, by_sector(*case), snr)
        here = values["here"]
        kept = holds(here["ours"], line["relation"], line["value"]) if here else None
        name = results.names.method(model, score)
        found.append({**line, "score": score, "name": name, "words": words, **values, "holds": kept} | said(line))
    return tuple(found)


def judge_one(line, name, words, row, snr=None):
    """The same of one statement that needs a value of its own. row: value, low and high, or None.

    line: a row of `Results.published_scores` as a mapping; snr: the test SNR of the value, where it is another.
    """
    here = None
    if row is not None:
        at = line["snr_db"] if snr is None else snr
        here = {"ours": row["value"], "low": row["low"], "high": row["high"], "here_at_snr_db": at}
    kept = holds(float(row["value"]), line["relation"], line["value"]) if here else None
    return line | {"score": "", "name": name, "words": words, "here": here, "holds": kept} | said(line)


def said(line):
    """A published value with its relation, for a mapping."""
    return {"published": f"{RELATIONS[line['relation']][0]} {line['value']}"}


def value_text(value, snr):
    """A value as of `value_at` with its interval, and its SNR where that is not the one asked for."""
    if value is None:
        return NONE
    other = f" (at {value['here_at_snr_db']:.3g} dB)" if value["here_at_snr_db"] != snr else ""
    return f"{with_interval(value | {'value': value['ours']})}{other}"


def kept_text(kept):
    return {None: NONE, True: "yes", False: "no"}[kept]


def statement_table(found):
    """What the document states in numbers and what this run has: a row for each of `judged`."""
    opened, harder = any(line["score"] for line in found), any(line["sector"] for line in found)
    protocols = {split: f", `{name}` thresholds" if opened else "" for split, name in PROTOCOLS.items()}
    rows = []
    for line in found:
        snr = line["snr_db"]
        row = {"model": line["name"], "measure": line["words"], "stated": line["stated"], "SNR [dB]": f"{snr:g}"}
        row["published"] = line["published"]
        row[f"here, {WORDS[SPLIT]}{protocols[SPLIT]}"] = value_text(line["here"], snr)
        row["as published"] = kept_text(line["holds"])
        if opened:
            row["the same, `blind` thresholds"] = value_text(line["blind"], snr)
        if harder:
            row[f"here, {WORDS[HARDER]}{protocols[HARDER]}"] = value_text(line["sector"], snr)
        rows.append(row)
    return table(rows)


def values_table(curves, head=""):
    """Our values with their intervals at some SNRs. curves: (words, rows by SNR); head: of the words' column."""
    snrs = shown_snrs(snr for _, rows in curves for snr in rows["test_snr_db"])
    return table([{head: words} | at_snrs(rows, snrs, with_interval) for words, rows in curves if len(rows)])


def shown_snrs(every):
    """Those of the test SNRs that tables show, the nearest to SNRS."""
    every = sorted(set(every))
    asked = [snr for snr in SNRS if every[0] <= snr <= every[-1]] if every else []
    return list(dict.fromkeys(nearest(every, snr) for snr in asked)) or every[-1:]


def curves_picture(name, shown, ylabel, alt):
    """A Picture of curves over the SNR by mean power: a panel each. shown: Panels."""
    drawing, grid = panels(1, len(shown), max(1 + 3.9 * len(shown), 6.6), 3.6)
    for axes, panel in zip(grid.flat, shown, strict=True):
        for rows, look in panel.curves:
            draw_curve(axes, rows, **look)
        draw_rejecting(axes, panel.rejecting)
        if panel.statements is not None:
            draw_published(axes, panel.statements, panel.colors)
        axes.set_title(panel.title)
    finish(drawing, grid, snr_axis(thesis.DEFINITION), ylabel)
    return picture(name, drawing, alt)


def counted(found):
    """How many of the statements hold, in a sentence; nothing where this run has none of them."""
    known = [line for line in found if line["holds"] is not None]
    return f"Published statements that hold here: {sum(x['holds'] for x in known)} of {len(known)}." if known else ""
