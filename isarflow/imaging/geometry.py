"""The geometry of an image: its axes, its resolution and extent in a sweep, and the size of a store.

docs/method.md derives the axes, in m: range is -d, with d = p . u(el, az) along the line of sight of the image's centre
(negative is towards the radar), and crossrange is c = cos(el) (y cos(az) - x sin(az)), a horizontal offset times
cos(el). Images are formed from k and the relative azimuth phi alone, so one matrix serves every elevation. A scatterer
off the plane z = 0 is blurred a little, by 2 k z sin(el) (1 - cos(phi)) radians at the edge of the aperture.

(crossrange, range, up) is right-handed: with range drawn upwards and crossrange to the right, the picture is the target
seen from above with the radar at the bottom, and crossrange is to the right as seen from the radar.
"""

import numpy as np

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.core.sweep import C0, closes_circle
from isarflow.imaging import focusing
from isarflow.imaging.formation import BYTES, build_imager, resolution

PURE_NOISE = "pure-noise"  # used in place of a target's name; the dash keeps it from being one
LEAST_COSINE = 0.1  # of an elevation; steeper ones leave no cross-range


def project(points, elevation, azimuth):
    """Project the target's points (..., 3), m, into an image at these degrees: range and crossrange (...), m."""
    el, az = np.radians(elevation), np.radians(azimuth)
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    nearer = np.cos(el) * (np.cos(az) * x + np.sin(az) * y) + np.sin(el) * z
    return -nearer, np.cos(el) * (np.cos(az) * y - np.sin(az) * x)


def uniform_step(name, values):
    """The step of an ascending, evenly spaced axis. InputError for any other axis."""
    steps = np.diff(values)
    if len(steps) == 0 or steps[0] <= 0 or not np.allclose(steps, steps[0], rtol=1e-4):
        there = f"{len(values)} from {values[0]:g} to {values[-1]:g}"
        raise InputError(f"{name}: an image needs at least two evenly spaced, ascending values; there are {there}.")
    return float((values[-1] - values[0]) / (len(values) - 1))


def centres(azimuth, aperture):
    """Azimuths (degrees) that are the centre of a whole aperture: all on a closed circle, else all but the ends.

    InputError if the aperture is longer than the sweep.
    """
    if aperture > len(azimuth):
        raise InputError(f"config key 'imaging.aperture': {aperture} is more than the sweep's {len(azimuth)} azimuths.")
    half = aperture // 2
    return azimuth if closes_circle(azimuth) else azimuth[half : len(azimuth) - half]


def imager_of(frequency, azimuth, imaging):
    """The imager of a sweep (frequency in Hz, azimuth in degrees). InputError if it can make no image."""
    return build_imager(frequency, _angles(azimuth, imaging["aperture"]), imaging)


def focus_of(frequency, azimuth, imaging):
    """The focus method of a sweep, as a function of samples (images, channel, F * A) and the pulses present.

    See `focusing.Focusing.focus`. Clean images and those of noise alone are formed without it.
    """
    method = focusing.build_focusing(frequency, _angles(azimuth, imaging["aperture"]), imaging)

    def focus(samples, present=None):
        apart = samples.reshape(*samples.shape[:2], len(frequency), -1)
        return method.focus(apart, present).reshape(samples.shape)

    return focus


def _angles(azimuth, aperture):
    """The azimuths of an aperture's samples relative to the middle one, rad. azimuth: the sweep's, degrees."""
    return np.radians(uniform_step("azimuth", azimuth)) * (np.arange(aperture) - aperture // 2)


def geometry(frequency, elevation, azimuth, imaging):
    """Compute resolution, unambiguous extent, aperture angle, number of images and size of a store for a sweep.

    frequency in Hz, elevation and azimuth in degrees (1-D, ascending); imaging: the config's section.
    Returns a mapping. Lengths in m, angles in degrees. As each sample covers one step, the bandwidth is frequencies x
    step and the aperture angle aperture x step: extent = samples x resolution (thesis eqs. 3.10, 3.12).
    Cross-range resolution and extent are for the centre frequency. `polar` keeps the inscribed rectangle's part of the
    sector: its pixels, and those of `exact`, are somewhat larger than these resolutions, and so is what they span.
    bytes: of one target's clean images; coherent and warnings are the imager's. InputError if none can be made.
    """
    step = uniform_step("frequency", frequency)
    turn = np.radians(uniform_step("azimuth", azimuth))
    samples = imaging["aperture"]
    wavelength = C0 / ((frequency[0] + frequency[-1]) / 2)
    images, channels = len(elevation) * len(centres(azimuth, samples)), len(imaging["polarizations"])
    imager = imager_of(frequency, azimuth, imaging)
    down, cross = imager.axes()
    range_resolution, crossrange_resolution = resolution(frequency, step, samples, turn)
    sizes = {
        "range_resolution": range_resolution,
        "crossrange_resolution": crossrange_resolution,
        "range_extent": float(C0 / (2 * step)),  # eq. 3.11
        "crossrange_extent": float(wavelength / (2 * turn)),  # eq. 3.13
        "crossrange_extent_highest_frequency": float(C0 / frequency[-1] / (2 * turn)),
        "aperture_angle": float(np.degrees(samples * turn)),
        "fractional_bandwidth": float((frequency[-1] - frequency[0]) / (C0 / wavelength)),
        "range_pixels": len(down),
        "crossrange_pixels": len(cross),
        "range_pixel": uniform_step(f"{imager.file}, range", down),
        "crossrange_pixel": uniform_step(f"{imager.file}, cross-range", cross),
        "least_cosine": float(np.cos(np.radians(np.abs(elevation).max()))),
        "images": images,
        "channels": channels,
        "bytes": images * channels * len(down) * len(cross) * BYTES,
        "working_bytes": imager.working_bytes(len(down) * len(cross)),
    }
    return sizes | {"coherent": imager.coherent, "warnings": imager.warnings(sizes)}


def planned(config):
    """`geometry` of the sweep that a config describes."""
    radar, aspect = config["radar"], config["aspect"]
    return geometry(sweep.frequencies(radar), sweep.elevations(aspect), sweep.azimuths(aspect), config["imaging"])


def megabytes(geometry, copies):
    """Memory of a job that makes `copies` of the images of this geometry, in MB."""
    # Images and their copies in the store; the imager's memory; the Python packages.
    return 500 + (2.5 * copies * geometry["bytes"] + geometry["working_bytes"]) / 1e6


def describe(geometry):
    """Write the result of `geometry` as lines of text."""
    channels = f" of {geometry['channels']} polarizations" if geometry["channels"] > 1 else ""
    return [
        *(
            f"{axis}: resolution {geometry[f'{axis}_resolution']:.4f} m, unambiguous extent "
            f"{geometry[f'{axis}_extent']:.3f} m, {geometry[f'{axis}_pixels']} pixels of "
            f"{geometry[f'{axis}_pixel']:.4f} m"
            for axis in ("range", "crossrange")
        ),
        f"crossrange extent at the highest frequency: {geometry['crossrange_extent_highest_frequency']:.3f} m",
        f"aperture {geometry['aperture_angle']:.2f} degrees, bandwidth {100 * geometry['fractional_bandwidth']:.1f} %",
        f"{geometry['images']} images{channels}, {geometry['bytes'] / 1e6:.3g} MB",
    ]


def warnings(geometry, reach):
    """Sentences on what will look wrong in images of this geometry (a result of `geometry`).

    reach: the largest distance of a point of the target from the origin, about which images are formed, in m.
    """
    sentences = []
    if geometry["least_cosine"] < LEAST_COSINE:
        sentences.append(
            f"at the steepest elevation cross-range shrinks to {100 * geometry['least_cosine']:.0f} % (the cosine of "
            "the elevation): turning the target hardly moves the line of sight, and its images show range only."
        )
    for axis, key in (("range", "radar.frequencies"), ("crossrange", "aspect.azimuth")):
        extent = geometry[f"{axis}_extent"]
        if 2 * reach > extent:
            sentences.append(
                f"the target reaches {reach:.2f} m from the origin but the unambiguous {axis} extent is only"
                f" {extent / 2:.2f} m to either side: what lies outside folds over. More samples ('{key}') over the"
                " same span widen it."
            )
    sampled = geometry["crossrange_extent_highest_frequency"]
    if sampled < 2 * reach <= geometry["crossrange_extent"]:
        sentences.append(
            f"the target reaches {reach:.2f} m from the origin but at the highest frequency the azimuth steps are only"
            f" fine enough for {sampled / 2:.2f} m to either side: its ends leave ghosts. Take more ('aspect.azimuth')."
        )
    return sentences + geometry["warnings"]
