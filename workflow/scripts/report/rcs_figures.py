"""Radar cross-section (RCS) as figures: cuts, maps, frequency sweeps and how it is distributed."""

import itertools
from dataclasses import dataclass, replace

import matplotlib
import matplotlib.ticker
import numpy as np
import pandas as pd

from isarflow.core.sweep import closes_circle, unit_vectors
from isarflow.report.layout import BLUE, PALETTE, canvas, circle_ticks, figure
from isarflow.report.plots import draw_legend, panels
from isarflow.report.selection import evenly
from isarflow.scattering.interpolation import between, is_dense, order, order_told

ACROSS, WIDE = 4, 6  # polar plots side by side; inches above which a figure takes the whole page
FLOOR = 50  # dB below the largest: deep nulls would flatten the rest
NAMED = 16  # single directions that an axis names each
POINTS = 4  # drawn for each of the samples that a curve's bandwidth asks for
LABELS = {"azimuth": "azimuth [°]", "elevation": "elevation [°]", "frequency": "frequency [GHz]"}
NONE = -199.9  # dBsm: no field at all
ALONG, NUMBER = "angle along the directions [°]", "number of the direction"


@dataclass(frozen=True)
class Curve:
    """A cut: its samples and what is drawn, `smooth` if it is the interpolated field and not lines between samples."""

    polarization: str
    label: str
    samples: np.ndarray
    levels: np.ndarray  # dBsm, of the samples
    x: np.ndarray
    y: np.ndarray  # dBsm
    smooth: bool


def rcs_dbsm(field):
    """Radar cross section in dBsm of scattering amplitudes in m; -200 dBsm where there is no field at all."""
    return 10 * np.log10(np.maximum(4 * np.pi * np.abs(field) ** 2, 1e-20))


def center_frequency(dataset):
    """The frequency sample in Hz nearest to the middle of the sweep."""
    frequency = dataset.frequency.values
    return float(frequency[np.argmin(np.abs(frequency - (frequency[0] + frequency[-1]) / 2))])


def by_transmitter(target, dataset, most):
    """A store with its target's name; a bistatic one as stores over receivers, of up to `most` transmitters."""
    if "receiver" not in dataset.sizes:
        return [(target, dataset)]
    flat = dataset.field if "direction" in dataset.sizes else dataset.field.stack(direction=["elevation", "azimuth"])
    parts = []
    for number in evenly(range(flat.sizes["direction"]), most):
        one = flat.isel(direction=number)
        title = f"{target}_from_{float(one.elevation):g}_{float(one.azimuth):g}"
        one = one.drop_vars(["direction", "elevation", "azimuth"], errors="ignore").rename(
            receiver="direction", receiver_elevation="elevation", receiver_azimuth="azimuth"
        )
        parts.append((title, one.to_dataset(name="field").assign_attrs(kind="bistatic")))
    return parts


def cut(dataset, reach, most):
    """Of a store: against what it is drawn, the label of that axis, the samples and the curves.

    Against azimuth, else against elevation or along single directions: at the middle frequency at up to `most` values
    of the other angle; at up to `most` frequencies where that has one. Against frequency where there is one direction.
    reach: the target's from the origin in m, by which curves over azimuth are interpolated; None if it is not known.
    """
    field, sizes = dataset.field, dataset.sizes
    if "direction" in sizes:
        across = "direction" if sizes["direction"] > 1 else "frequency"
    elif 1 < sizes["elevation"] > sizes["azimuth"] <= most:
        across = "elevation"
    else:
        across = next((name for name in ("azimuth", "elevation", "frequency") if sizes[name] > 1), "azimuth")
    if across == "azimuth":
        field = field.sel(elevation=evenly(dataset.elevation.values.tolist(), most))
    other = {"azimuth": "elevation", "elevation": "azimuth"}.get(across)
    if across != "frequency" and sizes["frequency"] > 1 and (other is None or field[other].size == 1):
        other, field = "frequency", field.sel(frequency=evenly(dataset.frequency.values.tolist(), most))
    elif across != "frequency":
        field = field.sel(frequency=center_frequency(dataset))
    x, label = _axis(dataset, across)
    values = [None] if other is None or field[other].size == 1 else field[other].values
    curves = []
    for polarization in dataset.polarization.values.tolist():
        for value in values:
            one = field.sel(polarization=polarization)
            one = one if value is None else one.sel({other: value})
            frequency, elevation = (float(one[name].values.ravel()[0]) for name in ("frequency", "elevation"))
            one = one.values.ravel()
            drawn, y, smooth = x, rcs_dbsm(one), False
            if across == "azimuth" and reach is not None:
                highest = order(frequency, reach, elevation)
                smooth = is_dense(x, highest)
            elif across == "azimuth" and closes_circle(x):
                highest = order_told(one)
                smooth = highest is not None
            if smooth:
                span = 360.0 if closes_circle(x) else x[-1] - x[0]
                drawn = np.linspace(x[0], x[0] + span, int(POINTS * (2 * highest + 1) * span / 360) + 2)
                y = rcs_dbsm(between(x, one, highest, drawn))
            elif label in (ALONG, LABELS["azimuth"]) and closes_circle(x):
                drawn, y = np.append(x, x[0] + 360), np.append(y, y[0])
            text = "" if value is None else _gigahertz(value) if other == "frequency" else f"{other} {value:g}°"
            curves.append(Curve(polarization, text, x, rcs_dbsm(one), drawn, y, smooth))
    frame = field.to_dataframe().reset_index()
    frame["rcs_dbsm"] = rcs_dbsm(frame.pop("field").to_numpy())
    return across, label, frame, curves


def cut_figure(target, dataset, reach, most):
    """RCS over one axis, a panel for each polarization."""
    across, label, frame, curves = cut(dataset, reach, most)
    frame.insert(0, "target", target)
    polarizations = dataset.polarization.values.tolist()
    drawing, grid = panels(len(polarizations), 1, 5.4, 0.8 + 2.1 * len(polarizations), sharey=False)
    apart = label == NUMBER
    for axes, polarization in zip(grid[:, 0], polarizations, strict=True):
        mine = [curve for curve in curves if curve.polarization == polarization]
        colors = _colors(len(mine))
        _draw(axes, mine, colors, joined=not apart)
        axes.set(ylabel=f"{polarization} RCS [dBsm]")
        axes.margins(x=0.05 if apart else 0.01)
        levels, largest = np.concatenate([curve.levels for curve in mine]), max(curve.y.max() for curve in mine)
        lowest = _lowest(levels)
        axes.set_ylim(lowest - 2, largest + 2)
        if apart:  # no direction is left out
            for curve, color in zip(mine, colors, strict=True):
                low = curve.levels < lowest
                axes.plot(curve.samples[low], np.full(low.sum(), lowest - 1), "v", color=color, mfc="none")
        if across in ("azimuth", "elevation"):
            circle_ticks(axes.xaxis, frame[across])
    if apart:
        grid[-1, 0].xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
    if apart and len(curves[0].samples) <= NAMED:
        names = [f"{elevation:g}, {azimuth:g}" for elevation, azimuth in zip(*_directions(dataset), strict=True)]
        grid[-1, 0].set_xticks(curves[0].samples, names, rotation=45, ha="right", rotation_mode="anchor")
        label = "elevation, azimuth [°]"
    grid[-1, 0].set_xlabel(label)
    draw_legend(drawing, grid.flat)
    alt, caption = _words(target, dataset, across, frame, curves, joined=not apart)
    if apart:
        caption += f" A triangle is a direction more than {FLOOR} dB below the largest."
    return figure(f"rcs_{target}", drawing, frame, alt, caption)


def polar_figure(target, dataset, reach, most, name="rcs_polar"):
    """The same cut in polar coordinates, a panel for each of its curves; None where it does not go most of the way."""
    across, _, frame, curves = cut(dataset, reach, most)
    if across not in ("azimuth", "direction") or np.ptp(curves[0].x) < 180 or _axis(dataset, across)[1] == NUMBER:
        return None
    frame.insert(0, "target", target)
    labels = list(dict.fromkeys(curve.label for curve in curves))
    columns = min(len(labels), ACROSS)
    rows = -(-len(labels) // columns)
    drawing = canvas(max(2.7 * columns, 4.2), 0.5 + (2.9 if len(labels) > 1 else 3.9) * rows)
    largest, every = max(curve.levels.max() for curve in curves), []
    for place, label in enumerate(labels):
        axes = drawing.add_subplot(rows, columns, place + 1, projection="polar")
        mine = [replace(curve, label=f"{curve.polarization} [dBsm]") for curve in curves if curve.label == label]
        _draw(axes, mine, PALETTE, np.deg2rad)
        axes.set_title(label.replace("-", "\N{MINUS SIGN}"))
        axes.set_ylim(max(min(curve.y.min() for curve in curves) - 2, largest - FLOOR), largest + 1)
        axes.set_xticks(np.radians(np.arange(0, 360, 45)))
        axes.yaxis.set_major_locator(matplotlib.ticker.MaxNLocator(4, steps=[1, 2, 5, 10]))
        axes.set_rlabel_position(67.5)
        axes.tick_params(labelsize=7, pad=0)
        every.append(axes)
    draw_legend(drawing, every)
    alt, caption = _words(target, dataset, across, frame, curves)
    start = "" if across == "azimuth" else " 0° is the first direction."
    return figure(f"{name}_{target}", drawing, frame, alt, caption + start, wide=drawing.get_figwidth() > WIDE)


def _words(target, dataset, across, frame, curves, joined=True):
    """The alternative text and the caption of a cut."""
    peak = frame.loc[frame["rcs_dbsm"].idxmax()]
    several = frame["frequency"].nunique() > 1
    at = "" if several else f" at {_gigahertz(frame['frequency'].iloc[0])}"
    where = f"{_gigahertz(peak['frequency'])}, " if several else ""
    if frame["elevation"].nunique() == 1:
        at += f", elevation {frame['elevation'].iloc[0]:g}°"
    kind = dataset.attrs.get("kind", "backscatter")
    chosen = [
        f" Of {dataset.sizes[axis]} {words} {drawn} are drawn."
        for axis, words in (("elevation", "elevations"), ("frequency", "frequencies"))
        if axis in dataset.sizes and 1 < (drawn := frame[axis].nunique()) < dataset.sizes[axis]
    ]
    alt = f"RCS of {target} against {across}{at}, from {frame['rcs_dbsm'].min():.0f} to {peak['rcs_dbsm']:.0f} dBsm."
    caption = (
        f"{target}: {kind} RCS{at}. The largest is {peak['rcs_dbsm']:.1f} dBsm, at {where}azimuth "
        f"{peak['azimuth']:.1f}°, elevation {peak['elevation']:.1f}°, {peak['polarization']}; the median is "
        f"{_medians(frame)}.{''.join(chosen)}{_how(across, curves) if joined else ''}"
    )
    return alt, caption


def _medians(frame):
    """The median of each polarization in words; where there is no field at all, by symmetry, it is said."""
    medians = frame.groupby("polarization", sort=False)["rcs_dbsm"].median()
    texts = {name: "no field" if median <= NONE else f"{median:.1f} dBsm" for name, median in medians.items()}
    return ", ".join(f"{text} in {name}" for name, text in texts.items())


def map_figure(target, dataset):
    """RCS over elevation and azimuth at the middle frequency, or None without a grid of them."""
    if "direction" in dataset.sizes or min(dataset.sizes["elevation"], dataset.sizes["azimuth"]) < 3:
        return None
    field = dataset.field.sel(frequency=center_frequency(dataset))
    polarizations = dataset.polarization.values.tolist()
    drawing, grid = panels(len(polarizations), 1, 5.4, 0.6 + 2.0 * len(polarizations))
    level = rcs_dbsm(field.values)
    look = {"cmap": "viridis", "vmin": level.max() - FLOOR, "vmax": level.max(), "shading": "nearest"}
    for axes, polarization, part in zip(grid[:, 0], polarizations, level, strict=True):
        picture = axes.pcolormesh(dataset.azimuth, dataset.elevation, part, rasterized=True, **look)
        axes.grid(False)
        axes.set(ylabel="elevation [°]", title=polarization)
        circle_ticks(axes.xaxis, dataset.azimuth.values)
    grid[-1, 0].set_xlabel("azimuth [°]")
    drawing.colorbar(picture, ax=grid, label="RCS [dBsm]", pad=0.02)
    frame = field.to_dataframe().reset_index()
    frame["rcs_dbsm"] = rcs_dbsm(frame.pop("field").to_numpy())
    frame.insert(0, "target", target)
    at = _gigahertz(center_frequency(dataset))
    alt = f"RCS of {target} over elevation and azimuth at {at}."
    return figure(f"rcs_map_{target}", drawing, frame, alt, f"{target}: RCS over elevation and azimuth at {at}.")


def frequency_figure(target, dataset, most):
    """RCS against frequency at up to `most` directions, with the median over all; None for one frequency."""
    if dataset.sizes["frequency"] < 2:
        return None
    frequency, polarizations = dataset.frequency.values / 1e9, dataset.polarization.values.tolist()
    level = rcs_dbsm(dataset.field.values).reshape(*dataset.field.shape[:2], -1)
    numbers = evenly(range(level.shape[-1]), most)
    places = zip(*_directions(dataset), strict=True)
    names = [f"({elevation:g}°, {azimuth:g}°)" for elevation, azimuth in places]
    drawing, grid = panels(len(polarizations), 1, 5.4, 0.9 + 2.1 * len(polarizations), sharey=False)
    for axes, polarization, part in zip(grid[:, 0], polarizations, level, strict=True):
        for number, color in zip(numbers, _colors(len(numbers)), strict=True):
            axes.plot(frequency, part[:, number], color=color, marker="o", label=names[number])
        if len(names) > 1:
            axes.plot(frequency, np.median(part, axis=1), color="black", ls="--", label="median of all directions")
        axes.set(ylabel=f"{polarization} RCS [dBsm]")
        seen = part[:, numbers]
        axes.set_ylim(_lowest(seen) - 2, seen.max() + 2)
    grid[-1, 0].set_xlabel(LABELS["frequency"])
    draw_legend(drawing, grid.flat)
    frame = pd.DataFrame(
        {
            "target": target,
            "polarization": np.repeat(polarizations, len(frequency) * len(numbers)),
            "frequency": np.tile(np.repeat(dataset.frequency.values, len(numbers)), len(polarizations)),
            "direction": np.tile([names[n] for n in numbers], len(polarizations) * len(frequency)),
            "rcs_dbsm": level[..., numbers].ravel(),
        }
    )
    alt = f"RCS of {target} against frequency."
    caption = f"{target}: RCS against frequency at directions (elevation, azimuth); samples, joined by lines."
    return figure(f"rcs_frequency_{target}", drawing, frame, alt, caption)


def distribution_figure(target, dataset):
    """The share of all frequencies and directions with less than an RCS; None for fewer than ten of them."""
    polarizations = dataset.polarization.values.tolist()
    level = np.sort(rcs_dbsm(dataset.field.values).reshape(len(polarizations), -1))
    if level.shape[1] < 10:
        return None
    share = np.linspace(0, 100, level.shape[1])
    drawing, ((axes,),) = panels(1, 1, 5.4, 2.6)
    for polarization, part, color in zip(polarizations, level, _colors(len(polarizations)), strict=True):
        axes.plot(part, share, color=color, label=polarization)
    axes.set(xlabel="RCS [dBsm]", ylabel="share below [%]")
    axes.set_xlim(_lowest(level), level.max() + 1)
    draw_legend(drawing, [axes])
    steps = np.linspace(0, 100, 101)
    frame = pd.DataFrame({"target": target, "percent": steps})
    for polarization, part in zip(polarizations, level, strict=True):
        frame[f"{polarization}_dbsm"] = np.percentile(part, steps)
    alt = f"The distribution of {target}'s RCS."
    return figure(
        f"rcs_distribution_{target}", drawing, frame, alt, f"{target}: the share of all samples below an RCS."
    )


def _draw(axes, curves, colors, turned=lambda angle: angle, joined=True):
    for curve, color in zip(curves, itertools.cycle(colors), strict=False):
        look = {} if joined and len(curve.samples) >= 3 else {"marker": "o", "ls": "-" if joined else ""}
        axes.plot(turned(curve.x), curve.y, color=color, label=curve.label or None, **look)
        if not curve.smooth and len(curve.samples) >= 3:
            axes.plot(turned(curve.samples), curve.levels, ".", color=color, ms=2.5)


def _lowest(levels):
    """The least level in dBsm that an axis shows."""
    return max(levels.min(), levels.max() - FLOOR)


def _colors(count):
    # Neither end of the map: both looks of the page have to show them.
    return matplotlib.colormaps["viridis"](np.linspace(0.3, 0.8, count)) if count > 1 else [BLUE]


def _how(across, curves):
    """How a caption says what stands between samples."""
    if all(curve.smooth for curve in curves):
        return " Between the samples the curve is the field's own band-limited series."
    if any(curve.smooth for curve in curves):
        return (
            " Curves are the field's own band-limited series; those with points are straight lines between samples "
            "that are too far apart to hold the field between them."
        )
    coarse = " They are too far apart to hold the field between them." if across == "azimuth" else ""
    return f" Points are the samples, joined by straight lines.{coarse}" if len(curves[0].samples) > 2 else ""


def _gigahertz(frequency):
    return f"{frequency / 1e9:.4g} GHz"


def _axis(dataset, across):
    """Values and label of what a cut is drawn against."""
    if across == "frequency":
        return dataset.frequency.values / 1e9, LABELS[across]
    if across != "direction":
        return dataset[across].values, LABELS[across]
    u, *_ = unit_vectors(dataset.elevation.values, dataset.azimuth.values)
    steps = np.degrees(np.arccos(np.clip(np.sum(u[1:] * u[:-1], axis=1), -1, 1)))
    even = len(steps) > 1 and np.ptp(steps) < 1e-3 and 0 < steps[0] < 90
    return (steps[0] * np.arange(len(u)), ALONG) if even else (np.arange(1, len(u) + 1), NUMBER)


def _directions(dataset):
    """Elevation and azimuth of every direction, (D,) each."""
    if "direction" in dataset.sizes:
        return dataset.elevation.values, dataset.azimuth.values
    return tuple(x.ravel() for x in np.meshgrid(dataset.elevation, dataset.azimuth, indexing="ij"))
