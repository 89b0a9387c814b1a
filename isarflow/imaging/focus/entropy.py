"""Minimum entropy: the range errors of which the image's power lies in the fewest pixels.

`drift` tries quadratic errors, one number. `pulse` then finds an error for each pulse: near an image its entropy is a
weighted sum of pixel powers, the weights their logarithms; each pulse is laid where it adds most to the image so
weighted, again and again (the fixed point of Kragh, Proc. ASAP workshop, 2006, here of range errors, not of phases).
"""

import numpy as np

from isarflow.imaging.focusing import TINY, Focusing, summit

WIDEST, STEP, HALVINGS = 1.25, 1 / 8, 5  # wavelengths at the ends of the aperture: drifts tried, and how finely
DRIFTING = 0.05  # what a drift costs, times its square in wavelengths: where few pulses have all power any is as sharp
JITTER, FINE = 0.5, 1 / 16  # wavelengths: the largest error of a pulse beside the drift, and steps of the search
ROUNDS, MORE = 6, 14  # of `pulse` from each beginning, and from the better one
# Between errors half a wavelength apart the phase alone does not decide, and range does little: the smaller one is more
# probable, the more so of a weak pulse. An error costs this times its square in wavelengths, in the pulses' mean match.
UNLIKELY = 1


class Focus(Focusing):
    SETTINGS = {
        "error": {"enum": ["drift", "pulse"], "default": "drift", "description": "quadratic in time, or of each pulse"},
    }

    def focus(self, samples, present=None):
        return self.refocused(samples, present, self.by_pulse if self.settings["error"] == "pulse" else self.by_drift)

    def by_drift(self, samples, present, first):
        """Quadratic errors (images, A), around the quadratic part of first ones."""
        square = self.time**2
        there = square * present
        middle = (first @ square) / np.maximum((there * square).sum(axis=1), 1e-9)  # of errors without a displacement

        def left(drifts):
            unlikely = DRIFTING * ((drifts - middle) / self.wavelength) ** 2
            return self.entropy(self.undone(samples, np.outer(drifts, square))) + unlikely

        step = STEP * self.wavelength
        tried = middle + step * np.arange(-round(WIDEST / STEP), round(WIDEST / STEP) + 1)[:, None]
        entropies = np.array([left(drifts) for drifts in tried])
        best = np.take_along_axis(tried, entropies.argmin(axis=0)[None], 0)[0]
        least = entropies.min(axis=0)
        for by in step / 2 ** np.arange(1, HALVINGS + 1):
            for moved in (best - by, best + by):
                entropy = left(moved)
                best, least = np.where(entropy < least, moved, best), np.minimum(entropy, least)
        return np.outer(best, square)

    def by_pulse(self, samples, present, first):
        """Errors (images, A), from first ones and from the drift found around these."""
        starts = first, self.by_drift(samples, present, first)
        begun = [self.laid(samples, present, start, ROUNDS) for start in starts]
        return self.in_place(self.laid(samples, present, self.sharper(samples, *begun), MORE), samples)

    def laid(self, samples, present, first, rounds):
        """Errors (images, A) after some rounds, none further than JITTER from the first ones."""
        steps = FINE * self.wavelength * np.arange(-round(JITTER / FINE), round(JITTER / FINE) + 1)
        phases = np.exp(-2j * np.outer(self.k, steps)).astype(np.complex64)
        samples, errors = self.undone(samples, first), np.zeros(first.shape)
        for _ in range(rounds):
            image, power = self.image(self.undone(samples, errors))
            mean = np.maximum(power.mean(axis=(1, 2), keepdims=True), TINY)
            weighted = np.log(np.maximum(power / mean, 1)) * image  # weaker pixels count nothing: it converges sooner
            back = (weighted.reshape(-1, len(self.pixels)) @ self.pixels.conj().T).reshape(samples.shape)
            match = (np.moveaxis((back.conj() * samples).sum(axis=1), 1, 2) @ phases).real  # (images, A, steps)
            likely = UNLIKELY * match.max(axis=2).mean(axis=1)[:, None, None] * (steps / self.wavelength) ** 2
            errors = FINE * self.wavelength * (summit(match - likely) - len(steps) // 2) * present
        return first + errors
