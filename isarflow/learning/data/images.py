"""Read images from their stores, with the origin of each."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from isarflow.core.errors import InputError
from isarflow.core.store import open_store
from isarflow.learning.data.features import of_peak_one, upsample
from isarflow.learning.data.split import Division, blocks, folded, split
from isarflow.learning.experiments import TOLERANCE

ORIGIN = ("elevation", "azimuth", "realization")
RECEIVED = "received"


def target_of(store):
    """The target's name: stores are imaging/<target>/<label>.zarr."""
    return Path(store).parent.name


def azimuths(store):
    """The azimuths of a store in degrees, shape (azimuths,)."""
    with open_store(store) as dataset:
        return dataset.azimuth.values.astype(float)


class Divided(NamedTuple):
    """Division of a target's views. elevation, azimuth: of the sweep, degrees; sides, blocks: see `split`."""

    elevation: np.ndarray
    azimuth: np.ndarray
    sides: dict
    blocks: np.ndarray

    def angles(self, *sides):
        """Elevations and azimuths in degrees of these sides together, ascending."""
        index = [np.unique(np.concatenate(parts)) for parts in zip(*(self.sides[side] for side in sides), strict=True)]
        return self.elevation[index[0]], self.azimuth[index[1]]

    def on(self, origin, *sides):
        """True for rows of `origin`, images of this target, whose views are on these sides: booleans (n,)."""
        elevation, azimuth = self.angles(*sides)
        return np.isin(origin["elevation"], elevation) & np.isin(origin["azimuth"], azimuth)


def divide(stores, planes, run):
    """The `Divided` of each target of the stores, by its name.

    planes: of the targets by name; pure noise has none. run: one of `experiments.runs`.
    """
    division = Division(**run["division"])
    divided, one_of_each = {}, {target_of(store): store for store in stores}  # a target's stores have the same views
    for target, store in sorted(one_of_each.items()):
        with open_store(store) as dataset:
            angles = [dataset[name].values.astype(float) for name in ("elevation", "azimuth")]
        own = planes.get(target, ())
        divided[target] = Divided(
            *angles, split(*angles, own, division, target), blocks(angles[1], own, division, target)
        )
    return divided


def read_side(stores, divided, run, *sides, elevation="all", realizations=None):
    """Read the views of these sides of each target, as a run's models see them. divided: the result of `divide`.

    elevation, realizations: as of `read`; the former of a run that trains at some elevations alone, which no split by
    elevation has.
    """
    angles = {target: of.angles(*sides) for target, of in divided.items()}
    angles = {target: of for target, of in angles.items() if all(map(len, of))}  # by family a target has one side
    stores = [store for store in stores if target_of(store) in angles]
    every = next(iter(angles.values()))[0]  # the sweep's, and so the same for all targets
    azimuth = {target: of[1] for target, of in angles.items()}
    at = azimuth, every if isinstance(elevation, str) else elevation
    return read(stores, *at, run["upsample"], realizations, run["channels"])


def read(stores, azimuth, elevation="all", pixels="none", realizations=None, channels="all"):
    """All images of the stores at some azimuths and elevations (degrees; elevation may be 'all').

    azimuth: a mapping of each target to its azimuths. pixels: 'none', or the number a side after up-sampling.
    realizations: the most of each view's noise, the first ones; None for all. channels: the polarizations that are
    taken, or 'all'; images of some are divided by the peak of these.
    Returns the images, complex64 (n, [channel,] range, crossrange), with an axis of several channels in the store's
    order, and a DataFrame with the origin of each: label (of its SNR, as 'clean' or 'snr_6dB'), target, elevation,
    azimuth (degrees) and realization, 0 in a store without noise; of noisy images also snr_<definition>, each one's own
    SNR in dB, and received, the pulses as text of 0 and 1, if some may be lost. Rows are in the order of the former
    columns, each store's angles in the store's order.
    Raises InputError for an image that is not finite, and KeyError for an angle that a store does not have.
    """
    stores = sorted(map(Path, stores), key=lambda store: (store.stem, target_of(store)))
    how = elevation, pixels, realizations, channels
    images, origins = zip(*(_read(store, azimuth[target_of(store)], *how) for store in stores), strict=True)
    return np.concatenate(images), pd.concat(origins, ignore_index=True)


def _read(store, azimuth, elevation, pixels, realizations, channels):
    with open_store(store, indexed=False) as dataset:
        dataset, is_part = _of_channels(dataset, channels)
        if "realization" in dataset.dims:
            dataset = dataset.isel(realization=slice(realizations)).drop_vars("peak", errors="ignore")
        else:
            dataset = dataset[["image"]].expand_dims(realization=[0])
        if not isinstance(elevation, str):
            dataset = _at(dataset, elevation=elevation)
        # Loaded before azimuths are chosen: a chunk has all of them, and choosing while reading takes twice as long.
        dataset = _at(dataset.load(), azimuth=azimuth)
    image = dataset["image"].transpose(*ORIGIN, "channel", "range", "crossrange", missing_dims="ignore")
    if not np.isfinite(image.values).all():
        raise InputError(f"{store} holds images that are not finite; delete it and make it again.")
    images = image.values.reshape(-1, *image.shape[len(ORIGIN) :])
    images = of_peak_one(images) if is_part else images
    if pixels != "none":
        images = upsample(images, image["range"].values, dataset.attrs["range_wavenumber"], pixels)
    origin = pd.MultiIndex.from_product([image[name].values for name in ORIGIN], names=ORIGIN).to_frame(index=False)
    origin.insert(0, "label", store.stem)
    origin.insert(1, "target", target_of(store))
    if RECEIVED in dataset:
        pulses = dataset[RECEIVED].transpose(*ORIGIN, "pulse").values
        origin[RECEIVED] = ["".join(row) for row in np.where(pulses.reshape(len(origin), -1), "1", "0")]
    for name in [name for name in dataset if name.startswith("snr_")]:
        origin[name] = np.repeat(dataset[name].transpose("elevation", "azimuth").values, image.sizes["realization"])
    return images, origin


def _of_channels(dataset, channels):
    """A store's dataset in these channels, without an axis for a single one, and whether it has other channels."""
    if channels == "all" or "channel" not in dataset.dims:
        return dataset, False
    wanted = np.flatnonzero(dataset["channel"].isin(channels))
    some = dataset.isel(channel=wanted if len(wanted) > 1 else wanted[0], drop=True)
    return some, len(wanted) < dataset.sizes["channel"]


def aspects(origin, planes):
    """The target and aspect of each row of `origin`, (n,) as text: the same for a view and its mirror image.

    planes: of the targets by name, their mirror planes; pure noise has none.
    """
    found = np.empty(len(origin), object)
    for target, rows in origin.groupby("target").indices.items():
        of_target = folded(origin["azimuth"].to_numpy()[rows], planes.get(target, ()))
        found[rows] = [f"{target} {aspect:.4f}" for aspect in of_target + 0.0]
    return found.astype(str)


def among(angles, others):
    """True for angles (n,) that are among the others, within TOLERANCE: booleans (n,)."""
    return (np.abs(np.asarray(angles)[:, None] - np.asarray(others, float)) < TOLERANCE).any(axis=1)


def _at(dataset, **angles):
    """A dataset at these angles, in its own order. KeyError if it has not all of them."""
    places = {}
    for name, wanted in angles.items():
        there = dataset[name].values
        if not among(np.ravel(wanted), there).all():
            raise KeyError(f"not all of these are an {name} of the images: {wanted}")
        places[name] = np.flatnonzero(among(there, np.ravel(wanted)))
    return dataset.isel(places)
