"""What the page's viewer shows: fields and meshes of all targets, of which the reader's browser forms the images."""

from contextlib import suppress

import numpy as np
from matplotlib import colormaps

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, closes_circle
from isarflow.imaging.geometry import imager_of, planned
from isarflow.imaging.imagers.fourier import bilinear_weights, wavenumber_grid, window
from isarflow.report.layout import Section
from isarflow.report.plots import FLOOR_DB, paints
from isarflow.report.selection import evenly, noise_snrs

PLACE, NEEDS = ("look", 1), "images_are_made"  # on the page, see page.py
MOST_TRIANGLES = 12_000  # of the mesh that is shown: it stays quick to turn
MOST_SAMPLES = 150_000  # of all fields
FULL = 32_767  # the largest number of a field: 90 dB above the smallest
WAYS = ("polar", "none")  # to images, that imaging.js knows (see imaging/imagers/fourier.py)


def section(results):
    return Section("explore", "Mesh, image and range profiles of any view", live=explorer(results))


def explorer(results):
    """Return what the script reads, a mapping for JSON.

    Of at most MOST_SAMPLES of fields: where not even three elevations fit, of the images' first polarization alone.
    """
    settings, first = results.settings, results.scattering(results.targets[0])
    imaging, plan, noise = settings["imaging"], planned(settings), settings["noise"]
    frequency, azimuth = first.frequency.values, first.azimuth.values
    angle = imager_of(frequency, azimuth, imaging).angle
    polarizations = sorted(first.polarization.values.tolist(), key=lambda name: name != results.polarizations[0])
    each = len(results.drawn) * len(frequency) * len(azimuth)
    if len(polarizations) * min(3, first.sizes["elevation"]) * each > MOST_SAMPLES:
        polarizations = polarizations[:1]
    elevations = evenly(first.elevation.values.tolist(), max(1, MOST_SAMPLES // (len(polarizations) * each)))
    fourier, over = imaging["imager"] == "fourier", imaging.get("window", "hamming")
    targets = [
        {"name": name, "field": _field(results, name, polarizations, elevations), "mesh": _mesh(results, name)}
        for name in results.drawn
    ]
    data = {"targets": targets, "polarizations": polarizations, "elevations": elevations}
    data |= {"frequency": frequency.tolist(), "k": (2 * np.pi * frequency / C0).tolist(), "angle": angle.tolist()}
    data |= {"azimuths": azimuth.tolist(), "closed": closes_circle(azimuth), "snrs": noise_snrs(noise["snr_db"])[::-1]}
    data["windows"] = [window(over, len(axis)).tolist() for axis in (frequency, angle)]
    data["pixels"] = [plan["range_pixels"], plan["crossrange_pixels"]] if fourier else [len(frequency), len(angle)]
    data["ways"], data["floor"] = _ways(frequency, angle, imaging.get("reformat", WAYS[0])), FLOOR_DB
    data["definition"] = noise["definition"]
    data["colors"] = [[round(255 * part) for part in color] for color in colormaps["viridis"].colors]
    return data


def _ways(frequency, angle, first):
    """Return wavenumbers kx, ky in rad/m, and the samples and weights of each of their pairs, by way to form images."""
    ways = {}
    for way in sorted(WAYS, key=lambda way: way != first):
        with suppress(InputError):  # this sweep's sector holds no rectangle
            kx, ky = wavenumber_grid(frequency, angle, way)
            weights = [[[place, 1]] for place in range(len(kx) * len(ky))]
            if way == "polar":
                matrix = bilinear_weights(frequency, angle, kx, ky)
                weights = [[[int(place), row[place]] for place in np.flatnonzero(row)] for row in matrix]
            ways[way] = {"kx": kx.tolist(), "ky": ky.tolist(), "weights": weights}
    return ways


def _field(results, target, polarizations, elevations):
    """Return a field, up to a factor, as whole numbers: pairs (polarization, frequency, elevation, azimuth)."""
    field = results.scattering(target).field.sel(polarization=polarizations, elevation=elevations)
    field = field.transpose("polarization", "frequency", "elevation", "azimuth").values
    parts = np.stack([field.real, field.imag], axis=-1).ravel()
    return np.round(parts / max(np.abs(parts).max(), 1e-30) * FULL).astype(int).tolist()


def _mesh(results, target):
    """Return vertices in m and triangles of the finest mesh of a target that is not too fine, if any.

    Of several parts also each triangle's, and the parts' colours: red, green, blue to 255, and opacity.
    """
    for band in range(results.settings["mesh"]["bands"])[::-1] if target in results.meshed else ():
        vertices, triangles = results.mesh(target, band)
        if len(triangles) <= MOST_TRIANGLES:
            part, parts = results.part(target, band)
            colors = (paints(parts) * [255, 255, 255, 1]).round(2).tolist()
            of_parts = {"part": part.tolist(), "colors": colors} if parts else {}
            return {"vertices": vertices.round(4).tolist(), "triangles": triangles.tolist()} | of_parts
    return None
