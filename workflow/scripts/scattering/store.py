"""From a band's mesh to its part of the field, and from the bands to a target's store. What a store looks like."""

import importlib.metadata
import os
import platform
import sys
import tempfile
from pathlib import Path

import numpy as np
import xarray as xr
from tqdm import tqdm

from common.errors import InputError
from common.radar import azimuths, bands, elevations
from common.store import open_store, write
from mesh.io import read_ply

CONVENTION = (
    "E_s = field exp(-j k r) / r for a unit incident plane wave, exp(+j omega t), phase referred to the origin; "
    "RCS = 4 pi |field|^2; a scatterer d metres nearer to the radar than the origin has phase exp(+2 j k d)"
)
COORDINATES = {
    "polarization": {"units": "1", "long_name": "receive and transmit polarization (V = elevation, H = azimuth)"},
    "frequency": {"units": "Hz", "long_name": "frequency"},
    "elevation": {"units": "degrees", "long_name": "elevation of the radar above the horizon"},
    "azimuth": {"units": "degrees", "long_name": "azimuth of the radar, from the nose (x) towards y"},
}


def solve_band(mesh_path, store_path, band, band_count, radar, aspect, scattering, symmetry, threads, target):
    """Solve one band of frequencies on its mesh and write it as a store like the target's, of its frequencies only.

    Raises InputError, with the target's name, if the mesh cannot be solved as the config asks.
    """
    import jax  # joining bands does without it, and starts in a third of the time

    from scattering.solve import solve

    _keep_compiled()
    vertices, triangles = read_ply(mesh_path)
    frequency, elevation, azimuth = bands(radar, band_count)[band], elevations(aspect), azimuths(aspect)
    polarizations = radar["polarizations"]
    device = jax.devices()[0]
    print(
        f"{len(triangles)} triangles, {len(frequency)} frequencies from {frequency[0] / 1e9:g} to "
        f"{frequency[-1] / 1e9:g} GHz, {len(elevation)} x {len(azimuth)} directions, on {device.device_kind}"
    )
    form = "{desc}: {percentage:.0f} %, {elapsed} so far, about {remaining} left"
    with tqdm(total=len(frequency), bar_format=form, file=sys.stderr) as bar:
        try:
            solution = solve(
                vertices,
                triangles,
                frequency,
                elevation,
                azimuth,
                polarizations,
                symmetry,
                scattering["precision"],
                threads,
                _Progress(bar, frequency),
                scattering["formulation"],
            )
        except InputError as error:
            raise InputError(f"config key 'targets.{target}': {error}") from None
    for n, f in enumerate(frequency):
        parts = ", ".join(f"{part} {seconds[n]:.1f} s" for part, seconds in solution.seconds.items())
        print(f"{f / 1e9:.4f} GHz: {solution.unknowns} unknowns, {parts}, residual {solution.residual[n]:.1e}")
    attrs = {
        "formulation": scattering["formulation"],
        "precision": scattering["precision"],
        "unknowns": [solution.unknowns] * len(frequency),
        "residual": solution.residual.tolist(),
        "versions": versions("jax", "numpy", "scipy"),
    }
    write_field(store_path, solution.field.astype(np.complex64), polarizations, frequency, elevation, azimuth, attrs)


def write_field(store_path, field, polarizations, frequency, elevation, azimuth, attrs):
    """Write a scattering store. field: complex64 (polarization, frequency, elevation, azimuth) in m; Hz, degrees."""
    dataset = xr.Dataset(
        {
            "field": (
                tuple(COORDINATES),
                field,
                {"units": "m", "long_name": "backscatter amplitude"},
            )
        },
        coords={
            name: (name, values, COORDINATES[name])
            for name, values in zip(COORDINATES, (polarizations, frequency, elevation, azimuth), strict=True)
        },
        attrs={"convention": CONVENTION, **attrs},
    )
    _write(dataset, store_path)


def join_bands(band_paths, store_path):
    """Put the bands of a target together along frequency, with the attributes of all."""
    parts = [open_store(path).load() for path in band_paths]
    dataset = xr.concat(parts, "frequency", combine_attrs="override", data_vars="all")
    for name in ("unknowns", "residual"):
        dataset.attrs[name] = [value for part in parts for value in part.attrs[name]]
    _write(dataset, store_path)


def versions(*packages):
    """The versions of Python and of these packages, for a store's attributes."""
    found = {name: importlib.metadata.version(name) for name in packages}
    return {"python": platform.python_version()} | found


def _keep_compiled():
    """Let the next job load what this one compiles: two or three seconds of a job's start."""
    import jax

    # Compiled for this machine's processor, so kept on this machine, where nobody else may write.
    folder = Path(tempfile.gettempdir()) / f"isarflow-{os.getuid()}-compiled"
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.stat().st_uid == os.getuid():
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)


# Where in a frequency's time a part begins, and how much of it it takes: about.
SHARES = {"assembly": (0.0, 0.3), "factorization": (0.3, 0.6), "directions": (0.9, 0.1), "done": (1.0, 0.0)}


class _Progress:
    """Shows on a tqdm bar which frequency and which part of it runs."""

    def __init__(self, bar, frequency):
        self.bar, self.frequency = bar, frequency

    def __call__(self, n, part, done):
        begin, share = SHARES[part]
        self.bar.n = n + begin + share * done
        at = f"{self.frequency[n] / 1e9:.4f} GHz ({n + 1} of {len(self.frequency)})"
        self.bar.set_description_str(f"{at}, {part}" if part == "done" else f"{at}, {part} {100 * done:.0f} %")


def _write(dataset, path):
    # A strip of all directions at one frequency is what a solve makes and what a plot reads.
    chunks = (dataset.sizes["polarization"], dataset.sizes["frequency"], 1, dataset.sizes["azimuth"])
    write(dataset, path, {"field": {"chunks": chunks}})
