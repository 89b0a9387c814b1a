"""The interface of every imager, and the steps that all share: cut apertures, divide images by their peaks."""

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.kinds import IMAGERS, file_of_object, load_class
from isarflow.core.sweep import C0, closes_circle

Images = Callable[[np.ndarray], np.ndarray]  # a function of samples to images
BYTES = 8  # one complex64
# Keys of the config's section that are no settings of an imager.
SHARED = ("imager", "aperture", "polarizations", "focus")


def resolution(frequency: np.ndarray, step: float, samples: int, turn: float) -> tuple[float, float]:
    """Resolution in range and crossrange, m (thesis eqs. 3.4, 3.9), for the centre of frequencies `step` Hz apart.

    samples: azimuths of an aperture, `turn` rad apart.
    """
    wavelength = C0 / ((frequency[0] + frequency[-1]) / 2)
    return float(C0 / (2 * len(frequency) * step)), float(wavelength / (2 * samples * turn))


class Formation:
    """A way to form images from apertures of one geometry.

    An imager is a class `Imager` in a file of its own, imagers/<kind>.py; it defines `axes` and `at`.

    frequency: (F,) in Hz. angle: (A,) azimuth relative to the image's centre, in rad. settings: those of the
    config's section `imaging` that it states as SETTINGS, a mapping of each to its JSON schema (type, bounds,
    description; literals, as the file is read for them and not run). A config with others is refused.
    coherent: True if the phase of an image has a meaning; if not, only magnitudes are kept.
    linear: True if an image is the same linear map of the samples whatever they are.
    compared: a mapping of names to changes of the settings, whose point responses the page shows side by side; None
    for that of the run's settings alone. compared_note: the page's text on them.
    """

    coherent = True
    linear = False
    compared: Mapping[str, Mapping[str, Any]] | None = None
    compared_note = ""

    def __init__(self, frequency: np.ndarray, angle: np.ndarray, settings: Mapping[str, Any]) -> None:
        self.frequency, self.angle, self.settings = frequency, angle, settings

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Pixel centres (range, crossrange) in m, evenly spaced and ascending.

        InputError if this geometry cannot make an image.
        """
        raise NotImplementedError

    def at(self, down: np.ndarray, cross: np.ndarray) -> Images:
        """A function that forms images at ranges `down` (D,) and crossranges `cross` (C,) in m.

        It maps samples (images, F, A), complex in m, to images (images, D, C). Those of a lost pulse are 0. A scatterer
        of amplitude f at one of these places gives a peak of |f|. The page asks for finer places than the `axes`, too.
        """
        raise NotImplementedError

    @functools.cached_property
    def on_axes(self) -> Images:
        """The function of `at` for the imager's own `axes`."""
        return self.at(*self.axes())

    def working_bytes(self, pixels: int) -> int:
        """Bytes needed to form images of so many pixels: for a matrix, and for it in double precision before that."""
        return 5 * BYTES * pixels * len(self.frequency) * len(self.angle)

    def carrier(self) -> float:
        """The wavenumber in rad/m in the middle of an image's spectrum over range, about which it is up-sampled."""
        return float(2 * np.pi * self.frequency[len(self.frequency) // 2] / C0) if self.coherent else 0.0

    def words(self) -> str:
        """Describe in a few words how the images of these settings are formed."""
        return ", ".join([Path(self.file).stem, *(f"{key} {value}" for key, value in sorted(self.settings.items()))])

    @property
    def file(self) -> str:
        return file_of_object(self)

    def warnings(self, geometry: Any) -> list[str]:
        """Sentences on what will look wrong in images of these settings. geometry: a result of `geometry.geometry`."""
        return []


def build_imager(frequency: np.ndarray, angle: np.ndarray, imaging: Mapping[str, Any]) -> Formation:
    """The imager of a config's section `imaging`: class `Imager` of imagers/<imaging.imager>.py.

    InputError where it cannot be imported, where its Imager is no Formation, and where this geometry makes no image.
    """
    imager = load_class(IMAGERS, imaging["imager"], Formation)
    built: Formation = imager(frequency, angle, {key: imaging[key] for key in imaging if key not in SHARED})
    return built


def with_imager(imaging: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """A config's section `imaging` with another imager and its settings, as one of `imagers` names them."""
    return {key: imaging[key] for key in SHARED if key in imaging} | dict(settings)


def apertures(field: np.ndarray, azimuth: np.ndarray, aperture: int) -> np.ndarray:
    """Cut the samples of every image out of one elevation's sweep.

    field: ([channel,] frequency, azimuth); azimuth in degrees. On a closed circle the apertures wrap around.
    Returns (images, [channel,] frequency * aperture), the images in the order of `geometry.centres`.
    """
    half = aperture // 2
    if closes_circle(azimuth):
        field = np.concatenate([field[..., -half:], field, field[..., :half]], axis=-1)
    cut = np.moveaxis(np.lib.stride_tricks.sliding_window_view(field, aperture, axis=-1), -2, 0)
    return cut.reshape(*cut.shape[:-2], -1)


def form_images(imager: Formation, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Form the images of one elevation, each divided by its one peak over all channels.

    All are formed in one call, so that no image depends, in its last bit, on how many others the run makes. A zero
    image (a symmetric target, cross-polarized) stays zero.

    Parameters:
        imager: as of `build_imager`
        samples: (images, [channel,] F * A), as of `apertures`

    Returns:
        Images, complex64 (images, [channel,] range, crossrange), and their peaks (images,).

    Raises:
        InputError: if the imager gives images of another shape than its axes, or values that are not finite.

    A point 0.5 m nearer to the radar than the origin, of 15 frequencies by 15 azimuths:

    >>> frequency, angle = np.linspace(9e9, 11e9, 15), np.radians(np.linspace(-6, 6, 15))
    >>> settings = {"imager": "fourier", "window": "hamming", "reformat": "polar", "upsample": "none"}
    >>> imager = build_imager(frequency, angle, settings)
    >>> echo = np.exp(4j * np.pi / C0 * 0.5 * np.outer(frequency, np.cos(angle)))
    >>> images, peaks = form_images(imager, echo.reshape(1, -1))
    >>> row, column = np.unravel_index(abs(images[0]).argmax(), images[0].shape)
    >>> down, cross = imager.axes()
    >>> bool(abs(down[row] + 0.5) < 0.05 and abs(cross[column]) < 0.05)
    True
    """
    image = imager.on_axes(samples.reshape(-1, len(imager.frequency), len(imager.angle)))
    shape = (samples[..., 0].size, *(len(axis) for axis in imager.axes()))
    if image.shape != shape or not np.isfinite(image).all():
        wrong = f"images of shape {image.shape}" if image.shape != shape else "values that are not finite"
        raise InputError(f"{imager.file}: its Imager makes {wrong}; its axes ask for finite images of shape {shape}.")
    image = image if imager.coherent else np.abs(image)
    image = image.reshape(*samples.shape[:-1], *shape[1:])
    peak = np.abs(image).max(axis=tuple(range(1, image.ndim)), keepdims=True)
    image = image / np.where(peak > 0, peak, 1)
    return image.astype(np.complex64, copy=False), peak.reshape(len(samples))
