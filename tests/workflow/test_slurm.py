"""profiles/slurm on a real Slurm of one node, started here; skipped where none is installed."""

import json
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pandas as pd
import pytest
import slurm

from isarflow.core.sweep import sweeps
from isarflow.scattering import needs
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

pytestmark = pytest.mark.skipif(bool(slurm.missing()), reason=slurm.missing())
RESULTS = "results/smoke"
SMOKE = ("report", "--configfile", "config/smoke.yaml")
# What is this Slurm's own: it keeps no accounts, and its node may have fewer than the 16 cores of the profile.
OWN = ("--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", 4, "--max-threads", 2)
BROKEN = """
name: broken
targets: {'*': null, mine: {mesh: resources/broken.stl, role: known}}
radar: {center_frequency: 1.0e9, bandwidth: 0, frequencies: 1, polarizations: [VV]}
aspect: {elevation: {start: 0, stop: 0, step: 1}, azimuth: {count: 4}}
"""


def start(project, environment, *arguments):
    """snakemake with profiles/slurm as a running process."""
    command = [sys.executable, "-m", "snakemake", "--profile", "profiles/slurm", *map(str, (*OWN, *arguments))]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(command, cwd=project.folder, env=environment, **streams)


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """The environment in which a Slurm is at hand, and the interpreter that runs the tests."""
    with slurm.one_node(tmp_path_factory.mktemp("slurm")) as environment:
        yield {**environment, "PATH": f"{environment['PATH']}{os.pathsep}{Path(sys.executable).parent}"}


@pytest.fixture(scope="module")
def broken(project_of, environment):
    """A running project whose only target cannot be read; beside the other one, since most of it is waiting."""
    project = project_of("broken")
    project.write("resources/broken.stl", "solid mine\nendsolid mine\n")
    project.write("config/broken.yaml", BROKEN)
    return project, start(project, environment, "report", "--configfile", "config/broken.yaml", "--retries", 0)


@pytest.fixture(scope="module")
def smoke(project_of, environment, broken):
    """The project in which config/smoke.yaml has run, its output, and Slurm's jobs: a list of them for each rule."""
    project = project_of("cluster")
    process = start(project, environment, *SMOKE)
    output, _ = process.communicate(timeout=900)
    assert process.returncode == 0, output
    jobs = {}
    for job in jobs_of(project, environment):
        jobs.setdefault(re.match("rule_([a-z_]+?)(_wildcards|$)", job["Comment"])[1], []).append(job)
    return project, output, jobs


def jobs_of(project, environment):
    return [job for job in slurm.jobs(environment) if job["WorkDir"] == str(project.folder)]


def test_smoke_config_runs_in_jobs_of_slurm(smoke):
    project, output, jobs = smoke
    planned = Counter({rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE)})
    assert planned.pop("total") == planned.total() >= 25
    assert planned.pop("scattering") == 3  # joins the bands, here and not in a job
    assert planned.pop("sphere") == 1
    assert {rule: len(found) for rule, found in jobs.items()} == dict(planned)
    assert {job["JobState"] for found in jobs.values() for job in found} == {"COMPLETED"}
    results = project.folder / RESULTS
    assert (results / "report/index.html").stat().st_size > 100_000
    scores = pd.read_csv(results / "learning/scores.csv")
    assert set(scores.model) == {"lr", "knn"}
    assert set(scores.test_snr_db) == {0, 20}


def test_jobs_ask_for_what_their_rules_say(smoke):
    project, _, jobs = smoke
    config = load_config(read_yaml(project.folder / "config/smoke.yaml"))
    asked = sweeps(config["radar"], config["aspect"], config["mesh"]["bands"])
    for job in jobs["solve"]:
        _, target, band = job["Comment"].rsplit("_", 2)
        figures = json.loads((project.folder / RESULTS / f"mesh/{target}.json").read_text())["bands"][int(band)]
        need = needs.need(figures, 1, asked[int(band)], config["scattering"])
        assert job["MinMemoryNode"] == f"{400 + need['megabytes']}M"
    asked = {rule: {(job["CPUs/Task"], job["TimeLimit"]) for job in found} for rule, found in jobs.items()}
    assert asked["solve"] == {("2", "00:10:00")}
    assert asked["train"] == {("1", "12:00:00")}
    assert asked["timing"] == {("1", "01:00:00")}
    assert asked["report"] == {("2", "01:00:00")}  # of eight threads what the node has
    assert {job["MinMemoryNode"] for job in jobs["mesh"]} == {"4000M"}
    assert {job["MinMemoryNode"] for job in jobs["report"]} == {"4000M"}


def test_second_run_has_nothing_to_do(smoke, environment):
    project, _, _ = smoke
    before = len(jobs_of(project, environment))
    process = start(project, environment, *SMOKE)
    output, _ = process.communicate(timeout=300)
    assert process.returncode == 0, output
    assert "Nothing to be done" in output
    assert len(jobs_of(project, environment)) == before


def test_failed_job_says_why(broken, environment):
    project, process = broken
    output, _ = process.communicate(timeout=300)
    assert process.returncode != 0
    assert "Error: resources/broken.stl holds no triangles; a surface mesh is needed." in output
    assert "Traceback" not in output
    assert [job["JobState"] for job in jobs_of(project, environment)] == ["FAILED"]
