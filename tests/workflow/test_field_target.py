"""Targets that are given by their field: no mesh and no solve, and the rest as ever."""

import json
import os

import feko
import numpy as np
import pytest
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.sweep import azimuths, elevations, frequencies
from isarflow.scattering.fields.store import write_field
from isarflow.setup.config import load_config
from isarflow.setup.overview import overview
from isarflow.setup.yaml_file import read_yaml

TINY = ("--configfile", "config/tiny.yaml")
CONFIG = """
name: tiny
targets:
  '*': null
  pair: {field: "fields/{pair} 1.ffe", role: known, reference: "fields/{target}.csv"}
  copy: {field: "fields/{copy}.zarr", role: unknown, background: "fields/{empty}.zarr"}
mesh: {bands: 1}
radar: {center_frequency: 1.0e+9, bandwidth: 0.2e+9, frequencies: 3, polarizations: [VV]}
aspect: {elevation: {start: 0, stop: 10, step: 10}, azimuth: {start: -20, stop: 20, step: 10}}
imaging: {aperture: 3}
noise: {snr_db: [10], realizations: 1}
learning: {experiments: {'*': null}}
"""
# Files of a user, with braces in their names, which Snakemake takes for wildcards in names that it knows of.
PAIR, COPY, REFERENCE = "fields/{pair} 1.ffe", "fields/{copy}.zarr", "fields/{target}.csv"
EMPTY = "fields/{empty}.zarr"  # what is measured without the copy
OLD = (1e9, 1e9)  # s, an old date, as `cp -p`, unzip and tar bring along


@pytest.fixture(scope="module")
def project(project_of):
    project = project_of("fields")
    (project.folder / "fields").mkdir()
    config = read_yaml(project.folder / project.write("config/tiny.yaml", CONFIG))
    sweep = frequencies(config["radar"]), elevations(config["aspect"]), azimuths(config["aspect"])
    project.write(PAIR, feko.sweep(*sweep))
    project.write(REFERENCE, "frequency_hz,elevation_deg,azimuth_deg,rcs_dbsm\n1.0e9,10,0,-1.5\n")
    axes = dict(zip(("frequency", "elevation", "azimuth"), sweep, strict=True))
    field = feko.amplitudes(*sweep)["VV"].astype(np.complex64)[None]
    data = xr.Dataset({"field": (("polarization", *axes), field)}, {"polarization": ["VV"], **axes})
    room = 0.1j * np.ones_like(field)
    data.assign(field=data.field + room).to_zarr(project.folder / COPY, zarr_format=2)
    data.assign(field=0 * data.field + room).to_zarr(project.folder / EMPTY, zarr_format=2)
    assert project.planned("report", *TINY) == {"field": 2, "image": 2, "noise": 1, "report": 1}
    finished = project.run("--cores", 2, "report", "rcs", *TINY)
    assert finished.returncode == 0, finished.stdout
    return project


@pytest.fixture
def kept(project):
    """The project, whose fields and config are put back after the test, as they were and when."""
    folders = [project.folder / name for name in ("fields", "config")]
    files = {path: path.read_bytes() for folder in folders for path in folder.rglob("*") if path.is_file()}
    yield project
    for path, content in files.items():
        if path.read_bytes() != content:
            path.write_bytes(content)


def test_images_of_both_kinds_agree(project):
    results = project.folder / "results/tiny"
    pair, copy = (xr.open_zarr(results / f"imaging/{name}/clean.zarr").load() for name in ("pair", "copy"))
    assert pair.image.shape == (2, 3, 3, 3)
    np.testing.assert_allclose(pair.image, copy.image, atol=1e-5)
    assert not (results / "mesh").exists()


def test_report_says_where_the_fields_came_from(project):
    folder = project.folder / "results/tiny"
    page = (folder / "report/index.html").read_text()
    assert "No mesh: pair, copy, given by the field alone." in page
    for name, path in (("pair", PAIR), ("copy", COPY)):
        origin = json.loads((folder / f"scattering/{name}.zarr/.zattrs").read_text())["origin"]
        assert f"The field of {name} was not solved here; it comes from {path} (SHA-256 {origin[path][:12]}" in page


def test_the_reference_stands_beside_the_rcs(project):
    assert f"beside {REFERENCE}" in (project.folder / "results/tiny/rcs/index.html").read_text()


def test_nothing_reruns_by_itself_or_for_a_new_date(project):
    for path in (project.folder / "fields").rglob("*"):
        os.utime(path)
    assert project.planned("report", "rcs", *TINY) == {}


def test_an_older_file_with_another_content_reruns_its_own_chain(kept):
    path = kept.folder / PAIR
    path.write_text(path.read_text().replace("StandardConfiguration1", "AnotherConfiguration", 1)[:-1])
    os.utime(path, OLD)
    assert kept.planned("report", *TINY) == {"field": 1, "image": 1, "noise": 1, "report": 1}


def test_an_older_chunk_of_a_store_reruns_its_own_chain(kept):
    chunk = max(path for path in (kept.folder / COPY / "field").iterdir() if path.name[0] != ".")
    chunk.write_bytes(chunk.read_bytes()[:-1] + b"\1")
    os.utime(chunk, OLD)
    assert kept.planned("report", *TINY) == {"field": 1, "image": 1, "report": 1}


def test_an_older_background_reruns_its_own_chain(kept):
    (chunk,) = (path for path in (kept.folder / EMPTY / "field").iterdir() if path.name[0] != ".")
    chunk.write_bytes(chunk.read_bytes()[:-1] + b"\1")
    os.utime(chunk, OLD)
    assert kept.planned("report", *TINY) == {"field": 1, "image": 1, "report": 1}


def test_an_older_reference_reruns_what_it_is_compared_in(kept):
    kept.edit(REFERENCE, "-1.5", "-2.5")
    os.utime(kept.folder / REFERENCE, OLD)
    assert kept.planned("report", "rcs", *TINY) == {"rcs": 1}


def test_meshed_target_beside_fields_gets_its_mesh_and_solve(kept):
    kept.edit(
        "config/tiny.yaml", "mesh: {bands", "  drone: {mesh: resources/cad/drone.stl, role: unknown}\nmesh: {bands"
    )
    assert kept.planned("report", *TINY) == {
        "mesh": 1,
        "solve": 1,
        "scattering": 1,
        "sphere": 1,
        "image": 1,
        "report": 1,
    }


def test_a_store_without_a_polarization_that_is_asked_for_is_refused_before_any_work(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    axes = [1e9, 1.1e9], [0.0], [0.0, 10.0, 20.0]
    write_field("one.zarr", np.ones((1, 2, 1, 3), np.complex64), ["VV"], *axes, {})
    target = {"field": "one.zarr", "role": "other"}
    said = r"field.*one\.zarr: no polarization HH, which config key 'radar\.polarizations' asks for; there is VV"

    def config(*polarizations):
        radar = {"polarizations": list(polarizations)}
        return load_config({"targets": {"*": None, "copy": target}, "radar": radar, "learning": {"experiments": {}}})

    assert not [line for line in overview(config("VV"), tmp_path / "results", refuse=True) if "no polarization" in line]
    with pytest.raises(InputError, match=f"'targets.copy.{said}"):
        overview(config("VV", "HH"), tmp_path / "results", refuse=True)
    assert any(
        "Warning: copy: one.zarr: no polar" in line for line in overview(config("VV", "HH"), tmp_path / "results")
    )


# The last: the job that fails leaves its target without a store.
def test_sweep_that_the_file_lacks_is_refused_with_both(kept):
    kept.edit("config/tiny.yaml", "stop: 20, step: 10", "stop: 20, step: 8")
    assert kept.planned("report", *TINY) == {"field": 2, "image": 2, "noise": 1, "report": 1}
    finished = kept.run("--cores", 1, "results/tiny/scattering/pair.zarr", *TINY)
    assert finished.returncode != 0
    assert (
        f"{PAIR}: no azimuth -12, -4, 4, 12 degrees, which config key 'aspect.azimuth' asks for; "
        "there is 0, 10, 20, 340, 350 degrees." in finished.stdout
    )
    assert "Traceback" not in finished.stdout
