"""Make a target's store from a field of another program: FEKO's far fields (.ffe) or a store of the same format."""

import contextlib

import numpy as np
import pandas as pd
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.store import check_given
from isarflow.core.sweep import azimuths, elevations, frequencies
from isarflow.scattering import ffe, field_files
from isarflow.scattering.store import CONVENTION, COORDINATES, versions, write_field

# Largest distance of a sample from the place that the sweep asks for. Nothing is interpolated.
TOLERANCES = {"frequency": 1e-6, "elevation": ffe.ANGLE, "azimuth": ffe.ANGLE}  # relative, degrees, degrees
UNITS = {"frequency": "Hz", "elevation": "degrees", "azimuth": "degrees"}
KEYS = {"frequency": "radar", "elevation": "aspect.elevation", "azimuth": "aspect.azimuth"}
MIRRORED = 0.1  # relative: largest rms difference of a field from that of its mirror image; meshes are not symmetric
SAME = 1e-4  # relative: samples of one direction that agree so well count as one, as at both ends of a closed circle


def write_external(field, store_path, radar, aspect, symmetry=(), origin=None):
    """Write the store of a target with a `field` in its config: the samples at the sweep's frequencies and directions.

    field: a path to a zarr store or .ffe file, a list of .ffe files, or {V: ..., H: ...} of those. symmetry: the
    target's mirror planes in the config. origin: the SHA-256 of each path, where it is known already.
    Raises InputError if a sample of the sweep is missing, given twice or not finite, and if mirror images differ.
    """
    wanted = {"frequency": frequencies(radar), "elevation": elevations(aspect), "azimuth": azimuths(aspect)}
    take = _from_store if field_files.is_store(field) else _from_ffe
    samples = take(field, radar["polarizations"], wanted).astype(np.complex64)
    named = ", ".join(field_files.paths(field))
    if not np.isfinite(samples).all():
        raise InputError(f"{named}: the field holds values that are not finite.")
    for way, part in zip(radar["polarizations"], samples, strict=True):
        _check_not_zero(named, way, part, wanted)
        for plane in symmetry:
            _check_mirrored(named, way, part, wanted, plane)
    origin = origin or {path: field_files.digest(path) for path in field_files.paths(field)}
    attrs = {"formulation": "external", "origin": origin, "unknowns": None, "residual": None}
    attrs["versions"] = versions("numpy", "xarray")
    write_field(store_path, samples, radar["polarizations"], *wanted.values(), attrs)
    for path, digest in origin.items():
        print(f"field from {path}, SHA-256 {digest}")


def _check_not_zero(named, way, samples, wanted):
    """Refuse co-polarized samples that are 0 at all azimuths, as zarr reads a chunk whose file is missing."""
    empty = np.argwhere((samples == 0).all(axis=-1)) if way[0] == way[1] else ()
    if len(empty):
        frequency, elevation = wanted["frequency"][empty[0][0]], wanted["elevation"][empty[0][1]]
        raise InputError(
            f"{named}: the {way} field is 0 at all azimuths of {elevation:g} degrees elevation at "
            f"{frequency / 1e9:g} GHz, and of {len(empty)} such rings in all; are files of it missing?"
        )


def _check_mirrored(named, way, samples, wanted, plane):
    """Refuse a field that is not symmetric about a mirror plane, at directions whose mirror images are in the sweep."""
    azimuth, elevation = wanted["azimuth"], wanted["elevation"]
    if plane == "xy":
        apart, samples = np.abs(elevation[:, None] + elevation), np.swapaxes(samples, -1, -2)
    else:
        mirrored = -azimuth if plane == "xz" else 180 - azimuth
        apart = np.abs((azimuth[:, None] - mirrored + 180) % 360 - 180)
    there, here = np.nonzero(apart < ffe.ANGLE)
    sign = 1 if way[0] == way[1] else -1  # H or V turns round
    scale = np.linalg.norm(samples)
    different = np.linalg.norm(samples[..., there] - sign * samples[..., here]) / scale if scale > 0 else 0
    if different > MIRRORED:
        raise InputError(
            f"{named}: the {way} field differs from its mirror image in the plane {plane} by {100 * different:.0f} % "
            "of itself; take the plane out of the target's 'symmetry'."
        )


def check_polarizations(path, polarizations):
    """Raise InputError for a store of a field without one of the polarizations. Nothing else is read."""
    with _opened(path) as dataset:
        there = dataset["polarization"].values
    _places_of(path, there, polarizations)


@contextlib.contextmanager
def _opened(path):
    """The dataset of a store from another program. InputError if it is not one of a field."""
    try:
        with xr.open_zarr(path) as dataset:
            yield dataset
    except (KeyError, ValueError, OSError, RuntimeError) as error:
        wanted = f"a store with a variable 'field' over {', '.join(COORDINATES)}"
        raise InputError(f"{path}: not {wanted} ({error}).") from None


def _from_store(path, polarizations, wanted):
    """The wanted samples of a scattering store, shape (polarization, frequency, elevation, azimuth)."""
    check_given(path)
    with _opened(path) as dataset:
        field = dataset["field"].transpose(*COORDINATES).load()
        given = {name: np.asarray(field[name].values, float) for name in wanted}
    if (convention := dataset.attrs.get("convention", CONVENTION)) != CONVENTION:
        raise InputError(f"{path}: the store's convention is '{convention}'; wanted is '{CONVENTION}'.")
    if not np.iscomplexobj(field.values):
        raise InputError(f"{path}: the field is {field.dtype}; wanted are complex scattering amplitudes.")
    for name, unit in ({"field": "m"} | UNITS).items():
        if (stated := dataset[name].attrs.get("units", unit)) != unit:
            raise InputError(f"{path}: its {name} is in '{stated}', not in {unit}.")
    ways = _places_of(path, field.polarization.values, polarizations)
    places = [_places(path, name, given[name], values) for name, values in wanted.items()]
    return field.values[np.ix_(ways, *places)]


def _places_of(path, there, polarizations):
    """Positions of the polarizations in a store. InputError if one is not there exactly once."""
    there = [str(name) for name in there]
    absent = [name for name in polarizations if there.count(name) != 1]
    if absent:
        raise InputError(
            f"{path}: no polarization {', '.join(absent)}, which config key 'radar.polarizations' asks for; "
            f"there is {', '.join(there)}."
        )
    return [there.index(name) for name in polarizations]


def _from_ffe(field, polarizations, wanted):
    """The wanted samples of FEKO's files, shape (polarization, frequency, elevation, azimuth)."""
    files = field_files.by_transmission(field, polarizations)
    received = {transmitted: _grid(paths, wanted) for transmitted, paths in files.items()}
    return np.stack([received[transmitted][way] for way, transmitted in polarizations])


def _grid(paths, wanted):
    """Samples on the sweep, (frequency, elevation, azimuth), of each received polarization."""
    waves = pd.concat([ffe.read(path).assign(path=path) for path in paths], ignore_index=True)
    named, axes = ", ".join(paths), [*wanted]
    for name, values in wanted.items():
        given = np.unique(waves[name])
        places = given[_places(named, name, given, values)]
        waves[name] = waves[name].map(dict(zip(places, values, strict=True)))
    waves = waves.dropna(subset=axes)
    first = waves.drop_duplicates(axes).set_index(axes)
    kept = first.loc[pd.MultiIndex.from_frame(waves[axes])]
    mine, firsts = (table[["V", "H"]].to_numpy() for table in (waves, kept))
    different = np.flatnonzero(np.linalg.norm(mine - firsts, axis=1) > SAME * np.linalg.norm(firsts, axis=1))
    if len(different):
        one, other = (table.iloc[different[0]] for table in (kept, waves))
        raise InputError(
            f"{other.path}, line {other.line}: another field for the frequency and direction of {one.path}, line "
            f"{one.line}. If these are two incident polarizations, write them to separate files and name them "
            "{V: ..., H: ...}."
        )
    every = pd.MultiIndex.from_product(wanted.values(), names=axes)
    if len(missing := every.difference(first.index)):
        at = ", ".join(f"{name} {_text(name, value)}" for name, value in zip(axes, missing[0], strict=True))
        raise InputError(f"{named}: {len(missing)} of {len(every)} samples are missing; the first is at {at}.")
    shape = [len(values) for values in wanted.values()]
    return {way: first[way].reindex(every).to_numpy().reshape(shape) for way in "VH"}


def _places(where, name, given, wanted):
    """Positions of the wanted values among the given ones of an axis. InputError if one is not there exactly once."""
    apart = np.abs(np.asarray(given, float) - wanted[:, None])
    if name == "frequency":
        apart /= wanted[:, None]
    if name == "azimuth":
        apart = np.abs((apart + 180) % 360 - 180)
    near = apart < TOLERANCES[name]
    missing, twice = wanted[~near.any(axis=1)], wanted[near.sum(axis=1) > 1]
    if len(missing):
        raise InputError(
            f"{where}: no {name} {_text(name, *missing)}, which config key '{KEYS[name]}' asks for; there is "
            f"{_text(name, *given)}."
        )
    if len(twice):
        raise InputError(f"{where}: {name} {_text(name, twice[0])} is there more than once.")
    return near.argmax(axis=1)


def _text(name, *values):
    """Values of a coordinate with their unit, at most six of them."""
    shown = [f"{value:.9g}" for value in values]
    if len(shown) > 6:
        shown = [*shown[:3], f"... ({len(shown)} in all)", *shown[-2:]]
    return f"{', '.join(shown)} {UNITS[name]}"
