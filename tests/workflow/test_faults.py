"""What may befall a run: kills, two at once, a spoilt store, a full disk, a folder that may not be written."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import time

import numpy as np
import pytest

from isarflow.core.sweep import azimuths, elevations, frequencies
from isarflow.scattering.fields.store import write_field
from isarflow.setup.yaml_file import read_yaml

TINY = ("--configfile", "config/tiny.yaml")
RESULTS = "results/tiny-2.0"
# The smallest run through every stage: one target is meshed and solved, the other's field is given. Names have hyphens
# and dots in them, as people give them.
CONFIG = """
name: tiny-2.0
targets:
  '*': null
  corner-1: {mesh: resources/cad/trihedral.stl, role: known, symmetry: [xz]}
  points: {field: fields/points.zarr, role: known}
mesh: {bands: 1}
radar: {center_frequency: 0.7e+9, bandwidth: 0.2e+9, frequencies: 3, polarizations: [VV]}
aspect: {elevation: {start: 0, stop: 10, step: 10}, azimuth: {count: 16}}
imaging: {aperture: 3}
noise: {snr_db: [20], realizations: 2}
learning:
  experiments:
    '*': null
    e: {train: {elevation: all, snr_db: clean}, models: [lr]}
"""
# Where the times of jobs and predictions stand; all else has the same bytes in every run.
TIMED = (
    "logs",
    "benchmarks",
    "learning/times.json",
    "report/index.html",
    "report/tables/prediction_times",
)


def made(project_of, name):
    project = project_of(name)
    (project.folder / "fields").mkdir()
    config = read_yaml(project.folder / project.write("config/tiny.yaml", CONFIG))
    sweep = frequencies(config["radar"]), elevations(config["aspect"]), azimuths(config["aspect"])
    random = np.random.default_rng(0)
    field = (random.normal(size=(1, *map(len, sweep), 2)) @ [1, 1j]).astype(np.complex64)
    write_field(project.folder / "fields/points.zarr", field, ["VV"], *sweep, {"formulation": "points"})
    return project


def content(project):
    folder = project.folder / RESULTS
    files = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}
    return {
        name: path.read_bytes()
        for name, path in files.items()
        if not name.startswith(TIMED) and path.name != ".snakemake_timestamp"
    }


@pytest.fixture(scope="module")
def unbroken(project_of):
    """A project with a whole run on two cores, and its content."""
    project = made(project_of, "unbroken")
    finished = project.run("--cores", 2, "report", *TINY)
    assert finished.returncode == 0, finished.stdout
    return project, content(project)


def caught(project, log, *arguments):
    """A run that has just begun the job with this log."""
    path = project.folder / RESULTS / "logs" / log
    assert not path.exists()
    run = project.start(*arguments, start_new_session=True)
    deadline = time.monotonic() + 300
    while not path.exists():
        assert run.poll() is None, run.communicate()[0]
        assert time.monotonic() < deadline
        time.sleep(0.005)
    return run


def test_killed_in_every_stage_and_on_one_core_the_results_are_the_same(unbroken, project_of):
    """kill -9 of the run and its job in one stage after the other; each time the same command goes on."""
    project = made(project_of, "killed")
    command = ("--cores", 1, "report", *TINY)
    for stage in (
        "mesh/corner-1",
        "scattering/bands/corner-1-0",
        "imaging/corner-1/noise",
        "learning/predict/e/lr",
        "report",
    ):
        run = caught(project, f"{stage}.log", *command)
        if stage == "mesh/corner-1":
            os.killpg(run.pid, signal.SIGSTOP)  # or it may have gone on when the second one has started
            second = project.run(*command)
        os.killpg(run.pid, signal.SIGKILL)
        run.communicate()
        assert list((project.folder / ".snakemake/locks").iterdir())

    finished = project.run(*command)
    assert finished.returncode == 0, finished.stdout
    found, expected = content(project), unbroken[1]
    assert sorted(found) == sorted(expected)
    assert [name for name in found if found[name] != expected[name]] == []
    kinds = ("scattering/corner-1.zarr", "imaging/points/snr_20dB.zarr", "learning/models/e/lr", "report/figures")
    assert all(any(name.startswith(kind) for name in found) for kind in kinds)

    # What the run that started beside the first one was told.
    assert second.returncode != 0
    who = re.search(
        r"Another run is at work in this folder: process (\d+) on (\S+), since (.+)\. Before", second.stdout
    )
    assert who and int(who[1]) > 0 and who[2] == os.uname().nodename
    assert f"wait until it ends or stop it (kill {who[1]})" in second.stdout
    assert "cannot be locked" in second.stdout and "Traceback" not in second.stdout


def test_a_spoilt_store_stops_the_next_job_and_is_made_again(unbroken):
    project, expected = unbroken
    store = project.folder / RESULTS / "imaging/points/clean.zarr"
    chunk = store / "image/0.0.0.0"
    at, spoilt = chunk.stat(), bytearray(chunk.read_bytes())
    spoilt[100] ^= 1
    chunk.write_bytes(spoilt)
    os.utime(chunk, ns=(at.st_atime_ns, at.st_mtime_ns))
    assert project.planned("report", *TINY) == {}
    command = ("--cores", 2, f"{RESULTS}/learning/scores.csv", "--forcerun", "train", *TINY)
    finished = project.run(*command)
    assert finished.returncode != 0
    message = f"Error: {RESULTS}/imaging/points/clean.zarr: the store's file image/0.0.0.0 is not what was written."
    assert message in finished.stdout and "Traceback" not in finished.stdout
    shutil.rmtree(store)
    finished = project.run(*command)
    assert finished.returncode == 0, finished.stdout
    assert content(project) == expected


@contextlib.contextmanager
def mounted(folder, *options):
    """Something mounted on the folder, for a while; skips the test where that is not permitted."""
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(["mount", *options, folder], capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip(f"mount is not permitted here: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", folder], check=True)


def test_a_full_disk_is_named_and_nothing_half_written_is_taken_for_whole(unbroken):
    project, expected = unbroken
    folder, filler = project.folder / RESULTS, project.folder / RESULTS / "filler"
    store = f"{RESULTS}/imaging/points/clean.zarr"
    command = ("--cores", 1, store, *TINY)
    with mounted(folder, "-t", "tmpfs", "-o", "size=2m", "tmpfs"):
        assert project.run("--cores", 1, f"{RESULTS}/scattering/points.zarr", *TINY).returncode == 0
        with contextlib.suppress(OSError), open(filler, "wb", buffering=0) as file:
            while True:
                file.write(bytes(4096))
        finished = project.run(*command)
        assert finished.returncode != 0 and "rule image" not in finished.stdout
        assert re.search(rf"\S*/{RESULTS} cannot be written to: No space left on device\.", finished.stdout)
        os.truncate(filler, filler.stat().st_size - 10 * 4096)  # the store is of more files than that
        finished = project.run(*command)
        assert finished.returncode != 0
        assert "No space left on device. Make room there and run the same command" in finished.stdout
        assert "Traceback" not in finished.stdout
        assert not (project.folder / store).exists()
        filler.unlink()
        finished = project.run(*command)
        assert finished.returncode == 0, finished.stdout
        found = content(project)
        assert {name: expected[name] for name in found} == found


def test_a_folder_that_may_not_be_written_is_named_before_any_work(unbroken):
    project, _ = unbroken
    folder = project.folder / RESULTS
    command = ("--cores", 1, f"{RESULTS}/learning/scores.csv", "--forcerun", "scores", *TINY)
    with contextlib.ExitStack() as stack:
        if os.geteuid() == 0:  # whom permissions do not stop
            stack.enter_context(mounted(folder, "--bind", folder))
            subprocess.run(["mount", "-o", "remount,bind,ro", folder], check=True)
        else:
            folder.chmod(0o555)
            stack.callback(folder.chmod, 0o755)
        finished = project.run(*command)
        assert finished.returncode != 0 and "rule scores" not in finished.stdout
        assert re.search(rf"\S*/{RESULTS} cannot be written to: (Read-only|Permission)", finished.stdout)
        assert "Traceback" not in finished.stdout
    finished = project.run(*command)
    assert finished.returncode == 0, finished.stdout
