"""Make a target's stores of images from its field: clean, or at one SNR, with noise added to the samples."""

import itertools
from pathlib import Path

import numpy as np
import xarray as xr
from tqdm import tqdm

from isarflow.core import store as stores
from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.core.kinds import of_focus
from isarflow.imaging import motion as motions
from isarflow.imaging.formation import apertures, form_images
from isarflow.imaging.geometry import PURE_NOISE, centres, describe, focus_of, geometry, imager_of
from isarflow.imaging.noise import DEFINITIONS, definition_offset, generator, signal_power, variances, white_noise

# Parts of the geometry that are attributes of every store.
STATED = ("aperture_angle", "range_resolution", "crossrange_resolution", "range_extent", "crossrange_extent")
# Units and meaning of each variable and coordinate of a store.
VARIABLES = {
    "image": ("1", "ISAR image divided by its peak magnitude"),
    "peak": ("m", "peak magnitude of the image, as a scattering amplitude"),
    "elevation": ("degrees", "elevation of the radar above the horizon"),
    "azimuth": ("degrees", "azimuth of the radar, centre of the aperture"),
    "channel": ("1", "polarization, receive and transmit (V = elevation, H = azimuth)"),
    "range": ("m", "down-range from the origin, negative towards the radar"),
    "crossrange": ("m", "cross-range from the origin"),
    "realization": ("1", "number of the noise sample"),
    "snr_definition_offset": ("dB", "by how much the aperture's SNR is higher as peak_3db than as mean"),
    **{f"snr_{name}": ("dB", f"SNR of the image's aperture, by the definition {name}") for name in DEFINITIONS},
    **motions.VARIABLES,
}
COMMENTS = {
    "channel": "noise has the same variance in all channels, that which gives the first one its SNR",
    "range": "along the line of sight of the image's centre direction",
    "crossrange": "horizontal, along increasing azimuth; true horizontal distance times cos(elevation)",
}


def make_clean(field_path, image_path, imaging):
    """Form the images of a scattering store without noise and write them.

    The store has `image` (elevation, azimuth, [channel,] range, crossrange), complex64, divided by its one peak
    magnitude, that `peak` (elevation, azimuth) in m, and snr_definition_offset in dB. imaging: the config's section;
    its polarizations are the channels; a single one has no axis. Every SNR is that of the first.
    """
    plan = _Plan(_open(field_path, imaging["polarizations"]), imaging)
    print(*describe(plan.geometry), sep="\n")
    formed = [(*form_images(plan.imager, samples), definition_offset(samples[:, 0])) for samples in plan.samples()]
    images, peaks, offsets = map(np.array, zip(*formed, strict=True))
    offset = float(np.nanmean(offsets)) if np.isfinite(offsets).any() else 0.0
    print(f"SNR definitions: peak_3db reads {offset:.2f} dB higher than mean, on average over the images")
    plan.write(image_path, images, peaks, {"snr_definition_offset_db": offset}, {"snr_definition_offset": offsets})


def make_noisy(field_path, image_paths, imaging, target, noise, motion=motions.STILL):
    """Form the images of a scattering store at some SNRs and write them, as `make_clean` with a leading realization.

    image_paths: a store for each SNR, named by its label, as snr_6dB.zarr. target: its name, part of the seed. noise:
    mapping with seed, realizations, definition and per. A store also has each image's SNR in dB by each definition.
    motion: a `Motion`, the limits of the errors of each image, the same at all SNRs. A store has those that may differ
    from 0, and where pulses may be lost `received`, and where parts move `pose` (realization, elevation, azimuth,
    pulse). The power that an SNR refers to is that of the first pose on a turntable.
    """
    plan, per = _Plan(_open(field_path, imaging["polarizations"]), imaging), noise["per"]
    focus = focus_of(plan.field.frequency.values, plan.sweep, imaging)
    powers = {name: [signal_power(samples[:, 0], name) for samples in plan.samples()] for name in DEFINITIONS}
    drawn = itertools.product(range(noise["realizations"] if any(motion) else 0), range(len(plan.elevation)))
    errors = [plan.errors(motion, row, noise["seed"], target, number) for number, row in drawn]  # alike at all SNRs
    for path in tqdm(image_paths, unit="SNR", desc="adding noise", leave=False):
        snr_db = sweep.snr_of_label(Path(path).stem)
        variance = [variances(power, snr_db, per) for power in powers[noise["definition"]]]
        images = np.empty((noise["realizations"], len(plan.elevation), len(plan.azimuth), *plan.shape), np.complex64)
        peaks = np.empty(images.shape[:3], np.float32)
        for number in range(noise["realizations"]):
            randoms = plan.randoms(noise["seed"], target, snr_db, number)
            for row, (samples, of_row) in enumerate(zip(plan.samples(), variance, strict=True)):
                added, pulses = plan.noise(of_row, per, randoms), None
                if any(motion):
                    of_images = errors[number * len(plan.elevation) + row]
                    samples, pulses = plan.moved(samples, row, of_images, motion), of_images.received
                    added = np.where(plan.of_pulses(pulses), added, 0)
                images[number, row], peaks[number, row] = form_images(plan.imager, focus(samples + added, pulses))
        with np.errstate(invalid="ignore"):  # an aperture without signal has no SNR
            own = {f"snr_{name}": 10 * np.log10(np.divide(power, variance)) for name, power in powers.items()}
        shared = {"snr_db": float(snr_db), "snr_definition": noise["definition"], "noise_per": per}
        shared |= {"focus": imaging["focus"]} if of_focus(imaging)[0] != "none" else {}
        if any(motion):
            shared |= {f"motion_{key}": limit for key, limit in motion._asdict().items()}
            own |= plan.stated(motion, errors)
        plan.write(path, images, peaks, shared | {"seed": noise["seed"]}, own)


def make_pure_noise(radar, aspect, image_path, imaging, seed):
    """Form images of receiver noise alone, one for each direction of the config's sweep; write them as `make_clean`."""
    axes = {"pose": [0], "polarization": imaging["polarizations"], "frequency": sweep.frequencies(radar)}
    axes |= {"elevation": sweep.elevations(aspect), "azimuth": sweep.azimuths(aspect)}
    ones = np.ones([len(values) for values in axes.values()], np.complex64)
    plan = _Plan(xr.DataArray(ones, axes, list(axes)), imaging)
    randoms, variance = plan.randoms(seed, PURE_NOISE, 0, 0), np.ones(len(plan.azimuth))
    formed = [form_images(plan.imager, plan.noise(variance, "image", randoms)) for _ in plan.elevation]
    plan.write(image_path, *map(np.array, zip(*formed, strict=True)), {"seed": seed})


class _Plan:
    """Parts that all images of one field share: the imager, the axes, the attributes.

    field: (pose, polarization, frequency, elevation, azimuth); its polarizations are the images' channels.
    Images that do not move are of the first pose.
    """

    def __init__(self, field, imaging):
        frequency, self.elevation, self.sweep = (field[name].values for name in ("frequency", "elevation", "azimuth"))
        self.field, self.imaging = field.isel(pose=0), imaging
        self.poses = field.values
        self.geometry = geometry(frequency, self.elevation, self.sweep, imaging)
        self.azimuth = centres(self.sweep, imaging["aperture"])
        self.imager = imager_of(frequency, self.sweep, imaging)
        self.channels = self.field.polarization.values.tolist()
        self.shape = (len(self.channels), *map(len, self.imager.axes()))

    def samples(self):
        """The apertures' samples of each elevation, (images, channel, S)."""
        every = np.moveaxis(self.field.values, 2, 0)
        return (apertures(channels, self.sweep, self.imaging["aperture"]) for channels in every)

    def randoms(self, seed, target, snr_db, number):
        """The random numbers of a realization, separate for each channel."""
        return [generator(seed, target, snr_db, number, name) for name in (None, *self.channels[1:])]

    def noise(self, variance, per, randoms):
        """Noise for one elevation's samples, (images, channel, S), of variances (images,): one receiver's channels."""
        frequencies = self.field.sizes["frequency"]
        if per == "image":
            samples = frequencies * self.imaging["aperture"]
            return np.stack([white_noise(variance, samples, random) for random in randoms], axis=1)
        shared = np.full(frequencies, variance[0])
        drawn = np.stack([white_noise(shared, len(self.sweep), random) for random in randoms])
        return apertures(drawn, self.sweep, self.imaging["aperture"])

    def errors(self, motion, row, seed, target, number):
        """The `motion.Errors` of one elevation's images."""
        views = [(seed, target, self.elevation[row], azimuth, number) for azimuth in self.azimuth]
        return motions.draw(motion, views, self.imaging["aperture"])

    def moved(self, samples, row, errors, motion):
        """The samples of one elevation's images under errors; those of lost pulses are 0."""
        frequency, angle = self.imager.frequency, self.imager.angle
        seen = motions.poses(motion, errors.phase, len(self.poses))
        for pose in np.unique(seen):
            of_pose = self.poses[pose][:, :, row]
            if errors.turn.any():
                own = motions.turned(of_pose, self.sweep, angle, errors.turn)
            else:
                own = apertures(of_pose, self.sweep, self.imaging["aperture"])
            samples = np.where(self.of_pulses(seen == pose), own, samples)
        return np.where(self.of_pulses(errors.received), motions.displaced(samples, frequency, angle, errors), 0)

    def of_pulses(self, received):
        """Booleans of pulses (images, A) as of samples, (images, 1, F * A)."""
        return np.tile(received, (1, len(self.imager.frequency)))[:, None]

    def stated(self, motion, errors):
        """The errors of all images that a store keeps, (realization, elevation, azimuth[, pulse]) by name."""
        apart = "jitter", "missing", "poses"
        kept = [name for name, limit in motion._asdict().items() if limit and name not in apart]
        kept = [each for name in kept for each in (motions.PLACES if name == "place" else (name,))]
        kept += ["received"] if motion.missing else []
        shape = -1, len(self.elevation), len(self.azimuth)
        every = {name: np.array([getattr(each, name) for each in errors]) for name in kept}
        if motion.poses and len(self.poses) > 1:
            seen = [motions.poses(motion, each.phase, len(self.poses)) for each in errors]
            every["pose"] = np.array(seen, np.int16)
        return {name: values.reshape(*shape, *values.shape[2:]) for name, values in every.items()}

    def write(self, path, image, peak, attrs, others=None):
        """Write images ([realization,] elevation, azimuth, channel, range, crossrange) and others of some of the axes.

        others: (elevation, azimuth), or also of realizations before these, or also of pulses after these.
        """
        down, cross = self.imager.axes()
        coords = {"elevation": self.elevation, "azimuth": self.azimuth}
        coords |= {"channel": self.channels, "range": down, "crossrange": cross}
        axes = tuple(coords)
        if image.ndim == 6:
            axes, coords["realization"] = ("realization", *axes), np.arange(len(image))
        shared = {
            "polarization": ", ".join(self.channels),
            **{key: value for key, value in self.imaging.items() if key not in ("polarizations", "focus")},
            "coherent": self.imager.coherent,
            **{key: self.geometry[key] for key in STATED},
            # In rad/m, the middle of the image's spectrum: zeros are added on both sides of it to up-sample the image.
            "range_wavenumber": self.imager.carrier(),
        }
        data = {"image": (axes, image), "peak": (axes[:-3], peak.astype(np.float32))}
        named = {2: ("elevation", "azimuth"), 3: axes[:3], 4: (*axes[:3], "pulse")}
        for name, values in (others or {}).items():
            values = np.asarray(values)
            data[name] = named[values.ndim], values.astype(np.float32) if values.dtype.kind == "f" else values
        dataset = xr.Dataset(data, coords, shared | attrs)
        if len(self.channels) == 1:
            dataset = dataset.squeeze("channel", drop=True)
        for name, variable in dataset.variables.items():
            variable.attrs |= dict(zip(("units", "long_name"), VARIABLES[name], strict=True))
            variable.attrs |= {"comment": COMMENTS[name]} if name in COMMENTS else {}
        # One realization per chunk: models are tested on the first ones alone, and there are few files. Noise does not
        # compress.
        chunks = tuple(1 if name == "realization" else size for name, size in dataset.image.sizes.items())
        encoding = {"image": {"chunks": chunks, "compressors": None}, "peak": {"chunks": dataset.peak.shape}}
        stores.write(dataset, path, encoding)


def _open(path, polarizations):
    """These polarizations of a scattering store: `field` (pose, polarization, frequency, elevation, azimuth)."""
    with stores.open_store(path) as store:
        field = store["field"].sel(polarization=polarizations)
        field = field if "pose" in field.dims else field.expand_dims("pose")
        field = field.transpose("pose", "polarization", "frequency", "elevation", "azimuth").load()
    if not np.isfinite(field.values).all():
        raise InputError(f"{path}: the field holds values that are not finite; make it again.")
    return field
