"""Solve one band of frequencies on its mesh."""

import sys
from functools import partial

import numpy as np
from tqdm import tqdm

from isarflow.core.errors import InputError
from isarflow.mesh import topology
from isarflow.mesh.io import read_ply
from isarflow.scattering import needs
from isarflow.scattering.solver import build
from isarflow.scattering.store import versions, write_field

# The least share of the planned memory that is needed: a plan of 25.4 GB was seen where a solve took 21.3.
SURE_SHARE = 0.8


def solve_band(mesh_path, store_path, sweep, scattering, symmetry, threads, target):
    """Solve a Sweep of one band's frequencies on its mesh and write it as a store like the target's.

    scattering: the target's settings; symmetry: its mirror planes, e.g. ['xz'].
    Raises InputError, with the target's name, if the mesh cannot be solved as the config asks.
    """
    vertices, triangles = read_ply(mesh_path)
    _check_memory(vertices, triangles, len(symmetry), sweep, scattering, target)
    frequency = sweep.frequency
    print(
        f"{len(triangles)} triangles, {len(frequency)} frequencies from {frequency[0] / 1e9:g} to "
        f"{frequency[-1] / 1e9:g} GHz, {' x '.join(map(str, sweep.shape))} directions"
        f"{f', {len(sweep.receivers[0])} receivers' if sweep.receivers else ''}"
    )
    form = "{desc}: {percentage:.0f} %, {elapsed} so far, about {remaining} left"
    with tqdm(total=len(frequency), bar_format=form, file=sys.stderr) as bar:
        try:
            progress = partial(_show, bar, frequency)
            solution = build(scattering).solve(vertices, triangles, sweep, symmetry, threads, progress)
        except InputError as error:
            raise InputError(f"config key 'targets.{target}': {error}") from None
    _check_shape(solution.field, sweep, scattering["solver"])
    residual = [None] * len(frequency) if solution.residual is None else solution.residual.tolist()
    for n, f in enumerate(frequency):
        parts = [f"{part} {seconds[n]:.1f} s" for part, seconds in solution.seconds.items()]
        system = [] if residual[n] is None else [f"{solution.unknowns} unknowns", f"residual {residual[n]:.1e}"]
        print(f"{f / 1e9:.4f} GHz: {', '.join(system + parts)}")
    attrs = {**scattering, **solution.used, "unknowns": [solution.unknowns] * len(frequency), "residual": residual}
    attrs["versions"] = versions("jax", "numpy", "scipy")
    where = sweep.polarizations, frequency, sweep.elevation, sweep.azimuth
    write_field(store_path, solution.field.astype(np.complex64), *where, attrs, sweep.receivers)


def _check_memory(vertices, triangles, planes, sweep, scattering, target):
    """Refuse a solve that this machine certainly has no memory for."""
    unknowns = topology.unknowns(triangles)
    measures = {"unknowns": unknowns, "triangles": len(triangles), "box": np.ptp(vertices, axis=0)}
    needed, memory = needs.need(measures, planes, sweep, scattering)["megabytes"], needs.memory_megabytes()
    if SURE_SHARE * needed > memory:
        raise InputError(
            f"config key 'targets.{target}': its solve up to {sweep.frequency[-1] / 1e9:g} GHz takes about "
            f"{unknowns:,} unknowns and {needed / 1000:.1f} GB; this machine has {memory / 1000:.1f} GB. "
            "Lower 'mesh.edges_per_wavelength' or the frequency, or name a mirror plane in the target's 'symmetry'."
        )


def _check_shape(field, sweep, solver):
    """Refuse a field of another shape than the sweep asks for, which a user's own solver may return."""
    axes = {"polarization": len(sweep.polarizations), "frequency": len(sweep.frequency)}
    axes |= dict(zip(("direction",) if sweep.paired else ("elevation", "azimuth"), sweep.shape, strict=True))
    axes |= {"receiver": len(sweep.receivers[0])} if sweep.receivers else {}
    if np.shape(field) != tuple(axes.values()):
        raise InputError(
            f"config key 'scattering.solver': '{solver}' gives a field of shape {np.shape(field)}, where "
            f"{tuple(axes.values())} is asked for ({', '.join(axes)})."
        )


def _show(bar, frequency, n, part, done, so_far=None):
    """Show on a tqdm bar the frequency and the part of it that runs; from n on as `FieldSolver.solve` calls it."""
    bar.n = n + (done if so_far is None else so_far)
    at = f"{frequency[n] / 1e9:.4f} GHz ({n + 1} of {len(frequency)})"
    bar.set_description_str(f"{at}, {part}" if part == "done" else f"{at}, {part} {100 * done:.0f} %")
