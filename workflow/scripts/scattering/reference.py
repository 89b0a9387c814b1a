"""Check the columns of a user's CSV of RCS, named by `targets.<target>.reference`. Light to import."""

import contextlib
import csv
from pathlib import Path

from isarflow.core.errors import InputError

WANTED = {"frequency_hz": "frequency", "elevation_deg": "elevation", "azimuth_deg": "azimuth"}


def is_csv(reference):
    """True for one CSV file, False for FEKO's files."""
    return isinstance(reference, str) and Path(reference).suffix.lower() == ".csv"


def several(frequency, elevation, azimuth, polarization):
    """Names of the columns that a CSV needs for a run with these values: those in which the run has several."""
    values = zip((*WANTED, "polarization"), (frequency, elevation, azimuth, polarization), strict=True)
    return [name for name, mine in values if len(set(mine)) > 1]


def _lines(file):
    """A file's lines without their comments."""
    return (line for line in (line.partition("#")[0] for line in file) if line.strip())


def check_frequencies(path, frequency):
    """Raise InputError for a CSV whose `frequency_hz` has none between the first and the last of the run's (Hz)."""
    first, last = frequency[0] * (1 - 1e-6), frequency[-1] * (1 + 1e-6)
    with open(path, encoding="utf-8-sig", newline="") as file:
        found = []
        for row in csv.DictReader(_lines(file), skipinitialspace=True):
            with contextlib.suppress(TypeError, ValueError):  # reported with its row when it is read
                found.append(float(row.get("frequency_hz")))
            if found and first <= found[-1] <= last:
                return  # most often the first row: this is read before every run
    if found:
        hint = " They look like GHz." if any(first <= 1e9 * one <= last for one in found) else ""
        raise InputError(
            f"{path}: its frequency_hz, {min(found):g} to {max(found):g}, has none of the run's, {frequency[0]:g} to "
            f"{frequency[-1]:g} Hz.{hint}"
        )


def check_columns(path, needed):
    """Raise InputError for a file that is no CSV, and for one without rcs_dbsm and the columns `needed`."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            there = next(csv.reader(_lines(file), skipinitialspace=True), [])
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a CSV file ({error}).") from None
    missing = [name for name in ("rcs_dbsm", *needed) if name not in there]
    if missing:
        hint = " Separate columns by commas." if len(there) == 1 and {";", "\t"} & set(there[0]) else ""
        raise InputError(
            f"{path}: no column {', '.join(missing)}; there are {', '.join(there) or 'none'}.{hint} A reference has "
            f"rcs_dbsm, and {', '.join(WANTED)} and polarization where the run has several."
        )
