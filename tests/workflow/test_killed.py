"""A run that is killed outright continues with the same command."""

import os
import signal
import time
from pathlib import Path

CONFIG = """
name: killed
targets: {trihedral: {mesh: resources/cad/trihedral.stl, role: other, symmetry: [xz]}}
mesh: {bands: 1}
radar: {center_frequency: 1.0e9, bandwidth: 0, frequencies: 1}
aspect: {elevation: {start: 0, stop: 0, step: 1}, azimuth: {count: 4}}
"""


def test_same_command_finishes_after_kill(project_of):
    project = project_of("killed")
    project.write("config/killed.yaml", CONFIG)
    arguments = ("--cores", "2", "report", "--configfile", "config/killed.yaml")
    run = project.start(*arguments, start_new_session=True)
    log = project.folder / "results/killed/logs/scattering/trihedral-0.log"
    deadline = time.monotonic() + 120
    while not log.exists():
        assert run.poll() is None, "the run ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.05)
    os.killpg(run.pid, signal.SIGKILL)
    run.communicate()
    assert any(Path(project.folder, ".snakemake/locks").iterdir())

    finished = project.run(*arguments)
    assert finished.returncode == 0, finished.stdout
    assert (project.folder / "results/killed/report/index.html").exists()


def test_second_run_at_once_is_refused(project_of):
    project = project_of("twice")
    project.write("config/killed.yaml", CONFIG)
    arguments = ("--cores", "2", "report", "--configfile", "config/killed.yaml")
    run = project.start(*arguments)
    log = project.folder / "results/killed/logs/mesh/trihedral.log"
    while not log.exists():
        assert run.poll() is None
        time.sleep(0.05)
    second = project.run(*arguments)
    run.communicate()
    assert run.returncode == 0
    assert second.returncode != 0
    assert "lock" in second.stdout.lower()
