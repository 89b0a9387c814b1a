"""What the page's viewer shows: fields and meshes of all targets, of which the reader's browser forms the images."""

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
from isarflow.report.draw_images import FLOOR_DB
from isarflow.report.layout import Section
from isarflow.report.selection import evenly, noise_snrs

PLACE, NEEDS = ("look", 1), "images_are_made"  # on the page, see page.py
MOST_TRIANGLES = 12_000  # of the mesh that is shown: it stays quick to turn, and two bytes tell its vertices apart
MOST_BYTES = 600_000  # of all fields
SAMPLE, FULL = 4, 32_767  # bytes: two numbers of two; the largest of two bytes
COLORS = 256
WAYS = ("polar", "none")  # to images, that imaging.js knows (see imaging/imagers/fourier.py)


def section(results):
    """Return the section, which a script draws."""
    return Section("explore", "Mesh, image and range profiles of any view", live=explorer(results))


def explorer(results):
    """Return what the script reads, a mapping for JSON.

    Of at most MOST_BYTES of fields: where not even three elevations fit, of the images' first polarization alone.
    """
    settings, first = results.settings, results.scattering(results.targets[0])
    imaging, plan, noise = settings["imaging"], planned(settings), settings["noise"]
    frequency, azimuth = first.frequency.values, first.azimuth.values
    angle = imager_of(frequency, azimuth, imaging).angle
    polarizations = sorted(first.polarization.values.tolist(), key=lambda name: name != results.polarizations[0])
    each = len(results.targets) * len(frequency) * len(azimuth) * SAMPLE
    if len(polarizations) * min(3, first.sizes["elevation"]) * each > MOST_BYTES:
        polarizations = polarizations[:1]
    elevations = evenly(first.elevation.values.tolist(), max(1, MOST_BYTES // (len(polarizations) * each)))
    fourier, over = imaging["imager"] == "fourier", imaging.get("window", "hamming")
    return {
        "frequency": frequency.tolist(),
        "elevations": elevations,
        "azimuths": azimuth.tolist(),
        "closed": closes_circle(azimuth),
        "angle": angle.tolist(),
        "windows": [window(over, len(axis)).tolist() for axis in (frequency, angle)],
        "pixels": [plan["range_pixels"], plan["crossrange_pixels"]] if fourier else [len(frequency), len(angle)],
        "ways": _ways(frequency, angle, imaging.get("reformat", WAYS[0])),
        "polarizations": polarizations,
        "floor": FLOOR_DB,
        "colors": np.round(255 * colormaps["viridis"](np.linspace(0, 1, COLORS))[:, :3]).astype(int).tolist(),
        "snrs": noise_snrs(noise["snr_db"])[::-1],
        "definition": noise["definition"],
        "targets": [
            {"name": name, "field": _field(results, name, polarizations, elevations), "mesh": _mesh(results, name)}
            for name in results.targets
        ],
    }


def _ways(frequency, angle, first):
    """Return the wavenumber grids (kx, ky) in rad/m of each way to form images that can be, the run's own first."""
    ways = {}
    for way in sorted(WAYS, key=lambda way: way != first):
        with suppress(InputError):  # this sweep's sector holds no rectangle
            ways[way] = [axis.tolist() for axis in wavenumber_grid(frequency, angle, way)]
    return ways


def _field(results, target, polarizations, elevations):
    """Return a field in m, `_packed`: (polarization, frequency, elevation, azimuth, real and imaginary part)."""
    field = results.scattering(target).field.sel(polarization=polarizations, elevation=elevations)
    field = field.transpose("polarization", "frequency", "elevation", "azimuth").values
    return _packed(np.stack([field.real, field.imag], axis=-1))


def _mesh(results, target):
    """Return the finest mesh of a target that is not too fine, if any: vertices in m; triangles' corners, each less
    the one before. Neighbours have near numbers: so triangles take a third of the room."""
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
    return {"vertices": _packed(vertices[order]), "triangles": _base64(steps)}


def _packed(values):
    """Return values as whole numbers: `scale`, what one of them is, and `numbers` as base64."""
    scale = max(float(np.abs(values).max()), 1e-30) / FULL
    return {"scale": scale, "numbers": _base64(values / scale)}


def _base64(values):
    return base64.b64encode(np.round(values).astype("<i2").tobytes()).decode()
