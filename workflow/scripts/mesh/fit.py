"""Whether the solve of a mesh fits into this machine's memory, before the mesh is made."""

import os
from pathlib import Path

import numpy as np

from common import radar as sweep
from common.errors import InputError
from mesh.read import UNITS, states_unit
from scattering.plan import planned_megabytes, planned_seconds, unknowns_that_fit

CONTAINER_LIMIT = Path("/sys/fs/cgroup/memory.max")  # there in a container with a limit of its own

COARSEST = 5  # edges in a wavelength, the least that the config allows


def memory_megabytes():
    """Memory of this machine or container in MB."""
    physical = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    limit = CONTAINER_LIMIT.read_text().strip() if CONTAINER_LIMIT.is_file() else "max"
    return (physical if limit == "max" else min(physical, int(limit))) / 1e6


def check_fit(unknowns, box, target, planes, mesh, radar, aspect, scattering, name):
    """Refuse a target whose top band, with about this many unknowns, would not fit; say what would.

    `box` are its lengths along x, y and z in metres, `target` its part of the config, `name` its file.
    """
    memory, radius = memory_megabytes(), _radius(box)
    needed = planned_megabytes(unknowns, unknowns / 1.5, planes, radius, radar, aspect, scattering)
    if needed <= memory:
        return
    # Unknowns go with the square of the frequency and of the edges in a wavelength.
    ratio = (unknowns_that_fit(memory, planes, radius, radar, aspect, scattering) / unknowns) ** 0.5
    top, density = sweep.frequencies(radar)[-1], mesh["edges_per_wavelength"]
    density *= 0.99 * ratio
    coarser = f", or with 'mesh.edges_per_wavelength: {density:.2g}' (below 8 the field is inexact)"
    raise InputError(
        f"{name} would need about {unknowns:,.0f} unknowns and {needed / 1000:,.1f} GB at {top / 1e9:g} GHz, but this "
        f"machine has {memory / 1000:,.1f} GB. It would fit up to {0.99 * ratio * top / 1e9:.3g} GHz"
        f"{coarser if density >= COARSEST else ''}; a mirror plane in the target's 'symmetry' halves the need. "
        f"{_measured(max(box), target, name)}"
    )


def _measured(length, target, name):
    """A target's length, and what it would be in the units that make it smaller, unless its unit is certain."""
    if states_unit(name) or "length" in target:
        return f"It is {length:.4g} m long."
    unit = target.get("unit", "m")
    others = {other: length * metres / UNITS[unit] for other, metres in UNITS.items() if metres < UNITS[unit]}
    read = f"It is {length:.4g} m long, if its numbers are {unit}"
    if not others:
        return f"{read}."
    sizes = " or ".join(f"'unit: {other}' ({metres:.4g} m)" for other, metres in others.items())
    return f"{read}; did you mean {sizes}?"


def plan(band, planes, radar, aspect, scattering):
    """What a band's solve will need: memory in MB, time in seconds on the two cores that scattering.plan describes."""
    count, radius = band["frequencies"]["count"], _radius(band["box"])
    return {
        "megabytes": planned_megabytes(band["unknowns"], band["triangles"], planes, radius, radar, aspect, scattering),
        "seconds": planned_seconds(band["unknowns"], planes, radius, count, radar, aspect, scattering),
    }


def _radius(box):
    return float(np.hypot(box[0], box[1]) / 2)
