"""Read backscatter from FEKO's far-field files (.ffe).

A file is a sequence of blocks, one for each frequency and incident plane wave: header lines `#Key: value`, one line
with the names of the columns, then a row for each requested direction of the far field. FEKO's time convention is
exp(+j omega t); a row is the far field E r exp(jkr) in volts, theta and phi in degrees, theta from the z axis. The
incident direction is the one the wave comes from, so backscatter is the row at the same theta and phi.
(Format: Altair Feko user guide, "Far Fields (.FFE)"; plane wave: "A0 card", polarization angle 0 = along -theta.)
"""

import re
from typing import NamedTuple

import numpy as np

from isarflow.core.errors import InputError

COLUMNS = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)", "RCS(Total)")
ANGLE = 1e-4  # degrees within which two directions are the same
STRENGTH = 1e-3  # relative, for the incident field that a row's E and RCS imply
AXES = {"Origin": (0, 0, 0), "U-Vector": (1, 0, 0), "V-Vector": (0, 1, 0)}


class Backscatter(NamedTuple):
    """The plane waves of a file, each array of shape (waves,). Amplitudes in m, for a unit incident wave."""

    frequency: np.ndarray  # Hz
    elevation: np.ndarray  # degrees above the horizon
    azimuth: np.ndarray  # degrees, 0 to 360
    received: dict  # {"V": along -theta, "H": along phi}
    line: np.ndarray  # line of each in the file


def read(path):
    """Read the backscatter of all plane waves in a .ffe file, in the file's order, as a `Backscatter`.

    RCS = 4 pi |E|^2 / |E0|^2 gives the incident field E0; amplitudes are divided by its magnitude. Its phase at the
    origin, which no file has, is taken as 0.
    Raises InputError, with the line, for anything but whole blocks of scattering from one plane wave each.
    """
    waves = []
    # Names of models may be in any encoding; everything else that is read is ASCII.
    with open(path, encoding="utf-8", errors="replace") as file:
        for block in _blocks(path, file):
            waves.append(_wave(path, *block))
    if not waves:
        raise InputError(f"{path}: there is no block of far fields in the file.")
    values = np.array(waves)
    frequency, theta, phi, rcs, line = values[:, [0, 1, 2, 7, 8]].T
    e_theta, e_phi = values[:, 3] + 1j * values[:, 4], values[:, 5] + 1j * values[:, 6]
    strength = _incident_field(path, np.hypot(np.abs(e_theta), np.abs(e_phi)), rcs, line.astype(int))
    return Backscatter(
        frequency,
        np.round(90 - theta, 6),
        np.round(phi, 6) % 360,
        {"V": -e_theta / strength, "H": e_phi / strength},
        line.astype(int),
    )


def _blocks(path, file):
    """(line, header, columns, rows) of each block; header {key: (line, value)}, rows [(line, text)]."""
    header, columns, rows, typed = {}, None, [], False
    for number, line in enumerate(file, 1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not typed and not text.startswith("##"):
            raise InputError(f"{path}, line {number}: not a FEKO far-field file; '##File Type: Far Field' comes first.")
        if not text.startswith("#"):
            rows.append((number, text))
            continue
        if rows:
            yield _first(header, rows), header, columns, rows
            header, columns, rows = {}, None, []
        key, _, value = (part.strip() for part in text.lstrip("#").partition(":"))
        if text.startswith("##"):
            if key == "File Type":
                typed = True
                if value.lower() != "far field":
                    raise InputError(f"{path}, line {number}: a file of type '{value}'; 'Far Field' is wanted.")
        elif key.startswith('"'):
            columns = re.findall(r'"([^"]*)"', text)
        elif key in header:
            raise InputError(f"{path}, line {header[key][0]}: this block has no rows; the file is cut short.")
        else:
            header[key] = (number, value)
    if header or rows:
        yield _first(header, rows), header, columns, rows


def _first(header, rows):
    return min(line for line, _ in [*header.values(), *rows])


def _wave(path, line, header, columns, rows):
    """Frequency, theta, phi, the real and imaginary parts of E along theta and phi, RCS and line of a block."""
    _check_kind(path, line, header)
    (frequency,) = _header(path, line, header, "Frequency", 1)
    counts = [_header(path, line, header, f"No. of {name} Samples", 1)[0] for name in ("Theta", "Phi")]
    theta, phi = _header(path, line, header, "Incident Wave Direction", 2)
    if not 0 <= theta <= 180:
        raise InputError(
            f"{path}, line {header['Incident Wave Direction'][0]}: theta {theta:g} is not within 0 to 180."
        )
    missing = [name for name in COLUMNS if name not in (columns or ())]
    if missing:
        raise InputError(f"{path}, line {line}: the block has no column {', '.join(missing)}.")
    if len(rows) != counts[0] * counts[1]:
        raise InputError(
            f"{path}, line {line}: the block has {len(rows)} rows, not {counts[0]:g} x {counts[1]:g}; "
            "the file is cut short or was changed."
        )
    places = [columns.index(name) for name in COLUMNS]
    found = []
    for number, text in rows:
        numbers = _floats(text.split())
        if len(numbers) != len(columns):
            raise InputError(f"{path}, line {number}: a row of {len(columns)} numbers is wanted, not '{text}'.")
        values = [numbers[place] for place in places]
        if abs(values[0] - theta) < ANGLE and abs((values[1] - phi + 180) % 360 - 180) < ANGLE:
            found.append((number, values))
    if len(found) != 1:
        raise InputError(
            f"{path}, line {line}: {len(found) or 'no'} rows look back along the incident wave (theta {theta:g}, "
            f"phi {phi:g}); one is wanted. Ask FEKO for the fields in the plane wave's incident direction."
        )
    ((number, values),) = found
    if not np.isfinite([frequency, *values]).all():
        raise InputError(f"{path}, line {number}: a value is not finite.")
    return frequency, theta, phi, *values[2:], number


def _check_kind(path, line, header):
    number, kind = header.get("Result Type", (line, "RCS"))
    if kind != "RCS":
        raise InputError(f"{path}, line {number}: the result is '{kind}', not RCS: no scattering of a plane wave.")
    number, system = header.get("Coordinate System", (line, "Spherical"))
    if system != "Spherical":
        raise InputError(f"{path}, line {number}: coordinates are '{system}'; 'Spherical' are wanted.")
    for key, wanted in AXES.items():
        if key in header:
            given = np.array(_header(path, line, header, key, 3))
            # An axis may be of any length.
            if not np.allclose(given, np.array(wanted) * max(np.linalg.norm(given), 1e-9), atol=1e-9):
                raise InputError(
                    f"{path}, line {header[key][0]}: '{key}' is {header[key][1]}; angles and phases are wanted in the "
                    f"global coordinates, {wanted}."
                )


def _header(path, line, header, key, count):
    """The numbers of a header line, which may be in brackets."""
    if key not in header:
        raise InputError(f"{path}, line {line}: the block does not say '{key}'; the file is cut short or not of RCS.")
    number, text = header[key]
    numbers = _floats(text.strip("()").replace(",", " ").split())
    if len(numbers) != count:
        raise InputError(f"{path}, line {number}: '{key}' should be {count} number(s), not '{text}'.")
    return numbers


def _floats(words):
    """The words as numbers; an empty list if one of them is not a number."""
    try:
        return [float(word) for word in words]
    except ValueError:
        return []


def _incident_field(path, magnitude, rcs, line):
    """Magnitude of the incident field in V/m that all waves of a file have, from |E| (V) and RCS (m^2)."""
    if ((magnitude == 0) != (rcs == 0)).any() or (rcs < 0).any():
        wrong = int(np.flatnonzero(((magnitude == 0) != (rcs == 0)) | (rcs < 0))[0])
        raise InputError(
            f"{path}, line {line[wrong]}: RCS {rcs[wrong]:g} does not belong to |E| = {magnitude[wrong]:g}."
        )
    seen = np.flatnonzero(rcs)
    if not len(seen):
        return 1.0
    strength = np.sqrt(4 * np.pi / rcs[seen]) * magnitude[seen]
    common = float(np.median(strength))
    off = np.abs(strength / common - 1)
    if off.max() > STRENGTH:
        wrong = seen[off.argmax()]
        raise InputError(
            f"{path}, line {line[wrong]}: E and RCS imply an incident field of {strength[off.argmax()]:g} V/m, "
            f"the rest of the file {common:g} V/m; one of the numbers is wrong."
        )
    return 1.0 if abs(common - 1) < STRENGTH else common
