"""Confusion matrices of every model at every SNR, for the page's own slider."""

from isarflow.learning.experiments import CLEAN
from isarflow.report.plots import matrix
from isarflow.report.section_headline import SETS, sets_of
from isarflow.report.vocabulary import METHOD, ranked, select, split_text, title


def matrices(results):
    """Counts by experiment, model and SNR: a mapping that is written into the page as JSON.

    Each entry has the set of test images that it is of, a name, the SNRs in dB, the targets and classes, and counts by
    SNR, target and class. Of each model in an open set that confidence score is there which is best on the validation
    images.
    """
    names, place, entries = results.names, results.targets.index, []
    for name, _, validation in sets_of(results):
        best = ranked(validation).drop_duplicates(METHOD[:-1])[METHOD]
        cells = select(results.confusion, elevation="all", threshold=SETS[name]).merge(best, on=METHOD)
        for (split, experiment, model, training, score), rows in names.groups(cells, *METHOD):
            counts = {
                snr: matrix(part).sort_index(key=lambda index: index.map(place))
                for snr, part in rows.groupby("test_snr_db")
            }
            first = next(iter(counts.values()))
            trained = "trained without noise" if training == CLEAN else f"training SNR: {training}"
            entries.append(
                {
                    "set": name,
                    "words": f"{names.method(model, score)}: {title(experiment)}, {split_text(split)}, {trained}",
                    "snrs": list(counts),
                    "targets": list(first.index),
                    "classes": list(first.columns),
                    "counts": [table.astype(int).to_numpy().tolist() for table in counts.values()],
                }
            )
    return {"entries": entries}
