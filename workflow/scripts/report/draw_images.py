"""Images drawn side by side, with the outline of the target over them."""

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter

from isarflow.imaging.geometry import project
from isarflow.report.layout import ON_DARK, figure
from isarflow.report.plots import draw_pixels, finish, panels

FLOOR_DB = -40
COLUMNS = 4
RASTER = 140  # cells of the raster from which an outline is read, along the target's longer side
OUTLINE = 0.2  # covered, after smoothing
ACROSS = 1.05  # inches an image


def decibels(image):
    """Magnitude of a peak-normalised complex image in dB, no lower than -100."""
    return 20 * np.log10(np.maximum(np.abs(image), 1e-5))


def edges(centers):
    """Outer edges of uniform pixels from their centres."""
    half = (centers[1] - centers[0]) / 2
    return float(centers[0] - half), float(centers[-1] + half)


def pixel_table(distance, cross, values, **columns):
    """A row for each pixel of images (range, crossrange): range and cross-range in m, and values by column."""
    places = {"range_m": np.repeat(distance, len(cross)), "crossrange_m": np.tile(cross, len(distance))}
    return pd.DataFrame({**columns, **places, **{name: image.ravel() for name, image in values.items()}})


def outline(vertices, triangles, elevation, azimuth):
    """The target's shadow in the image plane: crossrange (C,), range (R,) in m, and how much it covers (R, C), 0 to 1.

    vertices in m; elevation and azimuth are the image's, in degrees. Its outline is
    at OUTLINE, which a sheet seen edge-on, one cell wide, reaches too.
    """
    distance, cross = project(vertices, elevation, azimuth)
    corners = np.stack([cross, distance], axis=1)[triangles]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    cell = max(*(high - low), 1e-6) / RASTER  # at a pole a flat target is a point
    side = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    count = int(np.ceil(2 * side / cell)) + 1  # points closer together than half a cell leave no hole
    first, second = np.divmod(np.arange(count**2), count)
    weights = np.stack([first, second, count - 1 - first - second], axis=1)[first + second < count] / max(count - 1, 1)
    shape = np.ceil((high - low) / cell).astype(int) + 9  # with an empty rim, so that the outline closes
    covered = np.zeros(shape)
    for part in np.array_split(corners, 1 + len(corners) * len(weights) // 1_000_000):
        index = np.round((weights @ part - low) / cell).astype(int) + 4
        covered[index[..., 0], index[..., 1]] = 1
    axes = [start + cell * (np.arange(size) - 4) for start, size in zip(low, shape, strict=True)]
    return *axes, gaussian_filter(covered, 1.0).T


def gallery(name, target, images, surface, alt, caption):
    """The Figure of a target's images (range, crossrange) side by side. images: by their titles.

    surface: the target's vertices and triangles, for the outline of what it shows the radar; None for no outline.
    """
    first = next(iter(images.values()))
    distance, cross = first.range.values, first.crossrange.values
    # One digit, and not at the edge, where it would run into the neighbour's.
    tick = float(f"{0.8 * edges(cross)[1]:.0e}")
    rows = -(-len(images) // COLUMNS)
    height = ACROSS * np.ptp(edges(distance)) / np.ptp(edges(cross))
    drawing, grid = panels(
        rows, COLUMNS, 1.3 + (ACROSS + 0.1) * COLUMNS, 0.5 + rows * (height + 0.3), layout="compressed"
    )
    tables = []
    for axes, (title, image) in zip(grid.flat, images.items(), strict=False):
        level, extent = decibels(image.transpose("range", "crossrange").values), (*edges(cross), *edges(distance))
        picture = draw_pixels(axes, level, extent, vmin=FLOOR_DB, vmax=0)
        if surface is not None:
            shadow = outline(*surface, float(image.elevation), float(image.azimuth))
            axes.contour(*shadow, levels=[OUTLINE], colors="black", linewidths=1.8, alpha=0.6)
            axes.contour(*shadow, levels=[OUTLINE], colors=ON_DARK, linewidths=0.9)
        axes.set(xlim=edges(cross), ylim=edges(distance), title=title, xticks=[-tick, 0, tick])
        where = {"azimuth_deg": float(image.azimuth), "elevation_deg": float(image.elevation)}
        values = {"level_db": level.round(2)}
        tables.append(pixel_table(distance, cross, values, target=target, image=title, **where))
    finish(drawing, grid, "cross-range [m]", "range [m]", legend=False)
    drawing.colorbar(picture, ax=grid, label="|image| [dB]", shrink=0.8, aspect=30, pad=0.02)
    return figure(name, drawing, pd.concat(tables), alt, caption)
