"""Prediction times beside the published ones."""

import numpy as np

from isarflow.report import thesis
from isarflow.report.layout import Section, canvas, figure, number, table
from isarflow.report.vocabulary import run_title, select

# What is drawn of each row and how: a column, what the page calls it, and its marker.
TIMES = {
    "single_ms": ("one at a time", {"marker": "o", "ms": 6}),
    "batch_ms": ("in batches", {"marker": "s", "ms": 6, "mfc": "white", "mew": 1.5}),
    "published_ms": ("reference thesis", {"marker": "D", "ms": 5, "mfc": "none"}),
}


def section(results):
    frame = times_frame(results)
    machines, threads = ", ".join(sorted(frame["machine"].unique())), frame["threads"].max()
    return Section(
        id="times",
        title="Prediction times",
        text=(
            "Milliseconds per image, from the complex image to its class, without its confidence scores. Here: "
            f"{machines}, {'one thread' if threads == 1 else f'{threads} threads'}, in batches of "
            f"{frame['batch_size'].max()}. The reference thesis: Intel i7-7700HQ, with other training sets. Only "
            f"ratios between models compare.{_left_out(results)}",
        ),
        figures=(times_figure(results, frame),),
        tables=(times_table(results, frame),),
    )


def times_frame(results):
    """One row per experiment and model: our milliseconds, and the published ones where there is a counterpart.

    A network that is not of the thesis's size has none.
    """
    columns = {
        "milliseconds_per_observation": "published_ms",
        "training_observations": "published_training_observations",
    }
    published = results.published_times.rename(columns=columns).drop(columns=["source", "condition"])
    full = results.times["model"].map(lambda model: thesis.full_size(model, results.settings))
    frame = results.times.merge(published, how="left", on=["model", "experiment"])
    frame.loc[~full.to_numpy(bool), list(columns.values())] = np.nan
    return frame


def _left_out(results):
    """Which models stand without the published time of their like, in a sentence."""
    timed = select(results.times, model=list(results.published_times["model"]))
    reduced = [
        thesis.network(model, results)
        for model in results.names.values(timed, "model")
        if not thesis.full_size(model, results.settings)
    ]
    if not reduced:
        return ""
    return f" No published time stands beside {' and '.join(reduced)}: the thesis's is of the full-size network."


def times_figure(results, frame):
    """Milliseconds per image on a logarithmic axis: a row per experiment and model."""
    models, places = results.names.model, range(len(frame))
    drawing = canvas(5.4, 1.2 + 0.32 * len(frame))
    axes = drawing.add_subplot()
    entries = []
    for column, (_, look) in TIMES.items():
        published = column == "published_ms"
        for place, row in zip(places, frame.to_dict("records"), strict=True):
            axes.plot(row[column], place, ls="", color="black" if published else models(row["model"]).color, **look)
        entries += axes.plot([], [], ls="", color="black" if published else "#555555", **look)
    drawing.legend(entries, [text for text, _ in TIMES.values()], loc="outside upper center", ncols=3)
    axes.set_xscale("log")
    axes.set_yticks(
        places, [f"{models(row.model).label}, {run_title(results.runs[row.run])}" for row in frame.itertuples()]
    )
    axes.set_ylim(len(frame) - 0.4, -0.6)
    axes.set_xlabel("time per image [ms]")
    fastest = frame.loc[frame["batch_ms"].idxmin()]
    alt = "Prediction time per image of each model, one at a time, in batches, and as published."
    caption = (
        "Prediction time per image. The fastest in batches is "
        f"{thesis.network(fastest['model'], results)} with {number(fastest['batch_ms'], 2)} ms."
    )
    return figure("prediction_times", drawing, frame, alt, caption)


def times_table(results, frame):
    shown = {
        "run": lambda row: run_title(results.runs[row["run"]]),
        "model": lambda row: results.names.model(row["model"]).label,
        "training images": "{training_observations:,}",
        **{f"{text} [ms]": lambda row, key=key: number(row[key]) for key, (text, _) in TIMES.items()},
        "its training images": lambda row: number(row["published_training_observations"], 6),
    }
    caption = "Prediction time per image: one at a time, in batches (per image), and as published."
    return table("prediction_times", frame, shown, caption)
