"""Lines in the log on the stage's progress, and the limit of its time."""

import time

from isarflow.core.errors import InputError

EVERY = 8.0  # seconds of one step without a line
MOST = 1800.0  # seconds of processor time for a target

_job = None  # [name, start, processor's start, last line]; silent until a job begins


def begin(name):
    """Start the clock of a target's job."""
    global _job
    _job = [name, time.monotonic(), time.process_time(), time.monotonic()]


def say(text):
    """Print a line with the seconds since the job began."""
    if _job is not None:
        _job[3] = time.monotonic()
        print(f"{_job[3] - _job[1]:5.0f} s  {text}", flush=True)


def going(text):
    """Print a line if the last one is long ago. Raises InputError if the job took too long; `text` says with what."""
    if _job is None:
        return
    if time.process_time() - _job[2] > MOST:
        took = f"its meshes took more than {MOST / 60:.0f} minutes, the last of them to {text}"
        raise InputError(f"{_job[0]}: {took}. Export it with fewer triangles, or without what is very small.")
    if time.monotonic() - _job[3] > EVERY:
        say(f"... {text}")
