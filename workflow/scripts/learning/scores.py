"""One tidy table of scores, and one of confusion counts, from all predictions."""

from pathlib import Path

import numpy as np
import pandas as pd

from common.radar import snr_of_label
from learning.images import TOLERANCE
from learning.metrics import confusion, figures, intervals

RUN = ["experiment", "model", "split", "train_snr_db", "test_snr_db", "elevation"]
COLUMNS = [*RUN, "metric", "value", "low", "high", "n"]
CONFUSION = [*RUN, "truth", "predicted", "count"]


def score(predictions, experiments, scheme, seed, scores, confusions):
    """Write scores.csv and confusion.csv from prediction tables <experiment>/<model>/snr_<n>dB.csv.

    experiments: `learning.experiments` of the config; scheme: the split's; seed: the config's, for the intervals.
    Column `elevation`: 'all' counts every image; 'trained' only those at elevations the model was trained at (left
    out where that is all of them). n is the number of images that a figure rests on.
    """
    rows, cells = [], []
    for path in sorted(map(Path, predictions), key=lambda p: (p.parts[-3], p.parts[-2], snr_of_label(p.stem))):
        experiment, model = path.parts[-3:-1]
        train = experiments[experiment]["train"]
        for subset, counts, labels in _counts(path, train["elevation"]):
            run = [experiment, model, scheme, train["snr_db"], snr_of_label(path.stem), subset]
            total = counts.sum(axis=0)
            bounds = intervals(counts, labels, seed)
            for metric, value in figures(total, labels).items():
                rows.append([*run, metric, value, *bounds[metric], total.sum()])
            for (truth, predicted), count in np.ndenumerate(total):
                cells.append([*run, labels[truth], labels[predicted], count])
    pd.DataFrame(rows, columns=COLUMNS).to_csv(scores, index=False)
    pd.DataFrame(cells, columns=CONFUSION).to_csv(confusions, index=False)
    print(f"{len(predictions)} prediction tables, {len(rows)} scores")


def _counts(path, trained):
    """(name of the subset, counts (azimuths, labels, labels), labels) for each subset of elevations."""
    table = pd.read_csv(path, usecols=["elevation", "azimuth", "truth", "predicted"])
    labels = np.array(sorted(set(table["truth"].unique()) | set(table["predicted"].unique())))
    truth, predicted = (
        pd.Categorical(table[name], categories=labels).codes.astype(int) for name in ("truth", "predicted")
    )
    azimuths, groups = np.unique(table["azimuth"], return_inverse=True)
    shape = (len(azimuths), len(labels))
    yield "all", confusion(groups, truth, predicted, shape), labels
    if trained != "all":
        elevation = table["elevation"].to_numpy()
        rows = (np.abs(elevation[:, None] - np.asarray(trained, float)) < TOLERANCE).any(axis=1)
        yield "trained", confusion(groups[rows], truth[rows], predicted[rows], shape), labels
