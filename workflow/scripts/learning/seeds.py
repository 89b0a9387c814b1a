"""Scores over several seeds: their mean, and the interval that it would have over other seeds."""

import numpy as np
import pandas as pd
from scipy.special import expit, logit
from scipy.stats import t

from isarflow.learning.metrics import LEVEL
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
    low, high = interval(values["mean"], values["std"], values["count"], ~values["metric"].isin(NO_SHARES))
    found = values[KEYS].assign(value=values["mean"], low=low, high=high, n=values["count"])
    found.assign(lowest=values["min"], highest=values["max"]).to_csv(output, index=False)
    print(f"{len(found)} scores over {len(tables)} seeds")


def interval(mean, deviation, count, is_share):
    """The 95 % interval of the mean of so many values with a standard deviation: (low, high), arrays like `mean`.

    Student's t; for a share on the scale of log(p / (1 - p)), as `metrics.interval`. NaN for a single value.
    """
    mean, deviation, count = (np.asarray(of, float) for of in (mean, deviation, count))
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.where(count > 1, t.ppf((1 + LEVEL) / 2, count - 1) * deviation / np.sqrt(count), np.nan)
        slope = mean * (1 - mean)
        shares = [np.where(half > 0, expit(logit(mean) + end / slope), mean + 0 * half) for end in (-half, half)]
        return tuple(np.where(is_share, *ends) for ends in zip(shares, (mean - half, mean + half), strict=True))
