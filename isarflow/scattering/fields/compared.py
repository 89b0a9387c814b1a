"""A run's radar cross-section at the samples of the user's own file: a CSV of dBsm, or FEKO's far fields (.ffe)."""

import numpy as np
import pandas as pd

from isarflow.core.errors import InputError
from isarflow.scattering.fields import ffe, field_files
from isarflow.scattering.fields.interpolation import between
from isarflow.scattering.fields.places import alike, once
from isarflow.scattering.fields.rcs import by_frequency, rcs_dbsm, resolved
from isarflow.scattering.fields.reference import LEVEL, WANTED, check_columns, is_csv, samples, several

SAME_FREQUENCY_SHARE = 1e-6  # of a frequency, within which another is the same
SAME_ANGLE_DEGREES = 1e-3  # within which another angle is the same


def read_reference(reference, polarizations, needed):
    """Return the user's samples as a table: frequency_hz, elevation_deg, azimuth_deg, polarization, rcs_dbsm.

    reference: a path of a CSV, with rcs_dbsm and the columns `needed`, or {V: ..., H: ...} of .ffe files. Samples of
    one place that are the same are one. Raises InputError for what cannot be read and for samples that differ there.
    """
    if is_csv(reference):
        return _read_csv(reference, needed)
    parts = []
    for transmitted, paths in field_files.by_transmission(reference, polarizations).items():
        waves = ffe.read(paths)
        waves = ffe.once(waves, [alike(axis, waves[axis].to_numpy()) for axis in WANTED.values()])
        where = pd.DataFrame({column: waves[axis] for column, axis in WANTED.items()})
        for way in (pair[0] for pair in polarizations if pair[1] == transmitted):
            parts.append(where.assign(polarization=way + transmitted, rcs_dbsm=rcs_dbsm(waves[way])))
    return pd.concat(parts, ignore_index=True)


def _read_csv(path, needed):
    names = check_columns(path, needed)
    lines, rows = zip(*samples(path), strict=True)
    frame = pd.DataFrame(list(rows), index=list(lines), columns=list(dict.fromkeys(names)))
    levels = frame.dropna(subset=LEVEL)  # the others are left out, and counted
    numbers = [np.zeros(len(levels), int)]
    numbers += [alike(axis, levels[column].to_numpy()) for column, axis in WANTED.items() if column in levels]
    numbers += [pd.factorize(levels["polarization"])[0]] if "polarization" in levels else []
    amplitudes = 10 ** (levels[[LEVEL]].to_numpy() / 20)
    first = levels.index[once(numbers, amplitudes, lambda i: f"{path}, line {levels.index[i]}", "level")]
    return frame[frame[LEVEL].isna() | frame.index.isin(first)].reset_index(drop=True)


def compare(reference, dataset, reach):
    """Return the user's samples with the run's `computed_dbsm` at them and `difference_db` (computed less reference).

    Those at azimuths between the run's are compared with its band-limited series, where its azimuths are dense enough;
    what the run has no value for is left out and counted, in attrs. Raises InputError if that is all.
    """
    name = ", ".join(field_files.paths(reference))
    values = {column: dataset[axis].values for column, axis in (*WANTED.items(), ("polarization", "polarization"))}
    given = read_reference(reference, dataset.polarization.values.tolist(), several(*values.values()))
    given = given.assign(**{column: run_values[0] for column, run_values in values.items() if column not in given})
    computed = np.full(len(given), np.nan)
    keys = ["polarization", "frequency_hz"] + ([] if "direction" in dataset.sizes else ["elevation_deg"])
    for (polarization, frequency, *_), rows in given.groupby(keys, sort=False).indices.items():
        places = (given[column].to_numpy()[rows] for column in ("elevation_deg", "azimuth_deg"))
        computed[rows] = _computed(dataset, reach, polarization, frequency, *places)
    given["computed_dbsm"] = computed
    given["difference_db"] = computed - given["rcs_dbsm"]
    compared = given.dropna(subset="difference_db").reset_index(drop=True)
    if compared.empty:
        raise InputError(
            f"{name}: none of its {len(given)} samples has a level, and a frequency, direction and polarization of the "
            f"run.{_apart(given, values)}"
        )
    compared.attrs = {"reference": name, "left_out": len(given) - len(compared)}
    return compared


def _apart(given, run):
    """Return why a run with these values, by column, has no sample: for columns that share none, what both have."""
    sentences = ""
    for column, run_values in run.items():
        given_values = given[column].to_numpy()
        if column == "azimuth_deg":
            given_values, run_values = given_values % 360, run_values % 360
        if column == "polarization":
            shared = np.isin(given_values, run_values)
            extents = [", ".join(sorted(set(names))) for names in (given_values, run_values)]
        else:
            shared = (run_values.min() <= given_values) & (given_values <= run_values.max())
            extents = [f"{values.min():.10g} to {values.max():.10g}" for values in (given_values, run_values)]
        if not shared.any():
            sentences += f" Its {column}: {extents[0]}; the run's: {extents[1]}."
    return sentences


def _computed(dataset, reach, polarization, frequency, elevation, azimuth):
    """Return the run's RCS in dBsm at directions (B,), NaN where it has none.

    frequency: Hz; elevation and azimuth: degrees, (B,) each, of a run over a grid all at one elevation.
    """
    grid = "direction" not in dataset.sizes
    try:
        field = dataset.field.sel(polarization=polarization)
        field = field.sel(frequency=frequency, method="nearest", tolerance=SAME_FREQUENCY_SHARE * frequency)
        field = field.sel(elevation=elevation[0], method="nearest", tolerance=SAME_ANGLE_DEGREES) if grid else field
    except KeyError:
        return np.full(len(azimuth), np.nan)
    apart = np.abs((azimuth[:, None] - field.azimuth.values + 180) % 360 - 180)
    if not grid:
        apart = np.maximum(apart, np.abs(elevation[:, None] - field.elevation.values))
    gap = apart.min(axis=1)
    level = np.where(gap < SAME_ANGLE_DEGREES, rcs_dbsm(field.values[apart.argmin(axis=1)]), np.nan)
    highest = resolved(field, reach) if grid and reach is not None else None
    if highest is not None:
        inside = (gap >= SAME_ANGLE_DEGREES) & (gap <= 180 / (2 * highest + 1) + 1e-9)
        level[inside] = rcs_dbsm(between(field.azimuth.values, field.values, highest, azimuth[inside]))
    return level


def differences(target, compared):
    """Return the mean and the worst difference in dB at each polarization and frequency. compared: as of `compare`."""

    def measures(part):
        apart, size = part["difference_db"], part["difference_db"].abs()
        return {"samples": len(part), "mean_db": size.mean(), "bias_db": apart.mean(), "worst_db": size.max()}

    return by_frequency(target, compared.sort_values(["polarization", "frequency_hz"], kind="stable"), measures)


def worst_cut(compared):
    """Return the cut along the axis with most samples on which they differ most: that axis, its place, its rows."""
    rests = {across: [name for name in WANTED if name != across] for across in reversed(WANTED)}
    counts = {across: compared.groupby(["polarization", *rest])[across].nunique() for across, rest in rests.items()}
    across = max(counts, key=lambda name: counts[name].max())
    count = compared.groupby(rests[across])["difference_db"].transform("size")
    worst = compared["difference_db"].abs().where(count > count.max() / 2).idxmax()
    place = compared.loc[worst, rests[across]]
    part = compared[(compared[rests[across]] == place).all(axis=1)].sort_values(across)
    return across, place, part
