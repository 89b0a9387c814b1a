"""What scripts draw of the scores: the curves of all experiments, and confusion matrices with a slider over the SNR."""

from isarflow.report.layout import Section
from isarflow.report.plots import matrix
from isarflow.report.section_headline import SETS, comparison, in_words, sets_of
from isarflow.report.vocabulary import METHOD, ranked, select

PLACE, NEEDS = ("recognition", 0), "learns"  # on the page, see page.py


def section(results):
    """Return both sections."""
    curves = Section("compare", "Compare experiments", live=comparison(results))
    return curves, Section("matrices", "Who is taken for whom", live=matrices(results))


def matrices(results):
    """Return for JSON `entries`, one per method and set of images: its SNRs in dB and counts (SNR, target, class).

    Of each model in an open set that confidence score is there which is best on the validation images.
    """
    entries = []
    for name, _, validation in sets_of(results):
        best = ranked(validation).drop_duplicates(METHOD[:-1])[METHOD]
        cells = select(results.confusion, elevation="all", threshold=SETS[name]).merge(best, on=METHOD)
        for method, rows in results.names.groups(cells, *METHOD):
            by_snr = rows.groupby("test_snr_db")
            counts = [matrix(part).reindex(results.targets).dropna().astype(int) for _, part in by_snr]
            entry = {"set": name, "words": in_words(results.names, *method), "snrs": list(by_snr.groups)}
            entry |= {"targets": list(counts[0].index), "classes": list(counts[0].columns)}
            entries.append(entry | {"counts": [table.to_numpy().tolist() for table in counts]})
    return {"entries": entries}
