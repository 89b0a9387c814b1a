"""Make a target's store from a field of another program: FEKO's far fields (.ffe) or a store of the same format."""

import numpy as np
import pandas as pd

from isarflow.core.errors import InputError
from isarflow.core.sweep import azimuths, elevations, frequencies
from isarflow.scattering.fields import ffe, field_files
from isarflow.scattering.fields.given_store import poses_of, read_store
from isarflow.scattering.fields.off_grid import read_measured
from isarflow.scattering.fields.places import ANGLE, AbsentError, find, text
from isarflow.scattering.fields.store import versions, write_field

MIRRORED = 0.1  # relative: largest rms difference of a field from its mirror image; meshes are not symmetric


def write_external(field, store_path, radar, aspect, symmetry=(), origin=None, steps=None):
    """Write the store of a target with a `field` in its config: the samples at the sweep's frequencies and directions.

    field: a path to a zarr store or .ffe file, a list of .ffe files, or {V: ..., H: ...} of those. symmetry: the
    target's mirror planes in the config. origin: the SHA-256 of each path, where it is known already. steps: what a
    measured store goes through before (see `off_grid`), {key: value} of `field_files.STEPS` in the target's config.
    Raises InputError if a sample of the sweep is missing, given twice with two values or not finite, and if mirror
    images differ. Warnings are printed and become the store's attribute `warnings`.
    """
    wanted = {"frequency": frequencies(radar), "elevation": elevations(aspect), "azimuth": azimuths(aspect)}
    if field_files.is_store(field):
        count = poses_of(field)
        poses = [None] if count is None else range(count)
        read = [_from_store(field, radar["polarizations"], wanted, symmetry, pose, steps=steps) for pose in poses]
        samples, warnings = np.array([part for part, _ in read]), read[0][1]
    else:
        samples, warnings = _from_ffe(field, radar["polarizations"], wanted)[None], []
    with np.errstate(over="ignore"):
        samples = samples.astype(np.complex64)
    named = ", ".join(field_files.paths(field))
    for of_pose in samples:
        _check_finite(named, radar["polarizations"], of_pose, wanted)
        for way, part in zip(radar["polarizations"], of_pose, strict=True):
            _check_not_zero(named, way, part, wanted)
            for plane in symmetry:
                _check_mirrored(named, way, part, wanted, plane)
    origin = origin or {path: field_files.digest(path) for path in field_files.paths(field)}
    attrs = {"formulation": "external", "origin": origin, "unknowns": None, "residual": None}
    attrs["versions"] = versions("numpy", "xarray")
    attrs |= {"warnings": warnings} if warnings else {}
    samples = samples if len(samples) > 1 else samples[0]
    write_field(store_path, samples, radar["polarizations"], *wanted.values(), attrs)
    for path, digest in origin.items():
        print(f"field from {path}, SHA-256 {digest}")
    for sentence in warnings:
        print(f"Warning: {sentence}")


def _from_store(*place, steps):
    """The wanted samples of a store and a list of warnings: as they are there, or measured and interpolated."""
    try:
        return read_measured(*place, steps, f"{place[0]}:") if steps else read_store(*place)
    except AbsentError as absent:
        if steps:
            raise
        return read_measured(*place, why=str(absent))


def _check_finite(named, polarizations, samples, wanted):
    wrong = np.argwhere(~np.isfinite(samples))
    if len(wrong):
        way, *index = wrong[0]
        place = ", ".join(
            f"{name} {text(name, values[i])}" for (name, values), i in zip(wanted.items(), index, strict=True)
        )
        count = f"{len(wrong)} of {samples.size} samples"
        raise InputError(f"{named}: {count} are not finite; the first is {polarizations[way]} at {place}.")


def _check_not_zero(named, way, samples, wanted):
    """Refuse co-polarized samples that are 0 at all azimuths: no target has such a field, a file cut short may."""
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
    images, originals = np.nonzero(apart < ANGLE)
    sign = 1 if way[0] == way[1] else -1  # H or V turns round
    scale = np.linalg.norm(samples)
    different = np.linalg.norm(samples[..., images] - sign * samples[..., originals]) / scale if scale > 0 else 0
    if different > MIRRORED:
        raise InputError(
            f"{named}: the {way} field differs from its mirror image in the plane {plane} by {100 * different:.0f} % "
            "of itself; take the plane out of the target's 'symmetry'."
        )


def _from_ffe(field, polarizations, wanted):
    """The wanted samples of FEKO's files, shape (polarization, frequency, elevation, azimuth)."""
    files = field_files.by_transmission(field, polarizations)
    received = {transmitted: _grid(paths, wanted) for transmitted, paths in files.items()}
    return np.stack([received[transmitted][way] for way, transmitted in polarizations])


def _grid(paths, wanted):
    """Samples on the sweep, (frequency, elevation, azimuth), of each received polarization."""
    waves, named, places = ffe.read(paths), ", ".join(paths), {}
    for name, values in wanted.items():
        given, row = np.unique(waves[name], return_inverse=True)
        of_given, places[name] = find(named, name, given, values)
        waves[name] = of_given[row]
    axes = [*wanted]
    waves = waves[(waves[axes] >= 0).all(axis=1)]
    first = ffe.once(waves, [waves[name] for name in axes]).set_index(axes)
    asked = pd.MultiIndex.from_product(places.values(), names=axes)
    if len(missing := asked.difference(first.index)):
        coordinates = zip(wanted.items(), missing[0], strict=True)
        place = ", ".join(f"{name} {text(name, values[i])}" for (name, values), i in coordinates)
        raise InputError(f"{named}: {len(missing)} of {len(asked)} samples are missing; the first is at {place}.")
    shape = [len(values) for values in wanted.values()]
    return {way: first[way].reindex(asked).to_numpy().reshape(shape) for way in "VH"}
