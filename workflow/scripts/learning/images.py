"""Observations, one row each, from the stores of images."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from core.errors import InputError
from core.store import open_store
from learning.experiments import TOLERANCE
from learning.features import upsample

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
    with open_store(store) as dataset:
        return dataset.azimuth.values.astype(float)


def read(stores, azimuth, elevation="all", pixels="none"):
    """All images of the stores at these azimuths and elevations (degrees; elevation may be 'all').

    pixels: 'none', or how many a side the images are up-sampled to.
    Rows are in the order target name, elevation, azimuth, realization. A store without noise has realization 0.
    Raises InputError for an angle that a store does not have, for an image that is not finite, and for fewer pixels
    than the images have.
    """
    return join(_rows(store, azimuth, elevation, pixels) for store in sorted(stores, key=target_of))


def join(parts):
    """Observations of several parts, one after the other."""
    return Observations(*map(np.concatenate, zip(*parts, strict=True)))


def _rows(store, azimuth, elevation, pixels):
    with open_store(store) as dataset:
        image = dataset["image"]
        if "realization" not in image.dims:
            image = image.expand_dims(realization=[0])
        image = _select(image, "azimuth", azimuth, store)
        if not isinstance(elevation, str):
            image = _select(image, "elevation", elevation, store)
        image = image.transpose(*DIMENSIONS).load()
        carrier = dataset.attrs["range_wavenumber"] if pixels != "none" else None
    if not np.isfinite(image.values).all():
        raise InputError(f"{store} holds images that are not finite; delete it and make it again.")
    angles = np.meshgrid(image.elevation, image.azimuth, image.realization, indexing="ij")
    images = image.values.reshape(-1, *image.shape[-2:])
    if pixels != "none":
        if pixels < max(images.shape[1:]):
            raise InputError(
                f"{store} has images of {images.shape[1]} x {images.shape[2]} pixels, more than the {pixels} a side "
                "that 'upsample' of the experiment asks for."
            )
        images = upsample(images, image["range"].values, carrier, pixels)
    return Observations(images, np.full(len(images), target_of(store)), *(angle.ravel() for angle in angles))


def among(angles, some):
    """Which of the angles (n,) are among some others, within TOLERANCE: booleans (n,)."""
    return (np.abs(np.asarray(angles)[:, None] - np.asarray(some, float)) < TOLERANCE).any(axis=1)


def _select(image, name, angles, store):
    have, angles = image[name].values, np.atleast_1d(np.asarray(angles, float))
    missing = angles[~among(angles, have)]
    if len(missing):
        raise InputError(f"{store} has no {name} {missing[0]:g} degrees; it has {', '.join(f'{a:g}' for a in have)}.")
    return image.isel({name: np.flatnonzero(among(have, angles))})
