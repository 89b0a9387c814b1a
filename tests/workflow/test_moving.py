"""A target that moves through Snakemake: each pose is solved alone, one more is one solve more, and what images see."""

import numpy as np
import pytest
import xarray as xr

from isarflow.mesh import shapes
from isarflow.mesh.io import write_ply

CONFIG = """
name: moving
targets:
  '*': null
  flyer: {poses: [POSES], role: known, symmetry: [xz]}
mesh: {bands: 2}
radar: {center_frequency: 0.9e+9, bandwidth: 0.3e+9, frequencies: 4, polarizations: [VV, HH]}
aspect: {elevation: {start: 0, stop: 0, step: 1}, azimuth: {count: 12}}
imaging: {aperture: 3}
noise: {snr_db: [20], realizations: 1}
motion: {poses: random}
learning: {experiments: {'*': null}}
"""
TWO, THREE = "pose_0.ply, pose_1.ply", "pose_0.ply, pose_1.ply, pose_2.ply"
ALONE = CONFIG.replace("poses: [POSES]", "mesh: pose_1.ply").replace("moving", "alone").replace("random", "still")
STORE, NOISY = "results/moving/scattering/flyer.zarr", "results/moving/imaging/flyer/snr_20dB.zarr"
OF = ("--configfile", "moving.yaml")


def bar(turn):
    """A bar across the plane xz with two plates that turn about it, towards each other."""
    body = shapes.box((-0.1, -0.1, -0.03), (0.1, 0.1, 0.03))
    blades = shapes.pair(
        "blade", shapes.place(shapes.box((0, -0.02, 0.05), (0.14, 0.02, 0.07)), (0, 0, turn), (0, 0.15, 0))
    )
    return shapes.joined([body, *blades.values()])


@pytest.fixture(scope="module")
def project(project_of):
    project = project_of("moving")
    for number in range(3):
        write_ply(project.folder / f"pose_{number}.ply", *bar(60 * number))
    (project.folder / "broken.ply").write_text("ply\n")
    project.write("moving.yaml", CONFIG.replace("POSES", TWO))
    finished = project.run("--cores", 2, NOISY, "results/moving/imaging/flyer/clean.zarr", *OF)
    assert finished.returncode == 0, finished.stdout
    return project


def of(project, path):
    return xr.open_zarr(project.folder / path).load()


def test_a_pose_has_the_field_of_the_same_file_as_a_target_of_its_own(project):
    project.write("alone.yaml", ALONE)
    finished = project.run("--cores", 2, "results/alone/scattering/flyer.zarr", "--configfile", "alone.yaml")
    assert finished.returncode == 0, finished.stdout
    alone, moving = of(project, "results/alone/scattering/flyer.zarr"), of(project, STORE)
    assert moving.field.dims == ("pose", *alone.field.dims) and moving.sizes["pose"] == 2
    assert np.array_equal(moving.field[1], alone.field)
    assert not np.allclose(moving.field[0], moving.field[1], rtol=0.05)
    assert len(moving.attrs["residual"]) == 4 and moving.attrs["unknowns"] >= alone.attrs["unknowns"]


def test_pulses_see_the_poses_and_images_without_noise_the_first(project):
    noisy = of(project, NOISY)
    assert noisy.pose.dims[-1] == "pulse" and {*np.unique(noisy.pose)} == {0, 1}
    project.write("still.yaml", CONFIG.replace("poses: [POSES]", "mesh: pose_0.ply").replace("random", "still"))
    plan = project.planned("results/moving/imaging/flyer/clean.zarr", "--configfile", "still.yaml")
    assert plan == {"scattering": 1, "image": 1}  # the first pose's bands are the target's own
    assert of(project, "results/moving/imaging/flyer/clean.zarr").sizes["azimuth"] == 12


EDITS = {
    "one pose more": ("POSES", THREE, {"mesh": 1, "solve": 2, "scattering": 2, "noise": 1}),
    "at a rate": ("random", "1", {"noise": 1}),
    "standing still": ("random", "still", {"noise": 1}),
    "another file": ("POSES", "pose_0.ply, pose_2.ply", {"mesh": 1, "solve": 2, "scattering": 2, "noise": 1}),
    "another role": ("known", "other", {}),
}


def test_what_an_edit_makes_again(project):
    requests = []
    for number, (old, new, _) in enumerate(EDITS.values()):
        config = CONFIG.replace(old, new).replace("POSES", TWO)
        requests.append([NOISY, "--configfile", project.write(f"edit_{number}.yaml", config)])
    assert project.all_planned(*requests) == [jobs for *_, jobs in EDITS.values()]


def test_a_store_of_poses_is_a_field_that_another_run_takes(project):
    taken = CONFIG.replace("poses: [POSES]", f"field: {STORE}").replace("name: moving", "name: taken")
    project.write("taken.yaml", taken)
    images = "results/taken/imaging/flyer/snr_20dB.zarr"
    finished = project.run("--cores", 2, images, "rcs", "export", "--configfile", "taken.yaml")
    assert finished.returncode == 0, finished.stdout
    assert np.array_equal(of(project, "results/taken/scattering/flyer.zarr").field, of(project, STORE).field)
    assert np.array_equal(of(project, images).image, of(project, NOISY).image)


def test_the_pages_have_every_pose_and_draw_the_first(project):
    finished = project.run("--cores", 2, "rcs", "report", "check", *OF)
    assert finished.returncode == 0, finished.stdout
    page = (project.folder / "results/moving/report/index.html").read_text()
    assert "Targets that move have several poses, each meshed and solved: flyer 2." in page
    assert (project.folder / "results/moving/rcs/flyer_pose_01.csv").exists()
    assert "flyer_pose_01:" in (project.folder / "results/moving/check.txt").read_text()


def test_a_pose_that_does_not_mesh_is_named(project):
    project.write("broken.yaml", CONFIG.replace("POSES", "pose_0.ply, broken.ply").replace("moving", "broken"))
    finished = project.run("--cores", 2, "results/broken/scattering/flyer.zarr", "--configfile", "broken.yaml")
    assert finished.returncode != 0 and "flyer_pose_01" in finished.stdout and "broken.ply" in finished.stdout
