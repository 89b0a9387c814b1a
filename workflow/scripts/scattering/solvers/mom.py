"""The method of moments, with a direct solver: see `scattering.solve`, and `scattering.plan` for what it takes."""

from scattering.plan import planned


class Solver:
    name = "method of moments"
    SETTINGS = {
        "formulation": {
            "enum": ["efie", "cfie"],
            "description": "efie = electric field integral equation; cfie = combined field integral equation, closed "
            "targets only, no interior resonances",
        },
        "precision": {"enum": ["single", "double"], "description": "arithmetic of the solver"},
    }

    def __init__(self, settings):
        self.settings = settings

    def plan(self, measures, planes, sweep):
        return planned(measures, planes, sweep, **self.settings)

    def solve(self, vertices, triangles, sweep, symmetry, threads, progress):
        from scattering.device import keep_compiled
        from scattering.solve import solve

        print(f"on {keep_compiled()}")
        asked = sweep.frequency, sweep.elevation, sweep.azimuth, sweep.polarizations
        return solve(vertices, triangles, *asked, symmetry, threads=threads, progress=progress, **self.settings)
