"""Read a user's CSV of RCS, named by `targets.<target>.reference`. Light to import."""

import contextlib
import csv
import math
from pathlib import Path

from isarflow.core.errors import InputError
from isarflow.core.text import number
from isarflow.scattering.fields.places import check_elevations

LEVEL = "rcs_dbsm"
WANTED = {"frequency_hz": "frequency", "elevation_deg": "elevation", "azimuth_deg": "azimuth"}
WITHOUT = ("", "-inf", "-infinity", "na", "n/a", "nan", "-nan", "null", "none")  # a level that was not measured


def is_csv(reference):
    """True for one CSV file, False for FEKO's files."""
    return isinstance(reference, str) and Path(reference).suffix.lower() == ".csv"


def several(frequency, elevation, azimuth, polarization):
    """Names of the columns that a CSV needs for a run with these values: those in which the run has several."""
    values = zip((*WANTED, "polarization"), (frequency, elevation, azimuth, polarization), strict=True)
    return [name for name, column_values in values if len(set(column_values)) > 1]


def _rows(path):
    """Yield the line and the cells of a CSV file's rows, the header's first. Comments and rows of nothing are left out.

    Raises InputError for what is no text.
    """
    try:
        # Comments may be in any encoding; everything else that is read is ASCII.
        with open(path, encoding="utf-8-sig", errors="replace", newline="") as file:
            rows = csv.reader((line.partition("#")[0] for line in file), skipinitialspace=True)
            for row in rows:
                cells = [cell.strip() for cell in row]
                if any("\0" in cell for cell in cells):
                    raise csv.Error("it holds zero bytes; save it as plain text")
                if any(cells):
                    yield rows.line_num, cells
    except csv.Error as error:
        raise InputError(f"{path}: not a CSV file ({error}).") from None


def samples(path):
    """Yield the line and the values {column: value} of each row of a CSV whose columns are checked.

    Values are numbers, NaN for a level that is missing or of no field, and text in other columns. Raises InputError,
    with the line, for a row that has others.
    """
    rows = _rows(path)
    names, line = next(rows)[1], None
    for line, cells in rows:
        if any(cells[len(names) :]):
            commas = " Decimals are written with a point, not a comma." if len(cells) > len(names) else ""
            raise InputError(f"{path}, line {line}: {len(cells)} values, and {len(names)} columns are named.{commas}")
        row = dict(zip(names, cells + [""] * (len(names) - len(cells)), strict=False))
        for name in row.keys() & {LEVEL, *WANTED}:
            row[name] = _value(name, row[name], f"{path}, line {line}")
        yield line, row
    if line is None:
        raise InputError(f"{path}: there is no row below its header.")


def _value(name, word, where):
    """A cell as a number. InputError if it is none."""
    if name == LEVEL and word.lower() in WITHOUT:
        return math.nan
    try:
        value = number(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: '{word}' is not a finite number, for column {name}.")
    if name == "elevation_deg":
        check_elevations(where, [value])
    return value


def check_frequencies(path, frequency):
    """Raise InputError for a CSV whose `frequency_hz` has none between the first and the last of the run's (Hz)."""
    first, last = frequency[0] * (1 - 1e-6), frequency[-1] * (1 + 1e-6)
    rows, frequencies = _rows(path), []
    names = next(rows)[1]
    for _, cells in rows if "frequency_hz" in names else ():
        with contextlib.suppress(IndexError, ValueError):  # reported with its line when it is read
            frequencies.append(number(cells[names.index("frequency_hz")]))
        if frequencies and first <= frequencies[-1] <= last:
            return  # most often the first row: this is read before every run
    if frequencies:
        hint = " They look like GHz." if any(first <= 1e9 * value <= last for value in frequencies) else ""
        raise InputError(
            f"{path}: its frequency_hz, {min(frequencies):g} to {max(frequencies):g}, has none of the run's, "
            f"{frequency[0]:g} to {frequency[-1]:g} Hz.{hint}"
        )


def check_columns(path, needed):
    """Return the columns of a CSV. InputError for another file, and for one without rcs_dbsm and those `needed`."""
    _, columns = next(_rows(path), (1, []))
    missing = [name for name in (LEVEL, *needed) if name not in columns]
    if missing:
        hint = " Separate columns by commas." if len(columns) == 1 and {";", "\t"} & set(columns[0]) else ""
        raise InputError(
            f"{path}: no column {', '.join(missing)}; there are {', '.join(columns) or 'none'}.{hint} A reference has "
            f"rcs_dbsm, and {', '.join(WANTED)} and polarization where the run has several."
        )
    if twice := [name for name in (LEVEL, *WANTED, "polarization") if columns.count(name) > 1]:
        raise InputError(f"{path}: there is more than one column {', '.join(twice)}; leave one.")
    return columns
