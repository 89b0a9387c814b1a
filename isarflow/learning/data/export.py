"""Write images with labels, splits and origin as plain arrays, for other programs."""

from pathlib import Path

import h5py
import numpy as np
import xarray as xr

from isarflow.core import store
from isarflow.core.errors import InputError
from isarflow.core.sweep import snr_of_label
from isarflow.imaging.store import VARIABLES
from isarflow.learning.data import images
from isarflow.learning.data.split import SETTINGS, SIDES, check, divisions, split
from isarflow.learning.experiments import CLEAN

GUARD = "guard"  # an image that a split leaves out
NUMBERED = ", ".join(f"{number} {side}" for number, side in enumerate((*SIDES, GUARD)))
ROWS = 1024  # images per chunk, at most
ABOUT = {
    **VARIABLES,
    "image": ("1", "ISAR image divided by its peak magnitude, (n, [channel,] range, crossrange)"),
    "label": ("1", "class: the target's number in the attribute 'targets', from 0"),
    "snr": ("dB", "signal-to-noise ratio; infinite without noise"),
}


def export(stores, path, roles, planes, settings, seed, aperture):
    """Write the images of all targets at one SNR to `path`, an HDF5 file (.h5) or a zarr store (.zarr).

    docs/exported-images.md says what it holds. stores: imaging/<target>/<label>.zarr; roles, planes: of the targets,
    the latter their mirror planes; settings: the config's `learning.split`.
    """
    targets, label = sorted(roles), Path(stores[0]).stem
    with xr.open_zarr(stores[0]) as first:
        elevation, azimuth, attrs = first.elevation.values, first.azimuth.values, first.attrs
        axes = [name for name in ("channel", "range", "crossrange") if name in first.dims]
        grid = {name: (name, first[name].values, first[name].attrs) for name in axes}
    found, origin = images.read(stores, dict.fromkeys(targets, azimuth))
    snr = np.inf if label == CLEAN else snr_of_label(label)
    values = {
        "image": found,
        "label": origin.target.map(targets.index).to_numpy(np.int8),
        **{name: origin[name].to_numpy(np.float32) for name in ("elevation", "azimuth")},
        "realization": origin.realization.to_numpy(np.int16),
        "snr": np.full(len(origin), snr, np.float32),
    }
    about = {name: dict(zip(("units", "long_name"), of, strict=True)) for name, of in ABOUT.items()}
    data = {name: (("n", *axes) if name == "image" else "n", of, about[name]) for name, of in values.items()}
    place = values["label"], np.searchsorted(elevation, origin.elevation), np.searchsorted(azimuth, origin.azimuth)
    for name, table in splits(elevation, azimuth, roles, planes, settings, seed, aperture).items():
        said = {"units": "1", "long_name": f"side under {name.replace('_', ' ')}: {NUMBERED}"}
        data[f"split_{name}"] = "n", table[place], said
    dataset = xr.Dataset(data, grid)
    dataset.attrs = {"targets": targets, "roles": [roles[name] for name in targets], "sides": [*SIDES, GUARD]}
    dataset.attrs |= {key: attrs[key] for key in ("polarization", "snr_definition") if key in attrs}
    rows = -(-len(found) // -(-len(found) // ROWS))  # even chunks: a zarr store's last one is as large as the others
    chunks = rows, *found.shape[1:]
    if Path(path).suffix == ".h5":
        _write_hdf5(dataset, path, chunks)
    else:
        store.write(dataset, path, {"image": {"chunks": chunks, "compressors": None}})  # noise does not compress
    print(f"{len(found)} images of {' x '.join(map(str, found.shape[-2:]))} pixels: {path}")


def splits(elevation, azimuth, roles, planes, settings, seed, aperture):
    """The side of every view, as numbers of SIDES and, last, GUARD: tables (targets, elevations, azimuths), int8.

    Named `random`, `sector_<fold>` and so on; targets in order of their names. A division that leaves a known target a
    side without images is left out.
    """
    tables = {}
    of_views = [scheme for scheme in SETTINGS if scheme != "family"]
    for division in (one for scheme in of_views for one in divisions(scheme, settings, seed, aperture)):
        name = f"{division.scheme}_{division.fold}" if division.fold else division.scheme
        table = np.full((len(roles), len(elevation), len(azimuth)), len(SIDES), np.int8)
        try:
            for own, target in zip(table, sorted(roles), strict=True):
                found = split(elevation, azimuth, planes[target], division)
                if roles[target] == "known":
                    check(found, division, target, len(azimuth))
                for number, side in enumerate(SIDES):
                    own[np.ix_(*found[side])] = number
        except InputError as error:  # the sweep is too short for it
            print(f"Warning: no split_{name}: {error}")
        else:
            tables[name] = table
    return tables


def _write_hdf5(dataset, path, chunks):
    # Renamed when it is whole; a complex number is a compound of r and i, as h5py and MATLAB read it.
    part = Path(f"{path}.part")
    text = h5py.string_dtype()
    with h5py.File(part, "w") as file:
        for name, variable in dataset.variables.items():
            data = variable.values.astype(text if variable.dtype.kind == "U" else variable.dtype, copy=False)
            own = chunks if name == "image" else None
            file.create_dataset(name, data=data, chunks=own).attrs.update(variable.attrs)
        for name, value in dataset.attrs.items():
            file.attrs[name] = value if isinstance(value, str) else np.array(value, text)
    part.rename(path)
