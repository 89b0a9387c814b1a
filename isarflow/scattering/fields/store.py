"""Write the store of a field, and join the bands of a target."""

import importlib.metadata
import platform

import numpy as np
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.store import open_store, write

CONVENTION = (
    "E_s = field exp(-j k r) / r for a unit incident plane wave, exp(+j omega t), phase referred to the origin; "
    "RCS = 4 pi |field|^2; a scatterer d metres nearer to the radar than the origin has phase exp(+2 j k d)"
)
LISTED = "unknowns", "residual"  # attributes with a value for each frequency
POSE = {"units": "1", "long_name": "number of the pose of a target that moves, in its cycle"}
COORDINATES = {
    "polarization": {"units": "1", "long_name": "receive and transmit polarization (V = elevation, H = azimuth)"},
    "frequency": {"units": "Hz", "long_name": "frequency"},
    "elevation": {"units": "degrees", "long_name": "elevation of the radar above the horizon"},
    "azimuth": {"units": "degrees", "long_name": "azimuth of the radar, from the nose (x) towards y"},
}


def write_field(store_path, field, polarizations, frequency, elevation, azimuth, attrs, receivers=()):
    """Write a scattering store. field: complex64 (polarization, frequency, elevation, azimuth) in m; Hz, degrees.

    For directions one by one the field is (polarization, frequency, direction), elevation and azimuth (direction,).
    receivers: elevation and azimuth (R,) of a bistatic field, whose last dimension they are. Of a target that moves the
    field may have poses before all other dimensions.
    Raises InputError for a field that is not finite.
    """
    axes = dict(zip(COORDINATES, COORDINATES, strict=True))
    if field.ndim == 3 + bool(receivers):
        axes |= dict.fromkeys(("elevation", "azimuth"), "direction")
    values = zip(COORDINATES, (polarizations, frequency, elevation, azimuth), strict=True)
    coordinates = {name: (axes[name], value, COORDINATES[name]) for name, value in values}
    dims, name = list(dict.fromkeys(axes.values())), "backscatter amplitude"
    if receivers:
        dims, name = [*dims, "receiver"], "bistatic amplitude"
        for angle, degrees in zip(("elevation", "azimuth"), receivers, strict=True):
            attributes = {"units": "degrees", "long_name": f"{angle} of the receiver"}
            coordinates[f"receiver_{angle}"] = ("receiver", degrees, attributes)
    elif field.ndim == 1 + len(dims):
        dims = ["pose", *dims]
        coordinates["pose"] = ("pose", np.arange(len(field)), POSE)
    dataset = xr.Dataset(
        {"field": (dims, field, {"units": "m", "long_name": name})},
        coords=coordinates,
        attrs={"convention": CONVENTION, **attrs},
    )
    _write(dataset, store_path)


def join_bands(band_paths, store_path, attrs=None, poses=()):
    """Join the bands of a target along frequency, with the attributes of all bands and `attrs` as well.

    poses: the paths of stores of its further poses, if it moves. The field has a first dimension `pose` then, and
    unknowns and residual are, of each frequency, the largest of all poses.
    """
    parts = [open_store(path).load() for path in band_paths]
    dataset = xr.concat(parts, "frequency", combine_attrs="override", data_vars="all")
    for name in LISTED:
        dataset.attrs[name] = [value for part in parts for value in part.attrs[name]]
    dataset.attrs |= attrs or {}
    if poses:
        every = [dataset, *(open_store(path).load() for path in poses)]
        numbers = xr.DataArray(np.arange(len(every)), dims="pose", name="pose", attrs=POSE)
        dataset = xr.concat(every, numbers, combine_attrs="override", data_vars="all")
        for name in LISTED:
            of_poses = zip(*(one.attrs[name] for one in every), strict=True)
            dataset.attrs[name] = [None if None in values else max(values) for values in of_poses]
    _write(dataset, store_path)


def versions(*packages):
    """The versions of Python and of these packages, for a store's attributes."""
    installed = {name: importlib.metadata.version(name) for name in packages}
    return {"python": platform.python_version()} | installed


def _write(dataset, path):
    if not np.isfinite(dataset.field.values).all():
        raise InputError(f"{path}: the field holds numbers that are not finite (NaN or infinite); it is not written.")
    # An image needs the whole sweep of an elevation.
    chunks = [1 if name == "elevation" else dataset.sizes[name] for name in dataset.field.dims]
    write(dataset, path, {"field": {"chunks": tuple(chunks)}})
