"""Images drawn side by side, with the outline of the target over them."""

import numpy as np
import pandas as pd
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter

from isarflow.imaging.geometry import project
from isarflow.report.layout import ON_DARK, figure
from isarflow.report.plots import draw_pixels, finish, panels

FLOOR_DB = -40
COLUMNS = 4
RASTER, RIM = 140, 4  # cells from which an outline is read, along the target's longer side; empty ones around them
OUTLINE = 0.2  # covered, after smoothing
ACROSS = 1.05  # inches an image


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


def outline(vertices, triangles, elevation, azimuth):
    """Return the target's shadow in an image: crossrange (C,) and range (R,) in m, and how much is covered, (R, C).

    vertices in m, elevation and azimuth in degrees. Covered is 0 to 1, smoothed: at OUTLINE, which a sheet seen
    edge-on reaches too, is the outline.
    """
    distance, cross = project(vertices, elevation, azimuth)
    points = np.stack([cross, distance], axis=1)
    low, cell = points.min(axis=0), max(*np.ptp(points, axis=0), 1e-6) / RASTER  # a flat target may be a point
    cells = np.round((points - low) / cell).astype(int) + RIM
    raster = Image.new("L", tuple(cells.max(axis=0) + RIM + 1))
    pen = ImageDraw.Draw(raster)
    for corners in cells[triangles].reshape(-1, 6).tolist():
        pen.polygon(corners, fill=1, outline=1)
    axes = (start + cell * (np.arange(size) - RIM) for start, size in zip(low, raster.size, strict=True))
    return *axes, gaussian_filter(np.asarray(raster, float), 1.0)


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
