"""What the page's viewer shows: fields and meshes of all targets, of which the reader's browser forms the images.

The fields are small beside images of all aspects, SNRs and imagers that follow from them.
"""

import base64

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

MOST_TRIANGLES = 12_000  # of the mesh that is shown: it stays quick to turn
MOST_BYTES = 600_000  # of all fields, and again of images of an imager of one's own
SAMPLE = 4  # bytes: two numbers of two
FULL = 32_767  # the largest of two bytes
COLORS = 256
FOURIER = ("polar", "exact", "none")  # the ways to images that imaging.js knows (see imaging/imagers/fourier.py)
OWN_AZIMUTHS = 36  # at most, of images of an imager of one's own


def explorer(results):
    """A mapping that is written into the page as JSON.

    Fields are whole numbers, `scale` metres each, in the order (polarization, frequency, elevation, azimuth, real and
    imaginary part). Vertices are whole numbers, too. Both are base64, as are the triangles' corners, each
    less the one before.
    """
    settings, first = results.settings, results.scattering(results.targets[0])
    frequency, azimuth = first.frequency.values, first.azimuth.values
    imaging, plan = settings["imaging"], planned(settings)
    each = len(results.targets) * first.field[0, :, 0].size * SAMPLE
    imaged = results.polarizations[0]  # the images' first
    polarizations = sorted(first.polarization.values.tolist(), key=lambda name: name != imaged)
    if len(polarizations) * min(3, first.sizes["elevation"]) * each > MOST_BYTES:
        polarizations = polarizations[:1]
    count = max(1, MOST_BYTES // (len(polarizations) * each))
    elevations = evenly(first.elevation.values.tolist(), count)
    aperture, name = imaging["aperture"], imaging.get("window", "hamming")
    angle = imager_of(frequency, azimuth, imaging).angle
    fourier = imaging["imager"] == "fourier"
    own = {} if fourier else {"own": _own(results, elevations)}
    return {
        "frequency": frequency.tolist(),
        "elevations": elevations,
        "azimuths": azimuth.tolist(),
        "closed": closes_circle(azimuth),
        "angle": angle.tolist(),
        "windows": [window(name, len(frequency)).tolist(), window(name, aperture).tolist()],
        "pixels": [plan["range_pixels"], plan["crossrange_pixels"]] if fourier else [len(frequency), aperture],
        "ways": _ways(frequency, angle, imaging.get("reformat", FOURIER[0])),
        "polarizations": polarizations,
        "floor": FLOOR_DB,
        "colors": np.round(255 * colormaps["viridis"](np.linspace(0, 1, COLORS))[:, :3]).astype(int).tolist(),
        "snrs": sorted(noise_snrs(settings["noise"]["snr_db"]), reverse=True),
        "definition": settings["noise"]["definition"],
        "targets": [
            {
                "name": target,
                "field": _field(results.scattering(target), polarizations, elevations),
                "mesh": _mesh(results, target),
            }
            for target in results.targets
        ],
        **own,
    }


def _ways(frequency, angle, first):
    """The wavenumber grids (kx, ky) by the way to form images, in rad/m, the run's own first; those that can be."""
    ways = {}
    for way in sorted(FOURIER, key=lambda way: way != first):
        try:
            ways[way] = [axis.tolist() for axis in wavenumber_grid(frequency, angle, way)]
        except InputError:  # this sweep's sector holds no rectangle
            continue
    return ways


def _field(dataset, polarizations, elevations):
    """A target's field at these polarizations and elevations: `scale` in m, and whole numbers as base64."""
    field = dataset.field.sel(polarization=polarizations, elevation=elevations)
    field = field.transpose("polarization", "frequency", "elevation", "azimuth").values
    parts = np.stack([field.real, field.imag], axis=-1)
    scale = max(float(np.abs(parts).max()), 1e-30) / FULL
    return {"scale": scale, "samples": _packed(np.round(parts / scale).astype("<i2"))}


def _own(results, elevations):
    """Images of an imager of one's own, as the run made them without noise: levels, 0 to 255 for FLOOR_DB to 0 dB."""
    settings, first = results.settings, results.images(results.targets[0], "clean")
    each = len(results.targets) * len(elevations) * first.sizes["range"] * first.sizes["crossrange"]
    picks = around(first.sizes["azimuth"], int(np.clip(MOST_BYTES // each, 1, OWN_AZIMUTHS)))
    levels = []
    for target in results.targets:
        image = results.images(target, "clean").image.sel(elevation=elevations).isel(azimuth=picks)
        image = image.transpose("elevation", "azimuth", "range", "crossrange").values
        levels.append(_packed(np.round(255 * np.clip(1 - decibels(image) / FLOOR_DB, 0, 1)).astype(np.uint8)))
    return {
        "name": settings["imaging"]["imager"],
        "azimuths": first.azimuth.values[picks].tolist(),
        "range": first.range.values.tolist(),
        "crossrange": first.crossrange.values.tolist(),
        "levels": levels,
    }


def _mesh(results, name):
    """The finest mesh of a target that is not too fine; None where all are, or the target is given by its field."""
    bands = reversed(range(results.settings["mesh"]["bands"])) if name in results.meshed else ()
    meshes = (results.mesh(name, band) for band in bands)
    vertices, triangles = next((mesh for mesh in meshes if len(mesh[1]) <= MOST_TRIANGLES), (None, None))
    if vertices is None:
        return None
    vertices, triangles = _in_line(vertices, triangles)
    scale = float(np.abs(vertices).max()) / FULL
    wide = len(vertices) > FULL
    return {
        "scale": scale,
        "vertices": _packed(np.round(vertices / scale).astype("<i2")),
        "triangles": _packed(np.diff(triangles.ravel(), prepend=0).astype("<i4" if wide else "<i2")),
        "wide": wide,
    }


def _in_line(vertices, triangles):
    """The same mesh numbered such that neighbours have near numbers: so its triangles take a third of the room."""
    ends = topology.edges(triangles).ends
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(len(vertices), len(vertices))).tocsr()
    order = reverse_cuthill_mckee(graph)
    triangles = np.argsort(order)[triangles]
    turn = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3
    triangles = np.take_along_axis(triangles, turn, axis=1)
    return vertices[order], triangles[np.lexsort(triangles.T[::-1])]


def _packed(array):
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
