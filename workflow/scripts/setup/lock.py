"""Whose Snakemake's lock on the working folder is: a run that was killed, or one at work.

Snakemake leaves its lock behind when it is killed outright, and refuses the next run until somebody says --unlock; when
it ends it takes away the locks of every run in the folder. Each run therefore notes who it is in a folder of its own.
Locks are taken away if all runs that noted themselves are gone from this machine, and no job of theirs can be left.
"""

import json
import socket
import time
from pathlib import Path

import psutil

from core.errors import InputError

LOCKS = Path(".snakemake") / "locks"
RUNS = Path(".snakemake") / "runs"
CLOCK = 30  # seconds by which the time at which a process started may seem to move: the machine's clock is set


def take(results, remote):
    """Note that this process is a run that writes into the folder `results`. remote: whether a cluster runs its jobs.

    Raises InputError if another run is at work on the same results: a third one may have taken its lock away.
    """
    RUNS.mkdir(parents=True, exist_ok=True)
    for path in RUNS.glob("*.json"):
        other = _read(path)
        if other and other["results"] == str(results) and _alive(other):
            raise InputError(f"{_at_work(other)} It makes {results} too.")
    note = {**_identity(psutil.Process()), "results": str(results), "remote": remote}
    _own(note).write_text(json.dumps(note))


def leave():
    """Take away this process's note."""
    _own(_identity(psutil.Process())).unlink(missing_ok=True)


def release_stale():
    """Remove the locks if every run that noted itself here was killed. Else say who the others are: lines of text."""
    locks = list(LOCKS.iterdir()) if LOCKS.is_dir() else []
    found = {path: _read(path) for path in RUNS.glob("*.json")}
    notes = {path: note for path, note in found.items() if note}
    lines = []
    for note in notes.values():
        if _alive(note):
            lines.append(_at_work(note))
        elif note["host"] != socket.gethostname():
            lines.append(
                f"Another run took the lock of this folder: {_who(note)}. If it no longer runs there, take its lock "
                f"away with --unlock and delete {RUNS}."
            )
        elif note["remote"] and locks:
            lines.append(
                f"The run that had the lock of this folder was killed ({_who(note)}), but its jobs on the cluster may "
                f"go on. Cancel them (squeue, scancel), take its lock away with --unlock and delete {RUNS}."
            )
    if notes and not lines:
        lines = [
            f"The run that had the lock of this folder was killed, but a job of it goes on: process {job}. Wait until "
            f"it ends or stop it (kill {job}), and run the same command."
            for job in _jobs()
        ]
    if notes and not lines:
        # Only what was there before the notes were read: another run may have begun since.
        for path in (*locks, *notes):
            path.unlink(missing_ok=True)
    return lines


def _who(note):
    return f"process {note['pid']} on {note['host']}, since {time.ctime(note['started'])}"


def _at_work(note):
    return (
        f"Another run is at work in this folder: {_who(note)}. Before you start one that makes any of the same files, "
        f"wait until it ends or stop it (kill {note['pid']})."
    )


def _own(note):
    return RUNS / f"{note['host']}-{note['pid']}.json"


def _read(path):
    """A run's note; None if that run just ended, or was killed while it wrote: then --unlock is up to the user."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def _alive(note):
    """Whether the run that wrote the note is a process of this machine."""
    if note["host"] != socket.gethostname():
        return False
    try:
        return abs(psutil.Process(note["pid"]).create_time() - note["started"]) < CLOCK
    except psutil.NoSuchProcess:
        return False


def _jobs():
    """The numbers of the processes that run a job's script in this folder."""
    scripts = str(Path(".snakemake/scripts").absolute())
    running = psutil.process_iter(["cmdline"])
    return [one.pid for one in running if any(part.startswith(scripts) for part in one.info["cmdline"] or ())]


def _identity(process):
    # A process number alone may have been given to another process since.
    return {"host": socket.gethostname(), "pid": process.pid, "started": process.create_time()}
