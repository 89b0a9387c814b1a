"""Meshes whose paths have what shells and Snakemake give a meaning to: spaces, braces, quotes, brackets."""

import os
import shutil

import pytest

NAMES = {"a": "my {file} v2.stl", "b": "{target}.stl", "c": "x %s [a] * é' $q.stl"}
CONFIG = """
name: paths
targets:
  '*': null
%s
mesh: {bands: 1}
radar: {center_frequency: 0.5e+9, bandwidth: 0, frequencies: 1, polarizations: [VV]}
learning: {experiments: {'*': null}}
"""
MESHES = [f"results/paths/mesh/{target}.json" for target in NAMES]


@pytest.fixture(scope="module")
def project(project_of):
    project = project_of("paths")
    (project.folder / "CAD files").mkdir()
    for name in NAMES.values():
        shutil.copy(project.folder / "resources/cad/trihedral.stl", project.folder / "CAD files" / name)
    lines = [f'  {target}: {{mesh: "CAD files/{name}", role: known}}' for target, name in NAMES.items()]
    project.write("config/paths.yaml", CONFIG % "\n".join(lines))
    return project


def test_any_path_is_meshed_once_and_again_when_its_file_changes(project):
    configured = ("--configfile", "config/paths.yaml")
    finished = project.run("--cores", 2, *MESHES, *configured)
    assert finished.returncode == 0, finished.stdout
    for name in NAMES.values():
        assert f"clean and remesh CAD files/{name}" in finished.stdout
    assert all((project.folder / mesh).exists() for mesh in MESHES)
    assert project.planned(*MESHES, *configured) == {}
    for name in NAMES.values():
        shutil.copy(project.folder / "resources/cad/missile.stl", project.folder / "CAD files" / name)
        os.utime(project.folder / "CAD files" / name, (1e9, 1e9))  # as `cp -p`, unzip and tar bring old dates along
    assert project.planned(*MESHES, *configured) == {"mesh": 3}
