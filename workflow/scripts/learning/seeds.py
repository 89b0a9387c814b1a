"""Scores over several seeds: their mean, and the interval that it would have over other seeds."""

import numpy as np
import pandas as pd

from isarflow.learning.metrics import around
from isarflow.learning.scores import CASE

KEYS = [*CASE, "snr_definition", "fold", "metric"]
NO_SHARES = ("threshold", "f1_weighted_gain")  # metrics that may lie outside 0 to 1


def over_seeds(scores, output):
    """Write the means over several seeds' tables scores.csv: one row for each of their rows.

    Columns: those of scores.csv, with value the mean, low and high its 95 % interval over seeds, n their number, and
    lowest and highest of them. A seed without such a row is left out of it.
    """
    tables = [pd.read_csv(path, keep_default_na=False) for path in scores]
    every = pd.concat(tables, ignore_index=True)
    every["value"] = pd.to_numeric(every["value"])
    values = every.groupby(KEYS, sort=False)["value"].agg(["mean", "std", "count", "min", "max"]).reset_index()
    error, is_share = values["std"] / np.sqrt(values["count"]), ~values["metric"].isin(NO_SHARES)
    low, high = around(values["mean"], error, values["count"] - 1, is_share)  # NaN for a single value
    found = values[KEYS].assign(value=values["mean"], low=low, high=high, n=values["count"])
    found.assign(lowest=values["min"], highest=values["max"]).to_csv(output, index=False)
    print(f"{len(found)} scores over {len(tables)} seeds")
