"""Under which conditions the scores of a figure hold, as its caption ends, and what the page's words mean."""

import re
from functools import cache

from isarflow.core.folders import ROOT
from isarflow.learning.data.split import folds
from isarflow.learning.experiments import MOVED
from isarflow.report import thesis
from isarflow.report.vocabulary import POWERS, PROTOCOLS, SCHEMES, SPLITS, listed, title


def conditions(results, rows):
    """Return a sentence of the thresholds, splits, SNR and networks' sizes of what is drawn.

    rows: of scores.csv or confusion.csv.
    """
    splits = [_split(results, split, rows) for split in SPLITS if split in set(rows["split"])]
    protocols = [protocol for protocol in PROTOCOLS if protocol in set(rows["threshold"])]
    definition = rows["snr_definition"].iloc[0] if "snr_definition" in rows else results.definition
    parts = [f"thresholds {listed(protocols)}"] if protocols else []
    parts += [f"images {listed(splits)}", f"SNR by {noise_words(results.settings['noise'], definition)}"]
    parts += _networks(results, rows)
    return f" {parts[0][0].upper()}{parts[0][1:]}; {'; '.join(parts[1:])}."


def meaning(splits):
    """Return what these splits are, a sentence for each."""
    used = {split.removesuffix(MOVED) for split in splits}
    terms = [words.removeprefix("split ") for split, words in SCHEMES.items() if split in used]
    terms += ["targets that move"] if any(split.endswith(MOVED) for split in splits) else []
    return " ".join(glossary()[term] for term in terms)


def noise_words(noise, definition):
    """Return what an SNR by a definition counts, in words. noise: the config's section."""
    shared = noise["per"] == "sweep" and definition == noise["definition"]
    return f"{POWERS[definition]}{' (mean of a sweep over azimuth)' if shared else ''}"


def _networks(results, rows):
    labels = {}  # of the networks of each size
    for model in results.names.values(rows, "model"):
        if size := thesis.size(model, results.settings):
            kind, own = thesis.kind(model, results.settings), thesis.full_size(model, results.settings)
            there = "" if own else f"; the thesis's {' and '.join(map(str, thesis.SIZES[kind].values()))}"
            labels.setdefault(f"{size}{there}", []).append(results.names.model(model).label)
    sizes = "; ".join(f"{' and '.join(named)} ({words})" for words, named in labels.items())
    return [f"networks: {sizes}"] if sizes else []


def _split(results, split, rows):
    """Return a split in words, with its folds, and those of the experiments that leave some out."""
    count = len(folds(split.split(",")[0], results.settings["learning"]["split"]))
    if count == 1:
        return SPLITS[split]
    words = [f"{count} folds"]
    for name in sorted(rows[rows["split"] == split]["experiment"].unique()):
        tested = sorted({run["division"]["fold"] for run in results.runs.values() if run["experiment"] == name})
        if len(tested) < count:
            words.append(f"of {title(name)} only {'fold' if len(tested) == 1 else 'folds'} {listed(map(str, tested))}")
    return f"{SPLITS[split]} ({'; '.join(words)})"


@cache
def glossary():
    """Return the terms of resources/glossary.md, each with its meaning."""
    text = (ROOT / "resources/glossary.md").read_text()
    found = re.findall(r"^- \*\*(.+?)\*\*: (.+(?:\n  .+)*)", text, re.MULTILINE)
    return {term: " ".join(meaning.split()) for term, meaning in found}
