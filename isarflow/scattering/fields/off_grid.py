"""Calibrate measured pulses and bring them to the sweep's frequencies and azimuths by band-limited interpolation.

Over frequency a target is a sum of echoes exp(-2jkr) from ranges r. Their mean power p(r), the range profile, gives the
covariance of two frequencies, C(f, g) = sum_r p(r) exp(-2j (k_f - k_g) r), and so the best linear estimate at others,
C(wanted, given) C(given, given)^-1 (Wiener). With p of the gate alone in the first factor, it is that of echoes there.
"""

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.scattering.directions import samples_of_ring
from isarflow.scattering.fields.given_store import read_pulses
from isarflow.scattering.fields.interpolation import between
from isarflow.scattering.fields.places import ANGLE, TOLERANCES, all_there, apart, find

EXTENT = 0.8  # of the unambiguous extent: the most that a target may have
OUTSIDE = 1e-3  # of the power of range profiles: what may lie outside of a target's extent
WINDOW = 8  # Kaiser's parameter, of range profiles: side lobes of -58 dB
CELLS = 4  # ranges in a resolution cell, of range profiles
RIDGE = 1e-6  # of the power: noise of samples, and the least of a range profile
ACCURACY = 1e-2  # of the excitation's largest value: size of the orders in azimuth that are left out


def read_measured(path, polarizations, wanted, symmetry=(), pose=None, steps=None, why=""):
    """The wanted samples of a store of pulses or another grid, and a list of warnings; arguments as of `read_store`.

    steps: the target's keys `background`, `calibrate` and `gate`. why: a sentence on what the store lacks.
    Raises InputError, with the figure, for samples too far apart for the target's extent.
    """
    pulses, steps = read_pulses(path, polarizations, pose), steps or {}
    if "background" in steps:
        pulses = subtract(pulses, read_pulses(steps["background"], polarizations))
    if "calibrate" in steps:
        ways = ["VV", "HH"] if any(way[0] != way[1] for way in polarizations) else polarizations
        pulses = calibrate(pulses, *(read_pulses(steps["calibrate"][name], ways) for name in ("measured", "computed")))
    given, frequency = pulses.frequency.values, wanted["frequency"]
    find(path, "elevation", np.unique(pulses.elevation), wanted["elevation"])
    rings = [_ring(pulses, elevation, "xz" in symmetry) for elevation in wanted["elevation"]]
    ranges, power = range_profiles(given, pulses.values)
    near, far = sorted(steps.get("gate", (-np.inf, np.inf)))
    inside, unambiguous, outwards = (near <= ranges) & (ranges <= far), -2 * ranges[0], np.argsort(np.abs(ranges))
    total = np.cumsum((power.sum(axis=0) * inside)[outwards])
    reach = np.abs(ranges[outwards][np.searchsorted(total, (1 - OUTSIDE) * total[-1])])
    share = f"{2 * reach:.3g} m in range, {2 * reach / unambiguous:.2f} of the unambiguous {unambiguous:.3g} m"
    shifts = not all_there("frequency", given, frequency)
    turns = not all(all_there("azimuth", azimuth, wanted["azimuth"]) for azimuth, _ in rings)
    if (apart("frequency", np.clip(frequency, given[0], given[-1]), frequency) > TOLERANCES["frequency"]).any():
        find(path, "frequency", given, frequency)
    if (shifts or turns) and 2 * reach > EXTENT * unambiguous:
        raise InputError(f"{why} To interpolate, the extent must be below {EXTENT} of the unambiguous: it is {share}.")
    weights = np.eye(len(given))[np.abs(given - frequency[:, None]).argmin(axis=1)]
    if shifts or "gate" in steps:
        weights = np.array([estimate(given, frequency, ranges, of_way, inside) for of_way in power])
    orders = [samples_of_ring(2 * np.pi * value / C0 * reach, ACCURACY) - 2 for value in frequency]
    samples = [_around(azimuth, weights @ field, wanted["azimuth"], orders, why) for azimuth, field in rings]
    said = pulses.warnings + [f"{path}: measured, and taken with {name} {value}." for name, value in steps.items()]
    if shifts or turns:
        said.append(f"{path}: interpolated, of an extent of {share}; orders in azimuth up to {max(orders)}.")
    return np.stack(samples, axis=2), said


def subtract(pulses, background):
    """Return pulses less those without the target. InputError if they are not the same pulses, in the same order."""
    for name in TOLERANCES:
        ours, theirs = pulses[name].values, background[name].values
        if ours.shape != theirs.shape or (apart(name, theirs, ours) >= TOLERANCES[name]).any():
            raise InputError(f"{background.path}: its {name} is not that of {pulses.path}, sample by sample.")
    return pulses.copy(data=pulses.values - background.values)


def calibrate(pulses, measured, computed):
    """Return pulses times the factor, of each frequency and polarization, that takes a reference to its computed field.

    Of least squares over the directions that both have. Of HV and VH it is the geometric mean of those of VV and HH, of
    a phase between them that is continuous over frequency. InputError if there are no samples to compare.
    """
    gaps = [apart(name, measured[name].values[:, None], computed[name].values) for name in ("elevation", "azimuth")]
    samples, frequency = [], pulses.frequency.values
    for reference, shared in zip((measured, computed), np.nonzero(np.maximum(*gaps) < ANGLE), strict=True):
        if not len(shared) or not all_there("frequency", reference.frequency.values, frequency):
            both = f"all frequencies of {pulses.path}, and a direction of the other store of its 'calibrate'"
            raise InputError(f"{reference.path}: it has not {both}.")
        samples.append(reference.sel(frequency=frequency, method="nearest").values[..., shared].astype(complex))
    seen, known = samples
    factors = (seen.conj() * known).sum(axis=-1) / (np.abs(seen) ** 2).sum(axis=-1)
    factors = dict(zip(measured.polarization.values, factors, strict=True))
    if {"VV", "HH"} == factors.keys():
        ratio = factors["HH"] / factors["VV"]
        mean = factors["VV"] * np.sqrt(np.abs(ratio)) * np.exp(0.5j * np.unwrap(np.angle(ratio)))
        factors |= {"HV": mean, "VH": mean}
    return pulses.copy(data=pulses.values * np.array([factors[way] for way in pulses.polarization.values])[..., None])


def range_profiles(frequency, field):
    """Ranges (R,) in m over the unambiguous extent about the origin, and the mean power (polarization, R) there.

    frequency: (F,) Hz, ascending; field: (polarization, F, P). The extent is c / (2 df) of the widest step df.
    """
    step = np.diff(frequency).max(initial=0) or frequency[0]
    edges = np.concatenate([frequency[:1] - step / 2, (frequency[1:] + frequency[:-1]) / 2, frequency[-1:] + step / 2])
    count = CELLS * int(np.ceil(np.ptp(edges) / step - 1e-6))
    ranges = (np.arange(count) / count - 0.5) * C0 / 2 / step
    place = 2 * (frequency - edges[[0, -1]].mean()) / np.ptp(edges)
    window = np.diff(edges) * np.i0(WINDOW * np.sqrt(1 - place**2))
    return ranges, (np.abs((_waves(frequency, ranges).conj().T * window) @ field) ** 2).mean(axis=-1)


def estimate(given, wanted, ranges, power, inside):
    """Weights (wanted, given) of the best linear estimate of the echoes at ranges `inside`, by a range profile (R,)."""
    power = np.maximum(power / (power.max() or 1), RIDGE)
    waves, power = _waves(given, ranges), power / power.sum()
    covariance = (waves * power) @ waves.conj().T + RIDGE * np.eye(len(given))
    shared = (_waves(wanted, ranges) * (power * inside)) @ waves.conj().T
    return np.linalg.solve(covariance.T, shared.T).T


def _waves(frequency, ranges):
    """The field (F, R) of unit echoes from ranges."""
    return np.exp(-4j * np.pi / C0 * np.outer(frequency, ranges))


def _ring(pulses, elevation, mirrored):
    """Azimuths (P,) and field (polarization, F, P) at an elevation; mirrored: with images, if but half is given."""
    pulses = pulses[..., apart("elevation", pulses.elevation.values, elevation) < ANGLE]
    azimuth, field = pulses.azimuth.values, pulses.values
    if mirrored and np.sin(np.radians(azimuth)).min() > -np.radians(ANGLE):
        sign = np.array([1 if way[0] == way[1] else -1 for way in pulses.polarization.values])[:, None, None]
        azimuth, field = np.append(azimuth, -azimuth), np.concatenate([field, sign * field], axis=-1)
    return azimuth, field


def _around(azimuth, field, wanted, orders, why):
    """The field (polarization, F, A) at wanted azimuths; if all are there, the mean of the pulses at each."""
    near = apart("azimuth", azimuth, wanted[:, None]) < ANGLE
    if (there := near.any(axis=1)).all():
        return field @ (near / near.sum(axis=1, keepdims=True)).T
    given, most = np.unique(azimuth % 360), 360 / (2 * max(orders) + 1)
    gap = np.diff(given, append=given[0] + 360)[np.searchsorted(given, wanted[~there] % 360, "right") - 1].max()
    if gap > most:
        raise InputError(f"{why} To interpolate, azimuths {most:.3g} degrees apart are needed, not {gap:.4g}.")
    of_frequency = zip(np.moveaxis(field, 1, 0), orders, strict=True)
    return np.stack([between(azimuth, samples, highest, wanted) for samples, highest in of_frequency], axis=1)
