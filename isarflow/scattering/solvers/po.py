"""Physical optics with shadows: see `scattering.optics`."""

from isarflow.scattering.solver import FieldSolver

# Seconds of one core for each direction: of each triangle, and of each and each frequency.
SHADOWS, PHASES = 1e-7, 2e-9


class Solver(FieldSolver):
    """For a quick look, and for targets too large for the method of moments: no edges, no second reflections, no HV."""

    name = "physical optics"
    SETTINGS = {}

    def plan(self, measures, planes, sweep):
        seconds = len(sweep.each[0]) * measures["triangles"] * (SHADOWS + PHASES * len(sweep.frequency))
        return 600 + measures["triangles"] / 2000, seconds / 2

    def solve(self, vertices, triangles, sweep, symmetry, threads, progress):
        from isarflow.scattering.optics.physical import Surface, over_directions

        surface = Surface(vertices, triangles)
        return over_directions(surface.backscatter, ("VV", "HH"), sweep, threads, progress, "po")
