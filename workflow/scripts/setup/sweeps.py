"""Check what a config says of frequencies and directions, before any work is done."""

import numpy as np

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.core.sweep import images_are_made
from isarflow.setup.snrs import stepped

MOST_ANGLES = 100_000
CIRCLES = {"count"}, {"start", "stop", "step"}
PARALLEL = 1e-6  # of a great circle's two directions, the sine of the least angle between them
OF_STEPS = ("center_frequency", "bandwidth")


def with_band(radar):
    """A config's radar with its center_frequency and bandwidth, which a list of frequencies implies.

    Raises InputError where they are given beside a list, or are missing without one.
    """
    listed = isinstance(radar["frequencies"], list)
    for key in OF_STEPS:
        if listed and key in radar:
            raise InputError(
                f"config key 'radar.{key}' stands beside a list of 'radar.frequencies', which says all; leave it out."
            )
        if not listed and key not in radar:
            raise InputError(f"config key 'radar.{key}' is missing: 'radar.frequencies' is a number. Expected: Hz.")
    if not listed:
        return radar
    first, last = sweep.frequencies(radar)[[0, -1]]
    return radar | {"center_frequency": float((first + last) / 2), "bandwidth": float(last - first)}


def problems(config):
    """Yield sentences, beginning with the key, that say what is wrong with a config's frequencies and directions."""
    if not isinstance(config["radar"]["frequencies"], list):
        yield from _of_band(**config["radar"])
    aspect = config["aspect"]
    yield from _of_form(aspect)
    yield from _of_bistatic(config)
    if not sweep.is_grid(aspect):
        yield from _of_directions(config)
        return
    if isinstance(aspect["elevation"], dict):
        yield from _of_range("aspect.elevation", 90, **aspect["elevation"])
    if isinstance(aspect["azimuth"], dict):
        yield from _of_circle("aspect.azimuth", aspect["azimuth"])
    azimuths, aperture = sweep.azimuths(aspect), config["imaging"]["aperture"]
    if azimuths[-1] - azimuths[0] >= 360 and isinstance(aspect["azimuth"], dict):
        yield "'aspect.azimuth' covers 360 degrees or more; write {count: ...} for a circle."
    if images_are_made(config) and aperture > len(azimuths):
        yield (
            f"'imaging.aperture': {aperture} samples are more than the sweep's {len(azimuths)} azimuths "
            "('aspect.azimuth'). Write these as a list for their radar cross-section alone, without images."
        )


def _of_band(center_frequency, bandwidth, frequencies, **_):
    if frequencies == 1 and bandwidth != 0:
        yield f"'radar.bandwidth': {bandwidth:g} Hz, but 'radar.frequencies' is 1; then it must be 0."
    if frequencies > 1 and bandwidth == 0:
        yield (
            f"'radar.bandwidth': 0 Hz, but 'radar.frequencies' is {frequencies}; it must be more than 0, or "
            "'radar.frequencies' 1."
        )
    if bandwidth >= 2 * center_frequency:
        yield (
            f"'radar.bandwidth': {bandwidth:g} Hz reaches below 0 Hz; it must be less than twice "
            f"'radar.center_frequency' ({center_frequency:g} Hz)."
        )


def _of_form(aspect):
    if set(aspect) not in ({"elevation", "azimuth"}, {"directions"}, {"great_circle"}):
        yield (
            "'aspect' must have both 'elevation' and 'azimuth', or instead 'directions' or 'great_circle'; it has "
            f"{', '.join(sorted(aspect)) or 'nothing'}."
        )


def _of_directions(config):
    aspect = config["aspect"]
    if "great_circle" in aspect:
        circle = aspect["great_circle"]
        yield from _of_circle("aspect.great_circle.angle", circle["angle"])
        start, through = (sweep.unit_vectors(*np.array(circle[key], float))[0] for key in ("from", "through"))
        if np.linalg.norm(np.cross(start, through)) < PARALLEL:
            yield "'aspect.great_circle': 'from' and 'through' lie on one line, so that many circles hold both."
    for name, target in config["targets"].items():
        if "field" in target:
            yield (
                f"'targets.{name}.field': a field from elsewhere is taken on a grid; write 'aspect.elevation' and "
                "'aspect.azimuth', which may be lists, or leave the target out."
            )


def _of_bistatic(config):
    for name, target in config["targets"].items() if "bistatic" in config["scattering"] else ():
        for key in (key for key in ("field", "reference") if key in target):
            yield (
                f"'targets.{name}.{key}': it is of backscatter, and 'scattering.bistatic' has receivers apart from the "
                "radar; leave one of them out."
            )


def _of_circle(key, circle):
    if set(circle) not in CIRCLES:
        yield (
            f"'{key}' must have either 'count', or all of 'start', 'stop' and 'step'; "
            f"it has {', '.join(sorted(circle)) or 'nothing'}."
        )
    if "count" not in circle:
        yield from _of_range(key, 360, **circle)


def _of_range(key, limit, start, stop, step):
    if not -limit <= start <= stop <= limit:
        yield f"'{key}': start {start} to stop {stop} must ascend within -{limit} to {limit} degrees."
    if (stop - start) / step > MOST_ANGLES:
        yield f"'{key}.step': {step:g} degrees make more than {MOST_ANGLES} angles."
    stepped(key, start, stop, step, "degrees")
