"""From a target's field to its stores of images, clean or at one SNR."""

import json
from pathlib import Path

import numpy as np
import xarray as xr

from core import store as stores
from core import sweep
from core.errors import InputError
from imaging.formation import apertures, form_images
from imaging.geometry import PURE_NOISE, centres, describe, geometry, imager_of, warnings
from imaging.noise import definition_offset, generator, white_noise

# The figures of `geometry` that stand in every store's attributes.
FIGURES = ("aperture_angle", "range_resolution", "crossrange_resolution", "range_extent", "crossrange_extent")
RANGE_NOTE = "along the line of sight of the image's centre direction"
CROSSRANGE_NOTE = "horizontal, along increasing azimuth; true horizontal distance times cos(elevation)"


def make_clean(field_path, mesh_path, image_path, imaging):
    """Form the images of a scattering store without noise and write them.

    The store has `image` (elevation, azimuth, range, crossrange), complex64, divided by its peak magnitude, and that
    `peak` (elevation, azimuth) in m. imaging: the config's section.
    mesh_path: the mesh stage's figures, whose reach says if the target fits the unambiguous extent; None without a
    mesh. Images are of the field's first polarization, the first of radar.polarizations.
    """
    field = _open(field_path)
    figures = geometry(field.frequency.values, field.elevation.values, field.azimuth.values, imaging)
    print(*describe(figures), sep="\n")
    reach = 0.0
    if mesh_path is None:
        print("The target has no mesh: whether it fits the unambiguous extent is not known.")
    else:
        reach = json.loads(Path(mesh_path).read_text())["source"]["reach"]
    for warning in warnings(figures, reach):
        print(f"Warning: {warning}")
    images, peaks, offsets = [], [], []
    plan = _Plan(field, imaging)
    for samples in plan.samples():
        image, peak = form_images(plan.imager, samples)
        images.append(image)
        peaks.append(peak)
        offsets.append(definition_offset(samples))
    offset = float(np.nanmean(offsets)) if np.isfinite(offsets).any() else 0.0
    print(f"SNR definitions: peak_3db reads {offset:.2f} dB higher than mean, on average over the images")
    _write(plan.dataset(np.array(images), np.array(peaks), {"snr_definition_offset_db": offset}), image_path)


def make_noisy(field_path, image_path, imaging, target, snr_db, noise):
    """Form the images of a scattering store at one SNR and write them, like `make_clean`'s with a leading realization.

    noise: mapping with seed, realizations and definition. target: its name, part of the seed.
    """
    plan = _Plan(_open(field_path), imaging)
    randoms = [generator(noise["seed"], target, snr_db, number) for number in range(noise["realizations"])]
    images = np.empty((len(randoms), len(plan.elevation), len(plan.azimuth), *plan.shape), np.complex64)
    peaks = np.empty(images.shape[:3], np.float32)
    for row, samples in enumerate(plan.samples()):
        for number, random in enumerate(randoms):
            noisy = samples + white_noise(samples, snr_db, noise["definition"], random)
            images[number, row], peaks[number, row] = form_images(plan.imager, noisy)
    attrs = {"snr_db": float(snr_db), "snr_definition": noise["definition"], "seed": noise["seed"]}
    _write(plan.dataset(images, peaks, attrs), image_path)


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
    formed = [form_images(plan.imager, white_noise(samples, 0, "mean", random)) for samples in plan.samples()]
    images, peaks = map(np.array, zip(*formed, strict=True))
    _write(plan.dataset(images, peaks, {"seed": seed}), image_path)


class _Plan:
    """What all images of one field share: the imager, the axes, the attributes."""

    def __init__(self, field, imaging):
        frequency, self.sweep = field.frequency.values, field.azimuth.values
        self.field, self.imaging = field, imaging
        self.elevation, self.azimuth = field.elevation.values, centres(self.sweep, imaging["aperture"])
        self.imager = imager_of(frequency, self.sweep, imaging)
        self.range, self.crossrange = self.imager.axes()
        self.shape = (len(self.range), len(self.crossrange))
        figures = geometry(frequency, self.elevation, self.sweep, imaging)
        self.attrs = {
            "polarization": str(field.polarization.values),
            **imaging,
            "coherent": self.imager.coherent,
            **{key: figures[key] for key in FIGURES},
            # In rad/m, of the middle of the image's spectrum: about it zeros are added to up-sample the image.
            "range_wavenumber": self.imager.carrier(),
        }

    def samples(self):
        """The apertures' samples, one elevation after the other: (images, S)."""
        for elevation in range(len(self.elevation)):
            yield apertures(self.field.values[:, elevation, :], self.sweep, self.imaging["aperture"])

    def dataset(self, image, peak, attrs):
        """Images (elevation, azimuth, range, crossrange), or with a leading realization, as a Dataset."""
        axes = ("elevation", "azimuth")
        coords = {
            "elevation": _coordinate(
                "elevation", self.elevation, "degrees", "elevation of the radar above the horizon"
            ),
            "azimuth": _coordinate("azimuth", self.azimuth, "degrees", "azimuth of the radar, centre of the aperture"),
            "range": _coordinate(
                "range", self.range, "m", "down-range from the origin, negative towards the radar", RANGE_NOTE
            ),
            "crossrange": _coordinate(
                "crossrange", self.crossrange, "m", "cross-range from the origin", CROSSRANGE_NOTE
            ),
        }
        if image.ndim == 5:
            axes = ("realization", *axes)
            coords["realization"] = _coordinate("realization", np.arange(len(image)), "1", "number of the noise sample")
        return xr.Dataset(
            {
                "image": (
                    (*axes, "range", "crossrange"),
                    image,
                    {"units": "1", "long_name": "ISAR image divided by its peak magnitude"},
                ),
                "peak": (
                    axes,
                    peak.astype(np.float32),
                    {"units": "m", "long_name": "peak magnitude of the image, as a scattering amplitude"},
                ),
            },
            coords,
            {**self.attrs, **attrs},
        )


def _coordinate(name, values, units, long_name, comment=None):
    return (name, values, {"units": units, "long_name": long_name} | ({"comment": comment} if comment else {}))


def _open(path):
    """The first polarization of a scattering store: `field` (frequency, elevation, azimuth), loaded."""
    with stores.open_store(path) as store:
        field = store["field"].isel(polarization=0).transpose("frequency", "elevation", "azimuth").load()
    if not np.isfinite(field.values).all():
        raise InputError(f"{path}: the field holds values that are not finite; make it again.")
    return field


def _write(dataset, path):
    # One elevation a chunk: a direction reads fast and the files stay few. Noise does not compress.
    chunks = tuple(({**dataset.image.sizes, "elevation": 1}).values())
    encoding = {"image": {"chunks": chunks, "compressors": None}, "peak": {"chunks": dataset.peak.shape}}
    stores.write(dataset, path, encoding)
