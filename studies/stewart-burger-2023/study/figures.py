"""Parts of the thesis's figures that are drawn: scores over the SNR, matrices, histograms, pictures of images.

A part is named in page.yaml and yields blocks of Markdown. figure: as of `page.build`; a part appends to its `lacks`
what the run does not have of it.
"""

from itertools import product

import numpy as np

from isarflow.core.sweep import elevations as elevations_of
from isarflow.core.sweep import snr_label
from isarflow.core.words import number
from isarflow.learning.data import images
from isarflow.report import plots
from isarflow.report.layout import BLACK, BLUE, VERMILION
from isarflow.report.published import ADAPTATIONS
from isarflow.report.selection import evenly, nearest
from isarflow.report.vocabulary import MEASURES, listed, select, snr_axis
from study import anew
from study.anew import nearest_snr, plain
from study.markdown import picture, table
from study.selection import PAGE
from study.statements import by_sector, open_counts, ours
from study.texts import values_table

# How curves are split, by whose thresholds, and whose rows they are.
PANELS = [("split at random", ", thesis thresholds", ours), ("split by sector", ", blind thresholds", by_sector)]
BINS = 60


def curves(results, figure):
    """Draw curves over the SNR, at random with published statements and by sector, and list their values.

    Of each model the closed set, and the open set by each of figure.scores.
    """
    names, several, shown = results.names, len(figure.models) > 1, {}
    for (split, thresholds, rows_of), model, score in product(PANELS, figure.there, ("", *figure.scores)):
        rows = rows_of(results, figure.experiment, model, figure.metric, score, figure.elevation)
        if len(rows):
            look = names.score(score) if score else names.model(model)
            label = look.label if several else f"open set, {look.label}" if score else "closed set"
            line = f"{label}, {split}{thresholds if score else ''}", look.curve | {"label": label}, rows
            shown.setdefault(f"{split}{thresholds if figure.scores else ''}", []).append(line)
    whose = listed([names.model(model).label for model in figure.there])
    yield from _over_snr(results, figure, shown, f"{MEASURES[figure.metric]} of {whose} against the test SNR.")


def trainings(results, figure):
    """Draw the accuracy of a model trained at each of several SNRs, and list its values.

    figure.beside: experiments to compare, in words; one that trains once, without noise, is drawn as well.
    """
    (model,) = figure.models
    rows = ours(results, figure.experiment, model, figure.metric)
    trained, groups = results.names.values(rows, "training"), results.names.groups(rows, "training")
    lines = [(training, plots.training_look(training, trained), curve) for (training,), curve in groups]
    for words, experiment in figure.beside.items():
        for (training,), curve in results.names.groups(ours(results, experiment, model, figure.metric), "training"):
            look = {"color": BLACK, "band": False, "ls": "--", "label": f"trained {words} (Fig. 4.12)"}
            lines.append((words, look, curve) if training == "clean" else (f"{training}, {words}", None, curve))
    words = f"accuracy of {results.names.model(model).label} against the test SNR, a curve for each training SNR."
    yield from _over_snr(results, figure, {"": lines} if len(rows) else {}, words, "trained at")


def _over_snr(results, figure, shown, alt, head=""):
    """Draw curves over the SNR, and list their values.

    shown: (words, look, rows) of each curve, by the panel's title; without a look it is listed alone; head: over words.
    """
    if not shown:
        figure.lacks.append("scores by mean power")
        return
    every = [line for lines in shown.values() for line in lines]
    drawing, grid = plots.panels(1, len(shown), max(1 + 3.9 * len(shown), 6.6), 3.9)
    for axes, (title, lines) in zip(grid.flat, shown.items(), strict=True):
        for _, look, rows in lines:
            if look:
                plots.draw_curve(axes, rows, **look)
        opened = {rows["experiment"].iloc[0] for *_, rows in lines if rows["score"].iloc[0]}
        plots.draw_rejecting(axes, results.rejecting(opened))
        axes.set_title(title)
    own = {(rows["model"].iloc[0], rows["score"].iloc[0]): look["color"] for _, look, rows in every if look}
    names = ADAPTATIONS | {model: (model, "") for model in figure.models}
    colors = {name: own[of] for name, of in names.items() if of in own}
    case = {"experiment": figure.experiment, "elevation": figure.elevation, "reading": ["", "maximum"]}
    plots.draw_published(grid[0, 0], select(results.published_scores, **case, model=list(colors)), colors)
    plots.finish(drawing, grid, snr_axis("mean"), MEASURES[figure.metric])
    yield picture(figure, drawing, alt)
    yield values_table([(words, rows) for words, _, rows in every], head)


def matrices(results, figure):
    """Draw confusion matrices, a column for each adaptation: published and ours."""
    order, columns = results.of_role("known") + results.of_role("unknown"), len(figure.adaptations)
    drawing, grid = plots.panels(2, columns, 0.6 + 3.2 * columns, 5.9, False, False)
    for (above, below), name in zip(grid.T, figure.adaptations, strict=True):
        printed = select(results.published_confusion, model=name).set_index("true")[["drone", "missile", "other"]]
        plots.draw_matrix(above, printed, f"{PAGE['headings'][name]},\npublished")
        counts = open_counts(results, figure.experiment, *ADAPTATIONS[name])
        if len(counts):
            text = f"here at {nearest_snr(results):g} dB, test images"
            plots.draw_matrix(below, counts.reindex(order).fillna(0), text)
    plots.finish(drawing, grid, "predicted class", "target", legend=False)
    words = listed([PAGE["headings"][name] for name in figure.adaptations])
    yield picture(figure, drawing, f"confusion matrices of {words}, as published and here.")


def reconstructions(results, figure):
    """Draw images and what a network makes of them, a row for each target. figure.kinds: variables and their words."""
    store, kinds = results.reconstructions(figure.experiment, figure.models[0]), figure.kinds
    snr = nearest(store.snr.values.tolist(), figure.snr)
    dataset, rows, lines = store.sel(snr=snr).load(), [], []
    order = [target for target in results.targets if target in dataset.target.values]
    for target in order:
        made = dataset.sel(target=target)
        heads = [["", "", "" if lines else words, "", ""] for words in kinds.values()]  # of five images the third
        lines.append([*zip(np.ravel(heads), np.concatenate([made[kind] for kind in kinds]), strict=True)])
        row = {f"at {snr:g} dB": target}
        for words, of in (("input", made.seen), ("image without noise", made.truth)):
            row[f"MSE, reconstruction and {words}"] = number(float(((made.made - of) ** 2).mean()))
        rows.append(row)
    shown = f"five images of each of {listed(order)} at {snr:g} dB: {', '.join(kinds.values())}."
    yield _pictures(figure, lines, shown, 0.8, order)
    yield table(rows)


def histograms(results, figure):
    """Draw the confidence scores figure.effects of known and unknown test images, and thresholds from both sides."""
    network, count = (figure.experiment, figure.models[0]), len(figure.effects)
    drawing, grid = plots.panels(1, count, max(1 + 3.9 * count, 6.6), 3.4, False, False)
    for axes, (score, aim) in zip(grid.flat, figure.effects.items(), strict=True):
        snr = nearest_snr(results, aim)
        test = select(results.predictions(*network, snr), side="test")
        values = plain(score, test[f"known_{score}"])
        both = [values[test["role"] == role] for role in ("known", "unknown")]
        look = {"color": [BLUE, VERMILION], "label": ["known targets", "unknown targets"], "alpha": 0.45}
        axes.hist(both, BINS, density=True, histtype="stepfilled", **look)
        found = anew.judged(results, *network, score, snr)
        for name, dash, side in (("validation", "--", "validation"), ("errors", ":", "test")):
            look = {"color": "black", "ls": dash, "lw": 1.2, "label": f"threshold from {side} images"}
            axes.axvline(plain(score, found.thresholds[name]), **look)
        axes.set_xlabel(results.names.score(score).label)
    plots.finish(drawing, grid, "", "density")
    words = listed([results.names.score(score).label for score in figure.effects])
    yield picture(figure, drawing, f"histograms of {words} at {snr:g} dB, known and unknown targets.")


def images_shown(results, figure):
    """Draw a row of images of each of the first figure.targets known targets, at one azimuth, each of its peak.

    figure.snr: in dB, or clean; figure.elevations: how many; figure.pixels: a side, up-sampled, or none.
    """
    known, lines = results.of_role("known")[: figure.targets], []
    if not results.images_are_made:
        figure.lacks.append("images of known targets")
        return
    images_there, side = results.images(known[0], "clean"), figure.pixels[-1]
    if side != "none" and ("range_wavenumber" not in images_there.attrs or max(images_there.image.shape[-2:]) > side):
        figure.lacks.append(f"images that can be up-sampled to {side} pixels a side")
        return
    snr = figure.snr if figure.snr == "clean" else nearest_snr(results, figure.snr)
    for target in known:
        store = results.folder / "imaging" / target / f"{snr if snr == 'clean' else snr_label(snr)}.zarr"
        elevations, where = elevations_of(results.settings["aspect"]), {target: images.azimuths(store)[:1]}
        shown = evenly(elevations, figure.elevations) if figure.elevations > 1 else [nearest(elevations, 0)]
        line = []
        for elevation, pixels in product(shown, figure.pixels):
            (image, *_), _ = images.read([store], where, [elevation], pixels, channels=results.polarizations[:1])
            image = np.abs(image) / max(np.abs(image).max(), 1e-12)
            line.append((f"{target}, {elevation:g}°\n{image.shape[0]} × {image.shape[1]}", image))
        lines.append(line)
    noise = "without noise" if snr == "clean" else f"at {snr:g} dB"
    yield _pictures(figure, lines, f"images of {listed(known)} {noise}, headed by elevation and pixels.")


def _pictures(figure, lines, alt, side=1.3, labels=()):
    """Return a picture of rows of (title, image from 0 to 1). side: inches of an image; labels: of the rows."""
    rows, columns = len(lines), len(lines[0])
    drawing, grid = plots.panels(rows, columns, side * columns + 0.4, (side + 0.2) * rows, False, False, "compressed")
    for axes, (text, image) in zip(grid.flat, (one for line in lines for one in line), strict=True):
        plots.draw_pixels(axes, image)
        axes.set(xticks=[], yticks=[])
        axes.set_title(text, fontsize=8)
    for axes, label in zip(grid[:, 0], labels, strict=False):
        axes.set_ylabel(label)
    plots.finish(drawing, grid, "", legend=False)
    return picture(figure, drawing, alt)
