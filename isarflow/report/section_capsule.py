"""Networks with a decoder: what they reconstruct of an image. Their scores stand with the open set."""

import itertools

from isarflow.learning.experiments import CLEAN, split_of
from isarflow.report import thesis
from isarflow.report.layout import Section, figure
from isarflow.report.plots import draw_pixels, finish, panels
from isarflow.report.vocabulary import run_title, split_place

PLACE, NEEDS = ("recognition", 3), "opened"  # on the page, see page.py
EXAMPLES, OTHERS_EXAMPLES = 4, 2  # reconstructions of each target by the first network, and by each other one
SIDE = 0.98  # inches a reconstruction


def section(results):
    """Return the section; nothing where no model with a decoder is tested on unknown targets."""
    if not results.decoders:
        return ()
    every = [(results.names.model(model).place, model, results.runs[name]) for name, model in results.decoders]
    every.sort(key=lambda of: (of[0], split_place(split_of(of[2])), of[2]["snrs"] != [CLEAN], of[2]["name"]))
    run_of = {}  # the first one of each model
    for _, model, run in every:
        run_of.setdefault(model, run)
    text = (
        "A network with a decoder reconstructs each image from the class that it takes it for; what it cannot "
        "reconstruct is of no known class. Confidence scores compare both, by minus the MSE or by the ZNCC."
    )
    figures = []
    for model, run in run_of.items():
        figures.append(reconstruction_figure(results, run, model, f"_{model}" if figures else ""))
    capsules = thesis.kind(next(iter(run_of)), results.settings) == "capsule"
    title = "Capsule network" if capsules else "Networks with a decoder"
    return (Section("capsule", title, (text,), tuple(figures)),)


def reconstruction_figure(results, run, model, suffix):
    """Draw test images, two in a row, and what a model makes of them. suffix: of the figure's name, or empty."""
    dataset = results.reconstructions(run["name"], model)
    order = [target for target in results.targets if target in dataset.target.values]
    dataset = dataset.sel(target=order).isel(example=slice(OTHERS_EXAMPLES if suffix else EXAMPLES)).load()
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
        f"What {results.names.model(model).words} in {run_title(run, fold=True)} makes of test images. Of each: "
        "without noise; with noise, as the network sees it; and its reconstruction, headed by the class that it is "
        "taken for. At the side elevation and azimuth; range goes up, cross-range to the right."
    )
    data = dataset.to_dataframe(dim_order=["target", "example", "snr", "range", "crossrange"]).reset_index().round(4)
    return figure(f"capsule_reconstructions{suffix}", drawing, data, caption, wide=True)
