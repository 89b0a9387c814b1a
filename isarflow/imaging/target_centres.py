"""A target's scattering centres in space, from its field in a few directions."""

import numpy as np

from isarflow.core.sweep import C0, unit_vectors
from isarflow.imaging.imagers.centres import fit
from isarflow.imaging.scatterers import waves

MOST = 30  # centres of a target


def near(field, aperture, elevation, azimuth):
    """Return the part of a field within an aperture of so many azimuths about a direction, in degrees."""
    reach = aperture // 2 * float(field.azimuth[1] - field.azimuth[0]) + 1e-6
    aside = np.abs((field.azimuth.values - azimuth + 180) % 360 - 180)
    return field.isel(azimuth=aside <= reach, elevation=np.abs(field.elevation.values - elevation) <= reach)


def target_centres(field, vertices):
    """Return a target's scattering centres: places (M, 3) in m, amplitudes (M,), complex, in m.

    field: (frequency, elevation, azimuth) in m, of a few directions. They are searched in the box of the vertices.
    """
    field = field.transpose("frequency", "elevation", "azimuth")
    el, az = np.meshgrid(field.elevation.values, field.azimuth.values, indexing="ij")
    k = 2 * np.pi * field.frequency.values / C0
    wavevectors = 2 * np.multiply.outer(k, unit_vectors(el, az)[0]).reshape(-1, 3)
    cell = np.full(3, np.pi / (len(k) * (k[1] - k[0])))  # the resolution in range
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    axes = [np.arange(start, stop + size / 2, size / 2) for start, stop, size in zip(low, high, cell, strict=True)]
    searched = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    atoms = waves(wavevectors, searched).astype(np.complex64)
    return fit(field.values.ravel(), wavevectors, searched, atoms, cell, MOST)
