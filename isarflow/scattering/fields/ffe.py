"""Read backscatter from FEKO's far-field files (.ffe).

A file is a sequence of blocks, one for each frequency and incident plane wave: header lines `#Key: value`, one line
with the names of the columns, then a row for each requested direction of the far field. FEKO's time convention is
exp(+j omega t); a row is the far field E r exp(jkr) in volts, theta and phi in degrees, theta from the z axis. The
incident direction is the one the wave comes from, so backscatter is the row at the same theta and phi.
(Format: Altair Feko user guide, "Far Fields (.FFE)"; plane wave: "A0 card", polarization angle 0 = along -theta.)
"""

import re

import numpy as np
import pandas as pd

from isarflow.core.errors import InputError
from isarflow.core.text import number
from isarflow.scattering.fields import places

COLUMNS = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)", "RCS(Total)")
STRENGTH = 1e-3  # relative, for the incident field that a row's E and RCS imply
AXES = {"Origin": (0, 0, 0), "U-Vector": (1, 0, 0), "V-Vector": (0, 1, 0)}
WAVES = " If these are two incident polarizations, write them to separate files and name them {V: ..., H: ...}."


class _Wrong(Exception):
    """The number of a line, a colon, and what is wrong there."""


def read(paths):
    """Read the backscatter of all plane waves in .ffe files, as a table in the files' order.

    Columns: frequency in Hz, elevation and azimuth (0 to 360) in degrees, V (along -theta) and H (along phi), complex
    amplitudes in m for a unit incident wave, and path and line, the place of each.
    RCS = 4 pi |E|^2 / |E0|^2 gives the incident field E0; amplitudes are divided by its magnitude. Its phase at the
    origin, which no file has, is taken as 0.
    Raises InputError, with the line, for anything but whole blocks of scattering from one plane wave each.
    """
    return pd.concat([_read(path) for path in paths], ignore_index=True)


def once(waves, numbers):
    """The first of the waves of `read` at each frequency and direction. InputError if another one there differs.

    numbers: of each wave's frequency, elevation and azimuth, equal ones where these are the same.
    """
    path, line = waves["path"].to_list(), waves["line"].to_list()
    amplitudes = waves[["V", "H"]].to_numpy()
    return waves.iloc[places.once(numbers, amplitudes, lambda i: f"{path[i]}, line {line[i]}", "field", WAVES)]


def _read(path):
    try:
        # Names of models may be in any encoding; everything else that is read is ASCII.
        with open(path, encoding="utf-8-sig", errors="replace") as file:
            waves = [wave for block in _blocks(file) for wave in block.waves()]
        if not waves:
            raise InputError(f"{path}: there is no block of far fields in the file.")
        frequency, theta, phi, *parts, rcs, line = np.array(waves).T
        line, e_theta, e_phi = line.astype(int), parts[0] + 1j * parts[1], parts[2] + 1j * parts[3]
        strength = _incident_field(np.hypot(np.abs(e_theta), np.abs(e_phi)), rcs, line)
    except _Wrong as wrong:
        raise InputError(f"{path}, line {wrong}") from None
    where = {"frequency": frequency, "elevation": np.round(90 - theta, 6), "azimuth": np.round(phi, 6) % 360}
    return pd.DataFrame(where | {"V": -e_theta / strength, "H": e_phi / strength, "path": path, "line": line})


def _blocks(file):
    """The `_Block`s of a file's lines."""
    block, typed = _Block(), False
    for place, line in enumerate(file, 1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not typed and not text.startswith("##"):
            raise _Wrong(f"{place}: not a FEKO far-field file; '##File Type: Far Field' comes first.")
        if not text.startswith("#"):
            block.rows.append((place, text))
            continue
        if block.rows:
            yield block
            block = _Block()
        key, _, value = (part.strip() for part in text.lstrip("#").partition(":"))
        if text.startswith("##"):
            if key == "File Type":
                typed = True
                if value.lower() != "far field":
                    raise _Wrong(f"{place}: a file of type '{value}'; 'Far Field' is wanted.")
        elif key.startswith('"'):
            block.columns = re.findall(r'"([^"]*)"', text)
        elif key in block.header:
            raise _Wrong(f"{block.header[key][0]}: this block has no rows; the file is cut short.")
        else:
            block.header[key] = (place, value)
    if block.header or block.rows:
        yield block


class _Block:
    """One frequency and plane wave: header {key: (line, value)}, names of the columns, and rows [(line, text)]."""

    def __init__(self):
        self.header, self.columns, self.rows = {}, [], []

    @property
    def line(self):
        return [*self.header.values(), *self.rows][0][0]

    def waves(self):
        """Frequency, theta, phi, the real and imaginary parts of E along theta and phi, RCS and line, of each row.

        The rows are those that look back along the incident wave: more than one where phi goes from 0 to 360.
        """
        self._check_kind()
        (frequency,) = self._numbers("Frequency", 1)
        counts = [self._numbers(f"No. of {name} Samples", 1)[0] for name in ("Theta", "Phi")]
        theta, phi = self._numbers("Incident Wave Direction", 2)
        if not 0 <= theta <= 180:
            raise _Wrong(
                f"{self.header['Incident Wave Direction'][0]}: theta {theta:g} is not within 0 to 180 degrees, and "
                f"elevation {90 - theta:g} is beyond -90 to 90."
            )
        missing = [name for name in COLUMNS if name not in self.columns]
        if missing:
            raise _Wrong(f"{self.line}: the block has no column {', '.join(missing)}.")
        if len(self.rows) != counts[0] * counts[1]:
            raise _Wrong(
                f"{self.line}: the block has {len(self.rows)} rows, not {counts[0]:g} x {counts[1]:g}; the file is cut "
                "short or was changed."
            )
        waves = []
        for line, text in self.rows:
            row = dict(zip(self.columns, _floats(text, len(self.columns)), strict=False))
            if not row:
                raise _Wrong(f"{line}: a row of {len(self.columns)} numbers is wanted, not '{text}'.")
            if abs(row["Theta"] - theta) < places.ANGLE and places.apart("azimuth", row["Phi"], phi) < places.ANGLE:
                waves.append((frequency, theta, phi, *(row[name] for name in COLUMNS[2:]), line))
        if not waves:
            raise _Wrong(
                f"{self.line}: no rows look back along the incident wave (theta {theta:g}, phi {phi:g}). Ask FEKO for "
                "the fields in the plane wave's incident direction."
            )
        for wave in waves:
            if not np.isfinite(wave).all():
                raise _Wrong(f"{wave[-1]}: a value is not finite.")
        return waves

    def _check_kind(self):
        kinds = {"Result Type": ("the result is", "RCS"), "Coordinate System": ("coordinates are", "Spherical")}
        for key, (said, wanted) in kinds.items():
            line, given = self.header.get(key, (self.line, wanted))
            if given != wanted:
                raise _Wrong(f"{line}: {said} '{given}', not {wanted}, as scattering of a plane wave has it.")
        for key in [key for key in AXES if key in self.header]:
            given = np.array(self._numbers(key, 3))
            # An axis may be of any length.
            if not np.allclose(given, np.array(AXES[key]) * max(np.linalg.norm(given), 1e-9), atol=1e-9):
                line, text = self.header[key]
                raise _Wrong(f"{line}: '{key}' is {text}; in global coordinates it is {AXES[key]}.")

    def _numbers(self, key, count):
        """The numbers of a header line, which may be in brackets."""
        if key not in self.header:
            raise _Wrong(f"{self.line}: the block does not say '{key}'; the file is cut short or not of RCS.")
        line, text = self.header[key]
        numbers = _floats(text.strip("()").replace(",", " "), count)
        if not numbers:
            raise _Wrong(f"{line}: '{key}' should be {count} number(s), not '{text}'.")
        return numbers


def _floats(text, count):
    """The words of a text as so many numbers; an empty list if they are not."""
    try:
        numbers = [number(word) for word in text.split()]
    except ValueError:
        return []
    return numbers if len(numbers) == count else []


def _incident_field(magnitude, rcs, line):
    """Magnitude of the incident field in V/m that all waves of a file have, from |E| (V) and RCS (m^2)."""
    wrong = ((magnitude == 0) != (rcs == 0)) | (rcs < 0)
    if wrong.any():
        first = wrong.argmax()
        raise _Wrong(f"{line[first]}: RCS {rcs[first]:g} does not belong to |E| = {magnitude[first]:g}.")
    seen = rcs > 0
    if not seen.any():
        return 1.0
    strength = np.sqrt(4 * np.pi / rcs[seen]) * magnitude[seen]
    common = float(np.median(strength))
    off = np.abs(strength / common - 1)
    if off.max() > STRENGTH:
        raise _Wrong(
            f"{line[seen][off.argmax()]}: E and RCS imply an incident field of {strength[off.argmax()]:g} V/m, the "
            f"rest of the file {common:g} V/m; one of the numbers is wrong."
        )
    return 1.0 if abs(common - 1) < STRENGTH else common
