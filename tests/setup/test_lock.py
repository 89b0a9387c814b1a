"""Whose lock is on the working folder: of a run at work, of one that was killed, of another machine's."""

import contextlib
import errno
import os
import socket
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest

from isarflow.core.errors import InputError
from isarflow.setup import lock
from isarflow.setup.config import ROOT


@pytest.fixture
def another(tmp_path, monkeypatch):
    """In a working folder with a lock of Snakemake's: starts a process that is a run, by results and whether remote."""
    monkeypatch.chdir(tmp_path)
    lock.LOCKS.mkdir(parents=True)
    (lock.LOCKS / "0.output.lock").touch()
    take = "import sys; from isarflow.setup.lock import take; take(sys.argv[1], sys.argv[2] == 'True')"
    take += "; print(flush=True); input()"
    with contextlib.ExitStack() as stack:

        def start(results="results/tiny", remote=False):
            streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
            environment = {**os.environ, "PYTHONPATH": str(ROOT)}
            run = subprocess.Popen([sys.executable, "-c", take, results, str(remote)], env=environment, **streams)
            stack.callback(killed, run)
            assert run.stdout.readline()
            return run

        yield start
    lock.leave()


def killed(run):
    run.kill()
    run.communicate()
    return run


def is_locked():
    return (lock.LOCKS / "0.output.lock").exists()


def test_a_lock_is_kept_while_one_of_its_runs_lives(another):
    living = another()
    killed(another("results/other"))
    (line,) = lock.release_stale()
    assert f"process {living.pid} on {socket.gethostname()}, since " in line and is_locked()
    killed(living)
    assert lock.release_stale() == [] and not is_locked()


def test_a_lock_of_nobody_who_noted_himself_is_kept(another):
    assert lock.release_stale() == [] and is_locked()
    lock.take("results/tiny", False)
    lock.leave()
    assert lock.release_stale() == [] and is_locked()


def test_the_lock_of_a_killed_run_is_taken_by_the_next(another):
    killed(another())
    lock.take("results/tiny", False)
    (line,) = lock.release_stale()
    assert f"process {os.getpid()} on" in line and is_locked()


def test_a_run_that_just_begins_has_no_note_yet(another):
    killed(another("results/other"))
    living = another()
    (lock.RUNS / "tiny").write_text("")
    (line,) = lock.release_stale()
    assert "Another run is at work in this folder" in line and is_locked() and living.poll() is None


def test_the_results_of_a_run_at_work_are_nobody_elses(another):
    """Even where its lock is gone: Snakemake takes all locks away when any run in the folder ends."""
    living = another()
    with pytest.raises(InputError, match=rf"process {living.pid} on .* makes results/tiny too"):
        lock.take("results/tiny", False)
    lock.take("results/other", False)
    lock.leave()
    (line,) = lock.release_stale()
    assert f"process {living.pid} on" in line


def test_a_lock_is_kept_while_a_clusters_jobs_may_go_on(another):
    killed(another(remote=True))
    (line,) = lock.release_stale()
    assert "scancel" in line and is_locked()


def test_a_lock_of_another_machine_is_kept(another):
    lock.RUNS.mkdir()
    (lock.RUNS / "tiny").write_text('{"host": "far", "pid": 1, "since": "then", "remote": false}')
    (line,) = lock.release_stale()
    assert "process 1 on far, since then" in line and "--unlock" in line and is_locked()


def test_where_the_file_system_has_no_locks_a_run_lives_with_its_process(another, monkeypatch):
    living = another()
    monkeypatch.setattr("fcntl.flock", Mock(side_effect=OSError(errno.ENOSYS, "no locks")))
    with pytest.raises(InputError, match=f"process {living.pid} on"):
        lock.take("results/tiny", False)
    (line,) = lock.release_stale()
    assert f"process {living.pid} on" in line and is_locked()
    killed(living)
    assert lock.release_stale() == [] and not is_locked()


def test_a_lock_is_kept_while_a_job_of_the_run_that_was_killed_goes_on(another):
    killed(another())
    script = Path(".snakemake/scripts/x.job_mesh.py").absolute()
    script.parent.mkdir()
    script.write_text("print(flush=True); input()")
    streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, script], **streams) as orphan:
        assert orphan.stdout.readline()  # before it runs, its command line may not be there
        (line,) = lock.release_stale()
        assert f"a job of it goes on: process {orphan.pid}." in line and is_locked()
        orphan.kill()
    assert lock.release_stale() == [] and not is_locked()
