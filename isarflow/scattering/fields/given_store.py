"""Read the samples of a sweep from a zarr store of another program, and refuse what it only seems to hold."""

import contextlib

import numpy as np
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.store import SUMS, absent_chunks, absent_samples, check_given, chunk_of, has_list
from isarflow.scattering.fields.places import ANGLE, UNITS, AbsentError, apart, differ, find, text
from isarflow.scattering.fields.store import CONVENTION, COORDINATES

WORDS = {  # of units, in small letters
    "m": ("m", "meter", "meters", "metre", "metres"),
    "Hz": ("hz", "hertz"),
    "degrees": ("degrees", "degree", "deg", "°"),
}
PULSE = "pulse"  # the dimension of a list of pulses
LEFT_OUT = "Zarr leaves out chunks of nothing but zeros, and reads one that is lost as zeros, too"
WHOLE = "Copy the store anew; if it is complete, write it with all chunks (write_empty_chunks=True)."


def check_polarizations(path, polarizations):
    """Raise InputError for a folder that is no store of a field, and for one without one of the polarizations."""
    with _opened(path) as (_, axes):
        if not has_list(path):
            _absent_coordinates(path, axes)
    _ways(path, axes["polarization"], polarizations)


def poses_of(path):
    """The number of poses of a scattering store, of a target that moves; None of one without such a dimension."""
    with _opened(path) as (dataset, _):
        return dataset.sizes.get("pose")


def read_store(path, polarizations, wanted, symmetry=(), pose=None):
    """The wanted samples of a scattering store, (polarization, frequency, elevation, azimuth), and a list of warnings.

    wanted: {axis: values (N,)}. symmetry: the target's mirror planes; with xz a sample at an azimuth that is not there
    is that of the opposite azimuth, of which cross-polarized ones have the other sign. Coordinates and co-polarized
    samples whose chunk is absent are refused, unless the store has a list of its files; cross-polarized samples, which
    may be 0, are warned of. pose: the number of that which is read, of a store with poses, which must have such a list.
    """
    listed = check_given(path)
    if pose is not None and not listed:
        raise InputError(f"{path}: a store with poses has a list of its files, {SUMS}, and this one has none.")
    with _opened(path) as (dataset, axes):
        field = dataset["field"] if pose is None else dataset["field"].isel(pose=pose, drop=True)
        _check_kind(path, dataset)
        if PULSE in field.dims:
            raise AbsentError(f"{path}: a list of pulses is brought to the sweep's azimuths.")
        warnings = [] if listed else _absent_coordinates(path, axes)
        opposite = _opposite(axes["azimuth"], wanted["azimuth"]) if "xz" in symmetry else np.zeros(0, int)
        wanted = wanted | {"azimuth": wanted["azimuth"].copy()}
        wanted["azimuth"][opposite] *= -1
        numbers = {"polarization": _ways(path, axes["polarization"], polarizations)}
        numbers |= {name: find(path, name, axes[name], values) for name, values in wanted.items()}
        kept = {name: np.flatnonzero(of_given >= 0) for name, (of_given, _) in numbers.items()}
        if not listed:
            warnings += _absent_samples(path, field.dims, axes, kept)
        samples = field.expand_dims([*axes.keys() - {*field.dims}]).transpose(*COORDINATES).isel(kept).values
    for axis, (name, (of_given, _)) in enumerate(numbers.items()):
        samples = _once(path, samples, axis, of_given[kept[name]], axes[name][kept[name]])
    places = [np.searchsorted(np.unique(of_wanted), of_wanted) for _, of_wanted in numbers.values()]
    samples = samples[np.ix_(*places)]
    crossed = [place for place, way in enumerate(polarizations) if way[0] != way[1]]
    samples[np.ix_(crossed, range(samples.shape[1]), range(samples.shape[2]), opposite)] *= -1
    return samples, warnings


def read_pulses(path, polarizations, pose=None):
    """All samples of a store, a grid or a list of pulses, over (polarization, frequency, pulse); frequencies ascend."""
    listed = check_given(path)
    with _opened(path) as (dataset, axes):
        _check_kind(path, dataset)
        if not listed and (absent := absent_chunks(path, "field")):
            raise InputError(f"{path}: {absent} chunk(s) of the field are absent. {LEFT_OUT}. {WHOLE}")
        # All pulses may have the elevation 0.
        warnings = [] if listed else _absent_coordinates(path, {name: np.unique(axes[name]) for name in axes})
        _ways(path, axes["polarization"], polarizations)
        field = dataset["field"] if pose is None else dataset["field"].isel(pose=pose, drop=True)
        order = ["polarization", "frequency", *([PULSE] if PULSE in field.dims else ["elevation", "azimuth"])]
        samples = field.expand_dims([name for name in order if name not in field.dims]).transpose(*order).values
    ways = [axes["polarization"].tolist().index(way) for way in polarizations]
    ascending, angles = np.argsort(axes["frequency"]), (axes["elevation"], axes["azimuth"])
    angles = np.broadcast_arrays(*angles) if PULSE in order else np.meshgrid(*angles, indexing="ij")
    samples = samples.reshape(*samples.shape[:2], -1)[ways][:, ascending]
    coordinates = {"polarization": polarizations, "frequency": axes["frequency"][ascending]}
    coordinates |= {"elevation": (PULSE, angles[0].ravel()), "azimuth": (PULSE, angles[1].ravel())}
    return xr.DataArray(samples, coordinates, [*order[:2], PULSE], attrs={"path": path, "warnings": warnings})


def _opposite(given, wanted):
    """Return the places of the wanted azimuths that are not given, but whose opposites are."""
    there, opposite_there = ((apart("azimuth", given, sign * wanted[:, None]) < ANGLE).any(axis=1) for sign in (1, -1))
    return np.flatnonzero(~there & opposite_there)


@contextlib.contextmanager
def _opened(path):
    """The dataset of a store from another program, and the values of its axes. InputError if it is not one of a field.

    An axis of one value may be a scalar, over which the field is not. Angles of pulses have the dimension PULSE.
    """
    try:
        with xr.open_zarr(path, mask_and_scale=False, decode_times=False) as raw:
            for variable in raw.variables.values():
                # Zarr's value of what was never written may have been written, too: 0 degrees, or no field.
                if variable.attrs.get("_FillValue") == 0:
                    del variable.attrs["_FillValue"]
            dataset = xr.decode_cf(raw, decode_times=False)
            if missing := [name for name in ("field", *COORDINATES) if name not in dataset.variables]:
                raise ValueError(f"it has no {', '.join(missing)}")
            over = dataset["field"].dims
            axes = {name: dataset.variables[name] for name in COORDINATES}
            several = {dim if dim == PULSE else name for name in axes for dim in axes[name].dims}
            if {*over} - {"pose"} != several or any(variable.ndim > 1 for variable in axes.values()):
                raise ValueError(f"its field is over {', '.join(map(str, over))}")
            values = {name: np.atleast_1d(variable.values) for name, variable in axes.items()}
            names = [name.decode() if isinstance(name, bytes) else str(name) for name in values["polarization"]]
            yield dataset, {"polarization": np.array(names)} | {name: values[name].astype(float) for name in UNITS}
    except (KeyError, ValueError, OSError, RuntimeError) as error:
        wanted = f"a store with a variable 'field' over {', '.join(COORDINATES)}"
        raise InputError(f"{path}: not {wanted} ({' '.join(str(error).split())}).") from None


def _check_kind(path, dataset):
    if (convention := dataset.attrs.get("convention", CONVENTION)) != CONVENTION:
        raise InputError(f"{path}: the store's convention is '{convention}'; wanted is '{CONVENTION}'.")
    if not np.issubdtype(dataset["field"].dtype, np.complexfloating):
        raise InputError(f"{path}: the field is {dataset['field'].dtype}; wanted are complex scattering amplitudes.")
    for name, unit in ({"field": "m"} | UNITS).items():
        stated = dataset.variables[name].attrs.get("units", unit)
        if str(stated).strip().lower() not in WORDS[unit]:
            raise InputError(f"{path}: its {name} is in '{stated}', not in {unit}.")


def _ways(path, stored, polarizations):
    """Number a store's polarizations and the wanted ones, as `places.find`. InputError if a wanted one is not there."""
    if absent := [name for name in polarizations if name not in stored]:
        raise InputError(
            f"{path}: no polarization {', '.join(absent)}, which config key 'radar.polarizations' asks for; "
            f"there is {', '.join(stored)}."
        )
    number = {name: place for place, name in enumerate(polarizations)}
    return np.array([number.get(name, -1) for name in stored]), np.arange(len(polarizations))


def _absent_coordinates(path, axes):
    """Warn of an axis of one value whose chunk is absent, as the chunk of a 0 may be. InputError for others."""
    warnings = []
    for name, values in axes.items():
        absent = absent_chunks(path, name)
        if absent and (len(values) > 1 or name not in UNITS or values[0] != 0):
            raise InputError(f"{path}: {absent} chunk(s) of the coordinate '{name}' are absent. {LEFT_OUT}. {WHOLE}")
        if absent:
            warnings.append(f"{path}: the chunk of its one {name} is absent. {LEFT_OUT}: taken as {text(name, 0)}.")
    return warnings


def _absent_samples(path, dims, axes, kept):
    """Warn of wanted cross-polarized samples whose chunk is absent. InputError, with the place, for co-polarized ones.

    dims: the field's. kept: positions along each axis of the wanted samples.
    """
    absent = absent_samples(path, "field", [kept[name] for name in dims])
    if not absent.any():
        if absent_count := absent_chunks(path, "field"):
            print(f"{path}: {absent_count} chunk(s) of the field are absent, none with samples of this sweep")
        return []
    absent = xr.DataArray(absent, dims=dims).expand_dims([*axes.keys() - {*dims}]).transpose(*COORDINATES).values
    copolarized = np.array([way[0] == way[1] for way in axes["polarization"][kept["polarization"]]])
    for kind, of_kind in (("co", copolarized), ("cross", ~copolarized)):
        lost = absent & of_kind[:, None, None, None]
        if not lost.any():
            continue
        first = {name: kept[name][place] for name, place in zip(axes, np.argwhere(lost)[0], strict=True)}
        file, spans = chunk_of(path, "field", [first[name] for name in dims])
        spans = dict(zip(dims, spans, strict=True))
        inside = {name: np.arange(len(values))[spans.get(name, slice(None))] for name, values in axes.items()}
        inside = {name: axes[name][np.intersect1d(kept[name], places)] for name, places in inside.items()}
        ways = [way for way in inside.pop("polarization") if (way[0] == way[1]) == (kind == "co")]
        place = ", ".join(f"{name} {text(name, *values)}" for name, values in inside.items())
        sentence = (
            f"{path}: a chunk of {file} is absent, with {', '.join(ways)} at {place}; in all {lost.sum()} of the "
            f"sweep's {absent[of_kind].size} {kind}-polarized samples. {LEFT_OUT}"
        )
        if kind == "co":
            raise InputError(f"{sentence}. {WHOLE}")
    return [f"{sentence}: these are taken as 0."]


def _once(path, samples, axis, numbers, values):
    """The samples with one place for each number along an axis, in order. InputError if two of a number differ."""
    kinds, first = np.unique(numbers, return_index=True)
    name = [*COORDINATES][axis]
    for repeat in np.setdiff1d(np.arange(len(numbers)), first):
        same = first[np.searchsorted(kinds, numbers[repeat])]
        first_field, repeat_field = (np.moveaxis(samples.take([place], axis), 0, -1) for place in (same, repeat))
        if differ(repeat_field, first_field).any():
            places = [values[same], values[repeat]]
            pair_text = " and ".join(map(str, places)) if name == "polarization" else text(name, *places)
            gap = 100 * np.linalg.norm(repeat_field - first_field) / max(np.linalg.norm(first_field), 1e-30)
            raise InputError(
                f"{path}: {name} {pair_text} are one place, and the fields there differ by {gap:.3g} %; leave one out."
            )
    return samples.take(first, axis)
