"""Families in the workflow: each model is a target of its own, and what changes makes that model alone anew."""

import json

import pytest

FAMILIES = ("--configfile", "config/boxes.yaml")
CONFIG = """
name: boxes
targets:
  '*': null
  crate: {family: {kind: mine/crate.py, count: 2, seed: 1}, role: other}
mesh: {bands: 1, edges_per_wavelength: 5}
scattering: {solver: po}
radar: {center_frequency: 0.3e+9, bandwidth: 0, frequencies: 1, polarizations: [VV]}
aspect: {elevation: {start: 0, stop: 0, step: 1}, azimuth: {start: 0, stop: 20, step: 10}}
imaging: {aperture: 3}
learning: {experiments: {'*': null}}
"""
CRATE = """
from isarflow.mesh.families import Generator
from sides import half


class Family(Generator):
    PARAMETERS = {"side": {"minimum": 0.1, "maximum": 0.2, "unit": "m", "description": "of the crate"}}

    def parts(self, values, pose=0.0):
        return {"crate": half(values["side"] / 2)}
"""
SIDES = "from isarflow.mesh.shapes import box\n\n\ndef half(h):\n    return box((-h, -h, -h), (h, h, h))\n"
STORES = [f"results/boxes/scattering/crate_0{number}.zarr" for number in (1, 2)]


@pytest.fixture(scope="module")
def project(project_of):
    project = project_of("families")
    project.write("config/boxes.yaml", CONFIG)
    project.write("mine/crate.py", CRATE)
    project.write("mine/sides.py", SIDES)
    finished = project.run("--cores", 2, *STORES, *FAMILIES)
    assert finished.returncode == 0, finished.stdout
    assert "  crate (2 models): up to " in finished.stdout
    return project


def test_the_parameters_are_beside_the_mesh(project):
    for number in (1, 2):
        said = json.loads((project.folder / f"results/boxes/mesh/crate_0{number}.json").read_text())
        assert said["family"] == {"kind": "mine/crate.py", "seed": 1, "number": number, "vary": {}}
        side = said["parameters"]["side"]
        assert side["unit"] == "m"
        assert said["source"]["box"] == pytest.approx([side["value"]] * 3, abs=1e-6)


def test_one_more_model_is_one_more_solve(project):
    """The targets of all models are named in each request."""
    every = [*STORES, "results/boxes/scattering/crate_03.zarr"]
    one, all_of = ({"mesh": n, "solve": n, "scattering": n} for n in (1, 2))

    def planned(old, new, file="config/boxes.yaml", stores=STORES):
        project.edit(file, old, new)
        jobs = project.planned(*stores, *FAMILIES)
        project.edit(file, new, old)
        return jobs

    assert project.planned(*STORES, *FAMILIES) == {}
    assert planned("count: 2", "count: 3", stores=every) == one
    assert planned("count: 2", "count: 1", stores=STORES[:1]) == {}
    assert planned("seed: 1", "seed: 2") == all_of
    assert planned("seed: 1", "seed: 1, vary: {side: [0.1, 0.15]}") == all_of
    assert planned("role: other", "role: known, class: thing, kind: crate") == {}
    # The generator's code, and what it imports from beside it; a comment changes nothing.
    assert planned('values["side"] / 2', 'values["side"] / 3', "mine/crate.py") == all_of
    assert planned("box((-h, -h, -h)", "box((-h, -h, 0)", "mine/sides.py") == all_of
    assert planned("class Family", "# A box.\nclass Family", "mine/crate.py") == {}
    # Another family's generator is none of this one's code.
    assert planned("class Family", "ADDED = 1\n\n\nclass Family", "resources/cad/families/bird.py") == {}
