"""Whose Snakemake's lock on the working folder is: a run that was killed, or one at work.

Snakemake leaves its lock behind when it is killed outright, and refuses the next run until somebody says --unlock.
Each run therefore notes beside the lock who it is; locks whose runs are all gone from this machine are taken away.
"""

import json
import socket
import time
from pathlib import Path

import psutil

LOCKS = Path(".snakemake") / "locks"
NOTES = "*.json"  # Snakemake does not read these, and removes them with its locks


def take():
    """Note that this process is a run that holds a lock."""
    LOCKS.mkdir(parents=True, exist_ok=True)
    note = _identity(psutil.Process())
    (LOCKS / f"{note['host']}-{note['pid']}.json").write_text(json.dumps(note))


def release_stale():
    """Remove the locks if every run that noted itself here was killed. Else say who the others are: lines of text."""
    others = []
    try:
        notes = [json.loads(path.read_text()) for path in sorted(LOCKS.glob(NOTES))]
    except (OSError, ValueError):  # that run just ended, or was killed while it wrote: then --unlock is up to the user
        return others
    for note in notes:
        who = f"process {note['pid']} on {note['host']}, since {time.ctime(note['started'])}"
        if note["host"] != socket.gethostname():
            others.append(
                f"Another run took the lock of this folder: {who}. If it no longer runs there, take its lock away "
                "with --unlock."
            )
        elif psutil.pid_exists(note["pid"]) and _identity(psutil.Process(note["pid"])) == note:
            others.append(
                f"Another run is at work in this folder: {who}. Before you start one that makes any of the same "
                f"files, wait until it ends or stop it (kill {note['pid']})."
            )
    if notes and not others:
        others = [
            f"The run that had the lock of this folder was killed, but a job of it goes on: process {job}. Wait until "
            f"it ends or stop it (kill {job}), and run the same command."
            for job in _jobs()
        ]
    if notes and not others:
        for path in LOCKS.iterdir():
            path.unlink()
    return others


def _jobs():
    """The numbers of the processes that run a job's script in this folder."""
    scripts = str(Path(".snakemake/scripts").absolute())
    running = psutil.process_iter(["cmdline"])
    return [one.pid for one in running if any(part.startswith(scripts) for part in one.info["cmdline"] or ())]


def _identity(process):
    # A process number alone may have been given to another process since.
    return {"host": socket.gethostname(), "pid": process.pid, "started": process.create_time()}
