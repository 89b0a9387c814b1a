"""Fourier imaging (thesis section 3.4): a windowed sum over the aperture's samples for every pixel.

For one geometry this is the same linear map of the aperture's samples for every target, direction and noise.
There are three ways to form the sum: `none` takes the samples for a rectangle in (kx, ky), a plain inverse DFT; `polar`
resamples them onto a rectangle by bilinear interpolation; `exact` takes every sample where it is (back-projection).
"""

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.imaging.formation import Formation

WINDOWS = {"hamming": np.hamming, "hann": np.hanning, "blackman": np.blackman, "boxcar": np.ones}
LEAST_DEPTH = 0.5  # of the bandwidth: a shallower rectangle makes images of far coarser range than the sweep's


class Imager(Formation):
    """One matrix from the samples to the image, chosen by `reformat`.

    The window is divided by its sum: a scatterer of amplitude f at the origin gives a peak of f. Samples that were lost
    count as zeros: the peak is lower by their weights, and there are ghosts. The phase is that of thesis eq. 3.14,
    exp(2j (kx range - ky crossrange)) with the true kx: at its own place a scatterer has the phase of its amplitude.
    """

    SETTINGS = {
        "window": {"enum": ["hamming", "hann", "blackman", "boxcar"], "description": "over frequency and azimuth"},
        "reformat": {
            "enum": ["polar", "exact", "none"],
            "description": "polar = bilinear, onto a Cartesian grid; exact = back-projection; none = plain FFT",
        },
        "upsample": {
            "oneOf": [{"const": "none"}, {"type": "integer", "minimum": 3, "maximum": 128}],
            "description": "none (as many as samples), or 3 to 128 pixels a side, in both directions, by zero padding",
        },
    }
    linear = True
    compared = {
        "none (plain FFT)": {"reformat": "none", "upsample": "none"},
        "polar": {"reformat": "polar", "upsample": "none"},
        "exact": {"reformat": "exact", "upsample": "none"},
    }
    compared_note = (
        "The pixels of polar and exact span more cross-range than the azimuth steps make unambiguous: there exact "
        "shows what folds over, and polar, which weakens its sides, less of it."
    )

    def __init__(self, frequency, angle, settings):
        super().__init__(frequency, angle, settings)
        self.reformat = settings["reformat"]
        self.windows = [window(settings["window"], len(samples)) for samples in (frequency, angle)]

    def axes(self):
        """The DFT bins of the wavenumber grid, 0 at index n // 2.

        As many as there are samples, or `upsample` a side: more pixels over the same extent, pi / step.
        """
        axes, wanted = [], self.settings["upsample"]
        for k in wavenumber_grid(self.frequency, self.angle, self.reformat):
            count = len(k) if wanted == "none" else wanted
            if count < len(k):
                raise InputError(
                    f"config key 'imaging.upsample': {count} pixels a side are fewer than the {len(k)} samples there; "
                    "take as many or more, or none."
                )
            axes.append((np.arange(count) - count // 2) * np.pi / (count * (k[1] - k[0])))
        return tuple(axes)

    def at(self, down, cross):
        matrix = self.matrix(down, cross)
        return lambda samples: (samples.reshape(len(samples), -1) @ matrix.T).reshape(-1, len(down), len(cross))

    def matrix(self, down, cross):
        """The map from an aperture's samples to the image at ranges `down` (D,) and crossranges `cross` (C,), in m.

        Returns complex64 (D * C, F * A), both in C order of (range, crossrange) and (frequency, angle). `exact` also
        weights its samples with k, as they are less dense where k is large (d kx d ky = k dk dphi).
        """
        frequency, angle, (over_range, over_cross) = self.frequency, self.angle, self.windows
        if self.reformat == "exact":
            k = 2 * np.pi * frequency / C0
            weight = np.outer(over_range * k, over_cross)
            to_range = np.exp(2j * np.multiply.outer(down, np.outer(k, np.cos(angle)))) * (weight / weight.sum())
            to_cross = np.exp(-2j * np.multiply.outer(cross, np.outer(k, np.sin(angle))))
            return (to_range[:, None] * to_cross).reshape(len(down) * len(cross), -1).astype(np.complex64)
        kx, ky = wavenumber_grid(frequency, angle, self.reformat)
        to_range = np.exp(2j * np.outer(down, kx)) * over_range
        to_cross = np.exp(-2j * np.outer(cross, ky)) * over_cross
        matrix = np.kron(to_range, to_cross)
        if self.reformat == "polar":
            matrix = matrix @ bilinear_weights(frequency, angle, kx, ky)
        return matrix.astype(np.complex64)

    def carrier(self):
        return float(wavenumber_grid(self.frequency, self.angle, self.reformat)[0][len(self.frequency) // 2])

    def words(self):
        reformatting = "plain FFT" if self.reformat == "none" else f"{self.reformat} reformatting"
        return f"{self.settings['window']} window, {reformatting}"

    def warnings(self, geometry):
        # Over the aperture a scatterer at cross-range c moves c x angle in range; the plain FFT ignores this.
        walk = np.radians(geometry["aperture_angle"]) * geometry["crossrange_extent"] / 2
        if self.reformat != "none" or walk <= geometry["range_resolution"]:
            return []
        return [
            f"'imaging.reformat: none' blurs: a scatterer at the edge walks {walk:.2f} m in range over the aperture of "
            f"{geometry['aperture_angle']:.1f} degrees, and the resolution is {geometry['range_resolution']:.2f} m. "
            "Use 'polar' or 'exact'."
        ]


def wavenumber_grid(frequency, angle, reformat):
    """The uniform grid (kx, ky) in rad/m on which the DFT works, as many values as frequencies and angles.

    frequency: Hz. angle: relative azimuth in rad, symmetric about 0.
    `none`: k, and the centre k times the angle, as if the sector were a rectangle. `polar`, and `exact`, which has its
    pixels: the rectangle inscribed in the sampled sector (k cos, k sin), its near side at the lowest k.
    InputError if the sector is too wide for its depth to hold a rectangle with half its bandwidth.
    """
    k = 2 * np.pi * frequency / C0
    if reformat == "none":
        return k, (k[0] + k[-1]) / 2 * angle
    half = angle[-1]
    ky_max = k[0] * np.tan(half)
    deepest = np.sqrt(max(k[-1] ** 2 - ky_max**2, 0.0)) if half < np.pi / 2 else 0.0
    if deepest - k[0] < LEAST_DEPTH * (k[-1] - k[0]):
        raise InputError(
            f"config key 'imaging.reformat': an aperture of {2 * np.degrees(half):.0f} degrees is too wide for "
            f"{frequency[0]:g} to {frequency[-1]:g} Hz: the rectangle that {reformat} lays into that sector would keep "
            f"{max(100 * (deepest - k[0]) / (k[-1] - k[0]), 0):.0f} % of the bandwidth, and at least "
            f"{100 * LEAST_DEPTH:.0f} % is needed; take fewer azimuth samples ('imaging.aperture'), or more bandwidth."
        )
    return np.linspace(k[0], deepest, len(k)), np.linspace(-ky_max, ky_max, len(angle))


def bilinear_weights(frequency, angle, kx, ky):
    """Bilinear interpolation from the uniform (frequency, angle) samples, F * A, to the (kx, ky) grid, as a matrix."""
    kx, ky = (axis.ravel() for axis in np.meshgrid(kx, ky, indexing="ij"))
    over_frequency = _linear_weights(np.hypot(kx, ky) * C0 / (2 * np.pi), frequency)
    over_angle = _linear_weights(np.arctan2(ky, kx), angle)
    return (over_frequency[:, :, None] * over_angle[:, None]).reshape(len(kx), -1)


def _linear_weights(values, axis):
    """Weights (n, axis) of linear interpolation between the values of a uniform axis; beyond it, its end counts."""
    places = (values - axis[0]) / (axis[-1] - axis[0]) * (len(axis) - 1)
    return np.stack([np.interp(places, np.arange(len(axis)), unit) for unit in np.eye(len(axis))], axis=1)


def window(name, length):
    """Weights of a window over `length` samples, their sum 1. InputError if fewer than two samples count."""
    weights = WINDOWS[name](length)
    if np.count_nonzero(weights > 1e-9) < 2:
        raise InputError(
            f"config key 'imaging.window': {name} leaves fewer than two of {length} samples; take hamming or boxcar, "
            "or more samples ('radar.frequencies', 'imaging.aperture')."
        )
    return weights / weights.sum()
