"""Radar cross-section (RCS) as figures: cuts, maps and frequency sweeps."""

import itertools
from collections import namedtuple

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator, MultipleLocator

from isarflow.core.sweep import closes_circle, unit_vectors
from isarflow.report.layout import PALETTE, canvas, figure
from isarflow.report.plots import draw_legend, panels
from isarflow.report.selection import evenly
from isarflow.scattering.rcs import by_direction, center_frequency, rcs_dbsm, series

ACROSS = 4  # polar plots side by side
FLOOR = 50  # dB below the largest: deep nulls would flatten the rest
NAMED = 16  # single directions that an axis names
LABELS = {"azimuth": "azimuth [°]", "elevation": "elevation [°]", "frequency": "frequency [GHz]"}
ALONG, SINGLE = "angle along the directions [°]", "elevation, azimuth [°]"
# How a cut is read, by the label of its axis; else by LINES.
LINES = "Points are the samples, joined by straight lines."
HOW = {ALONG: f"{LINES} 0° is the first direction."}
HOW[SINGLE] = f"Points at the lower edge are {FLOOR} dB or more below the largest."
HOW[LABELS["azimuth"]] = (
    "Curves without points are the field's own band-limited series. Points are samples too far apart "
    "to hold the field between them, joined by straight lines."
)

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
        one = field.isel(direction=number)
        title = f"{target}_from_{float(one.elevation):g}_{float(one.azimuth):g}"
        one = one.drop_vars(["direction", "elevation", "azimuth"], errors="ignore").rename(
            receiver="direction", receiver_elevation="elevation", receiver_azimuth="azimuth"
        )
        parts.append((title, one.to_dataset(name="field").assign_attrs(kind="bistatic")))
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
    other = next((name for name in (*angles[1:], "frequency") if name != across and sizes[name] > 1), None)
    if other:
        field = field.sel({other: evenly(field[other].values.tolist(), most)})
    if "frequency" not in (across, other):
        field = field.sel(frequency=center_frequency(dataset))
    x, label = _axis(dataset, across)
    values, curves = field[other].values if other else [None], []
    for polarization, value in itertools.product(dataset.polarization.values.tolist(), values):
        one = field.sel({"polarization": polarization} | ({other: value} if other else {}))
        one = one.squeeze([name for name in one.dims if name != across])
        levels = rcs_dbsm(one.values.ravel())
        drawn = series(one, reach) if across == "azimuth" else None
        smooth = drawn is not None
        if not smooth:
            closed = label != SINGLE and closes_circle(x)
            drawn = (np.append(x, x[0] + 360), np.append(levels, levels[0])) if closed else (x, levels)
        curves.append(Curve(polarization, in_words(other, value) if other else "", x, levels, *drawn, smooth))
    return across, label, field, curves


def _axis(dataset, across):
    """Return values and label of what a cut is drawn against; single directions are numbered from 1."""
    if across != "direction":
        return dataset[across].values / (1e9 if across == "frequency" else 1), LABELS[across]
    u, *_ = unit_vectors(dataset.elevation.values, dataset.azimuth.values)
    steps = np.degrees(np.arccos(np.clip(np.sum(u[1:] * u[:-1], axis=1), -1, 1)))
    even = len(steps) > 1 and np.ptp(steps) < 1e-3 and 0 < steps[0] < 90
    return (steps[0] * np.arange(len(u)), ALONG) if even else (np.arange(1, len(u) + 1), SINGLE)


def draw_curves(curves, label, polar=False):
    """Return a canvas: a panel for each label of the curves, a line for each polarization. label: of the axis."""
    titles = list(dict.fromkeys(curve.label for curve in curves))
    columns = min(len(titles), ACROSS) if polar else 1
    rows = -(-len(titles) // columns)
    size = (max(2.7 * columns, 4.2), 0.5 + (2.9 if len(titles) > 1 else 3.9) * rows) if polar else (5.4, 0.8 + 2 * rows)
    drawing, turn = canvas(*size), np.radians if polar else np.asarray
    least, largest = min(curve.y.min() for curve in curves), max(curve.levels.max() for curve in curves)
    bottom = max(least - 2, largest - FLOOR)
    for place, title in enumerate(titles):
        axes = drawing.add_subplot(rows, columns, place + 1, projection="polar" if polar else None)
        for curve, color in zip((curve for curve in curves if curve.label == title), PALETTE, strict=False):
            few, look = len(curve.samples) < 3, {"color": color, "label": curve.polarization + " [dBsm]" * polar}
            if label == SINGLE:
                axes.plot(curve.x, np.maximum(curve.y, bottom), "o", clip_on=False, **look)
                continue
            axes.plot(turn(curve.x), curve.y, marker="o" if few else "", **look)
            if not (curve.smooth or few):
                axes.plot(turn(curve.samples), curve.levels, ".", color=color, ms=2.5)
        axes.set_title(title.replace("-", "\N{MINUS SIGN}"))
        axes.set_ylim(bottom, largest + 1)
        if polar:
            axes.set_xticks(np.radians(np.arange(0, 360, 45)))
            axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
            axes.set_rlabel_position(67.5)
            axes.tick_params(labelsize=7, pad=0)
        else:
            axes.set(xlabel=label, ylabel="RCS [dBsm]")
            if label == LABELS["azimuth"]:
                _circle_ticks(axes.xaxis, curves[0].samples)
    draw_legend(drawing, drawing.axes)
    return drawing


def _circle_ticks(axis, values):
    """Set ticks at parts of a circle, where the angles (degrees) span most of one."""
    if np.ptp(values) > 180:
        axis.set_major_locator(MultipleLocator(45))


def cut_figure(target, dataset, reach, most, polar=False, name="rcs"):
    """Draw RCS over one axis; no single direction is left out. polar: None where it goes less than half way round."""
    across, label, field, curves = cut(dataset, reach, most)
    if polar and (label not in (LABELS["azimuth"], ALONG) or np.ptp(curves[0].x) < 180):
        return None
    drawing = draw_curves(curves, label, polar)
    if label == SINGLE:
        named = dataset.isel(direction=evenly(range(len(curves[0].samples)), NAMED))
        names = _names(named, "{:g}, {:g}")
        for axes in drawing.axes:
            axes.set_xticks(evenly(curves[0].samples, NAMED), names, rotation=45, ha="right", rotation_mode="anchor")
    single = [axis for axis in ("frequency", "elevation", "azimuth") if axis != across and field[axis].size == 1]
    at = f" at {', '.join(in_words(axis, field[axis].item()) for axis in single)}" if single else ""
    caption = f"{target}: {dataset.attrs.get('kind', 'backscatter')} RCS{at}. {HOW.get(label, LINES)}"
    alt, wide = f"RCS of {target} against {across}{at}.", polar and len({curve.label for curve in curves}) > 2
    return figure(f"{name}_{target}", drawing, _table(target, field), caption, wide, alt)


def draw_map(axes, azimuth, values, level, top, depth):
    """Draw levels (V, A) in dB over azimuths (A,) in degrees and values (V,), down to `depth` dB below `top`."""
    look = {"cmap": "viridis", "vmin": top - depth, "vmax": top, "shading": "nearest", "rasterized": True}
    picture = axes.pcolormesh(azimuth, values, level, **look)
    axes.grid(False)
    _circle_ticks(axes.xaxis, azimuth)
    return picture


def map_figure(target, dataset):
    """Draw RCS over elevation and azimuth at the middle frequency; None without a grid of them."""
    if "direction" in dataset.sizes or min(dataset.sizes["elevation"], dataset.sizes["azimuth"]) < 3:
        return None
    field = dataset.field.sel(frequency=center_frequency(dataset))
    polarizations, level = dataset.polarization.values, rcs_dbsm(field.values)
    drawing, grid = panels(len(polarizations), 1, 5.4, 0.6 + 2.0 * len(polarizations))
    for axes, polarization, part in zip(grid[:, 0], polarizations, level, strict=True):
        picture = draw_map(axes, dataset.azimuth.values, dataset.elevation.values, part, level.max(), FLOOR)
        axes.set(ylabel="elevation [°]", title=polarization)
    grid[-1, 0].set_xlabel("azimuth [°]")
    drawing.colorbar(picture, ax=grid, label="RCS [dBsm]", pad=0.02)
    words = f"over elevation and azimuth at {in_words('frequency', field.frequency.item())}."
    return figure(f"rcs_map_{target}", drawing, _table(target, field), f"{target}: RCS {words}")


def frequency_figure(target, dataset, most):
    """Draw RCS over frequency at up to `most` directions, a panel for each; None for one frequency."""
    if dataset.sizes["frequency"] < 2:
        return None
    field, polarizations = by_direction(dataset), dataset.polarization.values
    picked = field.isel(direction=evenly(range(field.sizes["direction"]), most))
    names, frequency, level = _names(picked, "({:g}°, {:g}°)"), dataset.frequency.values, rcs_dbsm(picked.values)
    curves, x = [], frequency / 1e9
    for number, name in enumerate(names):
        for polarization, levels in zip(polarizations, level[:, :, number], strict=True):
            curves.append(Curve(polarization, name, x, levels, x, levels, False))
    columns = {"target": [target], "polarization": polarizations, "frequency": frequency, "direction": names}
    frame = pd.MultiIndex.from_product(columns.values(), names=columns).to_frame(index=False)
    frame["rcs_dbsm"] = level.ravel()
    caption = f"{target}: RCS against frequency at directions (elevation, azimuth); samples, joined by lines."
    drawing = draw_curves(curves, LABELS["frequency"])
    return figure(f"rcs_frequency_{target}", drawing, frame, caption)


def _names(part, form):
    """Return each direction of a part of a field as text. form: of its elevation and azimuth in degrees."""
    return [form.format(*place) for place in zip(part.elevation.values, part.azimuth.values, strict=True)]


def _table(target, field):
    """Return a row for each sample of a field in m, its RCS in dBsm last."""
    frame = field.to_dataframe().reset_index()
    frame["rcs_dbsm"] = rcs_dbsm(frame.pop("field").to_numpy())
    frame.insert(0, "target", target)
    return frame
