"""What a job writes to its log, and says when it may write nothing."""

import errno
import io
import os
import subprocess
import sys
import time
from functools import partial
from types import SimpleNamespace

import pytest
from tqdm import tqdm

from isarflow.core import job
from isarflow.core.errors import InputError
from isarflow.scattering.band import _show
from isarflow.setup import disk
from isarflow.setup.config import ROOT


class Terminal(io.StringIO):
    def __init__(self, tty):
        super().__init__()
        self.isatty = lambda: tty


@pytest.mark.parametrize(("tty", "quiet"), [(True, False), (True, True), (False, False)])
def test_progress_bar_becomes_lines_in_the_log(tty, quiet, monkeypatch):
    monkeypatch.setattr(job, "SECONDS", 0)
    if quiet:
        monkeypatch.setenv("ISARFLOW_QUIET", "yes")
    terminal, log = Terminal(tty), io.StringIO()
    stream = job._Tee(terminal, log)
    print("begun", file=stream)
    with tqdm(total=4, bar_format="{desc}: {percentage:.0f} %", file=stream, mininterval=0) as bar:
        progress = partial(_show, bar, [1e9, 2e9, 3e9, 4e9])
        progress(1, "factorization", 0.5, 0.6)
        progress(2, "directions", 0.5)  # of a solver that has no other parts
        progress(3, "done", 1.0)
    lines = log.getvalue().strip().splitlines()
    assert lines[0] == "begun"
    assert "2.0000 GHz (2 of 4), factorization 50 %: 40 %" in lines
    assert any(line.startswith("3.0000 GHz (3 of 4), directions 50 %: 62 %") for line in lines)
    assert lines[-1] == "4.0000 GHz (4 of 4), done: 100 %"
    assert not any("\r" in line for line in lines)
    assert ("\r" in terminal.getvalue()) == (tty and not quiet)


def test_log_is_not_flooded(monkeypatch):
    monkeypatch.setattr(job, "SECONDS", 1000)
    log = io.StringIO()
    for _ in tqdm(range(100), file=job._Tee(Terminal(False), log), mininterval=0):
        pass
    assert log.getvalue().count("%") <= 1


def fails(log, error):
    """Run a job that raises this error after a line of output."""
    with pytest.raises(SystemExit) as end, job.job(SimpleNamespace(log=[str(log)], output=["results/x/a.zarr"])):
        print("begun")
        raise error
    assert end.value.code == 1


REFUSALS = {
    "a full disk": (OSError(errno.ENOSPC, "No space left on device"), "results/x/a.zarr: No space left"),
    "a read-only disk": (OSError(errno.EROFS, "Read-only file system", "b.csv"), "b.csv: Read-only"),
    "another's file": (PermissionError(errno.EACCES, "Permission denied", "c.stl"), "c.stl: Permission denied"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_what_the_system_refuses_is_one_line(tmp_path, case):
    error, message = REFUSALS[case]
    wrapped = RuntimeError("a library's own words")
    wrapped.__cause__ = error
    for raised in (error, wrapped):
        fails(tmp_path / "log", raised)
        begun, line = (tmp_path / "log").read_text().splitlines()
        assert begun == "begun" and line.startswith(f"Error: {message}") and "run the same command" in line


def test_other_errors_keep_their_traceback(tmp_path):
    later = KeyError("a mistake of ours, after a refusal that was dealt with")
    later.__context__ = PermissionError(errno.EACCES, "Permission denied", "c.stl")
    for error in (OSError(errno.ENOENT, "No such file or directory", "d"), later):
        fails(tmp_path / "log", error)
        assert "Traceback" in (tmp_path / "log").read_text()


JOB = """
import atexit, os, signal, sys
from types import SimpleNamespace
from isarflow.core.job import job
with job(SimpleNamespace(log=[sys.argv[1]], output=["a.zarr"])):
    print("begun")
    {last}
"""


@pytest.mark.parametrize(
    ("last", "killed"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", True),
        ("os.kill(os.getpid(), signal.SIGTERM)", True),
        ("os.abort()", True),
        ("pass", False),
        ("raise KeyboardInterrupt", False),
        ("atexit.register(os.kill, os.getpid(), signal.SIGINT); raise KeyboardInterrupt", False),
        ("sys.exit(3)", False),
    ],
)
def test_log_says_that_a_job_was_killed(tmp_path, last, killed):
    log = tmp_path / "log"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    code = JOB.format(last=last)
    finished = subprocess.run([sys.executable, "-c", code, log], env=environment, capture_output=True)
    assert (finished.returncode != 0) == (last != "pass")
    assert b"Traceback" not in finished.stderr  # nor where Ctrl-C comes again while libraries say goodbye
    expected = ["begun", job.KILLED] if killed else ["begun"]
    # The one who watches writes a moment after the end; what it must not write it would have a second for.
    end = time.monotonic() + (30 if killed else 1)
    while time.monotonic() < end and (log.read_text().splitlines() != expected or not killed):
        time.sleep(0.05)
    assert log.read_text().splitlines() == expected


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_a_log_without_room_does_not_hide_the_message(capsys):
    fails("/dev/full", InputError("the cause"))
    error = capsys.readouterr().err
    assert "No space left on device" in error and "Traceback" not in error


def test_room_for_the_stores(tmp_path, monkeypatch):
    disk.check_writable(tmp_path, tmp_path / "not/yet")
    assert not (tmp_path / "not").exists()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file cannot be written to: Not a directory"):
        disk.check_writable(tmp_path / "file")
    monkeypatch.setattr(disk.shutil, "disk_usage", lambda folder: SimpleNamespace(free=2_000_000_000))
    (tmp_path / "imaging").mkdir()
    assert disk.shortage(tmp_path, 2_000_000_000) == [] and len(disk.shortage(tmp_path / "not", 3_000_000_000)) == 1
    with open(tmp_path / "imaging/a", "wb") as file:
        file.truncate(1_000_000_000)
    assert disk.shortage(tmp_path, 3_000_000_000) == []
    (line,) = disk.shortage(tmp_path, 4_000_000_000)
    assert line.startswith("Warning: 2 GB are free in ") and line.endswith("may take 3 GB more.")
