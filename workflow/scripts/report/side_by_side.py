"""The page of several runs side by side: their scores over each other, and how they differ on the same test images."""

import textwrap
from pathlib import Path

import jinja2
import pandas as pd

from isarflow.core.folders import SCORES
from isarflow.learning.paired import differences
from isarflow.report import layout, plots
from isarflow.report.vocabulary import F1, heading, snr_axis, split_text, title

PROTOCOL = "blind"  # of the thresholds that the page shows; the table beside it has the others, too
GROUP = ["experiment", "split", "threshold"]  # a section of the page each
METHOD = ["model", "training", "score"]  # a panel each
COLUMNS, WIDTH, HEIGHT = 3, 2.7, 3.3  # panels in a row; inches of one
TITLE = 34  # letters in a line of its title
TEMPLATES = Path(__file__).parent / "templates"


def write_comparison(roots, definition, seed, kept, page, table, over_seeds=None):
    """Write the page of runs side by side, one self-contained HTML file, and all differences as a table, a CSV file.

    roots: the runs' folders by name, the first the one that the others are compared with. definition: the SNR's, of
    the first one's config, by which scores are shown. seed: of the resamples. kept: as of `differences`.
    over_seeds: None, or the first run's learning/seeds.csv.
    """
    first, *others = roots
    found = differences(roots, seed, kept)
    found.to_csv(table, index=False)
    best = _best(Path(roots[first], SCORES).with_name("validation.csv"))
    scores = {name: _rows(Path(root, SCORES), definition, best) for name, root in roots.items()}
    methods = {name: set(map(tuple, rows[GROUP + METHOD].to_numpy())) for name, rows in scores.items()}
    shared = {method for name in others for method in methods[first] & methods[name]}
    alone = {name: sum(method not in shared for method in methods[name]) for name in roots}
    every = pd.concat([rows.assign(run=name) for name, rows in scores.items()], ignore_index=True)
    every = every[[tuple(method) in shared for method in every[GROUP + METHOD].to_numpy()]]
    with layout.style():
        axis = snr_axis(definition)
        sections = [_section(key, rows, found, list(roots), axis) for key, rows in every.groupby(GROUP, sort=True)]
        seeds = _over_seeds(_rows(over_seeds, definition, best), axis) if over_seeds else []
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    html = environment.get_template("side_by_side.html").render(
        first=first, others=others, sections=[*seeds, *sections], alone=alone, table=Path(table).name
    )
    Path(page).write_text(html)
    print(f"{len(sections)} sections, {len(found)} differences")


def _best(validation):
    """The confidence score of each method that is best on the validation images: {(*GROUP, model, training): score}."""
    rows = pd.read_csv(validation, keep_default_na=False).query("metric == @F1 and threshold == @PROTOCOL")
    means = rows.groupby([*GROUP, *METHOD])["value"].mean().reset_index().sort_values("value")
    return {tuple(row[:-2]): row[-2] for row in means.itertuples(index=False)}


def _rows(scores, definition, best):
    """The rows that the page shows of a table like scores.csv: weighted F1, of open runs by the best score alone."""
    rows = pd.read_csv(scores, keep_default_na=False, na_values={name: "" for name in ("value", "low", "high")})
    rows = rows.query("metric == @F1 and elevation == 'all' and fold == '' and snr_definition == @definition")
    rows = rows[rows["threshold"].isin(["", PROTOCOL])]
    wanted = [best.get(tuple(key), "") for key in rows[[*GROUP, "model", "training"]].to_numpy()]
    return rows[rows["score"] == wanted]


def _section(key, rows, found, runs, axis):
    """What the template shows of a group: its title, figure and table. rows: of all runs; found: the differences.

    axis: what the axis of SNRs is called.
    """
    for name, value in zip(GROUP, key, strict=True):
        found = found[found[name] == value]
    found = found[found["metric"] == F1]
    methods = sorted(set(map(tuple, rows[METHOD].to_numpy())))
    columns = min(COLUMNS, len(methods))
    bands = -(-len(methods) // columns)
    drawing, grid = plots.panels(2 * bands, columns, WIDTH * max(columns, 2), HEIGHT * bands, sharey=False)
    colors, listed = dict(zip(runs, layout.PALETTE, strict=False)), []
    for number, method in enumerate(methods):
        row, column = divmod(number, columns)
        above, below = grid[2 * row, column], grid[2 * row + 1, column]
        above.set_title(textwrap.fill(_name(method), TITLE))
        for run in runs:
            own = _of(rows, method, run)
            if not len(own):
                continue
            plots.draw_curve(above, own, colors[run], "o", label=run)
            differs = _of(found, method, run).sort_values("test_snr_db")
            if len(differs):
                ends = differs["difference"] - differs["low"], differs["high"] - differs["difference"]
                snrs, values = differs["test_snr_db"], differs["difference"]
                below.errorbar(snrs, values, ends, color=colors[run], marker="o", capsize=2)
                listed.append(_row(method, run, differs))
        below.axhline(0, color=colors[runs[0]], lw=0.8)
    plots.finish(drawing, grid, axis)
    for row in range(2 * bands):
        grid[row, 0].set_ylabel(f"minus {runs[0]}" if row % 2 else "weighted F1")
    alt = f"Weighted F1 of {', '.join(runs)} against the test SNR, and how they differ from {runs[0]}."
    return _part(_title(*key), drawing, alt, pd.DataFrame(listed))


def _row(method, run, differs):
    """How a run differs from the first over all test SNRs, as text."""
    signs = {"better": (differs["low"] > 0).sum(), "worse": (differs["high"] < 0).sum()}
    return {
        "method": _name(method),
        "run": run,
        "mean difference": layout.signed(differs["difference"].mean()),
        "better at": _snrs(signs["better"], len(differs)),
        "worse at": _snrs(signs["worse"], len(differs)),
        "images in common": f"{differs['n'].min():,}",
    }


def _over_seeds(rows, axis):
    """Sections of the scores over seeds, a mean with its interval for each method."""
    parts = []
    for key, group in rows.groupby(GROUP, sort=True):
        drawing, grid = plots.panels(1, 1, WIDTH * 2, HEIGHT)
        for color, (method, own) in zip(layout.PALETTE * 9, group.groupby(METHOD, sort=True), strict=False):
            plots.draw_curve(grid[0, 0], own, color, "o", label=_name(method))
        plots.finish(drawing, grid, axis, "weighted F1, mean over seeds")
        listed = [
            {"method": _name(method)} | {f"{row.test_snr_db:g} dB": _with_interval(row) for row in own.itertuples()}
            for method, own in group.groupby(METHOD, sort=True)
        ]
        seeds = int(group["n"].max())
        alt = "Weighted F1 against the test SNR, mean over seeds."
        parts.append(_part(f"Over {seeds} seeds: {_title(*key)}", drawing, alt, pd.DataFrame(listed)))
    return parts


def _part(heading, drawing, alt, shown):
    """A section as the template takes it."""
    figure = layout.figure("side_by_side", drawing, shown, alt, "")
    return {"title": heading, "figure": figure, "rows": shown.to_dict("records")}


def _of(rows, method, run):
    return rows[(rows[METHOD] == method).all(axis=1) & (rows["run"] == run)]


def _name(method):
    model, training, score = method
    words = [title(model), "" if training == "clean" else f"trained at {training}", title(score)]
    return ", ".join(filter(None, words))


def _with_interval(row):
    return f"{row.value:.3f} [{row.low:.3f}, {row.high:.3f}]"


def _title(experiment, split, threshold):
    judged = f"open set, {threshold} thresholds" if threshold else "closed set"
    return f"{heading(experiment)}, {split_text(split)}: {judged}"


def _snrs(count, of):
    return f"{count} of {of} SNRs" if of > 1 else ("yes" if count else "no")
