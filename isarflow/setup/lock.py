"""Tell whose Snakemake lock is on the working folder: that of a run at work, or of one that was killed.

Snakemake leaves its lock behind when it is killed, and refuses the next run until somebody says --unlock; when it ends
it removes the locks of every run in the folder. Each run therefore has a file for its results, with a note of which
process it is, and holds a lock of the kernel on it, which ends with the process. Snakemake's locks are removed when
nobody holds such a file and no job of a killed run goes on. Jobs do not hold it: Snakemake starts them without it.
"""

import fcntl
import json
import os
import socket
import time
from pathlib import Path

import psutil

from isarflow.core.errors import InputError

LOCKS, RUNS = Path(".snakemake/locks"), Path(".snakemake/runs")
UNLOCK = f"take its lock away with --unlock and delete {RUNS}"
_held = []  # the open file of this process's run


def take(results, remote):
    """Note that this process is a run that writes into the folder `results`. remote: True if a cluster runs its jobs.

    Raises InputError if another run is at work on the same results: a third one may have taken its lock away.
    """
    RUNS.mkdir(parents=True, exist_ok=True)
    file, note, is_free = _look(RUNS / Path(results).name, "a+")
    if not is_free:
        raise InputError(f"{_at_work(note)} It makes {results} too.")
    file.truncate(0)
    json.dump({"pid": os.getpid(), "host": socket.gethostname(), "since": time.ctime(), "remote": remote}, file)
    file.flush()
    _held.append(file)


def leave():
    """Remove this process's note and release its lock."""
    while _held:
        _held[-1].truncate(0)
        _held.pop().close()


def release_stale():
    """Remove the locks if every run that noted itself here was killed. Else return lines that name the others."""
    locks = list(LOCKS.glob("*"))  # another run may begin from here on
    runs = [_look(path) for path in RUNS.glob("*")]
    killed = [file for file, note, is_free in runs if note and is_free]
    lines = [line for _, note, is_free in runs for line in _doubt(note, is_free, locks)]
    if killed and not lines:
        lines = [
            f"The run that had the lock of this folder was killed, but a job of it goes on: process {job}. Wait until "
            f"it ends or stop it (kill {job}), and run the same command."
            for job in _jobs()
        ]
    if killed and not lines:
        for path in locks:
            path.unlink(missing_ok=True)
        for file in killed:
            file.truncate(0)
    for file, *_ in runs:
        file.close()
    return lines


def _doubt(note, is_free, locks):
    """Yield the reason why a run may be at work, one sentence, or nothing."""
    if not is_free:
        yield _at_work(note)
    elif note and note["host"] != socket.gethostname():  # on some file systems each machine has locks of its own
        yield f"Another run took the lock of this folder: {_who(note)}. If it no longer runs there, {UNLOCK}."
    elif note and note["remote"] and locks:
        killed = f"The run that had the lock of this folder was killed ({_who(note)})"
        yield f"{killed}, but its jobs on the cluster may go on. Cancel them (squeue, scancel), then {UNLOCK}."


def _look(path, mode="r+"):
    """A run's file, its note, and whether no other process holds it; if so, this one does until it closes the file.

    Without a note the run has just begun, was killed while it wrote the note, or removed it.
    """
    file = open(path, mode)  # noqa: SIM115
    file.seek(0)
    text = file.read()
    note = json.loads(text) if text.endswith("}") else None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return file, note, True
    except BlockingIOError:
        return file, note, False
    except OSError:  # a file system without locks
        return file, note, not (note and note["host"] == socket.gethostname() and psutil.pid_exists(note["pid"]))


def _who(note):
    return f"process {note['pid']} on {note['host']}, since {note['since']}" if note else "it has just begun"


def _at_work(note):
    stop = f" or stop it (kill {note['pid']})" if note else ""
    wait = f"Before you start one that makes any of the same files, wait until it ends{stop}."
    return f"Another run is at work in this folder: {_who(note)}. {wait}"


def _jobs():
    """The numbers of the processes that run a job's script in this folder."""
    scripts = str(Path(".snakemake/scripts").absolute())
    running = psutil.process_iter(["cmdline"])
    return [job.pid for job in running if any(part.startswith(scripts) for part in job.info["cmdline"] or ())]
