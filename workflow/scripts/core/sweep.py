"""The sweep that a config describes: frequencies, bands, elevations and azimuths."""

from dataclasses import dataclass

import numpy as np

from core.errors import InputError

C0 = 299_792_458.0  # speed of light in vacuum, m/s (exact)


def frequencies(radar):
    """Stepped frequencies in Hz, ascending, shape (frequencies,), both band edges included."""
    center, half = radar["center_frequency"], radar["bandwidth"] / 2
    return np.linspace(center - half, center + half, radar["frequencies"])


def bands(radar, count):
    """Split the frequencies into `count` contiguous bands of nearly equal length, lowest first."""
    return np.array_split(frequencies(radar), count)


def stepped(start, stop, step):
    """Angles in degrees from start to stop, both included, within rounding of a whole number of steps."""
    return start + step * np.arange(int(np.floor((stop - start) / step + 1e-9)) + 1)


def elevations(aspect):
    """Elevations above the horizon in degrees, ascending."""
    return stepped(**aspect["elevation"])


def azimuths(aspect):
    """Azimuths in degrees: `count` evenly over 360 from 0, or start to stop, both included."""
    azimuth = aspect["azimuth"]
    if "count" in azimuth:
        return np.arange(azimuth["count"]) * (360.0 / azimuth["count"])
    return stepped(**azimuth)


@dataclass(frozen=True)
class Sweep:
    """Where a field is wanted. frequency: (F,) Hz; elevation: (E,) and azimuth: (A,) degrees

    polarizations: receive and transmit, V (elevation) or H (azimuth), e.g. ['VV', 'HV']
    """

    frequency: np.ndarray
    elevation: np.ndarray
    azimuth: np.ndarray
    polarizations: list


def sweeps(radar, aspect, count):
    """The Sweep of each of `count` bands, lowest first."""
    rest = elevations(aspect), azimuths(aspect), radar["polarizations"]
    return [Sweep(band, *rest) for band in bands(radar, count)]


def closes_circle(azimuth):
    """True if the azimuths (degrees, ascending, uniform) go once round 360 degrees without a repeat."""
    return len(azimuth) > 2 and bool(np.isclose(len(azimuth) * (azimuth[1] - azimuth[0]), 360.0))


def images_are_made(config):
    """False for a sweep that cannot make an image (one frequency): then scattering is an RCS solver."""
    return config["radar"]["frequencies"] > 1


def snr_label(snr_db):
    """The SNR as it stands in file names: -6 gives 'snr_-6dB', 2.5 gives 'snr_2.5dB'."""
    return f"snr_{snr_db + 0.0:g}dB"  # + 0.0: no minus before a zero


def snr_of_label(label):
    """The SNR in dB that a file name says, the inverse of snr_label: 'snr_-6dB' gives -6.0."""
    try:
        return float(label.removeprefix("snr_").removesuffix("dB"))
    except ValueError:
        raise InputError(f"{label}: not an SNR; write it like snr_-6dB.") from None
