"""The method of moments, with a direct solver: see `scattering.solve`, and `scattering.plan` for what it takes."""

import numpy as np

from scattering.plan import planned_megabytes, planned_seconds


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

    def plan(self, band, planes, radar, aspect):
        unknowns, count = band["unknowns"], band["frequencies"]["count"]
        radius = float(np.hypot(*band["box"][:2]) / 2)
        return (
            planned_megabytes(unknowns, band["triangles"], planes, radius, radar, aspect, self.settings),
            planned_seconds(unknowns, planes, radius, count, radar, aspect, self.settings),
        )

    def solve(self, vertices, triangles, frequencies, elevation, azimuth, polarizations, symmetry, threads, progress):
        from scattering.device import keep_compiled
        from scattering.solve import solve

        print(f"on {keep_compiled()}")
        sweep = frequencies, elevation, azimuth, polarizations
        return solve(vertices, triangles, *sweep, symmetry, threads=threads, progress=progress, **self.settings)
