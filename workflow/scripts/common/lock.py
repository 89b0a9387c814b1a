"""Snakemake's lock on the working folder, when the run that took it was killed.

Snakemake leaves its lock behind when it is killed outright, and refuses the next run until somebody says --unlock.
Each run therefore notes who it is; a lock whose run is gone from this machine is taken away.
"""

import json
import socket
from pathlib import Path

import psutil

OWNER = Path(".snakemake") / "owner.json"
LOCKS = Path(".snakemake") / "locks"


def take():
    """Note that this process is the run that holds the lock."""
    OWNER.write_text(json.dumps(_identity(psutil.Process())))


def release_stale():
    """Remove locks of a run that was killed. Locks of a living run, or of another machine's, stay."""
    if not (OWNER.exists() and LOCKS.is_dir() and any(LOCKS.iterdir())):
        return
    try:
        owner = json.loads(OWNER.read_text())
    except ValueError:  # killed while it wrote: then --unlock is up to the user
        return
    if owner["host"] != socket.gethostname():
        return
    if psutil.pid_exists(owner["pid"]) and _identity(psutil.Process(owner["pid"])) == owner:
        return
    for lock in LOCKS.iterdir():
        lock.unlink()


def _identity(process):
    # A process number alone may have been given to another process since.
    return {"host": socket.gethostname(), "pid": process.pid, "started": process.create_time()}
