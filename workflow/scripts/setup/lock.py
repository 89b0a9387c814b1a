"""Tell whose Snakemake lock is on the working folder: that of a run at work, or of one that was killed.

Snakemake leaves its lock behind when it is killed, and refuses the next run until somebody says --unlock; when it ends
it removes the locks of every run in the folder. Each run therefore keeps a note of which process it is, by the name of
its results. Snakemake's locks are removed when no process that left a note lives and no job of a killed run goes on.
"""

import json
import os
import socket
import time
from pathlib import Path

import psutil

from isarflow.core.errors import InputError

LOCKS, RUNS = Path(".snakemake/locks"), Path(".snakemake/runs")
SAME = 60  # s between two readings of when a process started: the clock may have been set; another process is later


def take(results, remote):
    """Note that this process is a run that writes into the folder `results`. remote: True if a cluster runs its jobs.

    Raises InputError if another run is at work on the same results: a third one may have taken its lock away.
    """
    path, part = RUNS / Path(results).name, RUNS.with_name(f"run-{os.getpid()}")
    if path in _notes() and _lives(note := _notes()[path]):
        raise InputError(f"{_at_work(note)} It makes {results} too.")
    started = psutil.Process().create_time()
    note = {"pid": os.getpid(), "host": socket.gethostname(), "started": started, "remote": remote}
    RUNS.mkdir(parents=True, exist_ok=True)
    part.write_text(json.dumps(note))
    part.rename(path)


def leave():
    """Remove this process's note."""
    for path, note in _notes().items():
        if (note["host"], note["pid"]) == (socket.gethostname(), os.getpid()):
            path.unlink()


def release_stale():
    """Remove the locks if every run that noted itself here was killed. Else return lines that name the others."""
    locks, notes = list(LOCKS.glob("*")), _notes()  # another run may begin from here on
    lines = []
    for note in notes.values():
        if _lives(note):
            lines.append(_at_work(note))
        # Of another machine nothing is known, and a killed run's jobs on a cluster go on.
        elif note["host"] != socket.gethostname() or (note["remote"] and locks):
            lines.append(
                f"Another run took the lock of this folder: {_who(note)}. Once it is at work no longer, nor any job of "
                f"it on a cluster (squeue, scancel), take its lock away with --unlock and delete {RUNS}."
            )
    for job in _jobs() if notes and not lines else ():
        lines.append(
            f"The run that had the lock of this folder was killed, but a job of it goes on: process {job}. Wait until "
            f"it ends or stop it (kill {job}), and run the same command."
        )
    for path in [*locks, *notes] if notes and not lines else ():
        path.unlink(missing_ok=True)
    return lines


def _notes():
    """The notes by their files, without what earlier versions wrote there."""
    texts = {path: path.read_text() for path in RUNS.glob("*")}
    return {path: json.loads(text) for path, text in texts.items() if '"started"' in text}


def _lives(note):
    """Tell whether the process of a note is at work on this machine; its number may be another's by now."""
    if note["host"] != socket.gethostname() or not psutil.pid_exists(note["pid"]):
        return False
    return abs(psutil.Process(note["pid"]).create_time() - note["started"]) < SAME


def _who(note):
    return f"process {note['pid']} on {note['host']}, since {time.ctime(note['started'])}"


def _at_work(note):
    return (
        f"Another run is at work in this folder: {_who(note)}. Before you start one that makes any of the same files, "
        f"wait until it ends or stop it (kill {note['pid']})."
    )


def _jobs():
    """The numbers of the processes that run a job's script in this folder."""
    scripts = str(Path(".snakemake/scripts").absolute())
    running = psutil.process_iter(["cmdline"])
    return [job.pid for job in running if any(part.startswith(scripts) for part in job.info["cmdline"] or ())]
