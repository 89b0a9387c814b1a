"""What solves a target's mesh for its field: the class Solver of solvers/<name>.py, named by `scattering.solver`.

A Solver is made of the config's other scattering settings, with the target's own. It has two methods:

    plan(measures, planes, sweep)   megabytes of memory and seconds on two cores that a band takes, two numbers.
        measures: what is known of its mesh, `unknowns` (of an RWG basis), `triangles` and `box`, its lengths along x,
        y and z in m; planes: the number of mirror planes; sweep: the band's `core.sweep.Sweep`
    solve(vertices, triangles, sweep, symmetry, threads, progress)   a Solution, or InputError.
        vertices: (V, 3) m; triangles: (T, 3); symmetry: mirror planes as in the config;
        progress(number of the frequency, part, fraction of the part, fraction of the frequency's time) is called as
        the work goes on; without the last the part counts for the whole

Plans are made before anything runs, so that a solver's file imports what takes long to load in `solve`.
"""

import dataclasses

import numpy as np

from isarflow.core.kinds import load_class


@dataclasses.dataclass
class Solution:
    """field: (P, F, E, A) complex, m, or (P, F, D) of a sweep that is paired; seconds: {part: (F,)}

    Of a bistatic sweep the field has the receivers besides, (..., R).

    Of linear systems, residual: (F,), and unknowns: int

    used: settings that differ from what was asked, for the store's attributes
    """

    field: np.ndarray
    residual: np.ndarray | None
    seconds: dict
    unknowns: int | None
    used: dict = dataclasses.field(default_factory=dict)


def build(scattering):
    """The Solver of a config's scattering settings. Raises InputError where its file imports what is not installed."""
    name = scattering["solver"]
    return load_class("scattering/solvers", name, "Solver")(
        {key: value for key, value in scattering.items() if key not in ("solver", "bistatic")}
    )
