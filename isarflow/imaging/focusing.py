"""The interface of every focus method, and what they share: undo range errors, align range profiles, measure entropy.

Where a target is r metres nearer to the radar than the turntable has it, its samples are multiplied by exp(2j k r). r
is a function of the pulse alone, the same at all frequencies and in all channels. A sum of cos(angle) and sin(angle) is
a displacement: it moves the image and leaves it sharp, so no focus method can find it, and none may add it.
"""

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from isarflow.core.kinds import FOCUS, load_class, of_focus
from isarflow.core.sweep import C0
from isarflow.imaging.scatterers import Scatterers, waves

TINY = np.finfo(np.float32).tiny
MARGIN = 0.07  # of the entropy, for each cell that profiles are moved by alignment: a few strong pulses pretend many
PER_CELL = 20  # shifts in a range cell that the alignment tries; it reads between them
# A function of samples, the pulses present and first errors (images, A) to errors (images, A), all in m.
Search = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class Focusing:
    """A way to find and undo the range errors of apertures of one geometry.

    A focus method is a class `Focus` in a file of its own, focus/<kind>.py; it defines `focus`. frequency: (F,) in Hz.
    angle: (A,) azimuth relative to the image's centre, in rad. settings: those that it states as SETTINGS, as an imager
    does; one whose schema has a "default" may be left out.
    """

    def __init__(self, frequency: np.ndarray, angle: np.ndarray, settings: Mapping[str, Any]) -> None:
        self.frequency, self.angle, self.settings = frequency, angle, settings
        self.k = 2 * np.pi * frequency / C0
        self.wavelength = float(2 * np.pi / self.k.mean())
        self.time = angle / angle[-1]  # of each pulse, -1 to 1
        self.cells = Scatterers(frequency, angle, {"pixels": 1})

    def focus(self, samples: np.ndarray, present: np.ndarray | None = None) -> np.ndarray:
        """Samples without the range errors that were found.

        samples: (images, channels, F, A), complex64, in m; those of lost pulses are 0, and stay so. present: (images,
        A), true for pulses that were received; None for all. The same samples give the same bits.
        """
        raise NotImplementedError

    @functools.cached_property
    def pixels(self) -> np.ndarray:
        """The map from samples to an image with a pixel in each resolution cell, (F * A, F * A), by back-projection."""
        return waves(self.cells.wavevectors, self.cells.places()).conj().astype(np.complex64)

    def image(self, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """An image of each channel, (images, channels, F * A), and the power of its pixels."""
        image = (samples.reshape(-1, len(self.pixels)) @ self.pixels).reshape(*samples.shape[:2], -1)
        return image, image.real**2 + image.imag**2

    def entropy(self, samples: np.ndarray) -> np.ndarray:
        """The entropy (images,) of each image's powers, all channels together: the smaller, the sharper."""
        power = self.image(samples)[1]
        power /= np.maximum(power.sum(axis=(1, 2), keepdims=True), TINY)
        return -(power * np.log(np.maximum(power, TINY))).sum(axis=(1, 2))

    def undone(self, samples: np.ndarray, errors: np.ndarray) -> np.ndarray:
        """Samples without range errors (images, A), m."""
        phase = (-2 * self.k[:, None] * errors[:, None, None]).astype(np.float32)
        turn = np.empty(phase.shape, np.complex64)
        np.cos(phase, out=turn.real)  # ten times as fast as the exponential of complex numbers
        np.sin(phase, out=turn.imag)
        return samples * turn

    def in_place(self, errors: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Range errors (images, A) without their displacement, which is found beside a quadratic error: that stays.

        A pulse counts by its power, as what is found of weak ones is noise.
        """
        shapes = np.stack([np.cos(self.angle), np.sin(self.angle), self.time**2], axis=1)
        power = (samples.real**2 + samples.imag**2).sum(axis=(1, 2)).astype(float)
        share = power / np.maximum(power.sum(axis=1, keepdims=True), TINY)
        normal = np.einsum("as,na,at->nst", shapes, share, shapes) + 1e-9 * np.eye(3)  # fewer than three pulses
        fitted = np.linalg.solve(normal, ((errors * share) @ shapes)[:, :, None])[:, :2, 0]
        return (errors - fitted @ shapes[:, :2].T) * (power > 0)

    def aligned(self, samples: np.ndarray, present: np.ndarray) -> np.ndarray:
        """Range errors (images, A) in m, to a tenth of a cell, by correlation of the magnitudes of range profiles.

        From the middle of the aperture outwards each profile is laid where it correlates best with the sum of those
        before, then each anew with the sum of all others (Chen and Andrews, IEEE Trans. AES 16, 1980).
        """
        count = 4 * len(self.frequency)
        profiles = np.sqrt((np.abs(np.fft.ifft(samples, count, axis=2)) ** 2).sum(axis=1))
        # As a sum of waves over range, of which wave n turns by 2 n r (k[1] - k[0]) where the profile is moved by r.
        laid = np.moveaxis(np.fft.fft(profiles, axis=1)[:, : count // 2], 2, 0)
        step = self.cells.cell[0] / PER_CELL
        half = PER_CELL * len(self.frequency) // 2
        shifts = step * np.arange(-half, half + 1)
        turn = 2j * (self.k[1] - self.k[0]) * np.arange(count // 2)
        tried, total, errors = np.exp(np.outer(turn, shifts)), 0 * laid[0], np.zeros(present.shape)
        outwards = np.argsort(np.abs(self.angle), kind="stable")
        for first in (True, False):
            for pulse in outwards:
                own, others = laid[pulse], total if first else total - laid[pulse]
                match = ((others.conj() * own) @ tried).real
                moved = step * (summit(match) - half) * present[:, pulse] * others.any(axis=1)
                errors[:, pulse] -= moved
                laid[pulse] = own * np.exp(turn * moved[:, None])
                total = others + laid[pulse]
        return self.in_place(errors, samples)

    def refocused(self, samples: np.ndarray, present: np.ndarray | None, search: Search) -> np.ndarray:
        """Samples without the range errors that `search` finds; where these exceed a cell, also from aligned profiles.

        Of profiles of many scatterers alignment can be far off, so an image takes it where it is clearly sharper.
        """
        present = np.ones((len(samples), len(self.angle)), bool) if present is None else present
        found, aligned = search(samples, present, np.zeros(present.shape)), self.aligned(samples, present)
        cells = np.abs(aligned).max(axis=1) / self.cells.cell[0]
        far = cells > 1
        if far.any():
            tried = search(samples[far], present[far], aligned[far])
            found[far] = self.sharper(samples[far], found[far], tried, MARGIN * cells[far])
        return self.undone(samples, found)

    def sharper(self, samples: np.ndarray, first: np.ndarray, second: np.ndarray, by: Any = 0) -> np.ndarray:
        """Of two estimates of range errors (images, A) the second where its entropy is smaller by more than `by`."""
        better = self.entropy(self.undone(samples, first)) - self.entropy(self.undone(samples, second)) > by
        return np.where(better[:, None], second, first)


def summit(values: np.ndarray) -> np.ndarray:
    """Where values (..., N) are largest, as an index (...,) read between them by a parabola."""
    best = values.argmax(axis=-1).clip(1, values.shape[-1] - 2)
    before, there, after = (np.take_along_axis(values, best[..., None] + by, -1)[..., 0] for by in (-1, 0, 1))
    bend = 2 * there - before - after
    return best + np.divide(after - before, 2 * bend, out=np.zeros(best.shape), where=bend > 0)


def build_focusing(frequency: np.ndarray, angle: np.ndarray, imaging: Mapping[str, Any]) -> Focusing:
    """The focus method of a config's section `imaging`. InputError where it cannot be imported, or is no Focusing."""
    method, settings = of_focus(imaging)
    focus = load_class(FOCUS, method, Focusing)
    stated = getattr(focus, "SETTINGS", {})
    defaults = {name: rule["default"] for name, rule in stated.items() if "default" in rule}
    built: Focusing = focus(frequency, angle, defaults | settings)
    return built
