"""Solve one band of frequencies on its mesh."""

import sys
from functools import partial

import numpy as np
from tqdm import tqdm

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.io import read_parts, read_ply
from isarflow.scattering import needs
from isarflow.scattering.fields.store import versions, write_field
from isarflow.scattering.solver import build_solver, check_solution


def solve_band(mesh_path, store_path, sweep, scattering, symmetry, threads, target):
    """Solve a Sweep of one band's frequencies on its mesh and write it as a store like the target's.

    scattering: the target's settings; symmetry: its mirror planes, e.g. ['xz'].
    Raises InputError, with the target's name, if the mesh cannot be solved as the config asks.
    """
    vertices, triangles = read_ply(mesh_path)
    of_parts = {}
    if "parts" in scattering:
        of_parts["part"], names = read_parts(mesh_path)  # of those that the config says the mesh may lack the rest
        scattering = scattering | {"parts": {name: scattering["parts"][name] for name in names}}
    frequency, unknowns = sweep.frequency, topology.unknowns(triangles)
    measures = {"unknowns": unknowns, "triangles": len(triangles), "box": np.ptp(vertices, axis=0)}
    print(
        f"{len(triangles)} triangles, {len(frequency)} frequencies from {frequency[0] / 1e9:g} to "
        f"{frequency[-1] / 1e9:g} GHz, {' x '.join(map(str, sweep.shape))} directions"
        f"{f', {len(sweep.receivers[0])} receivers' if sweep.receivers else ''}"
    )
    form = "{desc}: {percentage:.0f} %, {elapsed} so far, about {remaining} left"
    with tqdm(total=len(frequency), bar_format=form, file=sys.stderr) as bar:
        try:
            planned = needs.need(measures, len(symmetry), sweep, scattering)
            needs.check_memory(
                planned["megabytes"], round(needs.unknowns_per_function(scattering) * unknowns), frequency[-1]
            )
            progress = partial(_show, bar, frequency)
            solution = build_solver(scattering).solve(
                vertices, triangles, sweep, symmetry, threads, progress, **of_parts
            )
        except InputError as error:
            raise InputError(f"config key 'targets.{target}': {error}") from None
    check_solution(solution, sweep, scattering["solver"])
    residual = [None] * len(frequency) if solution.residual is None else solution.residual.tolist()
    for n, f in enumerate(frequency):
        parts = [f"{part} {seconds[n]:.1f} s" for part, seconds in solution.seconds.items()]
        system = [] if residual[n] is None else [f"{solution.unknowns} unknowns", f"residual {residual[n]:.1e}"]
        print(f"{f / 1e9:.4f} GHz: {', '.join(system + parts)}")
    attrs = {**scattering, **solution.used, "unknowns": [solution.unknowns] * len(frequency), "residual": residual}
    attrs["versions"] = versions("jax", "numpy", "scipy")
    where = sweep.polarizations, frequency, sweep.elevation, sweep.azimuth
    write_field(store_path, solution.field.astype(np.complex64), *where, attrs, sweep.receivers)


def _show(bar, frequency, n, part, done, share=None):
    """Show on a tqdm bar the frequency and the part of it that runs; from n on as `FieldSolver.solve` calls it."""
    bar.n = n + (done if share is None else share)
    label = f"{frequency[n] / 1e9:.4f} GHz ({n + 1} of {len(frequency)})"
    bar.set_description_str(f"{label}, {part}" if part == "done" else f"{label}, {part} {100 * done:.0f} %")
