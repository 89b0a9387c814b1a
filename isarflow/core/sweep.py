"""The sweep that a config describes: frequencies, bands, elevations and azimuths."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from isarflow.core.errors import InputError

C0 = 299_792_458.0  # speed of light in vacuum, m/s (exact)


def frequencies(radar: Mapping[str, Any]) -> np.ndarray:
    """Frequencies in Hz, ascending, shape (frequencies,): from a list, or stepped with both band edges included."""
    if isinstance(radar["frequencies"], list):
        return np.array(sorted(radar["frequencies"]), float)
    center, half = radar["center_frequency"], radar["bandwidth"] / 2
    return np.linspace(center - half, center + half, radar["frequencies"])


def bands(radar: Mapping[str, Any], count: int) -> list[np.ndarray]:
    """Split the frequencies into `count` contiguous bands of nearly equal length, lowest first."""
    return np.array_split(frequencies(radar), count)


def stepped(start: float, stop: float, step: float) -> np.ndarray:
    """Angles in degrees from start to stop, both included, within rounding of a whole number of steps."""
    return start + step * np.arange(int(np.floor((stop - start) / step + 1e-9)) + 1)


def angles(written: Any) -> np.ndarray:
    """Angles in degrees, ascending: a list, `count` evenly over 360 from 0, or start to stop, both included."""
    if isinstance(written, list):
        return np.array(sorted(written), float)
    if "count" in written:
        return np.arange(written["count"]) * (360.0 / written["count"])
    return stepped(**written)


def elevations(aspect: Mapping[str, Any]) -> np.ndarray:
    """Elevations above the horizon in degrees, ascending, of a grid of directions."""
    return angles(aspect["elevation"])


def azimuths(aspect: Mapping[str, Any]) -> np.ndarray:
    """Azimuths in degrees, ascending, of a grid of directions."""
    return angles(aspect["azimuth"])


def is_grid(aspect: Mapping[str, Any]) -> bool:
    """True for elevations times azimuths, False for directions one by one, as a list or on a great circle."""
    return "elevation" in aspect or "azimuth" in aspect


def directions(aspect: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Elevation and azimuth in degrees, (D,) each, of directions one by one, in the order that they are written in."""
    if "directions" in aspect:
        return tuple(np.array(aspect["directions"], float).T)
    circle = aspect["great_circle"]
    start, through = (unit_vectors(*np.array(circle[key], float))[0] for key in ("from", "through"))
    ahead = through - (through @ start) * start
    turn = np.radians(angles(circle["angle"]))[:, None]
    ahead /= np.linalg.norm(ahead)
    points, onward = np.cos(turn) * start + np.sin(turn) * ahead, np.cos(turn) * ahead - np.sin(turn) * start
    # Rounded, so that a circle along a meridian or the horizon has exactly its angles.
    elevation = np.round(np.degrees(np.arcsin(np.clip(points[:, 2], -1, 1))), 6)
    # At a pole V and H have the azimuth that the circle comes from: they do not turn on the way.
    across = np.where(np.abs(elevation)[:, None] == 90, -onward, points)
    azimuth = np.round(np.degrees(np.arctan2(across[:, 1], across[:, 0])), 6)
    return elevation + 0.0, azimuth + 0.0


def unit_vectors(elevation: Any, azimuth: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors u towards the radar, V and H, (..., 3) each, of angles in degrees of the same shape."""
    el, az = np.deg2rad(elevation), np.deg2rad(azimuth)
    zero = np.zeros(np.broadcast_shapes(el.shape, az.shape))
    u = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el) + zero], -1)
    v = np.stack([-np.sin(el) * np.cos(az), -np.sin(el) * np.sin(az), np.cos(el) + zero], -1)
    h = np.stack([-np.sin(az) + zero, np.cos(az) + zero, zero], -1)
    return u, v, h


@dataclass(frozen=True)
class Sweep:
    """Frequencies and directions of a wanted field. frequency: (F,) Hz; elevation and azimuth of the radar, degrees

    For a grid elevation is (E,) and azimuth (A,); for directions one by one, which are `paired`, both are (D,).
    polarizations: receive and transmit, V (elevation) or H (azimuth), e.g. ['VV', 'HV']

    >>> sweep = Sweep(np.array([1e9]), np.array([0.0, 10.0]), np.array([0.0, 90.0, 180.0]), ["VV"])
    >>> [angles.shape for angles in sweep.each]
    [(6,), (6,)]
    """

    frequency: np.ndarray
    elevation: np.ndarray
    azimuth: np.ndarray
    polarizations: Sequence[str]
    paired: bool = False
    receivers: tuple[np.ndarray, ...] = ()  # bistatic: elevation and azimuth of each, (R,)

    @property
    def each(self) -> tuple[np.ndarray, ...]:
        """Elevation and azimuth of every direction, (D,) each; for a grid, azimuths of the first elevation first."""
        if self.paired:
            return self.elevation, self.azimuth
        return tuple(x.ravel() for x in np.meshgrid(self.elevation, self.azimuth, indexing="ij"))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the directions, (E, A) or (D,)."""
        return (len(self.elevation),) if self.paired else (len(self.elevation), len(self.azimuth))


def sweeps(
    radar: Mapping[str, Any], aspect: Mapping[str, Any], count: int, scattering: Mapping[str, Any] | None = None
) -> list[Sweep]:
    """The Sweep of each of `count` bands, lowest first, bistatic if the config's `scattering` says so."""
    bistatic = (scattering or {}).get("bistatic")
    receivers = tuple(np.array(bistatic["receivers"], float).T) if bistatic else ()
    grid = is_grid(aspect)
    coordinates = (elevations(aspect), azimuths(aspect)) if grid else directions(aspect)
    return [Sweep(band, *coordinates, radar["polarizations"], not grid, receivers) for band in bands(radar, count)]


def closes_circle(azimuth: np.ndarray) -> bool:
    """True if the azimuths (degrees, ascending, uniform) go once around 360 degrees without a repeat."""
    return len(azimuth) > 2 and bool(np.isclose(len(azimuth) * (azimuth[1] - azimuth[0]), 360.0))


def images_are_made(config: Mapping[str, Any]) -> bool:
    """True for a sweep that can make an image; otherwise scattering is an RCS solver."""
    return why_no_images(config) is None


def why_no_images(config: Mapping[str, Any]) -> str | None:
    """Say in one sentence why a config's sweep makes no images; None if it does."""
    frequency, aspect = config["radar"]["frequencies"], config["aspect"]
    if isinstance(frequency, list):
        return "'radar.frequencies' is a list, and an image takes evenly spaced frequencies, written as their number."
    if frequency == 1:
        return "'radar.frequencies' is 1, and an image takes several, for its range."
    if not is_grid(aspect):
        return "'aspect' names directions one by one, and an image takes azimuths that follow each other."
    if isinstance(aspect["azimuth"], list):
        return "'aspect.azimuth' is a list, and an image takes evenly spaced azimuths, {count} or {start, stop, step}."
    if "bistatic" in config.get("scattering", ()):
        return "'scattering.bistatic' has receivers apart from the radar, and images are of backscatter."
    return None


def snr_label(snr_db: float) -> str:
    """The SNR as file names have it: -6 gives 'snr_-6dB', 2.5 gives 'snr_2.5dB'."""
    return f"snr_{snr_db + 0.0:g}dB"  # + 0.0: no minus before a zero


def snr_of_label(label: str) -> float:
    """The SNR in dB that a file name says, the inverse of snr_label: 'snr_-6dB' gives -6.0."""
    try:
        return float(label.removeprefix("snr_").removesuffix("dB"))
    except ValueError:
        raise InputError(f"{label}: not an SNR; write it like snr_-6dB.") from None


def evenly(values: Iterable[Any], count: int) -> list[Any]:
    """Return at most `count` of the sorted values, evenly spread, the first and the last among them."""
    values = sorted(values)
    picks = np.unique(np.linspace(0, len(values) - 1, min(count, len(values))).round().astype(int))
    return [values[pick] for pick in picks]
