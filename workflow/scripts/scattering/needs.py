"""What a target's solves need in memory and time, by its mesh's figures or its CAD file's area, and what fits."""

import os
from math import floor
from pathlib import Path

from core import sweep
from core.errors import InputError
from mesh.measures import ideal_unknowns
from mesh.read import UNITS, states_unit
from mesh.resolution import COARSEST, wanted_edges
from scattering.solver import build

OWN = ("formulation",)  # settings that a target may have of its own
CONTAINER_LIMIT = Path("/sys/fs/cgroup/memory.max")  # there in a container with a limit of its own
# Of a CAD file's area at least this much is taken to remain when its solids are united: faces that are drawn twice, or
# as touching walls of two solids, have twice the area of their surface. Parts deep inside others may hide more.
SURE_SHARE = 0.5


def method(config, target):
    """How a target is solved: the config's scattering settings, with the target's own where it has some."""
    own = config["targets"][target]
    return config["scattering"] | {key: own[key] for key in OWN if key in own}


def memory_megabytes():
    """Memory of this machine, or of the container that this runs in, in MB."""
    physical = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    limit = CONTAINER_LIMIT.read_text().strip() if CONTAINER_LIMIT.exists() else "max"
    return (physical if limit == "max" else min(physical, int(limit))) / 1e6


def need(band, planes, radar, aspect, scattering):
    """A band's solve: memory in `megabytes`, time in `seconds` on two cores, as its solver plans them.

    band: a band's figures in mesh/<target>.json; planes: the number of mirror planes; radar, aspect, scattering: parts
    of the config, with the target's own settings (see `method`).
    """
    return dict(zip(("megabytes", "seconds"), build(scattering).plan(band, planes, radar, aspect), strict=True))


def _closed(unknowns, box, count=1):
    """The figures of a band whose mesh is a closed surface with so many unknowns."""
    return {"frequencies": {"count": count}, "unknowns": unknowns, "triangles": unknowns / 1.5, "box": box}


def unknowns_that_fit(megabytes, most, box, planes, radar, aspect, scattering):
    """The most unknowns of a closed surface, up to `most`, whose solve fits into this memory (0 if none)."""
    low, high = 0, int(most)
    while low < high:
        middle = (low + high + 1) // 2
        if need(_closed(middle, box), planes, radar, aspect, scattering)["megabytes"] <= megabytes:
            low = middle
        else:
            high = middle - 1
    return low


def expected(area, box, planes, mesh, radar, aspect, scattering):
    """What each band's solve of a surface of `area` m^2 will need, lowest band first: unknowns, megabytes, seconds."""
    solves = []
    for band, edge in zip(sweep.bands(radar, mesh["bands"]), wanted_edges(mesh, radar), strict=True):
        unknowns = ideal_unknowns(area, edge)
        figures = _closed(unknowns, box, len(band))
        solves.append({"unknowns": unknowns} | need(figures, planes, radar, aspect, scattering))
    return solves


def check_fit(unknowns, box, target, planes, mesh, radar, aspect, scattering, name, sure=1.0):
    """Refuse a target whose top band, with about this many unknowns, would not fit; say what would.

    `box` are its lengths along x, y and z in metres, `target` its part of the config, `name` its file. Where the
    unknowns may be fewer, `sure` is the share of them that is certain: only if that would not fit is it refused.
    """
    memory, how = memory_megabytes(), (planes, radar, aspect, scattering)
    if need(_closed(sure * unknowns, box), *how)["megabytes"] <= memory:
        return
    needed = need(_closed(unknowns, box), *how)["megabytes"]
    # Unknowns go with the square of the frequency and of the edges in a wavelength.
    ratio = (unknowns_that_fit(memory, unknowns, box, *how) / unknowns) ** 0.5
    top, density = sweep.frequencies(radar)[-1], mesh["edges_per_wavelength"]
    density = floor(10 * 0.99 * ratio * density) / 10
    inexact = " (below 8 the field is inexact)" if density < 8 else ""
    coarser = f", or with 'mesh.edges_per_wavelength: {density:g}'{inexact}"
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
