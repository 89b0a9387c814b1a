"""The page of several runs side by side: their scores over each other, and how they differ on the same test images."""

import textwrap
from pathlib import Path

import pandas as pd

from isarflow.core.folders import SCORES
from isarflow.core.words import signed
from isarflow.learning.evaluation.paired import differences
from isarflow.report import layout, plots
from isarflow.report.page import Part, write_page
from isarflow.report.results import read_learned
from isarflow.report.vocabulary import F1, SPLITS, at_snrs, heading, select, snr_axis, title

PROTOCOL = "blind"  # of the thresholds that the page shows; the table beside it has the others, too
GROUP = ["experiment", "split", "threshold"]  # a section of the page each
METHOD = ["model", "training", "score"]  # a panel each
COLUMNS, WIDTH, HEIGHT = 3, 2.7, 3.3  # panels in a row; inches of one
TITLE = 34  # letters in a line of its title
SUMMARY = (
    "Each figure has above the weighted F1 of each run on all its own test images, with 95 % intervals as bands, below "
    "how much more it is than that of {first} on the test images that both have. Where a difference's 95 % interval "
    "leaves out zero, it is more than the draw of images explains; of many intervals one in twenty does by chance.",
    "Of an open set's confidence scores the one is shown that is best on the validation images of {first}. All "
    "differences, of accuracy and of every score and protocol, stand in {table} beside this page.",
)


def write_comparison(roots, definition, seed, kept, page, table, over_seeds=None):
    """Write the page of runs side by side, one self-contained HTML file, and all differences as a CSV file, `table`.

    roots: the runs' folders by name, the first the one that the others are compared with; definition: of the SNR;
    seed, kept: as of `differences`; over_seeds: None, or the first run's learning/seeds.csv.
    """
    first, *others = roots
    found = differences(roots, seed, kept)
    found.to_csv(table, index=False)
    best = _best(Path(roots[first], SCORES).with_name("validation.csv"))
    rows = pd.concat([_rows(Path(root, SCORES), definition, best).assign(run=name) for name, root in roots.items()])
    having = rows.groupby(GROUP + METHOD)["run"]
    shared = having.transform(lambda runs: first in set(runs) and runs.nunique() > 1).to_numpy(bool)
    with layout.style():
        axis = snr_axis(definition)
        seeds = _rows(over_seeds, definition, best).groupby(GROUP) if over_seeds else ()
        sections = [_over_seeds(key, of, axis) for key, of in seeds]
        sections += [_section(key, of, found, [*roots], axis) for key, of in rows[shared].groupby(GROUP)]
    summary = [text.format(first=first, table=Path(table).name) for text in SUMMARY]
    shown = {"summary": summary if sections else ["These runs have no method in common."]}
    shown["parts"] = (Part("runs", "Runs side by side", tuple(sections)),)
    write_page(f"{first} beside {', '.join(others)}", first, shown, page, alone=True)
    print(f"{len(found)} differences")


def _best(validation):
    """Return the confidence score of each method that is best on the validation images, by GROUP, model, training."""
    rows = select(read_learned(validation), metric=F1, threshold=PROTOCOL)
    return rows.groupby([*GROUP, *METHOD])["value"].mean().reset_index("score").sort_values("value")["score"].to_dict()


def _rows(scores, definition, best):
    """Return the rows shown of a table like scores.csv: weighted F1, of open runs by the best score alone."""
    case = {"metric": F1, "elevation": "all", "fold": "", "snr_definition": definition, "threshold": ["", PROTOCOL]}
    rows = select(read_learned(scores), **case)
    methods = rows[[*GROUP, *METHOD[:-1]]].itertuples(index=False, name=None)
    return rows[rows["score"] == [best.get(method, "") for method in methods]]


def _section(key, rows, found, runs, axis):
    """Return the section of methods with these values of GROUP. found: the differences; axis: its label."""
    methods, found = rows.groupby(METHOD), select(found, **dict(zip(GROUP, key, strict=True)))
    columns = min(COLUMNS, len(methods))
    bands = -(-len(methods) // columns)
    drawing, grid = plots.panels(2 * bands, columns, WIDTH * max(columns, 2), HEIGHT * bands, sharey=False)
    colors, listed = dict(zip(runs, layout.PALETTE, strict=False)), []
    for number, (method, every) in enumerate(methods):
        row, column = divmod(number, columns)
        above, below = grid[2 * row : 2 * row + 2, column]
        above.set_title(textwrap.fill(_name(*method), TITLE))
        same = select(found, metric=F1, **dict(zip(METHOD, method, strict=True)))
        for run, own in every.groupby("run", sort=False):
            plots.draw_curve(above, own, colors[run], "o", label=run)
            differs = select(same, run=run).sort_values("test_snr_db")
            if len(differs):
                values, low, high = (differs[name] for name in ("difference", "low", "high"))
                bars = values - low, high - values
                below.errorbar(differs["test_snr_db"], values, bars, color=colors[run], marker="o", capsize=2)
                words = {"method": _name(*method), "run": run, "mean difference": signed(values.mean())}
                counts = {"better at": (low > 0).sum(), "worse at": (high < 0).sum()}
                words |= {head: f"{count} of {len(low)} SNRs" for head, count in counts.items()}
                listed.append(words | {"images in common": f"{differs['n'].min():,}"})
        below.axhline(0, color=colors[runs[0]], lw=0.8)
    plots.finish(drawing, grid, axis)
    for row, axes in enumerate(grid[:, 0]):
        axes.set_ylabel(f"minus {runs[0]}" if row % 2 else "weighted F1")
    words = f"Weighted F1 of {', '.join(runs)} against the test SNR, and how they differ from {runs[0]}."
    return _shown("runs", key, _title(*key), drawing, words, rows, found, listed)


def _over_seeds(key, rows, axis):
    drawing, grid = plots.panels(1, 1, WIDTH * 2, HEIGHT)
    snrs, listed = sorted(rows["test_snr_db"].unique()), []
    for color, (method, own) in zip(layout.PALETTE * 9, rows.groupby(METHOD), strict=False):
        plots.draw_curve(grid[0, 0], own, color, "o", label=_name(*method))
        listed.append({"method": _name(*method)} | at_snrs(own, snrs))
    plots.finish(drawing, grid, axis, "weighted F1, mean over seeds")
    words = "Weighted F1 against the test SNR, mean over seeds with its 95 % interval."
    heading = f"Over {rows['n'].max():.0f} seeds: {_title(*key)}"
    return _shown("seeds", key, heading, drawing, words, rows, rows, listed)


def _shown(kind, key, heading, drawing, words, drawn, data, listed):
    """Return a section of a figure and a table, whose rows are `listed`, if any. drawn, data: of their CSV files."""
    name = "_".join(filter(None, (kind, *key)))
    figures = (layout.figure(name, drawing, drawn, words, wide=True),)
    return layout.Section(name, heading, (), figures, (layout.table(name, data, listed, words),) if listed else ())


def _name(model, training, score):
    words = [title(model), "" if training == "clean" else f"trained at {training}", title(score)]
    return ", ".join(filter(None, words))


def _title(experiment, split, threshold):
    judged = f"open set, {threshold} thresholds" if threshold else "closed set"
    return f"{heading(experiment)}, {SPLITS[split]}: {judged}"
