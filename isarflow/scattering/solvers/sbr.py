"""Shooting and bouncing rays: see `optics.rays`. Embree, which traces them, is an extra package."""

import importlib.util

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.scattering.solver import FieldSolver

INSTALL = ".venv/bin/pip install --require-hashes -r envs/requirements-rays.lock"
WAYS = "VV", "VH", "HV", "HH"  # of the field that `rays` gives
# Of one core for each ray, with its share of the first hits.
TRACED_SECONDS = 5e-7  # to trace it
PHASE_SECONDS = 1e-8  # of each frequency


class Solver(FieldSolver):
    """For a quick look, with second and third reflections as in corners and ducts; no edges."""

    name = "shooting and bouncing rays"
    SETTINGS = {}

    def plan(self, measures, planes, sweep):
        rays = np.prod(np.sort(measures["box"])[1:]) * (10 * sweep.frequency[-1] / C0) ** 2  # of the largest face
        seconds = len(sweep.each[0]) * rays * (TRACED_SECONDS + PHASE_SECONDS * len(sweep.frequency))
        return 700 + rays * 600 / 1e6, seconds / 2

    def solve(self, vertices, triangles, sweep, symmetry, threads, progress):
        if importlib.util.find_spec("embreex") is None:
            raise InputError(f"the solver 'sbr' traces rays by Embree; install it with '{INSTALL}'.")
        from isarflow.scattering.optics.physical import over_directions
        from isarflow.scattering.optics.rays import Scene

        scene = Scene(vertices, triangles)
        return over_directions(scene.backscatter, WAYS, sweep, threads, progress, "sbr")
