"""Images of whole sweeps, clean or with noise, and what a model recognises on them: what two benchmarks share."""

import numpy as np
import pandas as pd

from isarflow.imaging.formation import apertures, form_images
from isarflow.imaging.geometry import imager_of
from isarflow.imaging.noise import signal_power, white_noise
from isarflow.learning.classifier import build_classifier
from isarflow.learning.predict import classify

TARGETS = ("drone", "missile", "aircraft", "ufo", "trihedral")  # of the reference experiment
NOISES = 2000  # images of noise alone, for models that learn from them


class Imaged:
    """Images of targets by one imager. fields: {target: (polarization, frequency, elevation, azimuth)}, m.

    imaging: as the config's section, with its polarizations; the SNR is that of the first, by the mean power.
    """

    def __init__(self, fields, imaging):
        self.fields = {target: field.sel(polarization=imaging["polarizations"]) for target, field in fields.items()}
        first = next(iter(self.fields.values()))
        self.azimuth, self.elevation = first.azimuth.values, first.elevation.values
        self.imager, self.aperture = imager_of(first.frequency.values, self.azimuth, imaging), imaging["aperture"]
        self.channels = len(imaging["polarizations"])

    def of(self, target, elevations, azimuths, snr_db=None, random=None):
        """Images (n, channels, range, crossrange) at elevations, by their numbers, and at azimuths, (E, n) numbers."""
        made = []
        for elevation, chosen in zip(elevations, azimuths, strict=True):
            field = self.fields[target].isel(elevation=elevation).values
            samples = apertures(field, self.azimuth, self.aperture)[chosen]
            if snr_db is not None:
                variance = signal_power(samples[:, 0], "mean") / 10 ** (snr_db / 10)
                samples = samples + self._noise(variance, random)
            made.append(form_images(self.imager, samples.astype(np.complex64))[0])
        return np.concatenate(made)

    def of_noise(self, random):
        """Images of noise alone, as `of`."""
        return form_images(self.imager, self._noise(np.ones(NOISES), random))[0]

    def _noise(self, variance, random):
        samples = len(self.imager.frequency) * self.aperture
        return np.stack([white_noise(variance, samples, random) for _ in range(self.channels)], axis=1)


def recognised(library, tested, models, snrs, step=1, drawn=12):
    """What models name rightly of the closed set of all targets: a row for each of them, each test and SNR.

    library: the Imaged of which every second elevation is known, at every `step`-th azimuth; tested: {name: Imaged},
    of which those between are tested, at `drawn` random azimuths each, the same for all, as is the noise;
    models: {name: (kind, settings)}.
    """
    targets, count = list(library.fields), len(library.azimuth)
    known, between = np.arange(0, len(library.elevation), 2), np.arange(1, len(library.elevation), 2)
    every = np.tile(np.arange(0, count, step), (len(known), 1))
    random = np.random.default_rng(1)
    azimuths = {of: np.stack([random.choice(count, drawn, replace=False) for _ in between]) for of in targets}
    labels, images = np.repeat(targets, between.size * drawn), {}
    for name, made in tested.items():
        for number, snr in enumerate(snrs):
            noise = np.random.default_rng(number)
            parts = [made.of(target, between, azimuths[target], snr, noise) for target in targets]
            images[name, snr] = np.concatenate(parts)
    training = np.concatenate([library.of(target, known, every) for target in targets])
    noise, rows = library.of_noise(np.random.default_rng(2)), []
    for name, (kind, settings) in models.items():
        model = build_classifier(kind, settings, 0)
        model.noise = noise if model.learns_noise else None
        model.fit(training, np.repeat(targets, every.size))
        for (test, snr), of in images.items():
            right = classify(model, of).labels == labels
            by_target = {target: right[labels == target].mean() for target in targets}
            rows.append({"model": name, "tested": test, "snr_db": snr, "accuracy": right.mean()} | by_target)
    return pd.DataFrame(rows)
