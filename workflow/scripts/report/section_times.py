"""Prediction times beside the published ones."""

from isarflow.report import thesis
from isarflow.report.layout import Section, figure, number, table
from isarflow.report.plots import finish, panels
from isarflow.report.vocabulary import run_title

PLACE, NEEDS = ("run", 1), "learns"  # on the page, see page.py
# What is drawn of each row and how: a column, what the page calls it, and its marker, in the model's colour or its own.
TIMES = {
    "single_ms": ("one at a time", {"marker": "o", "ms": 6}),
    "batch_ms": ("in batches", {"marker": "s", "ms": 6, "mfc": "white", "mew": 1.5}),
    "published_ms": ("reference thesis", {"marker": "D", "ms": 5, "mfc": "none", "color": "black"}),
}


def section(results):
    """Return the section: a figure and a table of the same times."""
    frame = times_frame(results)
    machine, threads = frame["machine"].iloc[0], frame["threads"].iloc[0]
    text = (
        "Milliseconds per image, from the complex image to its class, without its confidence scores. Here: "
        f"{machine}, {'one thread' if threads == 1 else f'{threads} threads'}, in batches of "
        f"{frame['batch_size'].max()}. The reference thesis: Intel i7-7700HQ, with other training sets. Only ratios "
        "between models compare. Networks of another size than the thesis's have no published time."
    )
    drawn, listed = times_figure(results, frame), times_table(results, frame)
    return Section("times", "Prediction times", (text,), (drawn,), (listed,))


def times_frame(results):
    """Return a row per experiment and model: our milliseconds, and the published ones of a network of the same size."""
    published = results.published_times.drop(columns=["source", "condition"])
    published = published.rename(columns={"milliseconds_per_observation": "published_ms"})
    published = published.rename(columns={"training_observations": "published_training_observations"})
    published = published[[thesis.full_size(model, results.settings) for model in published["model"]]]
    return results.times.merge(published, how="left", on=["model", "experiment"])


def times_figure(results, frame):
    """Draw milliseconds per image on a logarithmic axis: a row per experiment and model."""
    looks = [results.names.model(model) for model in frame["model"]]
    drawing, grid = panels(1, 1, 5.4, 1.2 + 0.32 * len(frame))
    (axes,) = grid.flat
    for column, (label, marker) in TIMES.items():
        for place, (look, value) in enumerate(zip(looks, frame[column], strict=True)):
            axes.plot(value, place, ls="", **{"color": look.color} | marker)
        axes.plot([], [], ls="", label=label, **{"color": "#555555"} | marker)
    labels = [f"{look.label}, {run_title(results.runs[run])}" for look, run in zip(looks, frame["run"], strict=True)]
    axes.set_yticks(range(len(frame)), labels)
    axes.set(xscale="log", ylim=(len(frame) - 0.4, -0.6))
    finish(drawing, grid, "time per image [ms]")
    alt = "Prediction time per image of each model, one at a time, in batches, and as published."
    return figure("prediction_times", drawing, frame, alt, "Prediction time per image, on a logarithmic axis.")


def times_table(results, frame):
    """Return the table of the times in ms, and of how many images each model here and in the thesis learned from."""
    shown = {
        "run": lambda row: run_title(results.runs[row["run"]]),
        "model": lambda row: results.names.model(row["model"]).label,
        "training images": "{training_observations:,}",
        **{f"{text} [ms]": lambda row, key=key: number(row[key]) for key, (text, _) in TIMES.items()},
        "its training images": lambda row: number(row["published_training_observations"], 6),
    }
    caption = "Prediction time per image: one at a time, in batches (per image), and as published."
    return table("prediction_times", frame, shown, caption)
