"""Solvers of a target's mesh for its field: the class Solver of solvers/<name>.py, named by `scattering.solver`."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.kinds import SOLVERS, load_class
from isarflow.core.sweep import Sweep


@dataclasses.dataclass
class Solution:
    """field: (P, F, E, A) complex, m, or (P, F, D) of a sweep that is paired; seconds: {part: (F,)}

    For a bistatic sweep the field also has the receivers, (..., R).

    For linear systems, residual: (F,), and unknowns: int

    used: settings that differ from those in the config, for the store's attributes
    """

    field: np.ndarray
    residual: np.ndarray | None
    seconds: dict[str, np.ndarray]
    unknowns: int | None
    used: dict[str, Any] = dataclasses.field(default_factory=dict)


class FieldSolver:
    """The interface of every solver: a class `Solver` in a file of its own, solvers/<name>.py, defines both methods.

    Plans are made before anything runs, so a solver's file imports modules that take long to load inside `solve`.

    settings: the config's scattering settings, with the target's own, as the solver states them in SETTINGS, a mapping
    of each to its JSON schema (type, bounds, description; literals, as the file is read for them and not run).
    sheets: whether it solves targets that are thin sheets of a `material`, which is then among the settings (see
    `materials`), and of several parts, if one is not metal: the settings then have `parts`, {name: {material: ...} or
    {}}, and `solve` gets `part` by keyword, (T,), each triangle's number of a part in their order. solids: whether it
    solves bodies of a `material`: solid ones, and opaque ones and coated metal by their surface impedance.
    """

    sheets = False
    solids = False

    def __init__(self, settings: Mapping[str, Any]) -> None:
        self.settings = settings

    def plan(self, measures: Mapping[str, Any], planes: int, sweep: Sweep) -> tuple[float, float]:
        """Megabytes of memory, and seconds on two cores, that a band takes.

        measures: of its mesh, `unknowns` (of an RWG basis), `triangles` and `box`, its lengths along x,
        y and z in m. planes: the number of mirror planes.
        """
        raise NotImplementedError

    def solve(
        self,
        vertices: np.ndarray,
        triangles: np.ndarray,
        sweep: Sweep,
        symmetry: Sequence[str],
        threads: int,
        progress: Callable[..., None],
    ) -> Solution:
        """The Solution of a band. Raises InputError for a mesh that cannot be solved.

        vertices: (V, 3) m; triangles: (T, 3); symmetry: mirror planes as in the config. progress(number of the
        frequency, part, fraction of the part, fraction of the frequency's time) is called during the work; without
        the last argument the fraction of the part is used for it.
        """
        raise NotImplementedError


def build_solver(scattering: Mapping[str, Any]) -> FieldSolver:
    """The Solver of a config's scattering settings.

    Raises InputError where its file imports what is not installed, and where its Solver is no FieldSolver.
    """
    solver_settings = {key: value for key, value in scattering.items() if key not in ("solver", "bistatic")}
    solver: FieldSolver = load_class(SOLVERS, scattering["solver"], FieldSolver)(solver_settings)
    return solver


def check_solution(solution: Any, sweep: Sweep, solver: str) -> None:
    """Raise InputError, with the solver's name, for a result that is no Solution of the sweep, as a user's own may be.

    The field's shape, complex numbers, all finite, and the residual's and seconds' shapes.
    """
    key, count = f"config key 'scattering.solver': '{solver}' gives", len(sweep.frequency)
    if not isinstance(solution, Solution):
        raise InputError(f"{key} a {type(solution).__name__}, where a Solution is asked for.")
    axes = {"polarization": len(sweep.polarizations), "frequency": count}
    axes |= dict(zip(("direction",) if sweep.paired else ("elevation", "azimuth"), sweep.shape, strict=True))
    axes |= {"receiver": len(sweep.receivers[0])} if sweep.receivers else {}
    field = np.asarray(solution.field)
    if field.shape != tuple(axes.values()):
        wanted = f"{tuple(axes.values())} is asked for ({', '.join(axes)})"
        raise InputError(f"{key} a field of shape {field.shape}, where {wanted}.")
    if field.dtype.kind != "c":
        raise InputError(f"{key} a field of {field.dtype}, where complex numbers are asked for.")
    finite = np.isfinite(field)
    if not finite.all():
        first = dict(zip(axes, np.argwhere(~finite)[0].tolist(), strict=True))
        where = ", ".join(f"{axis} {number}" for axis, number in first.items())
        wrong = f"{(~finite).sum()} of {field.size} numbers are not finite (NaN or infinite)"
        raise InputError(f"{key} a field of which {wrong}, the first at {where}, counted from 0.")
    residual = {} if solution.residual is None else {"residual": solution.residual}
    for name, values in {**residual, **solution.seconds}.items():
        if np.shape(values) != (count,):
            raise InputError(f"{key} '{name}' of shape {np.shape(values)}, where {(count,)} is asked for (frequency).")
    if residual and not np.isfinite(np.asarray(solution.residual)).all():
        raise InputError(f"{key} a residual that is not finite; without a linear system it is None.")
