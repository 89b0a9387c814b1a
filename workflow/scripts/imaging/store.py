"""From a target's field to its stores of images, clean or at one SNR."""

import json
from pathlib import Path

import numpy as np
import xarray as xr
from tqdm import tqdm

from core import store as stores
from core import sweep
from core.errors import InputError
from imaging.formation import apertures, form_images
from imaging.geometry import PURE_NOISE, centres, describe, geometry, imager_of, warnings
from imaging.noise import DEFINITIONS, definition_offset, generator, signal_power, variances, white_noise

# What of the geometry stands in every store's attributes.
STATED = ("aperture_angle", "range_resolution", "crossrange_resolution", "range_extent", "crossrange_extent")
# Units and meaning of each variable and coordinate of a store.
VARIABLES = {
    "image": ("1", "ISAR image divided by its peak magnitude"),
    "peak": ("m", "peak magnitude of the image, as a scattering amplitude"),
    "elevation": ("degrees", "elevation of the radar above the horizon"),
    "azimuth": ("degrees", "azimuth of the radar, centre of the aperture"),
    "range": ("m", "down-range from the origin, negative towards the radar"),
    "crossrange": ("m", "cross-range from the origin"),
    "realization": ("1", "number of the noise sample"),
    "snr_definition_offset": ("dB", "by how much the aperture's SNR is higher as peak_3db than as mean"),
    **{f"snr_{name}": ("dB", f"SNR of the image's aperture, by the definition {name}") for name in DEFINITIONS},
}
COMMENTS = {
    "range": "along the line of sight of the image's centre direction",
    "crossrange": "horizontal, along increasing azimuth; true horizontal distance times cos(elevation)",
}


def make_clean(field_path, mesh_path, image_path, imaging):
    """Form the images of a scattering store without noise and write them.

    The store has `image` (elevation, azimuth, range, crossrange), complex64, divided by its peak magnitude, and that
    `peak` (elevation, azimuth) in m; snr_definition_offset, of the same shape, is in dB what the choice of
    noise.definition changes. imaging: the config's section.
    mesh_path: what the mesh stage says of the mesh, whose reach says if the target fits the unambiguous extent; None
    without a mesh. Images are of the field's first polarization, the first of radar.polarizations.
    """
    plan = _Plan(_open(field_path), imaging)
    print(*describe(plan.geometry), sep="\n")
    reach = 0.0
    if mesh_path is None:
        print("The target has no mesh: whether it fits the unambiguous extent is not known.")
    else:
        reach = json.loads(Path(mesh_path).read_text())["source"]["reach"]
    for warning in warnings(plan.geometry, reach):
        print(f"Warning: {warning}")
    formed = [(*form_images(plan.imager, samples), definition_offset(samples)) for samples in plan.samples()]
    images, peaks, offsets = map(np.array, zip(*formed, strict=True))
    offset = float(np.nanmean(offsets)) if np.isfinite(offsets).any() else 0.0
    print(f"SNR definitions: peak_3db reads {offset:.2f} dB higher than mean, on average over the images")
    plan.write(image_path, images, peaks, {"snr_definition_offset_db": offset}, {"snr_definition_offset": offsets})


def make_noisy(field_path, image_paths, imaging, target, noise):
    """Form the images of a scattering store at some SNRs and write them, as `make_clean` with a leading realization.

    image_paths: a store for each SNR, named by its label, as snr_6dB.zarr. target: its name, part of the seed. noise:
    mapping with seed, realizations, definition and per.
    A store has each image's own SNR besides, snr_<definition> (elevation, azimuth) in dB by each definition.
    """
    plan = _Plan(_open(field_path), imaging)
    for path in tqdm(image_paths, unit="SNR", desc="adding noise", leave=False):
        _make_at(plan, path, target, sweep.snr_of_label(Path(path).stem), noise)


def _make_at(plan, path, target, snr_db, noise):
    """Write the images of a plan at one SNR; arguments as of `make_noisy`."""
    randoms = [generator(noise["seed"], target, snr_db, number) for number in range(noise["realizations"])]
    images = np.empty((len(randoms), len(plan.elevation), len(plan.azimuth), *plan.shape), np.complex64)
    peaks = np.empty(images.shape[:3], np.float32)
    own = {name: np.empty(peaks.shape[1:], np.float32) for name in DEFINITIONS}
    for row, samples in enumerate(plan.samples()):
        powers = {name: signal_power(samples, name) for name in DEFINITIONS}
        variance = variances(powers[noise["definition"]], snr_db, noise["per"])
        for name, power in powers.items():
            with np.errstate(invalid="ignore"):  # an aperture without signal has no SNR
                own[name][row] = 10 * np.log10(power / variance)
        for number, random in enumerate(randoms):
            noisy = samples + plan.noise(variance, noise["per"], random)
            images[number, row], peaks[number, row] = form_images(plan.imager, noisy)
    shared = {"snr_db": float(snr_db), "snr_definition": noise["definition"], "noise_per": noise["per"]}
    plan.write(path, images, peaks, shared | {"seed": noise["seed"]}, {f"snr_{name}": of for name, of in own.items()})


def make_pure_noise(radar, aspect, image_path, imaging, seed):
    """Form images of receiver noise alone, one for each direction of the sweep, and write them like `make_clean`'s.

    radar, aspect, imaging: sections of the config.
    """
    axes = {
        "frequency": sweep.frequencies(radar),
        "elevation": sweep.elevations(aspect),
        "azimuth": sweep.azimuths(aspect),
    }
    ones = np.ones([len(values) for values in axes.values()], np.complex64)
    plan = _Plan(xr.DataArray(ones, axes | {"polarization": radar["polarizations"][0]}, list(axes)), imaging)
    random = generator(seed, PURE_NOISE, 0, 0)
    variance = np.ones(len(plan.azimuth))
    formed = [form_images(plan.imager, plan.noise(variance, "image", random)) for _ in plan.elevation]
    plan.write(image_path, *map(np.array, zip(*formed, strict=True)), {"seed": seed})


class _Plan:
    """What all images of one field (frequency, elevation, azimuth) share: the imager, the axes, the attributes."""

    def __init__(self, field, imaging):
        frequency, self.elevation, self.sweep = (field[name].values for name in ("frequency", "elevation", "azimuth"))
        self.field, self.imaging = field, imaging
        self.geometry = geometry(frequency, self.elevation, self.sweep, imaging)
        self.azimuth = centres(self.sweep, imaging["aperture"])
        self.imager = imager_of(frequency, self.sweep, imaging)
        self.shape = tuple(map(len, self.imager.axes()))

    def samples(self):
        """The apertures' samples, one elevation after the other: (images, S)."""
        for elevation in range(len(self.elevation)):
            yield apertures(self.field.values[:, elevation, :], self.sweep, self.imaging["aperture"])

    def noise(self, variance, per, random):
        """Noise for the apertures' samples of one elevation, (images, S), of these variances (images,)."""
        frequencies, aperture = len(self.field), self.imaging["aperture"]
        if per == "image":
            return white_noise(variance, frequencies * aperture, random)
        return apertures(white_noise(np.full(frequencies, variance[0]), len(self.sweep), random), self.sweep, aperture)

    def write(self, path, image, peak, attrs, others=None):
        """Write a store of images (elevation, azimuth, range, crossrange), or with a leading realization.

        others: variables (elevation, azimuth) by name.
        """
        down, cross = self.imager.axes()
        coords = {"elevation": self.elevation, "azimuth": self.azimuth, "range": down, "crossrange": cross}
        axes = tuple(coords)
        if image.ndim == 5:
            axes, coords["realization"] = ("realization", *axes), np.arange(len(image))
        shared = {
            "polarization": str(self.field.polarization.values),
            **self.imaging,
            "coherent": self.imager.coherent,
            **{key: self.geometry[key] for key in STATED},
            # In rad/m, of the middle of the image's spectrum: about it zeros are added to up-sample the image.
            "range_wavenumber": self.imager.carrier(),
        }
        data = {"image": (axes, image), "peak": (axes[:-2], peak.astype(np.float32))}
        directions = ("elevation", "azimuth")
        data |= {name: (directions, np.asarray(of, np.float32)) for name, of in (others or {}).items()}
        dataset = xr.Dataset(data, coords, shared | attrs)
        for name, variable in dataset.variables.items():
            variable.attrs |= dict(zip(("units", "long_name"), VARIABLES[name], strict=True))
            variable.attrs |= {"comment": COMMENTS[name]} if name in COMMENTS else {}
        # One elevation a chunk: a direction reads fast and the files stay few. Noise does not compress.
        chunks = tuple({**dataset.image.sizes, "elevation": 1}.values())
        encoding = {"image": {"chunks": chunks, "compressors": None}, "peak": {"chunks": dataset.peak.shape}}
        stores.write(dataset, path, encoding)


def _open(path):
    """The first polarization of a scattering store: `field` (frequency, elevation, azimuth), loaded."""
    with stores.open_store(path) as store:
        field = store["field"].isel(polarization=0).transpose("frequency", "elevation", "azimuth").load()
    if not np.isfinite(field.values).all():
        raise InputError(f"{path}: the field holds values that are not finite; make it again.")
    return field
