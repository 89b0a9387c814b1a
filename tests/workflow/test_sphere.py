"""A user's own target: a sphere as STL, one frequency, one elevation, against Mie."""

import mie
import numpy as np
import xarray as xr

from core.sweep import C0

RADIUS, FREQUENCY = 0.15, 1.0e9
CONFIG = f"""
name: sphere
targets: {{'*': null, sphere: {{mesh: sphere.stl, role: known, unit: mm}}}}
radar: {{center_frequency: {FREQUENCY:e}, bandwidth: 0, frequencies: 1, polarizations: [VV, HH]}}
aspect:
  elevation: {{start: 10, stop: 10, step: 1}}
  azimuth: {{start: 0, stop: 90, step: 30}}
"""


def write_ascii_stl(path, vertices, triangles):
    lines = ["solid sphere"]
    for corners in vertices[triangles]:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(f"{x:.6f}" for x in corner) for corner in corners]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid sphere", ""]))


def test_sphere_from_a_users_file_agrees_with_mie(project_of):
    project = project_of("sphere")
    # As CAD programs export it: millimetres, triangles much finer than a wavelength needs.
    vertices, triangles = mie.icosphere(RADIUS * 1000, RADIUS * 1000 / 20)
    write_ascii_stl(project.folder / "sphere.stl", vertices, triangles)
    project.write("config/sphere.yaml", CONFIG)
    finished = project.run("--cores", 2, "report", "--configfile", "config/sphere.yaml")
    assert finished.returncode == 0, finished.stdout
    field = xr.open_zarr(project.folder / "results/sphere/scattering/sphere.zarr").field
    ratio = field.values / mie.backscatter(2 * np.pi * FREQUENCY / C0, RADIUS)
    assert ratio.shape == (2, 1, 1, 4)
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.3
    assert np.abs(np.degrees(np.angle(ratio))).max() < 3
    page = (project.folder / "results/sphere/report/index.html").read_text()
    assert "sphere" in page
