"""Observations, one row each, from the stores of images."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from common.errors import InputError

TOLERANCE = 1e-6  # degrees: two angles nearer than this are the same one
DIMENSIONS = ("elevation", "azimuth", "realization", "range", "crossrange")


class Observations(NamedTuple):
    """Images (n, range, crossrange), complex64, and where each comes from: arrays of shape (n,), angles in degrees."""

    images: np.ndarray
    target: np.ndarray
    elevation: np.ndarray
    azimuth: np.ndarray
    realization: np.ndarray


def target_of(store):
    """The target's name: stores are imaging/<target>/<label>.zarr."""
    return Path(store).parent.name


def azimuths(store):
    """The azimuths of a store in degrees, shape (azimuths,)."""
    with xr.open_zarr(store) as dataset:
        return dataset.azimuth.values.astype(float)


def read(stores, azimuth, elevation="all"):
    """All images of the stores at these azimuths and elevations (degrees; elevation may be 'all').

    Rows are in the order target name, elevation, azimuth, realization. A store without noise has realization 0.
    Raises InputError for an angle that a store does not have, and for an image that is not finite.
    """
    return Observations(
        *map(
            np.concatenate,
            zip(*(_rows(store, azimuth, elevation) for store in sorted(stores, key=target_of)), strict=True),
        )
    )


def _rows(store, azimuth, elevation):
    with xr.open_zarr(store) as dataset:
        image = dataset["image"]
        if "realization" not in image.dims:
            image = image.expand_dims(realization=[0])
        image = _select(image, "azimuth", azimuth, store)
        if not isinstance(elevation, str):
            image = _select(image, "elevation", elevation, store)
        image = image.transpose(*DIMENSIONS).load()
    if not np.isfinite(image.values).all():
        raise InputError(f"{store} holds images that are not finite; delete it and make it again.")
    angles = np.meshgrid(image.elevation, image.azimuth, image.realization, indexing="ij")
    images = image.values.reshape(-1, *image.shape[-2:])
    return images, np.full(len(images), target_of(store)), *(angle.ravel() for angle in angles)


def _select(image, name, angles, store):
    have = image[name].values
    near = np.abs(have[:, None] - np.atleast_1d(np.asarray(angles, float))) < TOLERANCE
    missing = np.asarray(angles, float)[~near.any(axis=0)]
    if len(missing):
        raise InputError(f"{store} has no {name} {missing[0]:g} degrees; it has {', '.join(f'{a:g}' for a in have)}.")
    return image.isel({name: np.flatnonzero(near.any(axis=1))})
