"""Interpolate backscatter between the azimuths of a sweep, by its bandwidth.

On a ring of constant elevation the excitation of a target within `reach` of the origin has the orders exp(j m az) with
|m| up to M (see `directions`), and backscatter, which is quadratic in it, orders up to 2 M. Samples dense enough
determine it everywhere between them. Samples of a whole circle do so exactly; for an arc or a list the series of least
norm through the samples is taken, which is less exact in the gap at either end: 5e-5 of the peak was seen.
"""

import numpy as np

from isarflow.core.sweep import C0, closes_circle
from isarflow.scattering.directions import samples_of_ring

ACCURACY = 1e-5  # of the excitation's largest value: size of the orders beyond M
QUIET = 1e-4  # of a field's power: the most that its highest harmonics have, if all are resolved
HIGHEST = 0.9  # of the highest order: where these begin
CUT = 1e-6  # relative: singular values below it are rounding alone


def order(frequency, reach, elevation):
    """The highest order 2 M of backscatter in azimuth. frequency: Hz; reach: m; elevation: degrees."""
    x = 2 * np.pi * frequency / C0 * reach * np.cos(np.radians(elevation))
    return samples_of_ring(x, ACCURACY) - 2


def order_told(field):
    """The highest order that samples (A,) over a whole circle resolve, or None if the field has higher ones.

    For a field of unknown reach: its orders end below that one if its highest harmonics are almost empty.
    """
    power = np.abs(np.fft.fftshift(np.fft.fft(field))) ** 2
    highest = (len(field) - 1) // 2
    high = np.abs(np.arange(len(field)) - len(field) // 2) > HIGHEST * highest
    return highest if power[high].sum() <= QUIET * power.sum() else None


def is_dense(azimuth, highest):
    """True if azimuths (A,), ascending degrees, are near enough to each other for orders up to `highest`."""
    if len(azimuth) < 3:
        return False
    step = 360 / len(azimuth) if closes_circle(azimuth) else np.diff(azimuth).max()
    return bool(step * (2 * highest + 1) <= 360 + 1e-9)


def between(azimuth, field, highest, wanted):
    """Backscatter at azimuths `at` (B,) from that at `azimuth` (A,), both degrees. field: (..., A); returns (..., B).

    The series of least norm with orders up to `highest` that passes through the samples.
    """
    orders = np.arange(-highest, highest + 1)

    def waves(angle):
        return np.exp(1j * np.deg2rad(np.outer(angle, orders)))

    series, *_ = np.linalg.lstsq(waves(azimuth), np.moveaxis(field, -1, 0).reshape(len(azimuth), -1), rcond=CUT)
    return np.moveaxis((waves(wanted) @ series).reshape(len(wanted), *field.shape[:-1]), 0, -1)
