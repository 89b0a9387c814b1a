"""What of a target's solves fits this machine: `costs` for its mesh's figures, or for its CAD file's area."""

import os
from bisect import bisect_right
from math import floor
from pathlib import Path

from isarflow.core.errors import InputError
from isarflow.core.sweep import sweeps
from isarflow.mesh.measures import ideal_unknowns
from isarflow.mesh.read.target import cad_of, files_of, is_metal, states_unit
from isarflow.mesh.resolution import COARSEST, wanted_edges
from isarflow.scattering.machine import slowness
from isarflow.scattering.materials import equation, has_normal_current, index, is_solid
from isarflow.scattering.solver import build_solver

OWN = ("formulation",)  # settings that a target may have of its own
CONTAINER_LIMIT = Path("/sys/fs/cgroup/memory.max")  # exists in a container with a limit of its own
# Least share of a CAD file's area assumed to remain when its solids are united: faces that are drawn twice, or as
# touching walls of two solids, have twice the area of their surface. Parts deep inside others may hide more.
SURE_SHARE = 0.5
# The least share of the planned memory that is needed: a plan of 25.4 GB was seen where a solve took 21.3.
SURE_MEMORY = 0.8


def method(config, target):
    """Settings of a target's solve: the config's scattering settings, with the target's own, and its `material`.

    Of `parts` of which one is not metal: their materials, {name: {material: ...} or {}}.
    """
    target_settings = config["targets"][target]
    own = {key: target_settings[key] for key in (*OWN, "material") if key in target_settings}
    parts = target_settings.get("parts", {})
    if not all(map(is_metal, parts.values())):
        own["parts"] = {
            name: {key: part[key] for key in ("material",) if key in part} for name, part in sorted(parts.items())
        }
    settings = config["scattering"] | own
    return settings if has_normal_current(settings | {"normal_current": True}) else of_metal(settings)


def of_metal(scattering):
    """Scattering settings without what is said of dielectric sheets alone."""
    return {key: value for key, value in scattering.items() if key != "normal_current"}


def mesh_of(config, target):
    """Settings of a target's meshes: those of the config, with the refractive `index` of a solid body."""
    material = config["targets"][target].get("material", {})
    return config["mesh"] | ({"index": index(material)} if is_solid(material) else {})


def unknowns_per_function(scattering):
    """Return how many unknowns a target's settings have for each RWG function: electric currents, and magnetic ones.

    The latter are in tds loops round vertices, of which a mesh has about a third as many as edges.
    """
    return {"pmchwt": 2, "ibc": 2, "tds": 4 / 3}.get(equation(scattering), 1)


def precision(config):
    """The precision of the config's solver; solvers other than the default may have none."""
    return config["scattering"].get("precision", "double")


def memory_megabytes():
    """Memory of this machine, or of the container that this runs in, in MB."""
    physical = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    limit = CONTAINER_LIMIT.read_text().strip() if CONTAINER_LIMIT.exists() else "max"
    return (physical if limit == "max" else min(physical, int(limit))) / 1e6


def check_memory(megabytes, unknowns, frequency):
    """Refuse a solve, planned to take so many `megabytes`, that this machine certainly has no memory for.

    frequency: the highest, in Hz.
    """
    memory = memory_megabytes()
    if SURE_MEMORY * megabytes > memory:
        raise InputError(
            f"its solve up to {frequency / 1e9:g} GHz takes about {unknowns:,} unknowns and {megabytes / 1000:.1f} GB; "
            f"this machine has {memory / 1000:.1f} GB. Lower the frequency or the edges in a wavelength "
            "('mesh.edges_per_wavelength'), or name a mirror plane in 'symmetry'."
        )


def need(measures, planes, sweep, scattering):
    """The memory in `megabytes` and the time in `seconds` on two cores that a band's solve takes, by its solver's plan.

    measures: `unknowns`, `triangles` and `box` (m) of its mesh, as in mesh/<target>.json; planes: the number of mirror
    planes; sweep: the band's `core.sweep.Sweep`; scattering: the target's settings (see `method`).
    """
    return dict(zip(("megabytes", "seconds"), build_solver(scattering).plan(measures, planes, sweep), strict=True))


def closed(unknowns, box):
    """The measures of a closed surface with this number of unknowns."""
    return {"unknowns": unknowns, "triangles": unknowns / 1.5, "box": box}


def unknowns_that_fit(megabytes, most, box, planes, sweep, scattering):
    """The most RWG functions of a closed surface, up to `most`, whose solve fits into this memory (0 if none)."""

    def needed(unknowns):
        return need(closed(unknowns, box), planes, sweep, scattering)["megabytes"]

    return bisect_right(range(1, int(most) + 1), megabytes, key=needed)


def expected(config, name, size):
    """`unknowns`, `megabytes` and `seconds` that each band's solve of a target will need here, lowest band first.

    Also its RWG `functions`, for each of which there may be more unknowns (see `unknowns_per_function`). Seconds are
    for this machine: the solver's plan times the result of `machine`.
    size: `area` in m^2 and `box` in m of the target's CAD file.
    """
    planes, scattering = _planes(config, name), method(config, name)
    solves, edges = [], wanted_edges(mesh_of(config, name), config["radar"], size["box"])
    for sweep, edge in zip(_sweeps(config), edges, strict=True):
        functions = ideal_unknowns(size["area"], edge)
        solve = need(closed(functions, size["box"]), planes, sweep, scattering)
        counts = {"unknowns": unknowns_per_function(scattering) * functions, "functions": functions}
        solves.append(counts | solve | {"seconds": slowness() * solve["seconds"]})
    return solves


def check_fit(config, name, size):
    """Refuse a target whose top band would not fit even with SURE_SHARE of the unknowns of `expected`.

    size: `area` in m^2 and `box` in m of the target's CAD file. InputError says what would fit.
    """
    memory, target, box = memory_megabytes(), config["targets"][name], size["box"]
    *_, (sweep, solve) = zip(_sweeps(config), expected(config, name, size), strict=True)
    plan_arguments, functions = (_planes(config, name), sweep, method(config, name)), solve["functions"]
    if need(closed(SURE_SHARE * functions, box), *plan_arguments)["megabytes"] <= memory:
        return
    # Unknowns go with the square of the frequency and of the edges in a wavelength.
    ratio = (unknowns_that_fit(memory, functions, box, *plan_arguments) / functions) ** 0.5
    top = sweep.frequency[-1] / 1e9  # GHz
    density = floor(10 * 0.99 * ratio * config["mesh"]["edges_per_wavelength"]) / 10
    inexact = " (below 8 the field is inexact)" if density < 8 else ""
    is_sure = all(map(states_unit, files_of(target))) or "length" in target
    by_unit = "" if is_sure else f", if its numbers are {target.get('unit', 'm')}; see its 'unit'"
    coarser = f", or with 'mesh.edges_per_wavelength: {density:g}'{inexact}"
    raise InputError(
        f"config key 'targets.{name}': {cad_of(target)} would need about {solve['unknowns']:,.0f} unknowns and "
        f"{solve['megabytes'] / 1000:,.1f} GB at {top:g} GHz, but this machine has {memory / 1000:,.1f} GB. It would "
        f"fit up to {0.99 * ratio * top:.3g} GHz{coarser if density >= COARSEST else ''}; a mirror plane in the "
        f"target's 'symmetry' halves the need. It is {max(box):.4g} m long{by_unit}."
    )


def _planes(config, name):
    return len(config["targets"][name].get("symmetry", []))


def _sweeps(config):
    return sweeps(config["radar"], config["aspect"], config["mesh"]["bands"], config["scattering"])
