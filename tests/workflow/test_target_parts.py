"""A target of several parts through Snakemake: what its mesh is made of, and what makes it again."""

import numpy as np
import pytest

from isarflow.mesh.io import read_parts, write_ply

CONFIG = """
name: parts
targets:
  '*': null
  box: {parts: {LID, BASE}, role: other}
mesh: {bands: 1}
radar: {center_frequency: 1.0e+9, bandwidth: 0, frequencies: 1, polarizations: [VV]}
aspect: {elevation: [0], azimuth: [0]}
"""
LID, BASE = "lid: {mesh: lid.ply, material: {name: abs, thickness: 0.001}}", "base: {mesh: base.ply}"
CONFIG = CONFIG.replace("LID", LID).replace("BASE", BASE)
# Edits of the config, and the jobs that they make necessary.
EDITS = {
    "another thickness": ("thickness: 0.001", "thickness: 0.002", {}),
    "parts in another order": (f"{LID}, {BASE}", f"{BASE}, {LID}", {}),
    "metal by name": ("{name: abs, thickness: 0.001}", "pec", {"mesh": 1}),
    "another file": ("base.ply", "lid.ply", {"mesh": 1}),
}
MESH, OF = "results/parts/mesh/box.json", ("--configfile", "parts.yaml")


@pytest.fixture(scope="module")
def project(project_of):
    project = project_of("parts")
    for name, side in (("lid", 1), ("base", -1)):
        points = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1 * side, 0], [0, 0.1 * side, 0]])
        write_ply(project.folder / f"{name}.ply", points, np.array([[0, 1, 2], [0, 2, 3]]))
    project.write("parts.yaml", CONFIG)
    finished = project.run("--cores", 1, MESH, *OF)
    assert finished.returncode == 0, finished.stdout
    return project


ONE = (
    CONFIG.replace("parts: {", "mesh: both.obj, parts: {").replace("mesh: lid.ply, ", "").replace("mesh: base.ply", "")
)
OF_ONE = {  # edits of the config where both are groups of one file, and the jobs that they make necessary
    "another thickness": ("thickness: 0.001", "thickness: 0.002", {}),
    "metal by name": ("{name: abs, thickness: 0.001}", "pec", {"mesh": 1}),
    "one of them unnamed": (", base: {}", "", {"mesh": 1}),
}


def test_a_mesh_of_parts_in_one_file_is_made_again_for_another_content_alone(project):
    points = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nv 0.1 -0.1 0\nv 0 -0.1 0\n"
    (project.folder / "both.obj").write_text(f"{points}g lid\nf 1 2 3 4\ng base\nf 1 2 5 6\n")
    path, mesh = project.write("one.yaml", ONE.replace("name: parts", "name: one")), "results/one/mesh/box.json"
    finished = project.run("--cores", 1, mesh, "--configfile", path)
    assert finished.returncode == 0, finished.stdout
    part, names = read_parts(project.folder / "results/one/mesh/box-0.ply")
    assert names == ["base", "lid"] and {*part.tolist()} == {0, 1}
    requests = []
    for number, (old, new, _) in enumerate(OF_ONE.values()):
        edited = ONE.replace("name: parts", "name: one").replace(old, new)
        assert ONE.count(old) == 1
        requests.append([mesh, "--configfile", project.write(f"one_{number}.yaml", edited)])
    assert project.all_planned(*requests) == [jobs for *_, jobs in OF_ONE.values()]
    with (project.folder / "both.obj").open("a") as file:
        file.write("f 1 4 6\n")
    assert project.planned(mesh, "--configfile", path) == {"mesh": 1}


def test_each_triangle_has_its_part(project):
    part, names = read_parts(project.folder / "results/parts/mesh/box-0.ply")
    assert names == ["base", "lid"] and {*part.tolist()} == {0, 1}


def test_a_mesh_is_made_again_for_another_file_and_not_for_another_material(project):
    requests = []
    for number, (old, new, _) in enumerate(EDITS.values()):
        assert CONFIG.count(old) == 1
        requests.append([MESH, "--configfile", project.write(f"edit_{number}.yaml", CONFIG.replace(old, new))])
    assert project.all_planned(*requests) == [jobs for *_, jobs in EDITS.values()]
    part = (project.folder / "lid.ply").read_bytes()
    (project.folder / "lid.ply").write_bytes(part[:-1] + b"\1")
    assert project.planned(MESH, *OF) == {"mesh": 1}
    (project.folder / "lid.ply").write_bytes(part)
