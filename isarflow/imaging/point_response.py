"""Compute the image of one scatterer at any place, which shows how good a way to form images is."""

from contextlib import suppress

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.imaging.geometry import imager_of

FINE = 4  # points per pixel on which peaks are searched
MAIN_LOBE = 2.5  # pixels; an echo farther away is a ghost or a sidelobe (a Hamming main lobe ends at 2)


def point_response(imager, down, cross):
    """Images of single scatterers of amplitude 1 at ranges `down` (D,) by crossranges `cross` (C,), in m.

    Returns a mapping of arrays (D, C): `loss_db`, how far the peak is below the amplitude; `ghost_db`, the strongest
    echo outside the main lobe, relative to the peak; `error`, the distance from the peak to the true place in pixels,
    the larger of both axes. An image is periodic, so distances are taken across the edges too.
    """
    pixels = imager.axes()
    step = np.array([axis[1] - axis[0] for axis in pixels])
    counts = [len(axis) for axis in pixels]
    fine = [((np.arange(FINE * n) + 0.5) / FINE - n / 2) * size for n, size in zip(counts, step, strict=True)]
    extent, form, angle = step * counts, imager.at(*fine), imager.angle
    k = 2 * np.pi * imager.frequency / C0
    measures = {name: np.empty((len(down), len(cross))) for name in ("loss_db", "ghost_db", "error")}
    for i, j in np.ndindex(len(down), len(cross)):
        echo = np.exp(2j * np.outer(k, -np.cos(angle) * down[i] + np.sin(angle) * cross[j])).astype(np.complex64)
        image = np.abs(form(echo[None])[0])
        row, column = np.unravel_index(image.argmax(), image.shape)
        peaks = [_vertex(image[:, column], row), _vertex(image[row], column)]
        place = [axis[0] + at * size / FINE for (at, _), axis, size in zip(peaks, fine, step, strict=True)]
        # Each parabola's top is above the highest point, along its own axis.
        peak = peaks[0][1] * peaks[1][1] / image[row, column]
        around = [
            np.abs((axis - at + length / 2) % length - length / 2) / size
            for axis, at, length, size in zip(fine, place, extent, step, strict=True)
        ]
        outside = np.maximum.outer(*around) > MAIN_LOBE
        off = (np.array(place) - [down[i], cross[j]] + extent / 2) % extent - extent / 2
        measures["loss_db"][i, j] = -20 * np.log10(peak)
        # Small images have no outside.
        measures["ghost_db"][i, j] = 20 * np.log10(image[outside].max(initial=1e-5) / peak)
        measures["error"][i, j] = np.abs(off / step).max()
    return measures


def _vertex(values, top):
    """Position (in steps) and height of the parabola through the highest of periodic values and its neighbours."""
    before, middle, after = values[top - 1], values[top], values[(top + 1) % len(values)]
    bend = before - 2 * middle + after
    shift = 0.5 * (before - after) / bend if bend else 0.0
    return top + shift, middle - 0.25 * (before - after) * shift


def by_way(frequency, azimuth, imaging, down, cross):
    """Return `point_response` of each way to form images that the imager compares and that this sweep allows.

    frequency: Hz; azimuth: degrees; imaging: the config's section.
    """
    responses, ways = {}, imager_of(frequency, azimuth, imaging).compared or {imaging["imager"]: {}}
    for way, changes in ways.items():
        with suppress(InputError):  # this sweep's sector holds no rectangle
            responses[way] = point_response(imager_of(frequency, azimuth, imaging | changes), down, cross)
    return responses
