"""Physical optics with shadows: see `optics.physical`."""

from isarflow.scattering.solver import FieldSolver

# Of one core for each direction.
SHADOW_SECONDS = 1e-7  # of each triangle
PHASE_SECONDS = 2e-9  # of each triangle and frequency


class Solver(FieldSolver):
    """For a quick look, and for targets too large for the method of moments: no edges, no second reflections, no HV."""

    name = "physical optics"
    SETTINGS = {}

    def plan(self, measures, planes, sweep):
        seconds = len(sweep.each[0]) * measures["triangles"] * (SHADOW_SECONDS + PHASE_SECONDS * len(sweep.frequency))
        return 600 + measures["triangles"] / 2000, seconds / 2

    def solve(self, vertices, triangles, sweep, symmetry, threads, progress):
        from isarflow.scattering.optics.physical import Surface, over_directions

        surface = Surface(vertices, triangles)
        return over_directions(surface.backscatter, ("VV", "HH"), sweep, threads, progress, "po")
