"""Networks with a decoder: what they reconstruct, and how well the error of it tells known targets from unknown."""

import itertools

import numpy as np
import pandas as pd

from isarflow.learning import thresholds
from isarflow.learning.experiments import CLEAN
from isarflow.report import thesis
from isarflow.report.conditions import conditions
from isarflow.report.layout import BLUE, VERMILION, Section, figure
from isarflow.report.plots import draw_curve, draw_density, draw_pixels, draw_published, draw_rejecting, finish, panels
from isarflow.report.published import FULL_SIZE, beside, confusion_figure
from isarflow.report.selection import decoded_snrs
from isarflow.report.vocabulary import F1, PROTOCOLS, of_run, run_title, select, snr_axis, split_place, split_text

PLACE, NEEDS = ("recognition", 3), "opened"  # on the page, see page.py
BINS = 50
EXAMPLES, OTHERS_EXAMPLES = 4, 2  # reconstructions of each target by the first network, and by each other one
SIDE = 0.98  # inches a reconstruction


def section(results):
    """Return the section; nothing where no model with a decoder is tested on unknown targets."""
    if not results.decoders:
        return ()

    def place(decoder):
        """Put the reference thesis's network, trained without noise, first."""
        run, model = results.runs[decoder[0]], decoder[1]
        return results.names.model(model).place, split_place(run["split"]), run["snrs"] != [CLEAN], run["name"]

    runs_of = {}  # by model
    for name, model in sorted(results.decoders, key=place):
        runs_of.setdefault(model, []).append(results.runs[name])
    model, opened = next(iter(runs_of.items()))
    run = opened[0]
    # The thesis's matrices are of its split.
    alike = next((other for other in opened if other["split"] == "random"), run)
    # Two confidence scores: the thesis's MSE and ZNCC are the first.
    shown = results.names.values(select(of_run(results.scores, run, model), threshold=PROTOCOLS), "score")[:2]
    adaptations = {f"{model}_{score}": (model, score) for score in shown}
    text = (
        "A network with a decoder reconstructs each image from the class that it takes it for. What it cannot "
        "reconstruct is none of the known classes: the confidence score compares the image with its reconstruction, by "
        "minus the mean squared error (MSE) or by the zero-mean normalised cross-correlation (ZNCC). The first figures "
        f"are of {thesis.network(model, results)} in {run_title(run)}, {split_text(run['split'])}. Numbers of all "
        "models and confidence scores stand with the open set."
    )
    figures = [
        f1_figure(results, opened, model, shown),
        *confusion_figure(results, "capsule_confusion", of_run(results.confusion, alike, model), adaptations),
        histogram_figure(results, run, model, shown),
        reconstruction_figure(results, run, model, "", EXAMPLES),
    ]
    for other in [*runs_of][1:]:
        figures.append(reconstruction_figure(results, runs_of[other][0], other, f"_{other}", OTHERS_EXAMPLES))
    title = "Capsule network" if thesis.kind(model, results.settings) == "capsule" else "Networks with a decoder"
    return (Section(id="capsule", title=title, text=(text,), figures=tuple(figures)),)


def f1_figure(results, opened, model, shown):
    """Draw weighted F1 against the test SNR: a column for each run, a row for each protocol of thresholds.

    opened: the model's open runs, as `experiments.runs` gives them; shown: confidence scores.
    """
    looks = {"": results.names.model(model), **{score: results.names.score(score) for score in shown}}
    rows = select(results.scores, elevation="all", metric=F1, score=list(looks))
    rows = pd.concat(of_run(rows, run, model).assign(run=run["name"]) for run in opened)
    # The thesis trains without noise and splits at random.
    alike = [run["name"] for run in opened if run["split"] == "random" and run["snrs"] == [CLEAN]]
    stated = {model: "", **{f"{model}_{score}": score for score in shown}} if alike else {}
    statements = select(results.published_scores, metric=["f1", "weighted_f1"], model=list(stated))
    statements = statements.assign(score=statements["model"].map(stated))
    drawn, statements, definition, words = beside(results, rows, statements, FULL_SIZE)
    drawing, grid = panels(len(PROTOCOLS), len(opened), max(1 + 3.6 * len(opened), 5.6), 3 * len(PROTOCOLS))
    for axes, (protocol, run) in zip(grid.flat, itertools.product(PROTOCOLS, opened), strict=True):
        draw_rejecting(axes, results.rejecting([run["experiment"]]))
        for score, look in looks.items():
            curve = select(drawn, run=run["name"], score=score, threshold=protocol if score else "")
            label, marker = (f"open set, {look.label}", look.marker) if score else ("closed set", "o")
            draw_curve(axes, curve, look.color, marker, label=label)
            if run["name"] in alike and protocol == "thesis":
                draw_published(axes, select(statements, score=score), look.color)
        axes.set_title(f"{split_text(run['split'])}, {protocol} thresholds\n{run_title(run)}")
    finish(drawing, grid, snr_axis(definition), "weighted F1")
    caption = (
        f"Weighted F1 of {thesis.network(model, results)} with 95 % intervals: the known targets alone, and with "
        f"unknown ones, by confidence score and protocol of thresholds.{words}{conditions(results, drawn, definition)}"
    )
    alt = "Weighted F1 of a network with a decoder against test SNR, in the closed set and in the open set."
    return figure("capsule_f1", drawing, drawn, alt, caption, wide=len(opened) > 1)


def plain(score, values):
    """Return values of a confidence score as they are shown: the MSE itself, not minus it."""
    return -values if score == "mse" else values


def histogram_figure(results, run, model, shown):
    """Draw how the confidence scores of known and unknown test images lie: a row per SNR, a column per score.

    The run is one fold, whose thresholds are drawn. shown: confidence scores.
    """
    snrs = sorted(decoded_snrs(results.settings["noise"]["snr_db"]), reverse=True)
    kept = results.settings["learning"]["kept"]
    tables = {snr: results.predictions(run["name"], model, snr) for snr in snrs}
    drawing, grid = panels(len(snrs), len(shown), 1 + 3.2 * len(shown), 0.8 + 2.2 * len(snrs), "col", False)
    drawn = []
    for column, score in zip(grid.T, shown, strict=True):
        label, known = results.names.score(score).label, f"known_{score}"
        every = plain(score, pd.concat(tables.values())[known])
        edges = np.linspace(every.min(), max(every.max(), every.min() + 1e-9), BINS + 1)
        for axes, (snr, table) in zip(column, tables.items(), strict=True):
            chosen = [plain(score, thresholds.choose(table, known, protocol, kept)) for protocol in PROTOCOLS]
            lines = dict(zip([f"threshold_{protocol}" for protocol in PROTOCOLS], chosen, strict=True))
            for role, color in (("known", BLUE), ("unknown", VERMILION)):
                values = plain(score, select(table, side="test", role=role)[known])
                counts, density = draw_density(axes, values, edges, color, f"{role} targets")
                bins = {"snr_db": snr, "score": score, "role": role, "from": edges[:-1], "to": edges[1:]}
                drawn.append(pd.DataFrame({**bins, "images": counts, "density": density, **lines}))
            for protocol, value, dash in zip(PROTOCOLS, chosen, ("--", ":", "-."), strict=True):
                axes.axvline(value, color="black", ls=dash, lw=1.2, label=f"{protocol} threshold")
            axes.set_title(f"{label} at {snr:g} dB")
        column[-1].set_xlabel(label)
    finish(drawing, grid, "", "density")
    names = " and ".join(results.names.score(score).label for score in shown)
    caption = (
        f"{names} of image and reconstruction, of test images in {run_title(run, fold=True)}. Right of a threshold, by "
        "the MSE left of it, an image is taken for one of a known target."
    )
    alt = f"Histograms of {names} for test images of known and of unknown targets."
    return figure("capsule_histograms", drawing, pd.concat(drawn), alt, caption, wide=len(shown) > 1)


def reconstruction_figure(results, run, model, suffix, count):
    """Draw test images and what a model makes of them: truth, then seen and made at each SNR; two examples in a row.

    suffix: of the figure's name; count: images of each target.
    """
    dataset = results.reconstructions(run["name"], model)
    order = [target for target in results.targets if target in dataset.target.values]
    dataset = dataset.sel(target=order).isel(example=slice(count)).load()
    snrs = sorted(dataset.snr.values.tolist(), reverse=True)
    width, rows = 1 + 2 * len(snrs), -(-dataset.sizes["example"] // 2) * len(order)
    size = 0.9 + 2 * (SIDE * width + 0.3), 0.25 + (SIDE + 0.13) * rows
    drawing, grid = panels(rows, 2 * width, *size, False, False, "compressed")
    places = grid.reshape(len(order), -1, width)
    for (number, target), example in itertools.product(enumerate(order), range(dataset.sizes["example"])):
        images = dataset.sel(target=target).isel(example=example)
        shown = [("truth", images.truth)]
        for snr in snrs:
            noisy = images.sel(snr=snr)
            shown += [(f"seen, {snr:g} dB", noisy.seen), (f"as {noisy.predicted.item()}", noisy.made)]
        for axes, (text, image) in zip(places[number, example], shown, strict=True):
            picture = draw_pixels(axes, image.values)
            axes.set(xticks=[], yticks=[])
            axes.set_title(text, fontsize=7, pad=2)
        where = f"{float(images.elevation):.4g}°, {float(images.azimuth):.4g}°"
        places[number, example][0].set_ylabel(f"{target}\n{where}", fontsize=7)
    finish(drawing, grid, "", legend=False)
    drawing.colorbar(picture, ax=grid, label="|image| of its peak", shrink=0.5, aspect=40, pad=0.01)
    caption = (
        f"What {thesis.network(model, results)} in {run_title(run, fold=True)} makes of test images. Of each: without "
        "noise; with noise as the network sees it; and its reconstruction, headed by the class that it takes the image "
        "for. At the side elevation and azimuth; range goes up, cross-range to the right."
    )
    alt = f"Test images of {', '.join(order)} without noise, as seen with noise, and as reconstructed."
    data = dataset.to_dataframe(dim_order=["target", "example", "snr", "range", "crossrange"]).reset_index().round(4)
    return figure(f"capsule_reconstructions{suffix}", drawing, data, alt, caption, wide=True)
