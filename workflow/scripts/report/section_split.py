"""How far the random split flatters: the same models on azimuths far from those that they were trained at."""

import pandas as pd

from learning.experiments import runs
from report.draw_learning import SPLITS, interval_text, signed, training_order
from report.layout import Section, Table, model_order, model_style
from report.section_open import PROTOCOLS, score_name
from report.selection import TABLE_SNRS, evenly

TRAINED = ["images", "model", "training"]
KEYS = [*TRAINED, "train_snr_db", "elevation", "metric", "score", "threshold", "test_snr_db"]


def section(results):
    """The comparison; nothing where no model is tested under both splits with the same training images."""
    pairs = paired(results.scores, results.settings)
    if not len(pairs):
        return ()
    accuracy = pairs[(pairs["metric"] == "accuracy") & (pairs["score"] == "") & (pairs["elevation"] == "all")]
    opened = pairs[
        (pairs["metric"] == "f1_weighted") & pairs["threshold"].isin(PROTOCOLS) & (pairs["elevation"] == "all")
    ]
    tables = (*([open_table(opened, results.validation)] if len(opened) else []), accuracy_table(accuracy))
    return (
        Section(
            id="splits",
            title="How far the random split flatters",
            text=(
                "Neighbouring azimuths share most of their aperture. Split at random, test images have near-copies "
                "among the training images; split by sector, no test image shares a sample with one of them"
                f"{_images(results, accuracy)}. {plainly(accuracy)}",
            ),
            tables=tables,
        ),
    )


def paired(scores, settings):
    """Rows of the same model, training images and metric under both splits, side by side. settings: the config's."""
    images = {run["experiment"]: repr((run["elevation"], run["upsample"])) for run in runs(settings).values()}
    scores = scores.assign(images=scores["experiment"].map(images))
    sides = []
    for split in SPLITS:
        # An experiment tested on the open set has the closed set's rows too: any of several is as good.
        rows = scores[scores["split"] == split].drop_duplicates(KEYS)
        sides.append(rows[[*KEYS, "experiment", "value", "low", "high"]])
    return sides[0].merge(sides[1], on=KEYS, suffixes=[f"_{split}" for split in SPLITS])


def _groups(rows):
    """The rows of each model and kind of training images, in the order of the page, after what the page calls it."""
    several = rows.groupby("model")[TRAINED].nunique().max(axis=1) > 1
    groups = sorted(rows.groupby(TRAINED), key=lambda one: (model_order(one[0][1]), training_order(one[1]), one[0][0]))
    for (_, model, trained), own in groups:
        yield f"{model_style(model)[2]}{f', training SNR {trained}' if several[model] else ''}", own


def _images(results, accuracy):
    """How many images train on either side, where that differs: the guards between the sectors cost some."""
    counts = {}
    for split in SPLITS:
        names = set(accuracy[f"experiment_{split}"])
        own = [one for one in results.times if one["experiment"] in names and one["model"] in set(accuracy["model"])]
        counts[split] = min((one["training_observations"] for one in own), default=0)
    if counts["random"] == counts["sector"]:
        return ""
    sizes = f"{counts['sector']:,} images train instead of {counts['random']:,}"
    return f" (and {sizes}, as the guards between the sectors cost some)"


def plainly(accuracy):
    """By how much the accuracy of each model differs at the highest SNR, and where most of all, in sentences."""
    accuracy = accuracy.assign(gain=accuracy["value_random"] - accuracy["value_sector"])
    top = accuracy[accuracy["test_snr_db"] == accuracy["test_snr_db"].max()]
    parts = [f"{name} {signed(own['gain'].iloc[0])}" for name, own in _groups(top)]
    most = accuracy.loc[accuracy["gain"].idxmax()]
    return (
        f"Accuracy at {top['test_snr_db'].max():g} dB under the random split less that under sector: "
        f"{'; '.join(parts)}. The random split flatters most {model_style(most['model'])[2]} at "
        f"{most['test_snr_db']:g} dB, by {most['gain']:.3f}."
    )


def accuracy_table(rows):
    """Accuracy under both splits at some SNRs: three rows for each model."""
    snrs = evenly(rows["test_snr_db"].unique().tolist(), TABLE_SNRS)
    shown = []
    for name, own in _groups(rows):
        own = own.set_index("test_snr_db")
        values = {split: own[f"value_{split}"] for split in SPLITS}
        values["random − sector"] = values["random"] - values["sector"]
        for split, series in values.items():
            form = "{:.3f}".format if split in SPLITS else signed
            line = {"model": name, "split": split}
            shown.append(line | {f"{snr:g} dB": form(series[snr]) for snr in snrs})
    return Table(
        name="split_accuracy",
        shown=pd.DataFrame(shown),
        data=rows,
        caption="Accuracy on the known targets at some test SNRs. The CSV file holds all SNRs, and the 95 % intervals.",
    )


def open_table(rows, validation):
    """Open-set weighted F1 under both splits at the highest SNR, with each model's best known score by protocol.

    Best is which has the largest weighted F1 by sector on the validation images at that SNR.
    """
    top = rows[rows["test_snr_db"] == rows["test_snr_db"].max()]
    keys = ["experiment", "model", "training", "score", "threshold", "test_snr_db"]
    held_out = validation[(validation["metric"] == "f1_weighted") & (validation["elevation"] == "all")]
    held_out = held_out[[*keys, "value"]].rename(columns={"experiment": "experiment_sector", "value": "validation"})
    top = top.merge(held_out, on=["experiment_sector", *keys[1:]])
    shown = []
    for protocol in PROTOCOLS:
        for name, own in _groups(top[top["threshold"] == protocol]):
            row = own.loc[own["validation"].idxmax()]
            line = {"model": name, "thresholds": protocol, "known score": score_name(row["score"])}
            for split in SPLITS:
                line[split] = interval_text({key: row[f"{key}_{split}"] for key in ("value", "low", "high")})
            shown.append(line | {"random − sector": signed(row["value_random"] - row["value_sector"])})
    return Table(
        name="split_open",
        shown=pd.DataFrame(shown),
        data=rows,
        caption=(
            f"Open-set weighted F1 at {top['test_snr_db'].max():g} dB with its 95 % interval, for each model with the "
            "known score that does best by sector on the validation images."
        ),
    )
