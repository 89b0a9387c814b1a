"""Phase gradient autofocus (Wahl, Eichel, Ghiglia and Jakowatz, IEEE Trans. AES 30, 1994).

In each range row the brightest pixel is moved to cross-range 0, and a window keeps what is blurred about it. Back over
pulses, the phase steps from each to the next are the error's, all rows and channels together. Their sum is undone where
that sharpens the image, and all begins anew with a narrower window. Samples are turned by a pixel's exact phases.
"""

import numpy as np

from isarflow.imaging.focusing import Focusing

ROUNDS = 10
NARROWER = 0.75  # each round's window, over the last one's; the first has all cells of cross-range
NARROWEST = 5  # cells
FAINTEST = 0.1  # of the brightest pixel's power: fainter rows hold sidelobes of others, with other phases


class Focus(Focusing):
    SETTINGS = {}

    def focus(self, samples, present=None):
        return self.refocused(samples, present, self.by_gradient)

    def by_gradient(self, samples, present, first):
        """Errors (images, A), from first ones."""
        rows, pulses = len(self.frequency), len(self.angle)
        waves = self.pixels.T.reshape(-1, rows, pulses)
        last = np.maximum.accumulate(np.where(present, np.arange(pulses), 0), axis=1)  # that is there at each pulse
        errors, width = first, float(pulses)
        for _ in range(ROUNDS):
            now = self.undone(samples, errors)
            power = self.image(now)[1].sum(axis=1).reshape(-1, rows, pulses)
            brightest = power.max(axis=2)
            used = brightest >= FAINTEST * brightest.max(axis=1, keepdims=True)
            turned = waves[np.arange(rows) * pulses + power.argmax(axis=2)] * used[:, :, None, None]
            echoes = np.einsum("nrfa,ncfa->ncra", turned, now, optimize=True)
            kept = np.abs(np.fft.fftfreq(pulses) * pulses) <= width / 2
            echoes = np.fft.ifft(np.fft.fft(echoes, axis=3) * kept, axis=3)
            before = np.take_along_axis(echoes, last[:, None, None, :-1], 3)
            steps = np.angle((before.conj() * echoes[..., 1:]).sum(axis=(1, 2))) * present[:, 1:]
            phases = np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))
            found = self.in_place(errors + phases / (2 * self.k.mean()), samples)
            errors = self.sharper(samples, errors, found)  # at last a window may be too narrow for an error of a pulse
            width = max(NARROWER * width, NARROWEST)
        return errors
