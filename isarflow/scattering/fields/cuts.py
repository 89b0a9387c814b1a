"""Cuts through a store: its radar cross-section (RCS) over one axis, between the samples too where they hold it."""

import itertools
from collections import namedtuple

import numpy as np

from isarflow.core.sweep import closes_circle, evenly, unit_vectors
from isarflow.scattering.fields.rcs import by_direction, center_frequency, rcs_dbsm, series

# What a cut is drawn against, as its axis says.
LABELS = {"azimuth": "azimuth [°]", "elevation": "elevation [°]", "frequency": "frequency [GHz]"}
ALONG = "angle along the directions [°]"
SINGLE = "elevation, azimuth [°]"

# Of one polarization: samples with their levels in dBsm and, over x, the levels y drawn; smooth: of the field between.
Curve = namedtuple("Curve", "polarization label samples levels x y smooth")


def in_words(axis, value):
    """Return a value on an axis as words: '1.5 GHz' of 'frequency' in Hz, 'azimuth 30°' of an angle in degrees."""
    return f"{value / 1e9:.4g} GHz" if axis == "frequency" else f"{axis} {value:g}°"


def by_transmitter(target, dataset, most):
    """Return (title, store) of a store; of a bistatic one, stores over the receivers of up to `most` transmitters."""
    if "receiver" not in dataset.sizes:
        return [(target, dataset)]
    field, parts = by_direction(dataset), []
    for number in evenly(range(field.sizes["direction"]), most):
        received = field.isel(direction=number)
        title = f"{target}_from_{float(received.elevation):g}_{float(received.azimuth):g}"
        received = received.drop_vars(["direction", "elevation", "azimuth"], errors="ignore").rename(
            receiver="direction", receiver_elevation="elevation", receiver_azimuth="azimuth"
        )
        parts.append((title, received.to_dataset(name="field").assign_attrs(kind="bistatic")))
    return parts


def cut(dataset, reach, most):
    """Return what a store's cut is drawn against, that axis's label, the field at the samples and the curves.

    Against azimuth, else elevation or single directions, else frequency: for up to `most` values of the other angle at
    the middle frequency, else of the frequency. reach: the target's in m, by which curves over azimuth are
    interpolated; None if it is not known.
    """
    field, sizes = dataset.field, dataset.sizes
    angles = ["direction"] if "direction" in sizes else ["azimuth", "elevation"]
    if "elevation" in sizes and 1 < sizes["elevation"] > sizes["azimuth"] <= most:
        angles.reverse()
    across = angles[0] if sizes[angles[0]] > 1 or sizes["frequency"] == 1 else "frequency"
    curve_axis = next((name for name in (*angles[1:], "frequency") if name != across and sizes[name] > 1), None)
    if curve_axis:
        field = field.sel({curve_axis: evenly(field[curve_axis].values.tolist(), most)})
    if "frequency" not in (across, curve_axis):
        field = field.sel(frequency=center_frequency(dataset))
    x, label = _axis(dataset, across)
    values, curves = field[curve_axis].values if curve_axis else [None], []
    for polarization, value in itertools.product(dataset.polarization.values.tolist(), values):
        line = field.sel({"polarization": polarization} | ({curve_axis: value} if curve_axis else {}))
        line = line.squeeze([name for name in line.dims if name != across])
        levels = rcs_dbsm(line.values.ravel())
        drawn = series(line, reach) if across == "azimuth" else None
        smooth = drawn is not None
        if not smooth:
            closed = label != SINGLE and closes_circle(x)
            drawn = (np.append(x, x[0] + 360), np.append(levels, levels[0])) if closed else (x, levels)
        curves.append(Curve(polarization, in_words(curve_axis, value) if curve_axis else "", x, levels, *drawn, smooth))
    return across, label, field, curves


def _axis(dataset, across):
    """Return values and label of what a cut is drawn against; single directions are numbered from 1."""
    if across != "direction":
        return dataset[across].values / (1e9 if across == "frequency" else 1), LABELS[across]
    u, *_ = unit_vectors(dataset.elevation.values, dataset.azimuth.values)
    steps = np.degrees(np.arccos(np.clip(np.sum(u[1:] * u[:-1], axis=1), -1, 1)))
    even = len(steps) > 1 and np.ptp(steps) < 1e-3 and 0 < steps[0] < 90
    return (steps[0] * np.arange(len(u)), ALONG) if even else (np.arange(1, len(u) + 1), SINGLE)
