"""The headline, weighted F1 of the open and the closed set against SNR, and the live curves and matrices of all."""

from itertools import cycle

import pandas as pd
from matplotlib.lines import Line2D

from isarflow.learning.experiments import CLEAN, REFERENCE, split_of
from isarflow.report.conditions import conditions
from isarflow.report.layout import BLACK, Section, figure
from isarflow.report.plots import draw_scores, matrix
from isarflow.report.published import FULL_SIZE, beside
from isarflow.report.vocabulary import (
    F1,
    LEAD,
    METHOD,
    PROTOCOLS,
    SPLITS,
    THESIS,
    ranked,
    select,
    snr_axis,
    span_text,
    title,
)

PLACE, NEEDS = ("recognition", 0), "learns"  # on the page, see page.py
# The sets of test images, as the page calls them, and the threshold in scores.csv.
SETS = {**{f"open set, {protocol} thresholds": protocol for protocol in PROTOCOLS}, "closed set": ""}
# The set of what the reference thesis states of its own method: by model and metric of the published table.
PUBLISHED = {"capsule f1": "closed set", "capsule_zncc weighted_f1": f"open set, {THESIS} thresholds"}
THESIS_PROTOCOL = {"ls": (0, (4, 2)), "lw": 1}
# Of the live curves by split, as SVG has them.
DASHES = {"solid": "", "dashed": "6 4", "dash-dotted": "8 3 2 3", "dotted": "2 3"}


def section(results):
    live = Section("compare", "Compare experiments", live=comparison(results))
    return live, Section("matrices", "Who is taken for whom", live=matrices(results))


def sets_of(tables):
    """Yield (name, rows of weighted F1 with it as `set`, the same on validation images) of each set that was tested."""
    for name, threshold in SETS.items():
        case = {"metric": F1, "elevation": "all", "threshold": threshold}
        scores = select(tables.scores, **case).assign(set=name)
        if len(scores):
            yield name, scores, select(tables.validation, **case)


def lead(results):
    """Return the `curves` of the best method and of the thesis's: by the protocol that asks for least, and closed.

    The thesis's is there by the protocol that chose the thesis's thresholds, too.
    """
    parts = {SETS[name]: curves(*of, results.names) for name, *of in sets_of(results)}
    shown = [parts[threshold] for threshold in (LEAD, "") if threshold in parts]
    shown += [select(parts[THESIS], theirs=True)] if THESIS in parts else []
    return pd.concat(shown)


def curves(part, validation, names):
    """Return the rows of the best method and of the thesis's in one set, with columns curve (words), best and theirs.

    part, validation: rows of weighted F1 on the test and validation images. The best method is that model, by its main
    confidence score, which reaches most under the first split on the latter; it may be the thesis's.
    """
    means, (model, trained, score), found = ranked(validation), REFERENCE, []
    best = ranked(names.by_main_score(validation)).head(1).assign(best=True)
    theirs = select(means, model=model, training=trained, score=["", score]).head(1).assign(best=False)
    for row in pd.concat([best, theirs]).drop_duplicates(METHOD).itertuples():
        same = select(means, model=row.model, training=row.training, score=row.score).drop_duplicates("split")
        rows = same[METHOD].merge(part.sort_values("test_snr_db"), on=METHOD)[[*part]]
        words = f"{'best' if row.best else 'thesis'}: {names.method(row.model, row.score)}"
        is_theirs = (row.model, row.training) == (model, trained) and row.score in ("", score)
        found.append(rows.assign(curve=words + " (" + rows["split"] + ")", best=row.best, theirs=is_theirs))
    return pd.concat(found)


def headline(results):
    """Draw the best method of this run and the thesis's: a row for open and closed set, a column per split."""
    names, statements, drawn = results.names, results.published_scores, lead(results)
    statements = statements.assign(set=(statements["model"] + " " + statements["metric"]).map(PUBLISHED))
    statements = select(statements, set=list(drawn[drawn["theirs"]]["set"]))
    drawn, statements, words = beside(results, drawn, statements, FULL_SIZE)
    splits = [split for split in SPLITS if split in set(drawn["split"])]
    kinds = {kind: drawn[drawn["set"].str.startswith(kind)] for kind in ("open set", "closed set")}
    kinds = {kind: rows for kind, rows in kinds.items() if len(rows)}
    shown = {f"{kind}, {SPLITS[of]}": select(rows, split=of) for kind, rows in kinds.items() for of in splits}
    published = statements.assign(panel=statements["set"].str.split(",").str[0] + f", {SPLITS['random']}")

    def look(row):  # squares for the thesis's method, broken lines for thresholds as it chose them
        model, broken = names.model(row["model"]), SETS[row["set"]] == THESIS
        own = {"color": model.color, "marker": "o", "label": f"best: {model.label}", "band": not broken}
        theirs = {"marker": "s", "label": f"{model.label}, as in the thesis", "mfc": "white"} if row["theirs"] else {}
        return own | theirs | (THESIS_PROTOCOL if broken else {})

    size, reference = (0.9 + 2.9 * len(splits), 1.1 + 2.0 * len(kinds)), names.model(REFERENCE[0])
    broken = Line2D([], [], color=BLACK, label=f"{THESIS} thresholds", **THESIS_PROTOCOL)
    more = [broken] if THESIS in set(drawn["threshold"]) else []
    marks = published, reference.color, "thesis, full size"
    drawing = draw_scores(results, shown, len(splits), size, ("set", "curve"), look, *marks, more)
    drawing.axes[0].set_ylim(0, 1.03)  # of all panels
    red = drawn["theirs"].any()
    whose = f", and, with squares, of {reference.words}, trained without noise, with ZNCC" if red else ""
    broken = f"; broken lines: its {THESIS} thresholds, chosen with images of unknown targets" if more else ""
    by = " by its main confidence score" if "open set" in kinds else ""
    caption = (
        f"Weighted F1 on the test images, with 95 % intervals, of the model that is best on the validation images{by} "
        f"(mean at {span_text(results.validation)}){whose}{broken}.{words}{conditions(results, drawn)}"
    )
    alt = f"Weighted F1 against test SNR of the best model{' and of the thesis’s' if red else ''}, by set and split."
    return figure("headline", drawing, drawn, caption, True, alt)


def _in_words(names, split, experiment, model, training, score):
    trained = "trained without noise" if training == CLEAN else f"training SNR: {training}"
    return f"{names.method(model, score)}: {title(experiment)} ({split}), {trained}"


def comparison(results):
    """Return all curves of weighted F1 for the page's live plot, a mapping for JSON.

    shown: whether a curve is the best one of its set, or the thesis's; main: whether it is by its model's main
    confidence score; points: [SNR, value, low, high]; rejecting: the weighted F1 of rejecting all, by open set.
    """
    names, listed, levels, parts = results.names, [], {}, list(sets_of(results))
    used = {split_of(run) for run in results.runs.values()}
    dashes = dict(zip([split for split in SPLITS if split in used], cycle(DASHES.items()), strict=False))
    for name, part, validation in parts:
        # Of each model the main confidence score: the others are drawn when asked for.
        main, shown = names.by_main_score(part), curves(part, validation, names)
        main, shown = (set(rows[METHOD].itertuples(index=False, name=None)) for rows in (main, shown))
        if SETS[name]:
            levels[name] = [round(value, 4) for value in results.rejecting(part["experiment"].unique())]
        for method, curve in names.groups(part, *METHOD):
            split, experiment, model, *_ = method
            points = curve.sort_values("test_snr_db")[["test_snr_db", "value", "low", "high"]].round(4).astype(object)
            points = points.where(points.notna(), None).to_numpy().tolist()  # JSON knows no NaN
            entry = {"set": name, "experiment": title(experiment), "model": names.model(model).label}
            entry |= {"words": _in_words(names, *method), "color": names.model(model).color, "dashes": dashes[split][1]}
            listed.append(entry | {"shown": method in shown, "main": method in main, "points": points})
    lines = "; ".join(f"{look} lines: {SPLITS[split]}" for split, (look, _) in dashes.items())
    caption = conditions(results, pd.concat(part for _, part, _ in parts)).strip()
    data = {"curves": listed, "rejecting": levels, "axis": snr_axis(results.definition)}
    return data | {"lines": lines, "caption": caption}


def matrices(results):
    """Return for JSON `entries`, one per method and set of images: its SNRs in dB and counts (SNR, target, class).

    Each model in an open set is there by its main confidence score.
    """
    entries = []
    for name, *_ in sets_of(results):
        cells = results.names.by_main_score(select(results.confusion, elevation="all", threshold=SETS[name]))
        for method, rows in results.names.groups(cells, *METHOD):
            by_snr = rows.groupby("test_snr_db")
            counts = [matrix(part).reindex(results.targets).dropna().astype(int) for _, part in by_snr]
            entry = {"set": name, "words": _in_words(results.names, *method), "snrs": list(by_snr.groups)}
            entry |= {"targets": list(counts[0].index), "classes": list(counts[0].columns)}
            entries.append(entry | {"counts": [table.to_numpy().tolist() for table in counts]})
    return {"entries": entries}
