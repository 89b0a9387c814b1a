"""Places of samples along a field's axes: those that a run wants, and those that are the same and count as one."""

import numpy as np

from isarflow.core.errors import InputError

ANGLE = 1e-4  # degrees within which two directions are the same
# Largest distance of a sample from the place that the sweep asks for. Nothing is interpolated.
TOLERANCES = {"frequency": 1e-6, "elevation": ANGLE, "azimuth": ANGLE}  # relative, degrees, degrees
UNITS = {"frequency": "Hz", "elevation": "degrees", "azimuth": "degrees"}
OTHERS = {"Hz": {"GHz": 1e9, "MHz": 1e6}, "degrees": {"radians": 180 / np.pi}}  # units that files are often in
KEYS = {"frequency": "radar", "elevation": "aspect.elevation", "azimuth": "aspect.azimuth"}
SAME = 1e-4  # relative: samples of one place that agree so well count as one, as at both ends of a closed circle


class AbsentError(InputError):
    """A wanted place is not given."""


def apart(name, values, reference):
    """Distances of values of an axis in the terms of its tolerance: relative to the second, or degrees."""
    if name == "frequency":
        return np.abs(values - reference) / reference
    return np.abs((values - reference + 180) % 360 - 180) if name == "azimuth" else np.abs(values - reference)


def find(where, name, given, wanted):
    """Number the places of an axis: of the given values, -1 for one that is not wanted, and of the wanted ones.

    Values of one place have one number, of the first wanted one there. Raises AbsentError if a wanted one is not given.
    """
    check_elevations(where, given if name == "elevation" else ())
    near = apart(name, given, wanted[:, None]) < TOLERANCES[name]
    missing = wanted[~near.any(axis=1)]
    if len(missing):
        units = (unit for unit, scale in OTHERS[UNITS[name]].items() if all_there(name, scale * given, wanted))
        raise AbsentError(
            f"{where}: no {name} {text(name, *missing)}, which config key '{KEYS[name]}' asks for; there is "
            f"{text(name, *given)}.{''.join(f' They look like {unit}.' for unit in units)}"
        )
    of_given = np.where(near.any(axis=0), near.argmax(axis=0), -1)
    return of_given, of_given[near.argmax(axis=1)]


def all_there(name, given, wanted):
    """Tell whether all wanted values of an axis are among the given ones."""
    return (apart(name, given, wanted[:, None]) < TOLERANCES[name]).any(axis=1).all()


def alike(name, values):
    """Number the places of an axis from 0: values (N,) that follow each other within its tolerance have one number."""
    values = values % 360 if name == "azimuth" else values
    order = np.argsort(values, kind="stable")
    ascending = values[order]
    steps = apart(name, ascending[:-1], ascending[1:]) >= TOLERANCES[name]
    numbers = np.empty(len(values), int)
    numbers[order] = np.append(0, np.cumsum(steps))[: len(values)]
    if len(values) and name == "azimuth" and apart(name, ascending[0], ascending[-1]) < TOLERANCES[name]:
        numbers[numbers == numbers.max()] = 0  # just below 360 degrees and 0
    return numbers


def once(numbers, amplitudes, where, what, hint=""):
    """Positions of the first sample of each place, in order.

    numbers: whole ones (N,) for each axis, that say each sample's place; amplitudes: (N, K); where: the function of a
    sample's position that says its file and line; what: the noun for a sample. Raises InputError with both if another
    sample of a place differs from its first.
    """
    _, first, group = np.unique(np.stack(numbers, axis=-1), axis=0, return_index=True, return_inverse=True)
    different = np.flatnonzero(differ(amplitudes, amplitudes[first[group]]))
    if len(different):
        earlier, later = first[group[different[0]]], different[0]
        raise InputError(f"{where(later)}: another {what} for the frequency and direction of {where(earlier)}.{hint}")
    return np.sort(first)


def differ(amplitudes, references):
    """Tell of which places, all axes but the last, amplitudes are not the same; NaN is the same as NaN."""
    size, gap = (np.linalg.norm(difference, axis=-1) for difference in (references, amplitudes - references))
    return ~(gap <= SAME * size) & ~(np.isnan(amplitudes).any(axis=-1) & np.isnan(references).any(axis=-1))


def check_elevations(where, elevation):
    """Raise InputError for elevations (degrees) that no direction has."""
    beyond = [value for value in elevation if abs(value) > 90 + ANGLE]
    if beyond:
        raise InputError(
            f"{where}: elevation {text('elevation', *beyond)} is beyond -90 to 90 degrees. If this is theta, the angle "
            "from the z axis, the elevation is 90 degrees less theta."
        )


def text(name, *values):
    """Values of a coordinate with their unit, at most six of them."""
    shown = [f"{value:.9g}" for value in values]
    if len(shown) > 6:
        shown = [*shown[:3], f"... ({len(shown)} in all)", *shown[-2:]]
    return f"{', '.join(shown)} {UNITS[name]}"
