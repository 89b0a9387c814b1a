"""Networks with a decoder: what they reconstruct, and how well the error of it tells known targets from unknown."""

import itertools

import numpy as np
import pandas as pd

from learning.experiments import CLEAN, runs, training
from report import thesis
from report.draw_learning import (
    SPLITS,
    draw_legend,
    draw_published,
    draw_rejecting,
    heading,
    split_text,
    title,
)
from report.layout import (
    BLUE,
    VERMILION,
    Figure,
    Section,
    canvas,
    model_order,
    model_style,
    number,
    style,
    to_svg,
)
from report.section_open import (
    COUNTED,
    PROTOCOLS,
    known_scores,
    published_confusion,
    rejecting,
    score_name,
    score_style,
)
from report.selection import decoded_snrs

SCORES = ("mse", "zncc")  # the reference thesis's, of an image and its reconstruction
SAME = ("elevation", "snrs", "random_snr", "split", "upsample")  # of two runs that learn from the same images
BINS = 50
EXAMPLES, OTHERS_EXAMPLES = 4, 2  # reconstructions of each target by the first network, and by each other one
SIDE = 0.98  # inches a reconstruction


def section(results):
    """Nothing where no model with a decoder is tested on unknown targets."""
    if not results.decoders:
        return ()
    every, snrs = runs(results.settings), decoded_snrs(results.settings["noise"]["snr_db"])
    # The reference thesis's network, trained without noise, first.
    order = sorted(
        results.decoders,
        key=lambda one: (
            model_order(one[1]),
            SPLITS.index(every[one[0]]["split"]),
            every[one[0]]["snrs"] != [CLEAN],
            one[0],
        ),
    )
    run, model = order[0]
    # The thesis's matrices are of its split.
    beside = next((name for name, one in order if one == model and every[name]["split"] == "random"), run)
    kind, network = thesis.kind(model, results.settings), thesis.network(model, results.settings)
    scores = results.scores[results.scores["elevation"] == "all"]
    own = of_run(scores, every[run], model)
    shown = scores_shown(own)
    others = {other: other_run for other_run, other in reversed(order) if other != model}
    tables = {snr: results.predictions(run, model, snr) for snr in snrs}
    return (
        Section(
            id="capsule",
            title="Capsule network" if kind == "capsule" else "Networks with a decoder",
            text=(
                "A network with a decoder reconstructs each image from the class that it takes it for. What it cannot "
                "reconstruct is none of the known classes: the known score compares the image with its reconstruction, "
                "by minus the mean squared error (MSE) or by the zero-mean normalised cross-correlation (ZNCC). The "
                f"first figures are of {network} in {title(run)}, {split_text(every[run]['split'])}. Numbers of all "
                "models and known scores stand with the open set.",
            ),
            figures=(
                f1_figure(
                    results,
                    [every[name] for name, one in order if one == model],
                    [other for other in every.values() if model in other["models"] and not other["open"]],
                    model,
                    shown,
                ),
                *published_confusion(
                    "capsule_confusion",
                    of_run(results.confusion[results.confusion["elevation"] == "all"], every[beside], model),
                    {f"{model}_{score}": (model, score) for score in shown},
                    thesis.moved(results.published_confusion, thesis.offset(results, COUNTED[True])),
                    results.targets,
                ),
                *([histogram_figure(tables, shown, own)] if shown else []),
                reconstruction_figure(
                    "capsule_reconstructions", results.reconstructions(run, model), results.targets, EXAMPLES, network
                ),
                *(
                    reconstruction_figure(
                        f"capsule_reconstructions_{other}",
                        results.reconstructions(others[other], other),
                        results.targets,
                        OTHERS_EXAMPLES,
                        thesis.network(other, results.settings),
                    )
                    for other in sorted(others, key=model_order)
                ),
            ),
        ),
    )


def of_run(table, run, model):
    """The rows of scores or confusion counts of one run of a model. run: what `experiments.runs` gives."""
    return table[
        (table["experiment"] == run["experiment"]) & (table["training"] == training(run)) & (table["model"] == model)
    ]


def scores_shown(scores):
    """The known scores that the figures show: the thesis's two; of a model that has neither, its first two."""
    found = known_scores(scores[scores["score"] != ""]["score"])
    return [score for score in SCORES if score in found] or found[:2]


def f1_figure(results, opened, closed, model, shown):
    """Weighted F1 against the test SNR, closed set and open set by known score: a column for each open run, a row for
    each protocol of thresholds.

    opened, closed: the model's runs, as `experiments.runs` gives them; the closed set of one of the latter is drawn too
    where it learns from the same images. shown: known scores.
    """
    scores = results.scores[(results.scores["elevation"] == "all") & (results.scores["metric"] == "f1_weighted")]
    published = {opens: thesis.statements(results, COUNTED[opens]) for opens in (False, True)}
    rejected, network = rejecting(results), thesis.network(model, results.settings)
    drawn, marked = [], False
    with style():
        figure = canvas(max(1 + 3.6 * len(opened), 5.6), 6.0)
        grid = figure.subplots(len(PROTOCOLS), len(opened), sharex=True, sharey=True, squeeze=False)
        for (row, protocol), (column, run) in itertools.product(enumerate(PROTOCOLS), enumerate(opened)):
            axes = grid[row, column]
            own = of_run(scores, run, model)
            color = model_style(model)[0]
            curves = [("closed set", own[own["score"] == ""], color, "o", (model, "f1"))]
            for score in shown:
                curve = own[(own["score"] == score) & (own["threshold"] == protocol)]
                printed = (f"{model}_{score}", "weighted_f1")
                curves.append((f"open set, {score_name(score)}", curve, *score_style(score), printed))
            for other in closed:
                if all(other[key] == run[key] for key in SAME):
                    curve = of_run(scores, other, model)
                    label = f"closed set, {title(other['name'])}"
                    curves.append((label, curve[curve["score"] == ""], color, ".", None))
            draw_rejecting(axes, [rejected[run["split"]]])
            for label, curve, color, marker, printed in curves:
                curve = curve.sort_values("test_snr_db")
                look = {"color": color, "marker": marker, "ls": "-" if printed else ":"}
                axes.plot(curve["test_snr_db"], curve["value"], **look, label=label)
                axes.fill_between(curve["test_snr_db"], curve["low"], curve["high"], color=color, alpha=0.18, lw=0)
                if printed and run["split"] == "random" and protocol == "thesis":  # as the reference thesis's
                    table = published[printed[1] != "f1"]
                    rows = table[(table["model"] == printed[0]) & (table["metric"] == printed[1])]
                    draw_published(axes, rows, color)
                    marked = marked or len(rows) > 0
                drawn.append(curve.assign(run=run["name"], curve=label))
            axes.set(title=f"{split_text(run['split'])}, {protocol} thresholds\n{title(run['name'])}")
        for axes in grid[-1]:
            axes.set_xlabel("test SNR [dB]")
        for axes in grid[:, 0]:
            axes.set_ylabel("weighted F1")
        draw_legend(figure, grid.flat)
        svg = to_svg(figure)
    data, first = pd.concat(drawn), opened[0]
    data = data.drop_duplicates()  # the closed set stands in both rows
    top = data[(data["run"] == first["name"]) & (data["test_snr_db"] == data["test_snr_db"].max())]
    top = top[top["threshold"].isin(["", PROTOCOLS[0]])]
    values = "; ".join(f"{row.curve} {row.value:.3f}" for row in top.itertuples())
    shifts = {name: thesis.offset(results, COUNTED[name == "open set"]) for name in ("closed set", "open set")}
    thesis_s = thesis.kind(model, results.settings) == "capsule"
    return Figure(
        name="capsule_f1",
        svg=svg,
        data=data,
        alt=f"Weighted F1 of {network} against test SNR, in the closed set and in the open set.",
        caption=(
            f"Weighted F1 of {network} with 95 % intervals: the known targets alone, and with unknown ones, by known "
            f"score, with {PROTOCOLS[0]} and with {PROTOCOLS[1]} thresholds. {heading(first['name'])}, "
            f"{split_text(first['split'])}, {PROTOCOLS[0]} thresholds, at {data['test_snr_db'].max():g} dB: {values}."
            f"{thesis.marked(shifts, marked, network=True) if thesis_s else ''}"
        ),
        wide=len(opened) > 1,
    )


def histogram(table, score, edges):
    """Counts of test images between the edges by role, known and unknown, of a prediction table's known score."""
    test = table[table["side"] == "test"]
    return {
        role: np.histogram(plain(score, test[test["role"] == role][f"known_{score}"]), edges)[0]
        for role in ("known", "unknown")
    }


def plain(score, values):
    """Values of a known score as they are shown: the MSE itself, not minus it."""
    return -values if score == "mse" else values


def histogram_figure(tables, shown, scores):
    """How the known scores of known and unknown test images lie: a row per SNR, a column per score.

    tables: predictions by SNR in dB; shown: known scores; scores: the model's, for the thresholds.
    """
    snrs = sorted(tables, reverse=True)
    colors = {"known": BLUE, "unknown": VERMILION}
    lines, rates = [], []
    with style():
        figure = canvas(1 + 3.2 * len(shown), 0.8 + 2.2 * len(snrs))
        grid = figure.subplots(len(snrs), len(shown), squeeze=False, sharex="col")
        for (column, score), (row, snr) in itertools.product(enumerate(shown), enumerate(snrs)):
            every = np.concatenate([plain(score, table[f"known_{score}"]) for table in tables.values()])
            edges = np.linspace(every.min(), every.max() if every.max() > every.min() else every.min() + 1, BINS + 1)
            axes, width = grid[row, column], np.diff(edges)
            here = scores[(scores["score"] == score) & (scores["test_snr_db"] == snr)].set_index("threshold")
            lines_at = {
                protocol: plain(score, here[here["metric"] == "threshold"].loc[protocol, "value"])
                for protocol in PROTOCOLS
            }
            for role, counts in histogram(tables[snr], score, edges).items():
                density = counts / max(counts.sum(), 1) / width
                axes.stairs(density, edges, fill=True, alpha=0.45, color=colors[role], label=f"{role} targets")
                axes.stairs(density, edges, color=colors[role])
                lines.append(
                    pd.DataFrame(
                        {
                            "snr_db": snr,
                            "score": score,
                            "role": role,
                            "from": edges[:-1],
                            "to": edges[1:],
                            "images": counts,
                            "density": density,
                            **{f"threshold_{protocol}": value for protocol, value in lines_at.items()},
                        }
                    )
                )
            for (protocol, value), dash in zip(lines_at.items(), ("--", ":"), strict=True):
                axes.axvline(value, color="black", ls=dash, lw=1.2, label=f"{protocol} threshold")
            axes.set_title(f"{score_name(score)} at {snr:g} dB")
            axes.set_ylabel("density" if column == 0 else "")
            if row == len(snrs) - 1:
                axes.set_xlabel(score_name(score))
            rates.append(f"{score_name(score)} at {snr:g} dB {here[here['metric'] == 'auroc']['value'].iloc[0]:.3f}")
        draw_legend(figure, grid.flat)
        svg = to_svg(figure)
    names = " and ".join(map(score_name, shown))
    taken = (
        "left of a threshold by the MSE, right of it by any other score" if "mse" in shown else "right of a threshold"
    )
    return Figure(
        name="capsule_histograms",
        svg=svg,
        data=pd.concat(lines),
        alt=f"Histograms of {names} for test images of known and of unknown targets. AUROC: {'; '.join(rates)}.",
        caption=(
            f"{names} of image and reconstruction, test images of known and unknown targets. An image is taken for one "
            f"of a known target {taken}. AUROC, the probability that the score puts an image of a known target before "
            f"one of an unknown target: {'; '.join(rates)}."
        ),
        wide=len(shown) > 1,
    )


def reconstruction_figure(name, dataset, targets, count, network):
    """Test images and what a model makes of them: a row per image; truth, then seen and made at each SNR.

    dataset: of learning/reconstructions.py; targets: names in the order of the page; count: images of each
    target; network: the model in words.
    """
    order = [target for target in targets if target in dataset.target.values]
    dataset = dataset.sel(target=order).isel(example=slice(count)).load()
    snrs = sorted(dataset.snr.values.tolist(), reverse=True)
    examples = range(dataset.sizes["example"])
    blocks = 2 if len(examples) > 1 else 1  # side by side
    lines = -(-len(examples) // blocks)
    width = 1 + 2 * len(snrs)
    size = 0.9 + blocks * (SIDE * width + 0.3), 0.25 + (SIDE + 0.13) * lines * len(order)
    with style():
        figure = canvas(*size, layout="compressed")
        grid = figure.subplots(lines * len(order), blocks * width, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for (place, target), example in itertools.product(enumerate(order), examples):
            one = dataset.sel(target=target).isel(example=example)
            row, first = place * lines + example // blocks, example % blocks * width
            panels = [("truth", one.truth)]
            for snr in snrs:
                noisy = one.sel(snr=snr)
                panels += [(f"seen, {snr:g} dB", noisy.seen), (f"as {noisy.predicted.item()}", noisy.made)]
            for axes, (text, image) in zip(grid[row, first:], panels, strict=False):
                axes.set_axis_on()
                picture = axes.imshow(
                    image.values, origin="lower", cmap="viridis", vmin=0, vmax=1, interpolation="nearest"
                )
                axes.set(xticks=[], yticks=[])
                axes.set_title(text, fontsize=7, pad=2)
            where = f"{float(one.elevation):.4g}°, {float(one.azimuth):.4g}°"
            grid[row, first].set_ylabel(f"{target}\n{where}", fontsize=7)
        figure.colorbar(picture, ax=grid, label="|image| of its peak", shrink=0.5, aspect=40, pad=0.01)
        svg = to_svg(figure)
    label = f"{network} in {title(dataset.attrs['run'])}"
    levels = " and ".join(f"{snr:g}" for snr in snrs)
    frame = dataset.to_dataframe(dim_order=["target", "example", "snr", "range", "crossrange"]).reset_index()
    return Figure(
        name=name,
        svg=svg,
        data=frame.round(4),
        alt=f"Test images of {', '.join(order)} without noise, as seen at {levels} dB, and as reconstructed.",
        caption=(
            f"What {label} makes of test images. Of each: without noise; with noise as the network sees it at {levels} "
            "dB; and its reconstruction, headed by the class that it takes the image for. At the side elevation and "
            "azimuth; range goes up, cross-range to the right. "
            f"{_errors(dataset, snrs)}"
        ),
        wide=True,
    )


def _errors(dataset, snrs):
    """How far the reconstructions shown are from the images without noise, in a sentence."""
    errors = ((dataset.made - dataset.truth) ** 2).mean(["example", "range", "crossrange"])
    parts = []
    for snr in snrs:
        here = (f"{one.target.item()} {number(one.item(), 2)}" for one in errors.sel(snr=snr))
        parts.append(f"at {snr:g} dB {', '.join(here)}")
    return f"Mean squared error between reconstruction and image without noise: {'; '.join(parts)}."
