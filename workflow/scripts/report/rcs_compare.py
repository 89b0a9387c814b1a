"""A target's radar cross-section beside that of the user's own file: a CSV of dBsm, or FEKO's far fields (.ffe)."""

import numpy as np
import pandas as pd

from isarflow.core.errors import InputError
from isarflow.report.layout import figure, table
from isarflow.report.plots import draw_legend, panels
from isarflow.report.rcs_figures import FLOOR, LABELS, rcs_dbsm
from isarflow.scattering import ffe, field_files
from isarflow.scattering.interpolation import between, is_dense, order
from isarflow.scattering.reference import WANTED, check_columns, is_csv, several

SAME = {"frequency": 1e-6, "elevation": 1e-3, "azimuth": 1e-3}  # relative; degrees


def read_reference(reference, polarizations, needed):
    """The user's samples as a table: frequency_hz, elevation_deg, azimuth_deg, polarization, rcs_dbsm.

    A CSV needs rcs_dbsm and the columns `needed`. reference: a path, or {V: ..., H: ...} of .ffe files. Raises
    InputError for what cannot be read.
    """
    if is_csv(reference):
        return _read_csv(reference, needed)
    parts = []
    for transmitted, paths in field_files.by_transmission(reference, polarizations).items():
        for path in paths:
            waves = ffe.read(path)
            for way in (pair[0] for pair in polarizations if pair[1] == transmitted):
                parts.append(
                    pd.DataFrame(
                        {
                            "frequency_hz": waves.frequency,
                            "elevation_deg": waves.elevation,
                            "azimuth_deg": waves.azimuth,
                            "polarization": way + transmitted,
                            "rcs_dbsm": rcs_dbsm(waves.received[way]),
                        }
                    )
                )
    return pd.concat(parts, ignore_index=True)


def _read_csv(path, needed):
    check_columns(path, needed)
    try:
        frame = pd.read_csv(path, comment="#", skipinitialspace=True)
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a CSV file ({error}).") from None
    for name in (name for name in ("rcs_dbsm", *WANTED) if name in frame):
        numbers = pd.to_numeric(frame[name], errors="coerce").astype(float)
        # A level may be missing, or that of no field at all: such a sample is left out.
        bare = (frame[name].isna() | (numbers == -np.inf)) if name == "rcs_dbsm" else False
        wrong = ~np.isfinite(numbers) & np.logical_not(bare)
        if wrong.any():
            line = int(np.flatnonzero(wrong)[0])
            raise InputError(f"{path}: row {line + 1} has no finite number in column {name}.")
        frame[name] = numbers.where(np.isfinite(numbers))
    return frame


def compare(reference, dataset, reach):
    """The user's samples with the run's `computed_dbsm` at them and `difference_db` (computed less reference).

    Those at azimuths between the run's are compared with its band-limited series, where its azimuths are dense enough;
    what the run has no value for is left out. Raises InputError if that is all.
    """
    name = reference if isinstance(reference, str) else ", ".join(field_files.paths(reference))
    values = {column: dataset[axis].values for column, axis in (*WANTED.items(), ("polarization", "polarization"))}
    given = read_reference(reference, dataset.polarization.values.tolist(), several(*values.values()))
    for column, mine in values.items():
        if column not in given:
            given[column] = mine[0]
    computed = np.full(len(given), np.nan)
    keys = ["polarization", "frequency_hz"] + ([] if "direction" in dataset.sizes else ["elevation_deg"])
    for key, rows in given.groupby(keys, sort=False).indices.items():
        one = _at(dataset, *key)
        if one is not None:
            elevation, azimuth = (given[column].to_numpy()[rows] for column in ("elevation_deg", "azimuth_deg"))
            computed[rows] = _values(one, elevation, azimuth, reach)
    given["computed_dbsm"] = computed
    given["difference_db"] = computed - given["rcs_dbsm"]
    found = given.dropna(subset="difference_db").reset_index(drop=True)
    if found.empty:
        raise InputError(
            f"{name}: none of its {len(given)} samples has a level, and a frequency, direction and polarization of the "
            f"run.{_apart(given, values)}"
        )
    found.attrs["left_out"] = len(given) - len(found)
    return found


def _apart(given, values):
    """Why a run with these `values` has none of the samples: of each column that shares none, what both have."""
    said = []
    for column, mine in values.items():
        theirs = np.unique(given[column])
        if column == "azimuth_deg":
            theirs, mine = theirs % 360, mine % 360
        if column == "polarization":
            shared, both = set(theirs) & set(mine), [", ".join(names) for names in (theirs, mine)]
        else:
            shared = theirs[(theirs >= min(mine)) & (theirs <= max(mine))].size
            both = [f"{min(numbers):.10g} to {max(numbers):.10g}" for numbers in (theirs, mine)]
        if not shared:
            said.append(f" Its {column}: {both[0]}; the run's: {both[1]}.")
    return "".join(said)


def _at(dataset, polarization, frequency, elevation=None):
    """The field of a polarization and frequency, and of a grid of an elevation; None if the run has none such."""
    places = np.abs(dataset.frequency.values / frequency - 1)
    if polarization not in dataset.polarization.values or places.min() > SAME["frequency"]:
        return None
    field = dataset.field.sel(polarization=polarization).isel(frequency=int(places.argmin()))
    if elevation is None:
        return field
    apart = np.abs(dataset.elevation.values - elevation)
    return None if apart.min() > SAME["elevation"] else field.isel(elevation=int(apart.argmin()))


def _values(field, elevation, azimuth, reach):
    """RCS in dBsm at directions (B,) of a field over azimuth or over single directions; NaN where there is none."""
    there = field.azimuth.values
    apart = np.abs((azimuth[:, None] - there + 180) % 360 - 180)
    if "direction" in field.dims:
        apart = np.maximum(apart, np.abs(elevation[:, None] - field.elevation.values))
    nearest = apart.argmin(axis=1)
    same = apart[np.arange(len(azimuth)), nearest] < SAME["azimuth"]
    level = np.where(same, rcs_dbsm(field.values[nearest]), np.nan)
    if same.all() or "direction" in field.dims or reach is None:
        return level
    highest = order(float(field.frequency), reach, float(field.elevation))
    if not is_dense(there, highest):
        return level
    gap = 360 / (2 * highest + 1)
    inside = ~same & (apart.min(axis=1) <= gap / 2 + 1e-9)
    level[inside] = rcs_dbsm(between(there, field.values, highest, azimuth[inside]))
    return level


def sentence(target, compared, reference):
    """The comparison in one sentence."""
    name = reference if isinstance(reference, str) else ", ".join(field_files.paths(reference))
    difference = compared["difference_db"]
    worst = compared.loc[difference.abs().idxmax()]
    left = compared.attrs["left_out"]
    beside = f" {left} more have no level, or no frequency, direction or polarization of this run." if left else ""
    return (
        f"{target} beside {name}: over {len(compared)} samples the mean difference without its sign is "
        f"{difference.abs().mean():.2f} dB, the worst {difference[worst.name]:+.2f} dB, at "
        f"{worst['frequency_hz'] / 1e9:.4g} GHz, elevation "
        f"{worst['elevation_deg']:g}°, azimuth {worst['azimuth_deg']:g}°, {worst['polarization']}, where the reference "
        f"is {worst['rcs_dbsm']:.1f} dBsm.{beside}"
    )


def compare_table(target, compared):
    """Mean and worst difference for each polarization and frequency."""
    rows = []
    for (polarization, frequency), part in compared.groupby(["polarization", "frequency_hz"]):
        apart = part["difference_db"]
        row = {"target": target, "polarization": polarization, "frequency_hz": frequency, "samples": len(part)}
        rows.append(row | {"mean_db": apart.abs().mean(), "bias_db": apart.mean(), "worst_db": apart.abs().max()})
    shown = {
        "polarization": "{polarization}",
        "frequency": lambda row: f"{row['frequency_hz'] / 1e9:.4g} GHz",
        "samples": "{samples}",
        "mean difference [dB]": "{mean_db:.2f}",
        "worst [dB]": "{worst_db:.2f}",
        "computed less reference [dB]": "{bias_db:+.2f}",
    }
    caption = f"{target}: by how much the computed RCS differs from the reference, without its sign."
    return table(f"rcs_compared_{target}", pd.DataFrame(rows), shown, caption)


def compare_figure(target, compared):
    """The computed RCS with the reference drawn over it, along the axis with most samples, where they differ most."""
    polarizations = list(dict.fromkeys(compared["polarization"]))
    counts = {
        name: compared.groupby(["polarization", *(other for other in WANTED if other != name)])[name].nunique().max()
        for name in ("azimuth_deg", "elevation_deg", "frequency_hz")
    }
    across = max(counts, key=counts.get)
    others = [name for name in WANTED if name != across]
    count = compared.groupby(others)["difference_db"].transform("size")
    most = compared.loc[compared["difference_db"].abs().where(count > count.max() / 2).idxmax(), others]
    part = compared[(compared[others] == list(most)).all(axis=1)].sort_values(across)
    scale = 1e-9 if across == "frequency_hz" else 1
    drawing, grid = panels(len(polarizations), 1, 5.4, 0.9 + 2.1 * len(polarizations), sharey=False)
    for axes, polarization in zip(grid[:, 0], polarizations, strict=True):
        rows = part[part["polarization"] == polarization]
        axes.plot(scale * rows[across], rows["computed_dbsm"], label="computed")
        axes.plot(scale * rows[across], rows["rcs_dbsm"], ".", ms=4, label="reference")
        axes.set(ylabel=f"{polarization} RCS [dBsm]")
        if len(rows):
            both = rows[["rcs_dbsm", "computed_dbsm"]].to_numpy()
            axes.set_ylim(max(both.min() - 2, both.max() - FLOOR), both.max() + 2)
    grid[-1, 0].set_xlabel(LABELS[WANTED[across]])
    draw_legend(drawing, grid.flat)
    texts = {"frequency_hz": "{:.4g} GHz", "elevation_deg": "elevation {:g}°", "azimuth_deg": "azimuth {:g}°"}
    scales = {"frequency_hz": 1e-9}
    at = ", ".join(texts[name].format(scales.get(name, 1) * value) for name, value in zip(others, most, strict=True))
    alt = f"RCS of {target}, computed and by the reference, against {WANTED[across]} at {at}."
    frame = compared.assign(target=target)
    caption = (
        f"{target}: computed, and the reference drawn over it, at {at}, where they differ most; the CSV holds all "
        "samples compared."
    )
    return figure(f"rcs_compared_{target}", drawing, frame, alt, caption)
