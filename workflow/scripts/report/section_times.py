"""Prediction times beside the published ones."""

from isarflow.report import thesis
from isarflow.report.layout import Section, number, several, table
from isarflow.report.vocabulary import run_title

PLACE, NEEDS = ("run", 1), "learns"  # on the page, see page.py
# What of the published table is shown, and what its column is called.
PUBLISHED = {"training_observations": "published_training_observations", "milliseconds_per_observation": "published_ms"}


def section(results):
    """Return the Section of the table of times, ours beside the published ones of networks of the same size."""
    published = results.published_times.drop(columns=["source", "condition"]).rename(columns=PUBLISHED)
    published = published[[thesis.full_size(model, results.settings) for model in published["model"]]]
    data = results.times.merge(published, how="left", on=["model", "experiment"])
    machine, threads = data["machine"].iloc[0], data["threads"].iloc[0]
    text = (
        f"From the complex image to its class, without its confidence scores. Here: {machine}, "
        f"{several(threads, 'thread')}, in batches of {data['batch_size'].max()}. The reference thesis: Intel "
        "i7-7700HQ, with other training sets. Only ratios between models compare. Networks of another size than the "
        "thesis's have no published time."
    )
    shown = {
        "run": lambda row: run_title(results.runs[row["run"]]),
        "model": lambda row: results.names.model(row["model"]).label,
        "training images": "{training_observations:,}",
        "one at a time [ms]": lambda row: number(row["single_ms"]),
        "in batches [ms]": lambda row: number(row["batch_ms"]),
        "reference thesis [ms]": lambda row: number(row["published_ms"]),
        "its training images": lambda row: number(row["published_training_observations"], 6),
    }
    caption = "Prediction time per image: one at a time, in batches (per image), and as published."
    return Section("times", "Prediction times", (text,), tables=(table("prediction_times", data, shown, caption),))
