"""Physical optics with shadows: see `scattering.optics`."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import C0
from isarflow.scattering.solver import FieldSolver, Solution

CHUNK = 16  # directions of a task
# Seconds of one core for each direction: of each triangle, and of each and each frequency.
SHADOWS, PHASES = 1.5e-7, 2.5e-8


class Solver(FieldSolver):
    """For a quick look, and for targets too large for the method of moments: no edges, no second reflections, no HV."""

    name = "physical optics"
    SETTINGS = {}

    def plan(self, measures, planes, sweep):
        seconds = len(sweep.each[0]) * measures["triangles"] * (SHADOWS + PHASES * len(sweep.frequency))
        return 600 + measures["triangles"] / 2000, seconds / 2

    def solve(self, vertices, triangles, sweep, symmetry, threads, progress):
        from isarflow.scattering.optics import Surface

        if sweep.receivers:
            raise InputError("the solver 'po' is of backscatter alone; leave out 'scattering.bistatic'.")
        begun, surface, wavenumbers = (
            time.perf_counter(),
            Surface(vertices, triangles),
            2 * np.pi * sweep.frequency / C0,
        )
        elevation, azimuth = sweep.each
        parts = [slice(begin, begin + CHUNK) for begin in range(0, len(azimuth), CHUNK)]
        found = []
        with ThreadPoolExecutor(threads) as pool:
            for part in pool.map(lambda of: surface.backscatter(wavenumbers, elevation[of], azimuth[of]), parts):
                found.append(part)
                done = len(found) / len(parts)
                progress(0, "directions", done, done * len(wavenumbers))
        copolar = np.concatenate(found).T
        field = np.stack([copolar * (receive == transmit) for receive, transmit in sweep.polarizations])
        seconds = np.full(len(wavenumbers), (time.perf_counter() - begun) / len(wavenumbers))
        return Solution(field.reshape(*field.shape[:2], *sweep.shape), None, {"directions": seconds}, None)
