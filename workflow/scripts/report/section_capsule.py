"""Networks with a decoder: what they reconstruct, and how well the error of it tells known targets from unknown."""

import itertools

import numpy as np
import pandas as pd

from isarflow.learning import thresholds
from isarflow.learning.experiments import CLEAN
from isarflow.report import thesis
from isarflow.report.conditions import conditions
from isarflow.report.layout import BLUE, VERMILION, Section, figure, number
from isarflow.report.plots import draw_curve, draw_density, draw_pixels, draw_published, draw_rejecting, finish, panels
from isarflow.report.published import FULL_SIZE, beside, confusion_figure
from isarflow.report.selection import decoded_snrs
from isarflow.report.vocabulary import (
    F1,
    PROTOCOLS,
    at_highest,
    heading,
    listed,
    of_run,
    run_title,
    select,
    snr_axis,
    split_place,
    split_text,
)

SCORES = ("mse", "zncc")  # the reference thesis's, of an image and its reconstruction
BINS = 50
EXAMPLES, OTHERS_EXAMPLES = 4, 2  # reconstructions of each target by the first network, and by each other one
SIDE = 0.98  # inches a reconstruction


def section(results):
    """Nothing where no model with a decoder is tested on unknown targets."""
    if not results.decoders:
        return ()
    runs, names = results.runs, results.names

    def place(decoder):
        """The reference thesis's network, trained without noise, first."""
        run, model = decoder
        return names.model(model).place, split_place(runs[run]["split"]), runs[run]["snrs"] != [CLEAN], run

    first = {}  # run of each model
    for run, model in sorted(results.decoders, key=place):
        first.setdefault(model, run)
    model, run = next(iter(first.items()))
    opened = [runs[name] for name, decoder in sorted(results.decoders, key=place) if decoder == model]
    # The thesis's matrices are of its split.
    alike = next((other for other in opened if other["split"] == "random"), runs[run])
    scores = of_run(select(results.scores, elevation="all"), runs[run], model)
    found = names.values(scores[scores["score"] != ""], "score")
    # The thesis's two; of a model that has neither, its first two.
    shown = [score for score in SCORES if score in found] or found[:2]
    adaptations = {f"{model}_{score}": (model, score) for score in shown}
    return (
        Section(
            id="capsule",
            title="Capsule network" if thesis.kind(model, results.settings) == "capsule" else "Networks with a decoder",
            text=(
                "A network with a decoder reconstructs each image from the class that it takes it for. What it cannot "
                "reconstruct is none of the known classes: the confidence score compares the image with its "
                "reconstruction, by minus the mean squared error (MSE) or by the zero-mean normalised "
                f"cross-correlation (ZNCC). The first figures are of {thesis.network(model, results)} in "
                f"{run_title(runs[run])}, {split_text(runs[run]['split'])}. Numbers of all models and confidence "
                "scores stand with the open set.",
            ),
            figures=(
                f1_figure(results, opened, model, shown),
                *confusion_figure(results, "capsule_confusion", of_run(results.confusion, alike, model), adaptations),
                *([histogram_figure(results, run, model, shown, scores)] if shown else []),
                reconstruction_figure(results, run, model, "", EXAMPLES),
                *(
                    reconstruction_figure(results, other_run, other, f"_{other}", OTHERS_EXAMPLES)
                    for other, other_run in first.items()
                    if other != model
                ),
            ),
        ),
    )


def f1_figure(results, opened, model, shown):
    """Weighted F1 against the test SNR, closed set and open set by confidence score: a column for each open run, a row
    for each protocol of thresholds.

    opened: the model's open runs, as `experiments.runs` gives them; shown: confidence scores.
    """
    names, network = results.names, thesis.network(model, results)
    looks = {"": ("closed set", names.model(model).color, "o")}
    for look, score in ((names.score(score), score) for score in shown):
        looks[score] = f"open set, {look.label}", look.color, look.marker
    scores = select(results.scores, elevation="all", metric=F1, score=list(looks))
    drawn = pd.concat(of_run(scores, run, model).assign(run=run["name"]) for run in opened)
    statements = results.published_scores
    # Model and metric of what the reference thesis states of the same, which it trains without noise, split at random.
    stated = {(model, "f1"): "", **{(f"{model}_{score}", "weighted_f1"): score for score in shown}}
    keys = statements[["model", "metric"]].itertuples(index=False, name=None)
    statements = statements.assign(score=list(map(stated.get, keys)))
    alike = [run["name"] for run in opened if run["split"] == "random" and run["snrs"] == [CLEAN]]
    statements = statements[statements["score"].notna() & bool(alike)]
    drawn, statements, definition, words = beside(results, drawn, statements, FULL_SIZE)
    drawing, grid = panels(len(PROTOCOLS), len(opened), max(1 + 3.6 * len(opened), 5.6), 3 * len(PROTOCOLS))
    for (row, protocol), (column, run) in itertools.product(enumerate(PROTOCOLS), enumerate(opened)):
        axes = grid[row, column]
        draw_rejecting(axes, results.rejecting([run["experiment"]]))
        for score, (label, color, marker) in looks.items():
            curve = select(drawn, run=run["name"], score=score, threshold=protocol if score else "")
            draw_curve(axes, curve, color, marker, label=label)
            if run["name"] in alike and protocol == "thesis":
                draw_published(axes, select(statements, score=score), color)
        axes.set_title(f"{split_text(run['split'])}, {protocol} thresholds\n{run_title(run)}")
    finish(drawing, grid, snr_axis(definition), "weighted F1")
    first, lead = opened[0], ["", PROTOCOLS[0]]
    top = at_highest(select(drawn, run=first["name"], threshold=lead))
    values = "; ".join(f"{looks[row.score][0]} {row.value:.3f}" for row in top.itertuples())
    first = f"{heading(run_title(first))}, {split_text(first['split'])}"
    caption = (
        f"Weighted F1 of {network} with 95 % intervals: the known targets alone, and with unknown ones, by confidence "
        f"score, with {listed(PROTOCOLS)} thresholds. {first}, {PROTOCOLS[0]} thresholds, at "
        f"{top['test_snr_db'].max():g} dB: {values}.{words}{conditions(results, drawn, definition)}"
    )
    alt = f"Weighted F1 of {network} against test SNR, in the closed set and in the open set."
    return figure("capsule_f1", drawing, drawn, alt, caption, wide=len(opened) > 1)


def plain(score, values):
    """Values of a confidence score as they are shown: the MSE itself, not minus it."""
    return -values if score == "mse" else values


def histogram_figure(results, run, model, shown, scores):
    """How the confidence scores of known and unknown test images lie: a row per SNR, a column per score.

    Of several folds the first, whose thresholds are drawn. shown: confidence scores; scores: the rows of all folds.
    """
    snrs = sorted(decoded_snrs(results.settings["noise"]["snr_db"]), reverse=True)
    kept = results.settings["learning"]["kept"]
    tables = {snr: results.predictions(run, model, snr) for snr in snrs}
    drawing, grid = panels(len(snrs), len(shown), 1 + 3.2 * len(shown), 0.8 + 2.2 * len(snrs), "col", False)
    drawn, rates = [], []
    for column, score in enumerate(shown):
        label = results.names.score(score).label
        every = np.concatenate([plain(score, table[f"known_{score}"]) for table in tables.values()])
        edges = np.linspace(every.min(), every.max() if every.max() > every.min() else every.min() + 1, BINS + 1)
        for axes, snr in zip(grid[:, column], snrs, strict=True):
            here = select(scores, score=score, test_snr_db=snr)
            chosen = {
                protocol: plain(score, thresholds.choose(tables[snr], f"known_{score}", protocol, kept))
                for protocol in PROTOCOLS
            }
            for role, color in (("known", BLUE), ("unknown", VERMILION)):
                values = plain(score, select(tables[snr], side="test", role=role)[f"known_{score}"])
                counts, density = draw_density(axes, values, edges, color, f"{role} targets")
                bins = {"snr_db": snr, "score": score, "role": role, "from": edges[:-1], "to": edges[1:]}
                lines = {f"threshold_{protocol}": value for protocol, value in chosen.items()}
                drawn.append(pd.DataFrame({**bins, "images": counts, "density": density, **lines}))
            for (protocol, value), dash in zip(chosen.items(), ("--", ":", "-."), strict=True):
                axes.axvline(value, color="black", ls=dash, lw=1.2, label=f"{protocol} threshold")
            axes.set_title(f"{label} at {snr:g} dB")
            rates.append(f"{label} at {snr:g} dB {select(here, metric='auroc')['value'].iloc[0]:.3f}")
        grid[-1, column].set_xlabel(label)
    finish(drawing, grid, "", "density")
    names = " and ".join(results.names.score(score).label for score in shown)
    left = "left of a threshold by the MSE, right of it by any other score"
    which = run_title(results.runs[run], fold=True)
    folds = ", the mean over all folds" if len(results.folds[results.runs[run]["experiment"]]) > 1 else ""
    caption = (
        f"{names} of image and reconstruction, test images of known and unknown targets in {which}. An image is taken "
        f"for one of a known target {left if 'mse' in shown else 'right of a threshold'}. AUROC, the probability that "
        f"the score puts an image of a known target before one of an unknown target{folds}: {'; '.join(rates)}."
    )
    alt = f"Histograms of {names} for test images of known and of unknown targets. AUROC: {'; '.join(rates)}."
    return figure("capsule_histograms", drawing, pd.concat(drawn), alt, caption, wide=len(shown) > 1)


def reconstruction_figure(results, run, model, suffix, count):
    """Test images and what a model makes of them: a row per image; truth, then seen and made at each SNR.

    suffix: of the figure's name; count: images of each target.
    """
    dataset = results.reconstructions(run, model)
    order = [target for target in results.targets if target in dataset.target.values]
    dataset = dataset.sel(target=order).isel(example=slice(count)).load()
    snrs = sorted(dataset.snr.values.tolist(), reverse=True)
    examples, width = range(dataset.sizes["example"]), 1 + 2 * len(snrs)
    blocks = 2 if len(examples) > 1 else 1  # side by side
    lines = -(-len(examples) // blocks)
    size = 0.9 + blocks * (SIDE * width + 0.3), 0.25 + (SIDE + 0.13) * lines * len(order)
    drawing, grid = panels(lines * len(order), blocks * width, *size, layout="compressed", sharex=False, sharey=False)
    for (place, target), example in itertools.product(enumerate(order), examples):
        images = dataset.sel(target=target).isel(example=example)
        row, first = place * lines + example // blocks, example % blocks * width
        shown = [("truth", images.truth)]
        for snr in snrs:
            noisy = images.sel(snr=snr)
            shown += [(f"seen, {snr:g} dB", noisy.seen), (f"as {noisy.predicted.item()}", noisy.made)]
        for axes, (text, image) in zip(grid[row, first:], shown, strict=False):
            picture = draw_pixels(axes, image.values)
            axes.set(xticks=[], yticks=[])
            axes.set_title(text, fontsize=7, pad=2)
        where = f"{float(images.elevation):.4g}°, {float(images.azimuth):.4g}°"
        grid[row, first].set_ylabel(f"{target}\n{where}", fontsize=7)
    finish(drawing, grid, "", legend=False)
    drawing.colorbar(picture, ax=grid, label="|image| of its peak", shrink=0.5, aspect=40, pad=0.01)
    errors = ((dataset.made - dataset.truth) ** 2).mean(["example", "range", "crossrange"])
    said = []
    for snr in snrs:
        parts = (f"{error.target.item()} {number(error.item(), 2)}" for error in errors.sel(snr=snr))
        said.append(f"at {snr:g} dB {', '.join(parts)}")
    levels = " and ".join(f"{snr:g}" for snr in snrs)
    caption = (
        f"What {thesis.network(model, results)} in {run_title(results.runs[run], fold=True)} makes of test images. Of "
        f"each: without noise; with noise as the network sees it at {levels} dB; and its reconstruction, headed by the "
        "class that it takes the image for. At the side elevation and azimuth; range goes up, cross-range to the "
        f"right. Mean squared error between reconstruction and image without noise: {'; '.join(said)}."
    )
    alt = f"Test images of {', '.join(order)} without noise, as seen at {levels} dB, and as reconstructed."
    data = dataset.to_dataframe(dim_order=["target", "example", "snr", "range", "crossrange"]).reset_index().round(4)
    return figure(f"capsule_reconstructions{suffix}", drawing, data, alt, caption, wide=True)
