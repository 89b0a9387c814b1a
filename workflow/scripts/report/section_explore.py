"""What the page's viewer shows: fields and meshes of all targets, of which the reader's browser forms the images.

The fields are small beside images of all aspects, SNRs and imagers that follow from them.
"""

import base64
from contextlib import suppress

import numpy as np
from matplotlib import colormaps
from scipy.sparse import coo_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from isarflow.core.errors import InputError
from isarflow.core.sweep import closes_circle
from isarflow.imaging.geometry import imager_of, planned
from isarflow.imaging.imagers.fourier import wavenumber_grid, window
from isarflow.mesh import topology
from isarflow.report.draw_images import FLOOR_DB, decibels
from isarflow.report.selection import around, evenly, noise_snrs

MOST_TRIANGLES = 12_000  # of the mesh that is shown: it stays quick to turn, and two bytes tell its vertices apart
MOST_BYTES = 600_000  # of all fields, and again of images of an imager of one's own
SAMPLE = 4  # bytes: two numbers of two
FULL = 32_767  # the largest of two bytes
COLORS = 256
FOURIER = ("polar", "exact", "none")  # the ways to images that imaging.js knows (see imaging/imagers/fourier.py)
OWN_AZIMUTHS = 36  # at most, of images of an imager of one's own


def explorer(results):
    """Return a mapping that is written into the page as JSON.

    Fields are whole numbers, `scale` metres each, in the order (polarization, frequency, elevation, azimuth, real and
    imaginary part). Vertices are whole numbers, too. Both are base64, as are the triangles' corners, each less the one
    before. At most MOST_BYTES of fields: where not even three elevations fit, of the images' first polarization alone.
    """
    settings, first = results.settings, results.scattering(results.targets[0])
    imaging, plan, fourier = settings["imaging"], planned(settings), settings["imaging"]["imager"] == "fourier"
    frequency, azimuth = first.frequency.values, first.azimuth.values
    angle, over_range = imager_of(frequency, azimuth, imaging).angle, imaging.get("window", "hamming")
    polarizations = sorted(first.polarization.values.tolist(), key=lambda name: name != results.polarizations[0])
    each = len(results.targets) * len(frequency) * len(azimuth) * SAMPLE
    if len(polarizations) * min(3, first.sizes["elevation"]) * each > MOST_BYTES:
        polarizations = polarizations[:1]
    elevations = evenly(first.elevation.values.tolist(), max(1, MOST_BYTES // (len(polarizations) * each)))
    shown = {
        "frequency": frequency.tolist(),
        "elevations": elevations,
        "azimuths": azimuth.tolist(),
        "closed": closes_circle(azimuth),
        "angle": angle.tolist(),
        "windows": [window(over_range, len(axis)).tolist() for axis in (frequency, angle)],
        "pixels": [plan["range_pixels"], plan["crossrange_pixels"]] if fourier else [len(frequency), len(angle)],
        "ways": _ways(frequency, angle, imaging.get("reformat", FOURIER[0])),
        "polarizations": polarizations,
        "floor": FLOOR_DB,
        "colors": np.round(255 * colormaps["viridis"](np.linspace(0, 1, COLORS))[:, :3]).astype(int).tolist(),
        "snrs": noise_snrs(settings["noise"]["snr_db"])[::-1],
        "definition": settings["noise"]["definition"],
        "targets": [
            {"name": name, "field": _field(results, name, polarizations, elevations), "mesh": _mesh(results, name)}
            for name in results.targets
        ],
    }
    return shown if fourier else {**shown, "own": _own(results, elevations)}


def _ways(frequency, angle, first):
    """Return the wavenumber grids (kx, ky) in rad/m of each way to form images that can be, the run's own first."""
    ways = {}
    for way in sorted(FOURIER, key=lambda way: way != first):
        with suppress(InputError):  # this sweep's sector holds no rectangle
            ways[way] = [axis.tolist() for axis in wavenumber_grid(frequency, angle, way)]
    return ways


def _field(results, target, polarizations, elevations):
    """Return a target's field at these polarizations and elevations: `scale` in m, and whole numbers as base64."""
    field = results.scattering(target).field.sel(polarization=polarizations, elevation=elevations)
    field = field.transpose("polarization", "frequency", "elevation", "azimuth").values
    parts = np.stack([field.real, field.imag], axis=-1)
    scale = max(float(np.abs(parts).max()), 1e-30) / FULL
    return {"scale": scale, "samples": _packed(parts / scale, "<i2")}


def _own(results, elevations):
    """Return the run's clean images of an imager of one's own: levels, 0 to 255 for FLOOR_DB to 0 dB."""
    first = results.images(results.targets[0], "clean")
    each = len(results.targets) * len(elevations) * first.sizes["range"] * first.sizes["crossrange"]
    picks = around(first.sizes["azimuth"], int(np.clip(MOST_BYTES // each, 1, OWN_AZIMUTHS)))
    levels = []
    for target in results.targets:
        image = results.images(target, "clean").image.sel(elevation=elevations).isel(azimuth=picks)
        level = decibels(image.transpose("elevation", "azimuth", "range", "crossrange").values)
        levels.append(_packed(255 * np.clip(1 - level / FLOOR_DB, 0, 1), np.uint8))
    axes = {name: first[name].values.tolist() for name in ("range", "crossrange")}
    azimuths = first.azimuth.values[picks].tolist()
    return {"name": results.settings["imaging"]["imager"], "azimuths": azimuths, **axes, "levels": levels}


def _mesh(results, target):
    """Return the finest mesh of a target that is not too fine; None where all are, or the target has none.

    It is numbered such that neighbours have near numbers: so its triangles take a third of the room.
    """
    bands = range(results.settings["mesh"]["bands"])[::-1] if target in results.meshed else ()
    meshes = (results.mesh(target, band) for band in bands)
    vertices, triangles = next((mesh for mesh in meshes if len(mesh[1]) <= MOST_TRIANGLES), (None, None))
    if vertices is None:
        return None
    ends = topology.edges(triangles).ends
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(len(vertices), len(vertices))).tocsr()
    order = reverse_cuthill_mckee(graph)
    triangles = np.argsort(order)[triangles]
    turn = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3
    triangles = np.take_along_axis(triangles, turn, axis=1)
    steps = np.diff(triangles[np.lexsort(triangles.T[::-1])].ravel(), prepend=0)
    scale = float(np.abs(vertices).max()) / FULL
    return {"scale": scale, "vertices": _packed(vertices[order] / scale, "<i2"), "triangles": _packed(steps, "<i2")}


def _packed(values, kind):
    """Return values as base64, rounded to whole numbers of a NumPy kind."""
    return base64.b64encode(np.round(values).astype(kind).tobytes()).decode()
