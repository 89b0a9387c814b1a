"""How scores and images are drawn: panels, curves with confidence bands, published markers, matrices, galleries."""

import textwrap

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.ticker import MaxNLocator

from isarflow.imaging.outline import OUTLINE, outline
from isarflow.mesh import topology
from isarflow.report.layout import GREY, ON_DARK, ON_LIGHT, PALETTE, canvas, figure
from isarflow.report.vocabulary import F1, MEASURES, select, snr_axis

# How a published statement is written, and the marker that stands for it.
RELATIONS = {">=": ("≥", "^"), ">": (">", "^"), "<=": ("≤", "v"), "<": ("<", "v"), "=": ("=", "o")}
MEANT = {"^": "at least", "v": "at most", "o": "equal to"}  # what these markers say in words
REJECTING = {"color": GREY, "ls": ":", "lw": 1.6, "label": "everything rejected"}
BAND = 0.18  # how opaque a 95 % interval is
TRAININGS = "os^Dv<>"  # markers by training SNR
LETTER, LINE = 0.075, 0.6  # inches
FLOOR_DB = -40  # of images
COLUMNS, ACROSS = 4, 1.05  # images in a row; inches of one
OBLIQUE = (-32.0, 28.0)  # azimuth and elevation of the eye in degrees: ahead, to the right of the nose, above
TOP = (-90.0, 90.0)
SIDE = (-90.0, 0.0)
CLEAR = 0.35  # opacity of sheets
SURFACE = np.array([0.62, 0.74, 0.86])  # light steel blue
EDGE = "#1d3446"
LIGHT = np.array([-0.35, 0.6, 0.72])  # from the eye's upper left: right, up, towards the eye


def panels(rows, columns, width, height, sharex=True, sharey=True, layout="constrained"):
    """A canvas of so many inches and a grid of axes (rows, columns) on it."""
    drawing = canvas(width, height, layout)
    return drawing, drawing.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)


def finish(drawing, grid, xlabel, ylabel="", legend=True, more=()):
    """Label a grid of axes at its outer edges, hide those in which nothing was drawn, and put one legend above all.

    more: what the legend has besides, drawn or not.
    """
    for column in grid.T:
        for axes in [axes for axes in column if axes.has_data()][-1:]:  # the lowest
            axes.set_xlabel(axes.get_xlabel() or xlabel)
            axes.tick_params(labelbottom=True)
    for axes in grid[:, 0]:
        axes.set_ylabel(axes.get_ylabel() or ylabel)
    for axes in [axes for axes in grid.flat if not axes.has_data()]:
        axes.set_axis_off()
    if legend:
        draw_legend(drawing, grid.flat, more)


def draw_legend(drawing, every, more=()):
    """One legend for all axes above them, each entry once."""
    entries = {}
    for axes in every:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    entries |= {handle.get_label(): handle for handle in more}
    if entries:
        # A column is as wide as its longest entry: letters, and the line before them.
        longest = max(len(line) for entry in entries for line in entry.split("\n"))
        columns = min(len(entries), max(int(drawing.get_figwidth() / (LETTER * longest + LINE)), 1))
        drawing.legend(entries.values(), entries.keys(), loc="outside upper center", ncols=columns)


def draw_curve(axes, rows, color, marker="", band=True, **look):
    """Draw a score over the test SNR, with its 95 % interval as a band. rows: of scores.csv, one for each SNR."""
    rows = rows.sort_values("test_snr_db")
    axes.plot(rows["test_snr_db"], rows["value"], color=color, marker=marker, **look)
    if band:
        axes.fill_between(rows["test_snr_db"], rows["low"], rows["high"], color=color, alpha=BAND, lw=0)


def draw_published(axes, rows, color, whose=""):
    """Published statements as open markers. color: by their models, or one for all; whose: in the legend, if any."""
    for row in rows.itertuples():
        edge = color[row.model] if isinstance(color, dict) else color
        look = {"ms": 8, "mfc": "white", "mec": edge, "mew": 1.5, "zorder": 3, "clip_on": False}
        marker = RELATIONS[row.relation][1]
        look["label"] = f"{whose}: {MEANT[marker]}" if whose else None
        axes.plot(row.snr_db, float(row.value), marker, **look)


def draw_rejecting(axes, values, **look):
    """The weighted F1 of rejecting every image of the open set: a line for each of the values."""
    for value in values:
        axes.axhline(value, **REJECTING | look)


def training_look(training, trained):
    """Return how `draw_curve` draws a model by what it was trained at, from dark to light. trained: all in order."""
    place = trained.index(training)
    color = colormaps["viridis"](0.9 * place / max(len(trained) - 1, 1))
    marker = TRAININGS[place % len(TRAININGS)]
    return {"color": color, "marker": marker, "band": False, "label": f"training SNR: {training}"}


def draw_scores(results, shown, columns, size, line, look, published=(), color=None, whose="", more=()):
    """Draw scores over the test SNR, and return the canvas: panels, `columns` in a row, of so many inches in all.

    A panel of weighted F1 has a dotted line where rejecting every image is; else where naming one class for all is.
    shown: rows of scores.csv of one metric, by the panel's title; line: columns whose values tell curves apart; look:
    how `draw_curve` draws one, a function of its first row; published: statements, whose column `panel` names theirs;
    color, whose: as of `draw_published`; more: as of `finish`.
    """
    drawing, grid = panels(len(shown) // columns, columns, *size)
    for axes, (title, rows) in zip(grid.flat, shown.items(), strict=True):
        axes.set_title(textwrap.fill(title, int(size[0] / columns / LETTER)))
        for _, curve in results.names.groups(rows, *line):
            draw_curve(axes, curve, **look(curve.iloc[0]))
        opened = rows[rows["threshold"] != ""]
        if len(opened):
            draw_rejecting(axes, results.rejecting(opened["experiment"].unique()))
        elif set(rows["metric"]) == {F1}:
            draw_rejecting(axes, results.guessing(rows["experiment"].unique()), label="one class named for all")
        if len(published):
            draw_published(axes, select(published, panel=title), color, whose)
    first = pd.concat(shown.values()).iloc[0]
    finish(drawing, grid, snr_axis(first["snr_definition"]), MEASURES[first["metric"]], more=more)
    return drawing


def draw_pixels(axes, image, extent=None, **colors):
    """An image with its pixels as they are, first row below. extent: of the axes; colors: cmap, vmin, vmax."""
    axes.grid(False)
    colors = {"cmap": "viridis", "vmin": 0, "vmax": 1} | colors
    return axes.imshow(image, extent=extent, origin="lower", interpolation="nearest", **colors)


def draw_matrix(axes, counts, text):
    """One confusion matrix: colour is the share of the row, text the share and the number of images."""
    share = counts / counts.sum(axis=1).to_numpy()[:, None]
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1.15, aspect="auto")
    axes.grid(False)
    axes.set_title(text)
    axes.set_xticks(range(len(counts.columns)), counts.columns)
    axes.set_yticks(range(len(counts.index)), counts.index, rotation=90, va="center")
    for (row, column), value in np.ndenumerate(share.to_numpy()):
        cell = f"{100 * value:.1f} %\n{counts.iloc[row, column]:,.0f}"
        axes.text(column, row, cell, ha="center", va="center", color=ON_DARK if value > 0.6 else ON_LIGHT)


def matrix(cells):
    """Confusion counts (target, predicted) of one model at one SNR, from the rows of confusion.csv."""
    return cells.pivot(index="target", columns="predicted", values="count").fillna(0)


def decibels(image):
    """Return the magnitude of a peak-normalised complex image in dB, no lower than -100."""
    return 20 * np.log10(np.maximum(np.abs(image), 1e-5))


def edges(centers):
    """Return the two outer edges of uniform pixels from their centres."""
    half = (centers[1] - centers[0]) / 2
    return float(centers[0] - half), float(centers[-1] + half)


def pixel_table(distance, cross, values, **columns):
    """Return a row for each pixel of images (range, crossrange): range and cross-range in m, and values by column."""
    places = {"range_m": np.repeat(distance, len(cross)), "crossrange_m": np.tile(cross, len(distance))}
    return pd.DataFrame({**columns, **places, **{name: image.ravel() for name, image in values.items()}})


def gallery(name, target, images, surface, caption):
    """Return the Figure of images (range, crossrange) by title, side by side. surface: for its outline, or None."""
    first = next(iter(images.values()))
    distance, cross = first.range.values, first.crossrange.values
    down, across = edges(distance), edges(cross)
    tick = float(f"{0.8 * across[1]:.0e}")  # one digit, and not at the edge, where it would run into the neighbour's
    rows, height = -(-len(images) // COLUMNS), ACROSS * np.ptp(down) / np.ptp(across)
    inches = 1.3 + (ACROSS + 0.1) * COLUMNS, 0.5 + rows * (height + 0.3)
    drawing, grid = panels(rows, COLUMNS, *inches, layout="compressed")
    tables = []
    for axes, (title, image) in zip(grid.flat, images.items(), strict=False):
        level = decibels(image.transpose("range", "crossrange").values)
        elevation, azimuth = float(image.elevation), float(image.azimuth)
        picture = draw_pixels(axes, level, (*across, *down), vmin=FLOOR_DB, vmax=0)
        if surface is not None:
            shadow = outline(*surface, elevation, azimuth)
            axes.contour(*shadow, levels=[OUTLINE], colors="black", linewidths=1.8, alpha=0.6)
            axes.contour(*shadow, levels=[OUTLINE], colors=ON_DARK, linewidths=0.9)
        axes.set(xlim=across, ylim=down, title=title, xticks=[-tick, 0, tick])
        columns = {"target": target, "image": title, "azimuth_deg": azimuth, "elevation_deg": elevation}
        tables.append(pixel_table(distance, cross, {"level_db": level.round(2)}, **columns))
    finish(drawing, grid, "cross-range [m]", "range [m]", legend=False)
    drawing.colorbar(picture, ax=grid, label="|image| [dB]", shrink=0.8, aspect=30, pad=0.02)
    return figure(name, drawing, pd.concat(tables), caption)


def project(points, azimuth, elevation):
    """Return right, up and depth, (...,) each, of points (..., 3) seen from afar. azimuth, elevation: degrees."""
    az, el = np.radians([azimuth, elevation])
    right = np.array([-np.sin(az), np.cos(az), 0.0])
    towards = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    up = np.cross(towards, right)
    return points @ right, points @ up, points @ towards


def paints(parts):
    """Return the colours of a target's parts, {name: is it metal}, as red, green, blue and opacity, (P, 4)."""
    colors = [to_rgb(PALETTE[number % len(PALETTE)]) for number in range(len(parts))]
    return np.reshape(
        [(*color, 1.0 if metal else CLEAR) for color, metal in zip(colors, parts.values(), strict=True)], (-1, 4)
    )


def draw_mesh(axes, vertices, triangles, view, edges=True, colors=SURFACE):
    """Draw a mesh into axes with equal scales.

    colors: before shading, red, green and blue, or (triangles, 3), or (triangles, 4) with opacities.
    """
    right, up, depth = project(vertices, *view)
    corners = np.stack([right, up], axis=-1)[triangles]
    order = np.argsort(depth[triangles].mean(axis=1), kind="stable")
    lit = np.stack(project(topology.shape(vertices[triangles])[0], *view), axis=1)
    lit *= np.where(lit[:, 2:] < 0, -1, 1)  # the side that faces the eye is the one that is lit
    shade = np.ones((len(triangles), np.shape(colors)[-1]))
    shade[:, :3] = 0.45 + 0.65 * np.clip(lit @ LIGHT, 0, 1)[:, None]
    colors = np.clip(colors * shade, 0, 1)[order]
    # Scales are equal, so one of the two directions says how large a metre is drawn.
    size, paper = axes.get_position().size, axes.figure.get_size_inches()
    points = 72 * min(size * paper / [np.ptp(right), np.ptp(up)])
    # Fine meshes get thin edges, or the picture would be black.
    side = points * np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1).mean()
    faces = PolyCollection(
        corners[order],
        facecolors=colors,
        edgecolors=EDGE if edges else colors,
        linewidths=float(np.clip(0.05 * side, 0.05, 0.5)) if edges else 0.3,
        rasterized=True,  # tens of thousands of triangles: as vectors the page would be too large
    )
    axes.add_collection(faces)
    margin = 0.03 * max(np.ptp(right), np.ptp(up))
    axes.set(xlim=(right.min() - margin, right.max() + margin), ylim=(up.min() - margin, up.max() + margin))
    axes.set_aspect("equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))  # as many as there is room for
        axis.set_major_formatter("{x:g}")
    axes.grid(False)
