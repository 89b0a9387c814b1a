"""The radar cross-section (RCS) of a store: in dBsm, as a table, and between its samples."""

import numpy as np
import pandas as pd

from isarflow.core.sweep import closes_circle
from isarflow.scattering.fields.interpolation import between, is_dense, order, order_told

RECEIVER = {"receiver_elevation": "receiver_elevation_deg", "receiver_azimuth": "receiver_azimuth_deg"}
COLUMNS = ("frequency_hz", "elevation_deg", "azimuth_deg", "polarization", "rcs_dbsm", "phase_deg")
PERCENTS = (5, 25, 50, 75, 95)
POINTS = 4  # drawn for each of the samples that a curve's bandwidth asks for


def rcs_dbsm(field):
    """Return the RCS in dBsm of scattering amplitudes in m; -200 dBsm where there is no field at all."""
    return 10 * np.log10(np.maximum(4 * np.pi * np.abs(field) ** 2, 1e-20))


def as_table(dataset):
    """Return a store as a table of COLUMNS, a row for each polarization, frequency and direction.

    A bistatic one has the columns of RECEIVER besides, and a row for each receiver.
    """
    names = {"frequency": "frequency_hz", "elevation": "elevation_deg", "azimuth": "azimuth_deg"} | RECEIVER
    frame = dataset.field.to_dataframe().reset_index().rename(columns=names)
    field = frame["field"].to_numpy()
    frame["rcs_dbsm"], frame["phase_deg"] = rcs_dbsm(field), np.degrees(np.angle(field))
    return frame[[*COLUMNS[:3], *(name for name in RECEIVER.values() if name in frame), *COLUMNS[3:]]]


def center_frequency(dataset):
    """Return the frequency sample in Hz nearest to the middle of the sweep."""
    frequency = dataset.frequency.values
    return float(frequency[np.argmin(np.abs(frequency - (frequency[0] + frequency[-1]) / 2))])


def by_direction(dataset):
    """Return a store's field over one dimension, `direction`; of a grid, one elevation after another."""
    return dataset.field if "direction" in dataset.sizes else dataset.field.stack(direction=["elevation", "azimuth"])


def resolved(field, reach):
    """Return the highest order of a field over azimuth that its samples (A,) hold; None where they hold not all of it.

    reach: the target's in m; if None, the order is told from samples round the circle.
    """
    azimuth = field.azimuth.values
    if reach is None:
        return order_told(field.values) if closes_circle(azimuth) else None
    highest = order(float(field.frequency), reach, float(field.elevation))
    return highest if is_dense(azimuth, highest) else None


def series(field, reach):
    """Return azimuths in degrees and levels in dBsm of the series through samples; None where they do not hold it."""
    azimuth, highest = field.azimuth.values, resolved(field, reach)
    if highest is None:
        return None
    span = 360.0 if closes_circle(azimuth) else azimuth[-1] - azimuth[0]
    x = np.linspace(azimuth[0], azimuth[0] + span, int(POINTS * (2 * highest + 1) * span / 360) + 2)
    return x, rcs_dbsm(between(azimuth, field.values, highest, x))


def by_frequency(target, table, measures):
    """Return a table of a target's measures at each polarization and frequency.

    measures: a function of the rows of `table` at one, gives values by column.
    """
    keys = ["polarization", "frequency_hz"]
    groups = table.groupby(keys, sort=False)
    rows = [{"target": target} | dict(zip(keys, key, strict=True)) | measures(part) for key, part in groups]
    return pd.DataFrame(rows)


def percentiles(target, table):
    """Return PERCENTS of RCS over all directions, its mean (of m²) and the largest, in dBsm. table: of `as_table`."""

    def measures(part):
        level = part["rcs_dbsm"].to_numpy()
        levels = dict(zip([f"p{p}_dbsm" for p in PERCENTS], np.percentile(level, PERCENTS), strict=True))
        return levels | {"mean_dbsm": 10 * np.log10(np.mean(10 ** (level / 10))), "max_dbsm": level.max()}

    return by_frequency(target, table, measures)
