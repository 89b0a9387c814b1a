"""What the radar does not know: a target's place, its motion on top of the turntable's, lost pulses, and moving parts.

With k the wavenumber and a the angle of a pulse from the image's centre, samples are multiplied by exp(2j k n), n being
by how much the target is nearer than the turntable has it (a distance of its own for each pulse):

    n = -dr cos a + dc sin a + d (a / a_end)^2 + e_pulse

for a displacement of dr in range and dc in cross-range, a drift of d at the ends of the aperture, as a constant
acceleration makes it, and a jitter e. A wrong `turn` samples the sweep at a (1 + t) where a is believed. Of a target
whose parts move each pulse sees one of its poses.
"""

from typing import NamedTuple

import numpy as np

from isarflow.core.sweep import C0
from isarflow.imaging.noise import random_numbers

# Variables of a store of images that moved, with their units and meaning.
VARIABLES = {
    "place_range": ("m", "displacement of the origin in range"),
    "place_crossrange": ("m", "displacement of the origin in cross-range"),
    "drift": ("1", "quadratic range error at the ends of the aperture, in wavelengths of the centre frequency"),
    "turn": ("1", "relative error of the assumed angular step"),
    "received": ("1", "whether a pulse was received"),
    "pose": ("1", "number of the pose that a pulse saw"),
}
PLACES = "place_range", "place_crossrange"


class Motion(NamedTuple):
    """The limits within which an image's errors are drawn; all 0 is a turntable."""

    place: float = 0.0  # m, in range and in cross-range, uniform
    drift: float = 0.0  # wavelengths of the centre frequency at the ends of the aperture, uniform
    jitter: float = 0.0  # wavelengths, of each pulse, rms of a normal distribution
    turn: float = 0.0  # of the angular step, uniform
    missing: float = 0.0  # share of the pulses
    poses: float | str = 0.0  # poses a pulse, or RANDOM


STILL = Motion()
RANDOM = "random"


class Errors(NamedTuple):
    """The errors of n images of A pulses each."""

    place_range: np.ndarray  # (n,), m
    place_crossrange: np.ndarray  # (n,), m
    drift: np.ndarray  # (n,), wavelengths
    turn: np.ndarray  # (n,)
    received: np.ndarray  # (n, A), booleans
    jitter: np.ndarray  # (n, A), wavelengths
    phase: np.ndarray  # (n, A), from 0 to below 1, of the cycle of poses


def draw(motion, views, pulses):
    """The Errors of images, each by random numbers of its own. `motion.poses` does not matter: see `poses`.

    views: of each image what its random numbers follow from, a tuple, as of its seed, target, direction and number. All
    numbers are drawn whatever the limits, so that a change of one changes no other error.
    """
    rows = []
    for view in views:
        random = random_numbers("motion", *view)
        limits = motion.place, motion.place, motion.drift, motion.turn
        uniform, jitter = random.uniform(-1, 1, len(limits)), random.standard_normal(pulses)
        received = random.permutation(pulses) >= int(motion.missing * pulses + random.uniform())  # so many on average
        rows.append((*np.multiply(limits, uniform), received, motion.jitter * jitter, random.uniform(size=pulses)))
    return Errors(*map(np.array, zip(*rows, strict=True)))


def poses(motion, phase, count):
    """The numbers (n, A) of the poses that the pulses of images see, of `count` poses in a cycle.

    phase: that of `Errors`. Still: the first. Random: parts turn many times between pulses, and each has its own; at a
    rate they turn by so many poses from one pulse to the next, from the first one's phase on.
    """
    if motion.poses == RANDOM:
        return (phase * count).astype(int)
    if not motion.poses:
        return np.zeros(phase.shape, int)
    first = (phase[:, :1] * count).astype(int)
    return (first + np.floor(motion.poses * np.arange(phase.shape[1])).astype(int)) % count


def nearer(angle, wavelength, range_=0.0, crossrange=0.0, drift=0.0, jitter=0.0):
    """By how much a target is nearer at each pulse, (..., A) in m. angle: (A,) rad; wavelength: m; errors: (...)."""
    of_range, of_cross, of_drift = (np.asarray(error, float)[..., None] for error in (range_, crossrange, drift))
    parabola = (angle / angle[-1]) ** 2
    moved = of_cross * np.sin(angle) - of_range * np.cos(angle)
    return moved + wavelength * (of_drift * parabola + np.asarray(jitter))


def phases(frequency, distance):
    """The factor exp(2j k n) of samples at frequencies (F,) in Hz, for distances n (..., A) in m: (..., F, A)."""
    k = 2 * np.pi / C0 * frequency
    return np.exp(2j * k[:, None] * distance[..., None, :]).astype(np.complex64)


def displaced(samples, frequency, angle, errors):
    """Samples (n, channel, F * A) of images under these errors, pulses not yet lost and no turn: the same shape."""
    wavelength = 2 * C0 / (frequency[0] + frequency[-1])
    places = errors.place_range, errors.place_crossrange, errors.drift, errors.jitter
    factor = phases(frequency, nearer(angle, wavelength, *places))
    return samples * factor.reshape(len(samples), 1, -1)


def turned(field, azimuth, angle, turn):
    """Apertures whose steps are (1 + turn) of those believed: (n, channel, F * A), as of `formation.apertures`.

    field: (channel, F, azimuth) over a circle of n azimuths in degrees, whose Fourier series is taken. turn: (n,).
    """
    count = len(azimuth)
    orders = np.fft.fftfreq(count, 1 / count)
    at = np.radians(azimuth - azimuth[0])[:, None] + angle * (1 + turn[:, None])  # n, A
    waves = np.exp(1j * np.multiply.outer(at, orders)).astype(np.complex64) / count
    return np.einsum("nam,cfm->ncfa", waves, np.fft.fft(field, axis=-1), optimize=True).reshape(count, len(field), -1)
