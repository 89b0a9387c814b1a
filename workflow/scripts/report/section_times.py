"""Prediction times beside the published ones."""

import pandas as pd

from report import thesis
from report.draw_learning import title
from report.layout import Figure, Section, Table, canvas, model_order, model_style, number, style, to_svg

# Under which condition the published times have an experiment's counterpart.
CONDITIONS = {
    "single_elevation": "single elevation",
    "multi_elevation": "19 elevations",
    "noisy_training": "no up-sampling",
    "upsampling": "64-point FFT",
    "fcnn_closed": "",
    "capsule_closed": "",
}
COLUMNS = {"single_ms": "one at a time", "batch_ms": "in batches"}


def section(results):
    frame = times_frame(results)
    machines = ", ".join(sorted(frame["machine"].unique()))
    return Section(
        id="times",
        title="Prediction times",
        text=(
            f"Milliseconds per image, from the complex image to its class, without its known scores. Here: {machines}, "
            f"{_threads(frame)}, in batches of {frame['batch_size'].max()}. The reference thesis: Intel i7-7700HQ, "
            f"with other training sets. Only ratios between models compare.{_left_out(results)}",
        ),
        figures=(times_figure(frame, results.settings),),
        tables=(times_table(frame),),
    )


def times_frame(results):
    """One row per experiment and model: our milliseconds, and the published ones where there is a counterpart.

    A network that is not of the thesis's size has none.
    """
    published = results.published_times.rename(
        columns={
            "milliseconds_per_observation": "published_ms",
            "training_observations": "published_training_observations",
        }
    ).drop(columns="source")
    ours = pd.DataFrame(results.times)
    full = ours["model"].map(lambda model: thesis.full_size(model, results.settings))
    ours["condition"] = ours["experiment"].map(CONDITIONS).where(full)
    return ours.merge(published, how="left", on=["model", "condition"]).drop(columns="condition")


def _left_out(results):
    """Which models stand without the published time of their like, in a sentence."""
    settings, published = results.settings, set(results.published_times["model"])
    reduced = [
        thesis.network(model, settings)
        for model in sorted({one["model"] for one in results.times}, key=model_order)
        if model in published and not thesis.full_size(model, settings)
    ]
    if not reduced:
        return ""
    return f" No published time stands beside {' and '.join(reduced)}: the thesis's is of the full-size network."


def times_figure(frame, settings):
    """Milliseconds per image on a logarithmic axis: a row per experiment and model."""
    labels = [f"{model_style(row.model)[2]}, {title(row.run)}" for row in frame.itertuples()]
    places = range(len(frame))
    with style():
        figure = canvas(5.4, 1.2 + 0.32 * len(frame))
        axes = figure.add_subplot()
        for row, place in zip(frame.itertuples(), places, strict=True):
            color = model_style(row.model)[0]
            axes.plot(row.single_ms, place, "o", color=color, ms=6)
            axes.plot(row.batch_ms, place, "s", color=color, ms=6, mfc="white", mew=1.5)
            axes.plot(row.published_ms, place, "D", color="black", ms=5, mfc="none")
        entries = (
            axes.plot([], [], "o", color="#555555", ms=6)[0],
            axes.plot([], [], "s", color="#555555", ms=6, mfc="white", mew=1.5)[0],
            axes.plot([], [], "D", color="black", ms=5, mfc="none")[0],
        )
        figure.legend(entries, [*COLUMNS.values(), "reference thesis"], loc="outside upper center", ncols=3)
        axes.set_xscale("log")
        axes.set_yticks(places, labels)
        axes.set_ylim(len(frame) - 0.4, -0.6)
        axes.set_xlabel("time per image [ms]")
        svg = to_svg(figure)
    fastest = frame.loc[frame["batch_ms"].idxmin()]
    return Figure(
        name="prediction_times",
        svg=svg,
        data=frame,
        alt="Prediction time per image of each model, one at a time, in batches, and as published.",
        caption=(
            "Prediction time per image. The fastest in batches is "
            f"{thesis.network(fastest['model'], settings)} with {number(fastest['batch_ms'], 2)} ms."
        ),
    )


def times_table(frame):
    shown = pd.DataFrame(
        {
            "run": [title(run) for run in frame["run"]],
            "model": [model_style(model)[2] for model in frame["model"]],
            "training images": [f"{count:,}" for count in frame["training_observations"]],
            **{f"{text} [ms]": [number(value) for value in frame[key]] for key, text in COLUMNS.items()},
            "reference thesis [ms]": [number(value) for value in frame["published_ms"]],
            "its training images": [number(value, 6) for value in frame["published_training_observations"]],
        }
    )
    return Table(
        name="prediction_times",
        shown=shown,
        data=frame,
        caption="Prediction time per image: one at a time, in batches (per image), and as published.",
    )


def _threads(frame):
    count = frame["threads"].max()
    return "one thread" if count == 1 else f"{count} threads"
