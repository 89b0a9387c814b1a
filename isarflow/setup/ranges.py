"""Check and write out what a config says of frequencies, directions and SNRs, before any work is done."""

import numpy as np

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.core.sweep import images_are_made
from isarflow.learning.experiments import CLEAN
from isarflow.setup.schema import repeated

MOST_ANGLES = 100_000
MOST_SNRS = 201  # in a list
ALL = "all"  # every SNR that the config has
CIRCLES = {"count"}, {"start", "stop", "step"}
PARALLEL = 1e-6  # of a great circle's two directions, the sine of the least angle between them


def with_band(radar):
    """A config's radar with its center_frequency and bandwidth, which a list of frequencies implies."""
    if not isinstance(radar["frequencies"], list):
        return radar
    first, last = sweep.frequencies(radar)[[0, -1]]
    return radar | {"center_frequency": float((first + last) / 2), "bandwidth": float(last - first)}


def write_out_snrs(config):
    """Replace the ranges and `all` of a config that keeps to the schema by lists of SNRs in dB, in place."""
    noise = config["noise"]
    noise["snr_db"] = _listed("noise.snr_db", noise["snr_db"], ())
    every = [CLEAN, *sorted(noise["snr_db"])]
    for name, experiment in config["learning"]["experiments"].items():
        key, train = f"learning.experiments.{name}.train.snr_db", experiment["train"]
        snrs = train["snr_db"]
        if isinstance(snrs, dict) and "step" not in snrs:
            snrs = {way: _listed(f"{key}.{way}", inner, every) for way, inner in snrs.items()}
        elif isinstance(snrs, dict | list) or snrs == ALL:
            snrs = _listed(key, snrs, every)
        experiment["train"] = train | {"snr_db": snrs}
        if "test" in experiment:
            key = f"learning.experiments.{name}.test.snr_db"
            experiment["test"] = {"snr_db": _listed(key, experiment["test"]["snr_db"], ())}


def _listed(key, snrs, every):
    """The list of SNRs that a range, a list with ranges in it, or `all` means."""
    if snrs == ALL:
        return list(every)
    listed = []
    for snr in snrs if isinstance(snrs, list) else [snrs]:
        if isinstance(snr, dict):
            # As people write them: 0.3, where 3 * 0.1 is not; and whole numbers without a point.
            rounded = [round(float(value), 9) for value in _of_range(key, "dB", 100, MOST_SNRS, **snr)]
            listed += [int(value) if value.is_integer() else value for value in rounded]
        else:
            listed.append(snr)
    twice = repeated(listed)
    if twice is not None:
        raise InputError(f"config key '{key}': {twice} stands twice in it.")
    if len(listed) > MOST_SNRS:
        raise InputError(f"config key '{key}' has more than {MOST_SNRS} entries.")
    return listed


def _of_range(key, unit, limit, most, start, stop, step):
    """The values of a range of the config. InputError if they leave the limits, are too many, or miss the stop."""
    if not -limit <= start <= stop <= limit:
        raise InputError(f"config key '{key}': start {start} to stop {stop} must ascend in -{limit} to {limit} {unit}.")
    if (stop - start) / step > most:
        raise InputError(f"config key '{key}.step': steps of {step:g} {unit} make more than {most} values.")
    values = sweep.stepped(start, stop, step)
    if not np.isclose(values[-1], stop):
        raise InputError(f"config key '{key}': steps of {step} from {start} end at {values[-1]:g}, not at stop {stop}.")
    return values


def problems(config):
    """Yield sentences, beginning with the key, that say what is wrong with a config's frequencies and directions."""
    if not isinstance(config["radar"]["frequencies"], list):
        yield from _of_band(**config["radar"])
    aspect = config["aspect"]
    if set(aspect) not in ({"elevation", "azimuth"}, {"directions"}, {"great_circle"}):
        has = ", ".join(sorted(aspect)) or "nothing"
        yield f"'aspect' must have 'elevation' and 'azimuth', or 'directions', or 'great_circle'; it has {has}."
    for name, target in config["targets"].items() if "bistatic" in config["scattering"] else ():
        for key in (key for key in ("field", "reference") if key in target):
            yield f"'targets.{name}.{key}': it is of backscatter, and 'scattering.bistatic' is not; leave one out."
    yield from _of_grid(config) if sweep.is_grid(aspect) else _of_directions(config)


def _of_band(center_frequency, bandwidth, frequencies, **_):
    if frequencies == 1 and bandwidth != 0:
        yield f"'radar.bandwidth': {bandwidth:g} Hz, but 'radar.frequencies' is 1; then it must be 0."
    if frequencies > 1 and bandwidth == 0:
        yield f"'radar.bandwidth': 0 Hz, but 'radar.frequencies' is {frequencies}; 0 Hz is for one frequency."
    if bandwidth >= 2 * center_frequency:
        yield f"'radar.bandwidth': {bandwidth:g} Hz reaches below 0 Hz; take less than twice 'radar.center_frequency'."


def _of_grid(config):
    aspect, aperture = config["aspect"], config["imaging"]["aperture"]
    if isinstance(aspect["elevation"], dict):
        _of_range("aspect.elevation", "degrees", 90, MOST_ANGLES, **aspect["elevation"])
    if isinstance(aspect["azimuth"], dict):
        yield from _of_circle("aspect.azimuth", aspect["azimuth"])
    azimuths = sweep.azimuths(aspect)
    if azimuths[-1] - azimuths[0] >= 360 and isinstance(aspect["azimuth"], dict):
        yield "'aspect.azimuth' covers 360 degrees or more; write {count: ...} for a circle."
    if images_are_made(config) and aperture > len(azimuths):
        more = f"{aperture} samples are more than the sweep's {len(azimuths)} azimuths ('aspect.azimuth')"
        yield f"'imaging.aperture': {more}. Write these as a list for their RCS, without images."


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
            grid = "'aspect.elevation' and 'aspect.azimuth', which may be lists"
            yield f"'targets.{name}.field': a field from elsewhere is taken on a grid; write {grid}, or leave it out."


def _of_circle(key, circle):
    if set(circle) not in CIRCLES:
        has = ", ".join(sorted(circle)) or "nothing"
        yield f"'{key}' must have either 'count', or all of 'start', 'stop' and 'step'; it has {has}."
    if "count" not in circle:
        _of_range(key, "degrees", 360, MOST_ANGLES, **circle)
