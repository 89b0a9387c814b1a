"""Radar cross-section (RCS) as figures: cuts, maps and frequency sweeps."""

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator, MultipleLocator

from isarflow.core.sweep import evenly
from isarflow.report.layout import PALETTE, canvas, figure
from isarflow.report.plots import draw_legend, panels
from isarflow.scattering.fields.cuts import ALONG, LABELS, SINGLE, Curve, cut, in_words
from isarflow.scattering.fields.rcs import by_direction, center_frequency, rcs_dbsm

ACROSS = 4  # polar plots side by side
FLOOR = 50  # dB below the largest: deep nulls would flatten the rest
NAMED = 16  # single directions that an axis names
# How a cut is read, by the label of its axis; else by LINES.
LINES = "Points are the samples, joined by straight lines."
HOW = {ALONG: f"{LINES} 0° is the first direction."}
HOW[SINGLE] = f"Points at the lower edge are {FLOOR} dB or more below the largest."
HOW[LABELS["azimuth"]] = (
    "Curves without points are the field's own band-limited series. Points are samples too far apart "
    "to hold the field between them, joined by straight lines."
)


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
            continue
        axes.set(xlabel=label, ylabel="RCS [dBsm]")
        if label == LABELS["azimuth"] and np.ptp(curves[0].samples) > 180:
            axes.xaxis.set_major_locator(MultipleLocator(45))
    draw_legend(drawing, drawing.axes)
    return drawing


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
    if np.ptp(azimuth) > 180:
        axes.xaxis.set_major_locator(MultipleLocator(45))
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
    field = by_direction(dataset)
    picked = field.isel(direction=evenly(range(field.sizes["direction"]), most))
    names, frequency = _names(picked, "({:g}°, {:g}°)"), dataset.frequency.values
    columns = {"target": [target], "polarization": dataset.polarization.values, "frequency": frequency}
    frame = pd.MultiIndex.from_product([*columns.values(), names], names=[*columns, "direction"]).to_frame(index=False)
    frame["rcs_dbsm"], curves = rcs_dbsm(picked.values).ravel(), []
    for (name, polarization), rows in frame.groupby(["direction", "polarization"], sort=False):
        x, levels = frequency / 1e9, rows["rcs_dbsm"].to_numpy()
        curves.append(Curve(polarization, name, x, levels, x, levels, False))
    caption = f"{target}: RCS against frequency at directions (elevation, azimuth); samples, joined by lines."
    drawing = draw_curves(curves, LABELS["frequency"])
    return figure(f"rcs_frequency_{target}", drawing, frame, caption)


def _names(part, form):
    return [form.format(*place) for place in zip(part.elevation.values, part.azimuth.values, strict=True)]


def _table(target, field):
    frame = field.to_dataframe().reset_index()
    frame["rcs_dbsm"] = rcs_dbsm(frame.pop("field").to_numpy())
    frame.insert(0, "target", target)
    return frame
