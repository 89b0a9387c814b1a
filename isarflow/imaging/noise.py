"""Receiver noise in the aperture: its strength for a given SNR, and its random numbers.

It is drawn for each image separately, also where neighbouring apertures share samples, or once for a whole sweep over
azimuth, whose apertures then share it: then several looks at a target, if fused, are not taken for independent ones.
"""

import hashlib

import numpy as np

DEFINITIONS = ("mean", "peak_3db")  # of the signal's power


def signal_power(samples, definition):
    """Signal power of each aperture, the numerator of the SNR: samples (images, S) in m -> (images,) in m^2.

    peak_3db: mean |E|^2 over the samples within 3 dB of the aperture's strongest (thesis eqs. 3.20, 3.21).
    mean: over all samples (eq. 3.19).
    """
    power = np.abs(samples).astype(np.float64) ** 2
    if definition == "mean":
        return power.mean(axis=1)
    strong = power >= 0.5 * power.max(axis=1, keepdims=True)
    return (power * strong).sum(axis=1) / strong.sum(axis=1)


def definition_offset(samples):
    """SNR in dB as peak_3db less that as mean: samples (images, S) -> (images,); NaN for one without signal."""
    with np.errstate(invalid="ignore"):
        return 10 * np.log10(signal_power(samples, "peak_3db") / signal_power(samples, "mean"))


def generator(seed, target, snr_db, realization, channel=None):
    """The random numbers of one realization, which follow from these values; `channel` names one after the first."""
    return random_numbers(seed, target, repr(float(snr_db)), realization, *([channel] if channel else []))


def random_numbers(*names):
    """Random numbers that follow from these names and numbers alone."""
    key = "|".join(map(str, names))
    return np.random.default_rng(int.from_bytes(hashlib.sha256(key.encode()).digest()))


def variances(power, snr_db, per):
    """The variance in m^2 of the noise in each image's aperture: (images,). power: of their signals, in m^2.

    per: `image`, each its own, so that all have this SNR; or `sweep`, one for all, `snr_db` below their mean power.
    """
    ratio = 10 ** (snr_db / 10)
    return power / ratio if per == "image" else np.full(len(power), power.mean() / ratio)


def white_noise(variance, samples, random):
    """Circular complex white Gaussian noise of these variances (rows,), `samples` numbers each: complex64."""
    parts = random.standard_normal((len(variance), samples, 2), dtype=np.float32)
    return parts.view(np.complex64)[..., 0] * np.sqrt(variance / 2).astype(np.float32)[:, None]
