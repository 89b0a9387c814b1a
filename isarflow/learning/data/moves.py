"""Move images as a target's motion does, from the images alone: back to samples, exact phases, and images again."""

from functools import cached_property

import numpy as np

from isarflow.core.sweep import C0
from isarflow.imaging.formation import build_imager
from isarflow.imaging.motion import Motion, displaced, draw, nearer, phases
from isarflow.learning.data.features import by_channel, of_peak_one

WEAKEST = 0.03  # of the imaging matrix's largest singular value: samples by which an image changes less are not told


class Moves:
    """The linear map of a run's images to samples and back, and the limits of its motion.

    motion: a run's, as of `experiments.motion_of`, with limits; pixels: 'none', or those a side of up-sampled images.
    limits: a `Motion`, without drift where images are focused; frequency: (F,) in Hz; angle: (A,) in rad;
    wavelength: in m, at the centre frequency;
    cells: the size of a resolution cell in range and cross-range, in m.
    to_image: (F * A, R * X) of samples as rows, to_samples: (R * X, F * A) of images, complex64.
    """

    def __init__(self, motion, pixels="none"):
        self.limits = Motion(**motion["limits"])
        if motion["imaging"].get("focus", "none") != "none":  # has undone the drift of the images that models see
            self.limits = self.limits._replace(drift=0.0)
        first, last, count = motion["frequencies"]
        self.frequency, pulses = np.linspace(first, last, count), motion["imaging"]["aperture"]
        self.angle = np.radians(motion["step"]) * (np.arange(pulses) - pulses // 2)
        self.wavelength = 2 * C0 / (first + last)
        self.imager = build_imager(self.frequency, self.angle, motion["imaging"])
        self.cells = tuple(float(axis[1] - axis[0]) for axis in self.imager.axes())
        if pixels != "none":
            self.imager = build_imager(self.frequency, self.angle, motion["imaging"] | {"upsample": pixels})
        self.shape = tuple(map(len, self.imager.axes()))

    @cached_property
    def to_image(self):
        unit = np.eye(len(self.frequency) * len(self.angle), dtype=np.complex64)
        return self.imager.on_axes(unit.reshape(-1, len(self.frequency), len(self.angle))).reshape(len(unit), -1)

    @cached_property
    def to_samples(self):
        return np.linalg.pinv(self.to_image.astype(complex), rcond=WEAKEST).astype(np.complex64)

    def phases(self, range_=0.0, crossrange=0.0, drift=0.0):
        """The factor of samples of a target displaced and drifting by so much, (..., F, A)."""
        return phases(self.frequency, nearer(self.angle, self.wavelength, range_, crossrange, drift))

    def samples(self, images):
        """Samples (n, channel, F, A) of images (n, [channel,] R, X)."""
        rows = by_channel(images).reshape(-1, len(self.to_samples)) @ self.to_samples
        return rows.reshape(len(images), -1, len(self.frequency), len(self.angle))

    def images(self, samples):
        """Images (n, channel, R, X) of samples (n, channel, F, A)."""
        rows = samples.reshape(-1, len(self.to_image)) @ self.to_image
        return rows.reshape(*samples.shape[:2], *self.shape)

    def drawn(self, images, *names):
        """Images (n, ...) moved by errors that follow from the names, each divided by its peak again."""
        errors = draw(self.limits, [(*names, number) for number in range(len(images))], len(self.angle))
        samples = self.samples(images)
        rows = displaced(samples.reshape(*samples.shape[:2], -1), self.frequency, self.angle, errors)
        samples = np.where(errors.received[:, None, None], rows.reshape(samples.shape), 0)
        return of_peak_one(self.images(samples).reshape(images.shape))


def moves_of(run):
    """The `Moves` of a run of `experiments.runs`; None of one on a turntable."""
    return Moves(run["motion"], run["upsample"]) if run["motion"].get("limits") else None
