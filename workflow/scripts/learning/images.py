"""Images from their stores, and where each comes from."""

from pathlib import Path

import numpy as np
import pandas as pd

from core.errors import InputError
from core.store import open_store
from learning.experiments import TOLERANCE
from learning.features import upsample
from learning.split import split

ORIGIN = ("elevation", "azimuth", "realization")


def target_of(store):
    """The target's name: stores are imaging/<target>/<label>.zarr."""
    return Path(store).parent.name


def azimuths(store):
    """The azimuths of a store in degrees, shape (azimuths,)."""
    with open_store(store) as dataset:
        return dataset.azimuth.values.astype(float)


def azimuths_of(store, planes, division, *sides):
    """The azimuths in degrees of these sides of a store's target, ascending: arguments as of `split`."""
    every = azimuths(store)
    found = split(every, planes, division)
    return every[np.sort(np.concatenate([found[side] for side in sides]))]


def read(stores, azimuth, elevation="all", pixels="none"):
    """All images of the stores at some azimuths and elevations (degrees; elevation may be 'all').

    azimuth: a mapping of each target to its azimuths. pixels: 'none', or how many a side the images are up-sampled to.
    Gives the images, complex64 (n, range, crossrange), and a DataFrame of n rows that says where each comes from:
    columns label (of its SNR, as 'clean' or 'snr_6dB'), target, elevation, azimuth (degrees) and realization, which is
    0 in a store without noise. Rows are in the order of these columns, each store's angles as they stand there.
    Raises InputError for an angle that a store does not have, for an image that is not finite, and for fewer pixels
    than the images have.
    """
    stores = sorted(map(Path, stores), key=lambda store: (store.stem, target_of(store)))
    images, origins = zip(
        *(_read(store, azimuth[target_of(store)], elevation, pixels) for store in stores), strict=True
    )
    return np.concatenate(images), pd.concat(origins, ignore_index=True)


def _read(store, azimuth, elevation, pixels):
    with open_store(store) as dataset:
        image = dataset["image"]
        if "realization" not in image.dims:
            image = image.expand_dims(realization=[0])
        image = _select(image, "azimuth", azimuth, store)
        if not isinstance(elevation, str):
            image = _select(image, "elevation", elevation, store)
        image = image.transpose(*ORIGIN, "range", "crossrange").load()
        carrier = dataset.attrs["range_wavenumber"] if pixels != "none" else None
    if not np.isfinite(image.values).all():
        raise InputError(f"{store} holds images that are not finite; delete it and make it again.")
    images = image.values.reshape(-1, *image.shape[-2:])
    if pixels != "none":
        if pixels < max(images.shape[1:]):
            raise InputError(
                f"{store} has images of {images.shape[1]} x {images.shape[2]} pixels, more than the {pixels} a side "
                "that 'upsample' of the experiment asks for."
            )
        images = upsample(images, image["range"].values, carrier, pixels)
    origin = pd.MultiIndex.from_product([image[name].values for name in ORIGIN], names=ORIGIN).to_frame(index=False)
    origin.insert(0, "label", store.stem)
    origin.insert(1, "target", target_of(store))
    return images, origin


def snrs(store, origin):
    """Each image's own SNR in dB by each definition: columns by name, for the rows of a store's `origin`."""
    with open_store(store) as dataset:
        rows = [np.searchsorted(dataset[name].values, origin[name]) for name in ("elevation", "azimuth")]
        return {name: dataset[name].values[*rows] for name in dataset if name.startswith("snr_")}


def among(angles, others):
    """Which of the angles (n,) are among the others, within TOLERANCE: booleans (n,)."""
    return (np.abs(np.asarray(angles)[:, None] - np.asarray(others, float)) < TOLERANCE).any(axis=1)


def _select(image, name, angles, store):
    have, angles = image[name].values, np.atleast_1d(np.asarray(angles, float))
    missing = angles[~among(angles, have)]
    if len(missing):
        raise InputError(f"{store} has no {name} {missing[0]:g} degrees; it has {', '.join(f'{a:g}' for a in have)}.")
    return image.isel({name: np.flatnonzero(among(have, angles))})
