"""Under which conditions the scores of a figure hold: a tail for its caption, the same everywhere."""

from isarflow.learning.split import folds
from isarflow.report import thesis
from isarflow.report.vocabulary import POWERS, PROTOCOLS, SPLITS, listed, title

MEANING = {
    "elevation": "Split by elevation, every second elevation trains and test images are of those between.",
    "sector": "Split by sector, arcs of the aspects take turns to be tested, an aperture away from all that trains.",
    "random": "Split at random, test images have near copies among the training images.",
    "shuffled": "Shuffled with mirror images apart, test images have near copies and mirror images that trained.",
}


def conditions(results, rows):
    """Return sizes of networks, thresholds, splits with their folds, and the definition of SNR, in sentences.

    rows: what is drawn, of scores.csv or confusion.csv.
    """
    splits = [_split(results, split, rows) for split in SPLITS if split in set(rows["split"])]
    protocols = [protocol for protocol in PROTOCOLS if protocol in set(rows["threshold"])]
    noise = results.settings["noise"]
    definition = rows["snr_definition"].iloc[0] if "snr_definition" in rows else noise["definition"]
    thresholds = f" Thresholds: {listed(protocols)}." if protocols else ""
    power = noise_words(noise, definition)
    return f"{_networks(results, rows)}{thresholds} Images {listed(splits)}. SNR by {power}."


def meaning(splits):
    """Return what these splits are, a sentence for each."""
    return " ".join(MEANING[split] for split in SPLITS if split in set(splits))


def noise_words(noise, definition):
    """Return what an SNR by a definition counts, in words. noise: the config's section."""
    shared = noise["per"] == "sweep" and definition == noise["definition"]
    return f"{POWERS[definition]}{' (mean of a sweep over azimuth)' if shared else ''}"


def _networks(results, rows):
    """Return the sizes of the networks, and the thesis's where they are others."""
    labels = {}  # of the networks of each size
    for model in results.names.values(rows, "model"):
        if size := thesis.size(model, results.settings):
            kind, own = thesis.kind(model, results.settings), thesis.full_size(model, results.settings)
            there = "" if own else f"; the thesis's {' and '.join(map(str, thesis.SIZES[kind].values()))}"
            labels.setdefault(f"{size}{there}", []).append(results.names.model(model).label)
    sizes = "; ".join(f"{' and '.join(named)} ({words})" for words, named in labels.items())
    return f" Networks: {sizes}." if sizes else ""


def _split(results, split, rows):
    """Return a split in words, with its folds, and those of the experiments that leave some out."""
    count = len(folds(split, results.settings["learning"]["split"]))
    if count == 1:
        return SPLITS[split]
    words = [f"{count} folds"]
    for name in sorted(rows[rows["split"] == split]["experiment"].unique()):
        if len(results.folds[name]) < count:
            words.append(f"of {title(name)} only no. {listed(map(str, results.folds[name]))}")
    return f"{SPLITS[split]} ({'; '.join(words)})"
