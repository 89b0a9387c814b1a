"""Compare runs: the scores of one minus the scores of another on the test images that both have."""

import numpy as np
import pandas as pd

from isarflow.learning.evaluation import judge, metrics, record
from isarflow.learning.evaluation.scores import HEAD, tables_of_cases
from isarflow.learning.experiments import is_by_family
from isarflow.learning.tables import read_table

IMAGE = ["target", "elevation", "azimuth", "realization"]  # columns that identify an image
METRICS = ("accuracy", "f1_weighted")
COLUMNS = [*HEAD, "test_snr_db", "score", "threshold", "run", "metric"]
COLUMNS += ["value", "reference_value", "difference", "low", "high", "n"]


def differences(roots, seed, kept_share):
    """Differences of the scores of each other run from the first one's, a DataFrame with COLUMNS.

    roots: the runs' folders by name, results/<run>, the first the reference. seed: of the resamples; kept_share: of
    known images, above the thresholds of the protocol `kept`. Raises InputError for a run that is not finished.
    Compared are the same experiment, model, split, training, confidence score and protocol at the same test SNR, in the
    closed set and, of open runs, with thresholds. Both values count only the test images that both runs have (`n`);
    `low` and `high` are the 95 % interval of the difference, in whose resamples both runs are drawn alike.
    """
    rows, ((_, reference), *other_runs) = [], [(name, _cases(root)) for name, root in roots.items()]
    families = record.read(next(iter(roots.values()))).kinds
    for case, paths in reference.items():
        matching = [(name, cases[case]) for name, cases in other_runs if case in cases]
        kinds = families if is_by_family(dict(zip(HEAD, case, strict=False))) else None
        decided = _decided(paths, kept_share, kinds) if matching else {}
        for name, of_other in matching:
            for kind, decision in _decided(of_other, kept_share, kinds).items():
                if kind in decided:
                    rows += [[*case, *kind, name, *row] for row in difference(decision, decided[kind], seed)]
    return pd.DataFrame(rows, columns=COLUMNS)


def difference(decision, reference, seed):
    """(metric, value, reference's, difference, low, high, images) of two `judge.Decision`s, if they share images."""
    columns = [*IMAGE, "truth", "block"]
    pair = decision, reference
    images, of_reference = (judged.test[columns].round(4).assign(predicted=judged.predicted) for judged in pair)
    common = images.merge(of_reference, on=IMAGE, suffixes=("", "_of_reference"))
    if common.empty:
        return
    blocks, place = np.unique(common["block_of_reference"], return_inverse=True)
    labels, counts = judge.ordered({*decision.labels, *reference.labels}), []
    for suffix in ("", "_of_reference"):
        codes = [pd.Index(labels).get_indexer(common[name + suffix]) for name in ("truth", "predicted")]
        counts.append(metrics.confusion(place, *codes, (len(blocks), len(labels))))
    for *values, low, high in metrics.differences(counts, [labels, labels], seed, METRICS, reference.strata(blocks)):
        # With few blocks the interval may be wider than a difference of shares can be.
        yield *values, *np.clip([low, high], -1, 1), len(common)


def _cases(root):
    """Map the columns HEAD and the SNR of every run and model of a finished run to its tables in order of folds."""
    finished = record.read(root)
    cases = tables_of_cases(record.paths(root, finished, finished.tables), finished.runs)
    return {(*head, snr): tables[snr] for head, (_, tables) in cases.items() for snr in sorted(tables)}


def _decided(paths, kept_share, kinds):
    """The final `Decision`s of one SNR, by confidence score and protocol."""
    table = pd.concat(map(read_table, paths), ignore_index=True)
    final = [decision for decision in judge.decide(table, kept_share, kinds) if decision.is_final]
    return {(decision.score, decision.threshold): decision for decision in final}
