"""What the page shows on demand: a target's mesh as the radar sees it, and its image, at an aspect and SNR to pick."""

import base64

import numpy as np
from matplotlib import colormaps

from core.sweep import snr_label
from report.draw_images import FLOOR_DB, decibels, edges
from report.selection import around, evenly, noise_snrs, noisy_targets

MOST_TRIANGLES = 20_000  # of the mesh that is shown: the page stays quick
MOST_PIXELS = 3_000_000  # of all images, a byte each
AZIMUTHS, ELEVATIONS = 24, 7  # at most
FEWEST_AZIMUTHS = 4
COLORS = 256  # a byte of level each


def explorer(results):
    """Meshes and images for the page's own viewer: a mapping that is written into it as JSON.

    Images are levels in dB, 0 to 255 for FLOOR_DB to 0, in the order (store, elevation, azimuth, range, cross-range).
    Vertices are whole numbers, `scale` metres each. Both are base64, as are the triangles' corners.
    """
    settings = results.settings
    snrs = sorted(noise_snrs(settings["noise"]["snr_db"]), reverse=True)
    noisy = noisy_targets(settings["targets"], results.runs)
    stores = {name: ["clean", *(snr_label(snr) for snr in snrs if name in noisy)] for name in results.targets}
    first = results.images(results.targets[0], "clean")
    each = sum(map(len, stores.values())) * first.sizes["range"] * first.sizes["crossrange"]
    # Fewer elevations where there would be too few azimuths.
    some = next((n for n in (ELEVATIONS, 3, 1) if n * FEWEST_AZIMUTHS * each <= MOST_PIXELS), 1)
    elevations = evenly(first.elevation.values.tolist(), some)
    count = int(np.clip(MOST_PIXELS // (len(elevations) * each), 1, AZIMUTHS))
    picks = around(first.sizes["azimuth"], count)
    return {
        "elevations": elevations,
        "azimuths": first.azimuth.values[picks].tolist(),
        "range": edges(first.range.values),
        "crossrange": edges(first.crossrange.values),
        "pixels": [first.sizes["range"], first.sizes["crossrange"]],
        "floor": FLOOR_DB,
        "colors": np.round(255 * colormaps["viridis"](np.linspace(0, 1, COLORS))[:, :3]).astype(int).tolist(),
        "definition": settings["noise"]["definition"],
        "targets": [
            {
                "name": name,
                "snrs": ["no noise", *(f"{snr:g} dB" for snr in snrs)][: len(stores[name])],
                "images": _packed([_levels(results.images(name, store), elevations, picks) for store in stores[name]]),
                "mesh": _mesh(results, name),
            }
            for name in results.targets
        ],
    }


def _levels(store, elevations, picks):
    image = store.image.isel(realization=0) if "realization" in store.image.dims else store.image
    image = image.sel(elevation=elevations).isel(azimuth=picks).transpose("elevation", "azimuth", "range", "crossrange")
    return np.round(255 * np.clip(1 - decibels(image.values) / FLOOR_DB, 0, 1)).astype(np.uint8)


def _mesh(results, name):
    """The finest mesh of a target that is not too fine; None where all are, or the target is given by its field."""
    bands = reversed(range(results.settings["mesh"]["bands"])) if name in results.meshed else ()
    meshes = (results.mesh(name, band) for band in bands)
    vertices, triangles = next((mesh for mesh in meshes if len(mesh[1]) <= MOST_TRIANGLES), (None, None))
    if vertices is None:
        return None
    scale = float(np.abs(vertices).max()) / 32767
    wide = len(vertices) > 65535
    return {
        "scale": scale,
        "vertices": _packed(np.round(vertices / scale).astype("<i2")),
        "triangles": _packed(triangles.astype("<u4" if wide else "<u2")),
        "wide": wide,
    }


def _packed(array):
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
