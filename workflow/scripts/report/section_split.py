"""How far the random split flatters: the same models on azimuths far from those that they were trained at."""

from report.layout import Section, signed, table
from report.selection import TABLE_SNRS, evenly
from report.vocabulary import ACCURACY, F1, INTERVAL, PROTOCOLS, SPLITS, at_highest, at_snrs, select

KEYS = ["images", "model", "training", "train_snr_db", "elevation", "metric", "score", "threshold", "test_snr_db"]


def section(results):
    """The comparison; nothing where no model is tested under both splits with the same training images."""
    pairs = select(paired(results), elevation="all")
    if not len(pairs):
        return ()
    accuracy = select(pairs, metric=ACCURACY, score="")
    opened = select(pairs, metric=F1, threshold=PROTOCOLS)
    tables = (*([open_table(results, opened)] if len(opened) else []), accuracy_table(results.names, accuracy))
    return (
        Section(
            id="splits",
            title="How far the random split flatters",
            text=(
                "Neighbouring azimuths share most of their aperture. Split at random, test images have near-copies "
                "among the training images; split by sector, no test image shares a sample with one of them"
                f"{_images(results, accuracy)}. {plainly(results.names, accuracy)}",
            ),
            tables=tables,
        ),
    )


def paired(results):
    """Rows of the same model, training images and metric under both splits, side by side, and their difference."""
    images = {run["experiment"]: repr((run["elevation"], run["upsample"])) for run in results.runs.values()}
    scores = results.scores.assign(images=results.scores["experiment"].map(images))
    # An experiment tested on the open set has the closed set's rows too: any of several is as good.
    sector, random = (
        select(scores, split=split).drop_duplicates(KEYS)[[*KEYS, "experiment", "value", "low", "high"]]
        for split in SPLITS
    )
    return sector.merge(random, on=KEYS, suffixes=[f"_{split}" for split in SPLITS])


def _gain(row):
    return row["value_random"] - row["value_sector"]


def _groups(names, rows):
    """The rows of each model and kind of training images, in the order of the page, after what the page calls it."""
    several = rows.groupby("model")[["images", "training"]].nunique().max(axis=1) > 1
    for (model, trained, _), group in names.groups(rows, "model", "training", "images"):
        yield f"{names.model(model).label}{f', training SNR {trained}' if several[model] else ''}", group


def _images(results, accuracy):
    """How many images train on either side, where that differs: the guards between the sectors cost some."""
    times = select(results.times, model=list(accuracy["model"]))
    sector, random = (
        select(times, experiment=list(accuracy[f"experiment_{split}"]))["training_observations"].min()
        for split in SPLITS
    )
    if random == sector:
        return ""
    return f" (and {sector:,} images train instead of {random:,}, as the guards between the sectors cost some)"


def plainly(names, accuracy):
    """By how much the accuracy of each model differs at the highest SNR, and where most of all, in sentences."""
    top = at_highest(accuracy)
    parts = [f"{name} {signed(_gain(rows.iloc[0]))}" for name, rows in _groups(names, top)]
    most = accuracy.loc[_gain(accuracy).idxmax()]
    return (
        f"Accuracy at {top['test_snr_db'].max():g} dB under the random split less that under sector: "
        f"{'; '.join(parts)}. The random split flatters most {names.model(most['model']).label} at "
        f"{most['test_snr_db']:g} dB, by {_gain(most):.3f}."
    )


def accuracy_table(names, rows):
    """Accuracy under both splits at some SNRs: three rows for each model."""
    snrs = evenly(rows["test_snr_db"].unique().tolist(), TABLE_SNRS)
    kinds = {split: lambda row, split=split: f"{row[f'value_{split}']:.3f}" for split in SPLITS}
    kinds["random − sector"] = lambda row: signed(_gain(row))
    shown = [
        {"model": name, "split": kind} | at_snrs(curve, snrs, text)
        for name, curve in _groups(names, rows)
        for kind, text in kinds.items()
    ]
    caption = "Accuracy on the known targets at some test SNRs. The CSV file holds all SNRs, and the 95 % intervals."
    return table("split_accuracy", rows, shown, caption)


def open_table(results, rows):
    """Open-set weighted F1 under both splits at the highest SNR, with each model's best confidence score by protocol.

    Best is which has the largest weighted F1 by sector on the validation images at that SNR.
    """
    names, top = results.names, at_highest(rows)
    keys = ["experiment_sector", "model", "training", "score", "threshold", "test_snr_db"]
    held_out = select(results.validation, metric=F1, elevation="all")
    held_out = held_out.rename(columns={"experiment": "experiment_sector", "value": "validation"})
    top = top.merge(held_out[[*keys, "validation"]], on=keys)
    shown = []
    for protocol in PROTOCOLS:
        for name, group in _groups(names, select(top, threshold=protocol)):
            row = group.loc[group["validation"].idxmax()]
            line = {"model": name, "thresholds": protocol, "confidence score": names.score(row["score"]).label}
            for split in SPLITS:
                line[split] = INTERVAL.format(**{key: row[f"{key}_{split}"] for key in ("value", "low", "high")})
            shown.append(line | {"random − sector": signed(_gain(row))})
    caption = (
        f"Open-set weighted F1 at {top['test_snr_db'].max():g} dB with its 95 % interval, for each model with the "
        "confidence score that does best by sector on the validation images."
    )
    return table("split_open", rows, shown, caption)
