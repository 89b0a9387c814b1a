"""What several entries of the page of the thesis have: pictures of images, prediction times, what tuning changes."""

import numpy as np

from learning.experiments import training
from report import thesis_reasons as why
from report.layout import number
from report.plots import draw_pixels, finish, panels
from report.section_times import CONDITIONS
from report.thesis_compare import named, ours, own_run, shown_snrs
from report.thesis_markdown import Entry, picture, table
from report.vocabulary import ACCURACY, select
from report.vocabulary import title as title_of

TUNED = {"lr": "lr_tuned", "svm": "svm_tuned", "knn": "knn_tuned", "fcnn": "fcnn_tuned"}


def tuning_effect(results, model):
    """What the choice of hyper-parameters changes on the test images, in a sentence; nothing without one."""
    curves = {}
    for run in results.runs.values() if results.learns else ():
        clean = training(run) == "clean" and run["elevation"] == "all" and own_run(results, run["experiment"])
        for name in (model, TUNED[model]):
            if clean and name in run["models"]:
                rows = ours(results, run["experiment"], name, ACCURACY)
                curves.setdefault(name, rows.set_index("test_snr_db")["value"])
    if len(curves) < 2:
        return ""
    own, tuned = curves[model], curves[TUNED[model]]
    snrs = [snr for snr in shown_snrs(own.index.intersection(tuned.index)) if snr >= 0]
    parts = [f"{tuned[snr]:.3f} at {snr:g} dB ({own[snr]:.3f})" for snr in snrs]
    return (
        f"{results.names.model(model).label} with the settings chosen here, accuracy on the test images, in brackets "
        f"with the published ones: {', '.join(parts)}."
    )


def images_picture(name, lines, alt):
    """A Picture of magnitudes, each of its peak: rows of (title, image), images over (range, crossrange)."""
    count = max(map(len, lines))
    drawing, grid = panels(len(lines), count, 1.3 * count + 0.4, 1.5 * len(lines), False, False, "compressed")
    for places, line in zip(grid, lines, strict=True):
        for axes, (text, image) in zip(places, line, strict=False):
            level = np.abs(image.transpose("range", "crossrange").values if hasattr(image, "dims") else image)
            draw_pixels(axes, level / max(level.max(), 1e-12))
            axes.set(xticks=[], yticks=[])
            axes.set_title(text, fontsize=8)
    finish(drawing, grid, "", legend=False)
    return picture(name, drawing, alt)


def times_entry(results, name, title, did, wanted):
    """Published prediction times beside ours. wanted: (experiment, model) of each row."""
    rows, lacks = [], []
    for experiment, model in wanted:
        label = results.names.model(model).label
        printed = select(results.published_times, model=model, condition=CONDITIONS[experiment])
        published = {"milliseconds_per_observation": np.nan, "training_observations": np.nan}
        published |= printed.iloc[0].to_dict() if len(printed) else {}
        row = {
            "model": label,
            "experiment": title_of(experiment),
            "published [ms]": number(published["milliseconds_per_observation"], 5),
        }
        row["training images there"] = number(published["training_observations"], 6)
        here = select(results.times, experiment=experiment, model=model) if named(results, experiment) else ()
        if len(here):  # of an experiment that trains at each of several SNRs all, which are of one size
            row["training images here"] = f"{here['training_observations'].iloc[0]}"
            row["here, one at a time [ms]"] = number(here["single_ms"].mean())
            row["here, in batches [ms]"] = number(here["batch_ms"].mean())
            ratio = published["milliseconds_per_observation"] / here["batch_ms"].mean()
            row["published / here in batches"] = number(ratio, 2)
        else:
            lacks.append(f"{label} in experiment `{experiment}`")
        rows.append(row)
    models = dict.fromkeys(model for _, model in wanted)
    sizes = [(why.network, model) for model in models if model in results.settings["learning"]["models"]]
    reasons = why.reasons(results, why.machine, *sizes, (why.parameters, *models))
    return Entry((name,), title, did, missing=", ".join(lacks), blocks=(table(rows),), why=reasons)
