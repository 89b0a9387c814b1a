"""The outline of a target in the plane of its image."""

import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter

from isarflow.imaging.geometry import project

RASTER, RIM = 140, 4  # cells from which an outline is read, along the target's longer side; empty ones around them
OUTLINE = 0.2  # covered, after smoothing


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
