"""Parts of the figures of the thesis's networks, as of `figures`: confusion matrices, reconstructions, histograms."""

import numpy as np

from isarflow.core.words import number
from isarflow.report.layout import BLUE, VERMILION
from isarflow.report.plots import draw_matrix, draw_pixels, finish, panels
from isarflow.report.published import ADAPTATIONS
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import select, with_interval
from study import anew
from study import statements as stated
from study.anew import nearest_snr, plain
from study.markdown import NONE, picture, table
from study.selection import PAGE
from study.statements import SPLIT

HEADINGS = PAGE["headings"]
EXAMPLES = 5  # reconstructions of a target
BINS = 60


def matrices(results, figure):
    """Draw confusion matrices, a column for each adaptation: published and ours."""
    if not figure.there:
        return
    order, columns = results.of_role("known") + results.of_role("unknown"), len(figure.adaptations)
    drawing, grid = panels(2, columns, 0.6 + 3.2 * columns, 5.9, False, False)
    for (above, below), name in zip(grid.T, figure.adaptations, strict=True):
        draw_matrix(above, anew.printed_matrix(results, name)[0], f"{HEADINGS[name]},\npublished")
        counts = stated.open_counts(results, figure.experiment, *ADAPTATIONS[name])
        if len(counts):
            draw_matrix(below, counts.reindex(order).fillna(0), f"here at {nearest_snr(results):g} dB, test images")
    finish(drawing, grid, "predicted class", "target", legend=False)
    words = f"confusion matrices of {', '.join(HEADINGS[name] for name in figure.adaptations)}, as published and here."
    yield picture(figure.picture, drawing, f"{figure.picture}: {words}")


def reconstructions(results, figure):
    """Draw images and what a network makes of them, a row for each target. figure.kinds: variables and their words."""
    if not figure.there:
        return
    store, kinds = results.reconstructions(figure.experiment, figure.models[0]), figure.kinds
    snr = nearest(store.snr.values.tolist(), figure.snr)
    dataset, rows = store.sel(snr=snr).load(), []
    order = [target for target in results.targets if target in dataset.target.values]
    size = 0.8 * len(kinds) * EXAMPLES + 0.5, 0.8 * len(order) + 0.4
    drawing, grid = panels(len(order), len(kinds) * EXAMPLES, *size, False, False, "compressed")
    for row, target in enumerate(order):
        images = dataset.sel(target=target)
        for axes, image in zip(grid[row], np.concatenate([images[kind] for kind in kinds]), strict=True):
            draw_pixels(axes, image)
            axes.set(xticks=[], yticks=[])
        grid[row, 0].set_ylabel(target)
        line = {"target": target}
        for words, of in (("input", images.seen), ("image without noise", images.truth)):
            line[f"MSE, reconstruction and {words}"] = number(float(((images.made - of) ** 2).mean()))
        rows.append(line)
    for axes, words in zip(grid[0, EXAMPLES // 2 :: EXAMPLES], kinds.values(), strict=True):
        axes.set_title(words)
    finish(drawing, grid, "", legend=False)
    shown = f"five images of each of {', '.join(order)} at {snr:g} dB: {', '.join(kinds.values())}."
    yield picture(figure.picture, drawing, f"{figure.picture} here: {shown}")
    yield f"At {snr:g} dB, of these images:"
    yield table(rows)


def histograms(results, figure):
    """Draw the confidence scores of known and unknown test images, with thresholds from validation and test images."""
    if not figure.there:
        return
    network = experiment, model = figure.experiment, figure.models[0]
    snr, rows = nearest_snr(results, figure.snr), []
    test = select(results.predictions(*network, snr), side="test")
    drawing, grid = panels(1, len(figure.scores), max(1 + 3.9 * len(figure.scores), 6.6), 3.4, False, False)
    for axes, score in zip(grid.flat, figure.scores, strict=True):
        values, label = plain(score, test[f"known_{score}"]), results.names.score(score).label
        edges = np.linspace(values.min(), max(values.max(), values.min() + 1e-9), BINS + 1)
        for role, color in (("known", BLUE), ("unknown", VERMILION)):
            draw_density(axes, values[test["role"] == role], edges, color, f"{role} targets")
        found = anew.judged(results, *network, score, snr)
        for name, dash, side in (("validation", "--", "validation"), ("errors", ":", "test")):
            look = {"color": "black", "ls": dash, "lw": 1.2, "label": f"threshold from {side} images"}
            axes.axvline(plain(score, found.thresholds[name]), **look)
        axes.set_xlabel(label)
        case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "metric": "auroc"}
        area = select(results.scores, **case, elevation="all", test_snr_db=snr).to_dict("records")
        rows.append({"score": label, "AUROC": with_interval(area[0]) if area else NONE, **found.cells(score)})
    finish(drawing, grid, "", "density")
    words = f"histograms of {' and '.join(row['score'] for row in rows)} at {snr:g} dB, known and unknown targets."
    yield picture(figure.picture, drawing, f"{figure.picture} here: {words}")
    yield f"At {snr:g} dB, test images:"
    yield table(rows)


def draw_density(axes, values, edges, color, label):
    """Draw a histogram of values as a density."""
    counts = np.histogram(values, edges)[0]
    density = counts / max(counts.sum(), 1) / np.diff(edges)
    axes.stairs(density, edges, fill=True, alpha=0.45, color=color, label=label)
    axes.stairs(density, edges, color=color)
