"""A user's own target: a sphere as STL, one frequency, one elevation, against Mie, and the pages of its RCS."""

import mie
import numpy as np
import pandas as pd
import xarray as xr

from isarflow.core.sweep import C0
from isarflow.scattering.fields.rcs import COLUMNS, rcs_dbsm

RADIUS, FREQUENCY = 0.15, 1.0e9
CONFIG = f"""
name: sphere
targets: {{'*': null, sphere: {{mesh: sphere.stl, role: known, unit: mm, scale: 0.5, reference: mie.csv}}}}
radar: {{frequencies: [{FREQUENCY:e}], polarizations: [VV, HH]}}
aspect:
  elevation: [10]
  azimuth: [0, 30, 45, 90]
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
    vertices, triangles = mie.icosphere(RADIUS * 2000, RADIUS * 2000 / 20)
    write_ascii_stl(project.folder / "sphere.stl", vertices, triangles)
    project.write("config/sphere.yaml", CONFIG)
    truth = 10 * np.log10(4 * np.pi * np.abs(mie.backscatter(2 * np.pi * FREQUENCY / C0, RADIUS)) ** 2)
    project.write("mie.csv", f"azimuth_deg,polarization,rcs_dbsm\n0,VV,{truth}\n45,HH,{truth - 1}\n")
    finished = project.run("--cores", 2, "report", "rcs", "check", "--configfile", "config/sphere.yaml")
    assert finished.returncode == 0, finished.stdout
    assert "No images, scattering alone: 'radar.frequencies' is a list" in finished.stdout
    field = xr.open_zarr(project.folder / "results/sphere/scattering/sphere.zarr").field
    ratio = field.values / mie.backscatter(2 * np.pi * FREQUENCY / C0, RADIUS)
    assert ratio.shape == (2, 1, 1, 4)
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.3
    assert np.abs(np.degrees(np.angle(ratio))).max() < 3
    page = (project.folder / "results/sphere/report/index.html").read_text()
    assert "sphere" in page
    samples = pd.read_csv(project.folder / "results/sphere/rcs/sphere.csv")
    assert list(samples.columns) == list(COLUMNS)
    np.testing.assert_allclose(samples["rcs_dbsm"], rcs_dbsm(field.values.ravel()), atol=1e-6)
    np.testing.assert_allclose(samples["phase_deg"], np.degrees(np.angle(field.values.ravel())), atol=1e-4)
    compared = pd.read_csv(project.folder / "results/sphere/rcs/tables/rcs_compared_sphere.csv")
    assert compared.set_index("polarization")["bias_db"].round(1).to_dict() == {"VV": 0.0, "HH": 1.0}
    assert "beside mie.csv" in (project.folder / "results/sphere/rcs/index.html").read_text()
    checked = (project.folder / "results/sphere/check.txt").read_text()
    assert "size 0.3 x 0.3 x 0.3 m" in checked
    assert "up to 1 GHz: about" in checked
    refused = project.run("--dry-run", "results/sphere/imaging/sphere/clean.zarr", "--configfile", "config/sphere.yaml")
    assert refused.returncode != 0
    assert "There are no images: config key 'radar.frequencies' is a list" in refused.stdout
    assert "Traceback" not in refused.stdout
