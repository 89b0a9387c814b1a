"""The method of moments, with a direct solver: see `scattering.solve`, and `scattering.costs` for its costs."""

from dataclasses import replace

import numpy as np

from isarflow.mesh import topology
from isarflow.scattering import materials
from isarflow.scattering.costs import at_one_frequency, chosen_tolerance, planned
from isarflow.scattering.needs import unknowns_per_function
from isarflow.scattering.solver import FieldSolver


class Solver(FieldSolver):
    name = "method of moments"
    sheets = True
    solids = True
    SETTINGS = {
        "formulation": {
            "enum": ["efie", "cfie"],
            "description": "efie = electric field integral equation; cfie = combined field integral equation, closed "
            "targets only, no interior resonances",
        },
        "precision": {"enum": ["single", "double"], "description": "arithmetic of the solver"},
        "tolerance": {
            "type": "number",
            "minimum": 1e-6,
            "maximum": 1e-3,
            "description": "what compressed matrices may leave out, relative to the diagonal's norm; they are for "
            "large targets, in single precision, not with the cfie",
        },
        "normal_current": {
            "type": "boolean",
            "description": "true or false: whether thin dielectric sheets have the current across them, too, which is "
            "more exact, for a third more unknowns",
        },
    }

    def __init__(self, settings):
        others = "material", "parts", "normal_current"
        super().__init__({key: value for key, value in settings.items() if key not in others})
        self.materials, self.has_normal_current = materials.of_parts(settings), materials.has_normal_current(settings)
        self.unknowns_per_function = unknowns_per_function(settings)
        self.settings["formulation"] = materials.equation(settings)

    def plan(self, measures, planes, sweep):
        measures = self._of_system(measures)
        return planned(measures, planes, sweep, **self._settings(measures, planes, sweep))

    def solve(self, vertices, triangles, sweep, symmetry, threads, progress, part=None):
        from isarflow.core.compiled import keep_compiled
        from isarflow.scattering.checks import checked_mesh
        from isarflow.scattering.mom.device import holds
        from isarflow.scattering.solve import FORMULATIONS, solve

        vertices, triangles = checked_mesh(vertices, triangles)
        box = np.ptp(vertices, axis=0)
        measures = {"unknowns": topology.unknowns(triangles), "triangles": len(triangles), "box": box}
        measures = self._of_system(measures)
        settings = self._settings(measures, len(symmetry), sweep)
        if holds(measures["unknowns"], 2 ** len(symmetry)):
            settings["tolerance"] = None  # a GPU factorizes whole matrices faster than the processor compressed ones
        kind = "whole" if settings["tolerance"] is None else f"compressed to {settings['tolerance']:g}"
        print(f"on {keep_compiled()}, with {kind} matrices")
        _, seconds = at_one_frequency(measures, len(symmetry), sweep, **settings)
        parts = dict(zip(seconds, np.cumsum([0.0, *seconds.values()]), strict=False))  # when each begins

        def say(n, part, done):
            # After the last part, 'done', comes the end.
            share = parts[part] + done * seconds[part] if part in parts else sum(seconds.values())
            progress(n, part, done, share / sum(seconds.values()))

        arguments = sweep.frequency, sweep.elevation, sweep.azimuth, sweep.polarizations, symmetry
        options = settings | {"paired": sweep.paired, "receivers": sweep.receivers, "threads": threads}
        if settings["formulation"] not in FORMULATIONS:  # it follows from what a target is of
            options["formulation"] = "efie"
        options |= self._of_materials(vertices, triangles, sweep.frequency, part)
        solution = solve(vertices, triangles, *arguments, progress=say, **options)
        return replace(solution, used={key: settings[key] for key in ("formulation", "tolerance")})

    def _of_materials(self, vertices, triangles, frequency, part):
        """The arguments of `solve` that say what the triangles are made of; part: (T,), or None of one material."""
        from isarflow.scattering.checks import check_bodies

        kinds = list(self.materials.values())
        if materials.is_solid(kinds[0]):  # which stands alone
            return {"permittivity": materials.permittivity(kinds[0])}
        part = np.zeros(len(triangles), int) if part is None else part
        is_opaque = np.array([materials.is_opaque(kind) for kind in kinds])
        sheets, surfaces, across = (np.zeros((len(frequency), len(kinds)), complex) for _ in range(3))
        for n, kind in enumerate(kinds):
            if is_opaque[n]:
                surfaces[:, n] = materials.surface_impedance(kind, frequency)
            else:
                sheets[:, n] = materials.impedance(kind, frequency)
                across[:, n] = self.has_normal_current * materials.normal_impedance(kind, frequency)
        check_bodies(vertices, triangles, part, self.materials, frequency[0])
        of_kinds = {"impedance": sheets, "surface_impedance": surfaces, "normal_impedance": across}
        return {name: of_kind[:, part] for name, of_kind in of_kinds.items()}

    def _of_system(self, measures):
        return {**measures, "unknowns": round(self.unknowns_per_function * measures["unknowns"])}

    def _settings(self, measures, planes, sweep):
        return self.settings | {"tolerance": chosen_tolerance(measures, planes, sweep, **self.settings)}
