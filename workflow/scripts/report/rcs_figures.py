"""Radar cross-section (RCS) as figures: cuts, maps, frequency sweeps and how it is distributed."""

import itertools
from collections import namedtuple

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from isarflow.core.sweep import closes_circle, unit_vectors
from isarflow.report.layout import BLUE, PALETTE, canvas, circle_ticks, figure
from isarflow.report.plots import draw_legend, panels
from isarflow.report.selection import evenly
from isarflow.scattering.interpolation import between, is_dense, order, order_told

ACROSS = 4  # polar plots side by side
FLOOR = 50  # dB below the largest: deep nulls would flatten the rest
NAMED = 16  # single directions that an axis names
POINTS = 4  # drawn for each of the samples that a curve's bandwidth asks for
LABELS = {"azimuth": "azimuth [°]", "elevation": "elevation [°]", "frequency": "frequency [GHz]"}
ALONG, SINGLE = "angle along the directions [°]", "elevation, azimuth [°]"
LINES = "Points are the samples, joined by straight lines."
HOW = {  # is a cut read, by the label of its axis
    LABELS[
        "azimuth"
    ]: "Curves without points are the field's own band-limited series. Points are samples too far apart "
    "to hold the field between them, joined by straight lines.",
    ALONG: f"{LINES} 0° is the first direction.",
    SINGLE: f"A triangle is a direction more than {FLOOR} dB below the largest.",
}

# A cut of one polarization: its samples with their levels in dBsm and, over x, the levels y that are drawn; `smooth` if
# these are of the interpolated field, not lines between samples.
Curve = namedtuple("Curve", "polarization label samples levels x y smooth")


def rcs_dbsm(field):
    """Return the RCS in dBsm of scattering amplitudes in m; -200 dBsm where there is no field at all."""
    return 10 * np.log10(np.maximum(4 * np.pi * np.abs(field) ** 2, 1e-20))


def in_words(axis, value):
    """Return a value on an axis as words: '1.5 GHz' of 'frequency' in Hz, 'azimuth 30°' of an angle in degrees."""
    return f"{value / 1e9:.4g} GHz" if axis == "frequency" else f"{axis} {value:g}°"


def lowest(levels):
    """Return the least level in dBsm that an axis shows."""
    return max(levels.min(), levels.max() - FLOOR)


def center_frequency(dataset):
    """Return the frequency sample in Hz nearest to the middle of the sweep."""
    frequency = dataset.frequency.values
    return float(frequency[np.argmin(np.abs(frequency - (frequency[0] + frequency[-1]) / 2))])


def by_direction(dataset):
    """Return a store's field over one dimension, `direction`; of a grid, one elevation after another."""
    return dataset.field if "direction" in dataset.sizes else dataset.field.stack(direction=["elevation", "azimuth"])


def by_transmitter(target, dataset, most):
    """Return (title, store) of a store; of a bistatic one, stores over the receivers of up to `most` transmitters."""
    if "receiver" not in dataset.sizes:
        return [(target, dataset)]
    field, parts = by_direction(dataset), []
    for number in evenly(range(field.sizes["direction"]), most):
        one = field.isel(direction=number)
        title = f"{target}_from_{float(one.elevation):g}_{float(one.azimuth):g}"
        one = one.drop_vars(["direction", "elevation", "azimuth"], errors="ignore").rename(
            receiver="direction", receiver_elevation="elevation", receiver_azimuth="azimuth"
        )
        parts.append((title, one.to_dataset(name="field").assign_attrs(kind="bistatic")))
    return parts


def cut(dataset, reach, most):
    """Return what a store's cut is drawn against, that axis's label, the field at the samples and the curves.

    Against azimuth, else against elevation or along single directions: at the middle frequency at up to `most` values
    of the other angle; at up to `most` frequencies where that has one. Against frequency where there is one direction.
    reach: the target's from the origin in m, by which curves over azimuth are interpolated; None if it is not known.
    """
    field, sizes = dataset.field, dataset.sizes
    angles = ["direction"] if "direction" in sizes else ["azimuth", "elevation"]
    if "elevation" in sizes and 1 < sizes["elevation"] > sizes["azimuth"] <= most:
        angles.reverse()
    across = angles[0] if sizes[angles[0]] > 1 or sizes["frequency"] == 1 else "frequency"
    other = next((name for name in (*angles[1:], "frequency") if name != across and sizes[name] > 1), None)
    if other:
        field = field.sel({other: evenly(field[other].values.tolist(), most)})
    if "frequency" not in (across, other):
        field = field.sel(frequency=center_frequency(dataset))
    x, label = _axis(dataset, across)
    values, curves = field[other].values if other else [None], []
    for polarization, value in itertools.product(dataset.polarization.values.tolist(), values):
        one = field.sel({"polarization": polarization} | ({other: value} if other else {})).squeeze()
        levels = rcs_dbsm(one.values.ravel())
        drawn = _series(x, one, reach) if across == "azimuth" else None
        smooth = drawn is not None
        if not smooth:
            closed = label != SINGLE and closes_circle(x)
            drawn = (np.append(x, x[0] + 360), np.append(levels, levels[0])) if closed else (x, levels)
        curves.append(Curve(polarization, in_words(other, value) if other else "", x, levels, *drawn, smooth))
    return across, label, field, curves


def _series(azimuth, field, reach):
    """Return azimuths in degrees and levels in dBsm of the series through samples; None where they do not hold it."""
    samples, closed = field.values.ravel(), closes_circle(azimuth)
    if reach is None:
        highest = order_told(samples) if closed else None
    elif not is_dense(azimuth, highest := order(float(field.frequency), reach, float(field.elevation))):
        highest = None
    if highest is None:
        return None
    span = 360.0 if closed else azimuth[-1] - azimuth[0]
    x = np.linspace(azimuth[0], azimuth[0] + span, int(POINTS * (2 * highest + 1) * span / 360) + 2)
    return x, rcs_dbsm(between(azimuth, samples, highest, x))


def _axis(dataset, across):
    """Return values and label of what a cut is drawn against; single directions are numbered from 1."""
    if across != "direction":
        return dataset[across].values / (1e9 if across == "frequency" else 1), LABELS[across]
    u, *_ = unit_vectors(dataset.elevation.values, dataset.azimuth.values)
    steps = np.degrees(np.arccos(np.clip(np.sum(u[1:] * u[:-1], axis=1), -1, 1)))
    even = len(steps) > 1 and np.ptp(steps) < 1e-3 and 0 < steps[0] < 90
    return (steps[0] * np.arange(len(u)), ALONG) if even else (np.arange(1, len(u) + 1), SINGLE)


def cut_figure(target, dataset, reach, most):
    """Draw RCS over one axis, a panel for each polarization; no single direction is left out of it."""
    across, label, field, curves = cut(dataset, reach, most)
    samples, single = curves[0].samples, label == SINGLE
    drawing, every = level_panels(dataset.polarization.values, label, 0.8)
    for axes, polarization in zip(every, dataset.polarization.values, strict=True):
        mine = [curve for curve in curves if curve.polarization == polarization]
        least = lowest(np.array([curve.levels for curve in mine]))
        _draw(axes, mine, _colors(len(mine)), least - 1 if single else None)
        axes.margins(x=0.05 if single else 0.01)
        axes.set_ylim(least - 2, max(curve.y.max() for curve in mine) + 2)
        if across == "azimuth":
            circle_ticks(axes.xaxis, samples)
    if single:
        named = dataset.isel(direction=evenly(samples - 1, NAMED))
        places = zip(named.elevation.values, named.azimuth.values, strict=True)
        names = [f"{elevation:g}, {azimuth:g}" for elevation, azimuth in places]
        every[-1].set_xticks(evenly(samples, NAMED), names, rotation=45, ha="right", rotation_mode="anchor")
    draw_legend(drawing, every)
    return _figure(f"rcs_{target}", drawing, target, dataset, across, label, field)


def polar_figure(target, dataset, reach, most, name="rcs_polar"):
    """Draw the same cut in polar coordinates, a panel for each curve; None where it does not go most of the way."""
    across, label, field, curves = cut(dataset, reach, most)
    if label not in (LABELS["azimuth"], ALONG) or np.ptp(curves[0].x) < 180:
        return None
    curves = [curve._replace(x=np.radians(curve.x), samples=np.radians(curve.samples)) for curve in curves]
    least, largest = min(curve.y.min() for curve in curves), max(curve.levels.max() for curve in curves)
    titles = list(dict.fromkeys(curve.label for curve in curves))
    columns = min(len(titles), ACROSS)
    rows = -(-len(titles) // columns)
    drawing = canvas(max(2.7 * columns, 4.2), 0.5 + (2.9 if len(titles) > 1 else 3.9) * rows)
    for place, title in enumerate(titles):
        axes = drawing.add_subplot(rows, columns, place + 1, projection="polar")
        _draw(axes, [one._replace(label=f"{one.polarization} [dBsm]") for one in curves if one.label == title], PALETTE)
        axes.set(title=title.replace("-", "\N{MINUS SIGN}"), xticks=np.radians(np.arange(0, 360, 45)))
        axes.set_ylim(max(least - 2, largest - FLOOR), largest + 1)
        axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        axes.set_rlabel_position(67.5)
        axes.tick_params(labelsize=7, pad=0)
    draw_legend(drawing, drawing.axes)
    return _figure(f"{name}_{target}", drawing, target, dataset, across, label, field, wide=columns > 2)


def _figure(name, drawing, target, dataset, across, label, field, wide=False):
    """Return the figure of a drawn cut."""
    single = [axis for axis in ("frequency", "elevation", "azimuth") if axis != across and field[axis].size == 1]
    at = f" at {', '.join(in_words(axis, field[axis].item()) for axis in single)}" if single else ""
    caption = f"{target}: {dataset.attrs.get('kind', 'backscatter')} RCS{at}. {HOW.get(label, LINES)}"
    return figure(name, drawing, _table(target, field), f"RCS of {target} against {across}{at}.", caption, wide)


def map_figure(target, dataset):
    """Draw RCS over elevation and azimuth at the middle frequency; None without a grid of them."""
    if "direction" in dataset.sizes or min(dataset.sizes["elevation"], dataset.sizes["azimuth"]) < 3:
        return None
    field = dataset.field.sel(frequency=center_frequency(dataset))
    polarizations, level = dataset.polarization.values, rcs_dbsm(field.values)
    drawing, grid = panels(len(polarizations), 1, 5.4, 0.6 + 2.0 * len(polarizations))
    look = {"cmap": "viridis", "vmin": level.max() - FLOOR, "vmax": level.max(), "shading": "nearest"}
    for axes, polarization, part in zip(grid[:, 0], polarizations, level, strict=True):
        picture = axes.pcolormesh(dataset.azimuth, dataset.elevation, part, rasterized=True, **look)
        axes.grid(False)
        axes.set(ylabel="elevation [°]", title=polarization)
        circle_ticks(axes.xaxis, dataset.azimuth.values)
    grid[-1, 0].set_xlabel("azimuth [°]")
    drawing.colorbar(picture, ax=grid, label="RCS [dBsm]", pad=0.02)
    words = f"over elevation and azimuth at {in_words('frequency', center_frequency(dataset))}."
    name, data = f"rcs_map_{target}", _table(target, field)
    return figure(name, drawing, data, f"RCS of {target} {words}", f"{target}: RCS {words}")


def frequency_figure(target, dataset, most):
    """Draw RCS over frequency at up to `most` directions, and the median of all; None for one frequency."""
    if dataset.sizes["frequency"] < 2:
        return None
    field, polarizations = by_direction(dataset), dataset.polarization.values
    picked = field.isel(direction=evenly(range(field.sizes["direction"]), most))
    places = zip(picked.elevation.values, picked.azimuth.values, strict=True)
    names = [f"({elevation:g}°, {azimuth:g}°)" for elevation, azimuth in places]
    frequency, level = dataset.frequency.values, rcs_dbsm(picked.values)
    drawing, every = level_panels(polarizations, LABELS["frequency"])
    for axes, part, whole in zip(every, level, rcs_dbsm(field.values), strict=True):
        for name, values, color in zip(names, part.T, _colors(len(names)), strict=True):
            axes.plot(frequency / 1e9, values, color=color, marker="o", label=name)
        if len(names) > 1:
            look = {"color": "black", "ls": "--", "label": "median of all directions"}
            axes.plot(frequency / 1e9, np.median(whole, axis=1), **look)
        axes.set_ylim(lowest(part) - 2, part.max() + 2)
    draw_legend(drawing, every)
    columns = {"target": [target], "polarization": polarizations, "frequency": frequency, "direction": names}
    frame = pd.MultiIndex.from_product(columns.values(), names=columns).to_frame(index=False)
    frame["rcs_dbsm"] = level.ravel()
    caption = f"{target}: RCS against frequency at directions (elevation, azimuth); samples, joined by lines."
    return figure(f"rcs_frequency_{target}", drawing, frame, f"RCS of {target} against frequency.", caption)


def distribution_figure(target, dataset):
    """Draw the share of all frequencies and directions with less than an RCS; None for fewer than ten of them."""
    polarizations = dataset.polarization.values
    level = np.sort(rcs_dbsm(dataset.field.values).reshape(len(polarizations), -1))
    if level.shape[1] < 10:
        return None
    drawing, ((axes,),) = panels(1, 1, 5.4, 2.6)
    frame = pd.DataFrame({"target": target, "percent": np.linspace(0, 100, 101)})
    for polarization, part, color in zip(polarizations, level, _colors(len(polarizations)), strict=True):
        axes.plot(part, np.linspace(0, 100, len(part)), color=color, label=polarization)
        frame[f"{polarization}_dbsm"] = np.percentile(part, frame["percent"])
    axes.set(xlabel="RCS [dBsm]", ylabel="share below [%]", xlim=(lowest(level), level.max() + 1))
    draw_legend(drawing, [axes])
    caption = f"{target}: the share of all samples below an RCS."
    return figure(f"rcs_distribution_{target}", drawing, frame, f"The distribution of {target}'s RCS.", caption)


def level_panels(polarizations, xlabel, head=0.9):
    """Return a canvas and its axes, one for each polarization with its RCS upwards. head: inches above them."""
    drawing, grid = panels(len(polarizations), 1, 5.4, head + 2.1 * len(polarizations), sharey=False)
    for axes, polarization in zip(grid[:, 0], polarizations, strict=True):
        axes.set_ylabel(f"{polarization} RCS [dBsm]")
    grid[-1, 0].set_xlabel(xlabel)
    return drawing, grid[:, 0]


def _draw(axes, curves, colors, floor=None):
    """Draw curves, with the samples of those that are no series; with `floor` samples alone, triangles where lower."""
    for curve, color in zip(curves, itertools.cycle(colors), strict=False):
        few = floor is not None or len(curve.samples) < 3
        look = {"marker": "o", "ls": "-" if floor is None else ""} if few else {}
        axes.plot(curve.x, curve.y, color=color, label=curve.label or None, **look)
        if floor is not None:
            low = curve.samples[curve.levels < floor + 1]
            axes.plot(low, np.full(len(low), floor), "v", color=color, mfc="none")
        elif not (curve.smooth or few):
            axes.plot(curve.samples, curve.levels, ".", color=color, ms=2.5)


def _colors(count):
    """Return as many colours, of neither end of the map: both looks of the page have to show them."""
    return matplotlib.colormaps["viridis"](np.linspace(0.3, 0.8, count)) if count > 1 else [BLUE]


def _table(target, field):
    """Return a row for each sample of a field in m, its RCS in dBsm last."""
    frame = field.to_dataframe().reset_index()
    frame["rcs_dbsm"] = rcs_dbsm(frame.pop("field").to_numpy())
    frame.insert(0, "target", target)
    return frame
