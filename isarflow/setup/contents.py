"""Digest the files that a user names, so that what they hold decides what runs again, and their dates do not.

Snakemake compares dates, and a file that replaces another one may be the older one: `cp -p`, unzip and tar keep dates.
A large file is read once: its digest is kept until the file changes, for later runs and for each job, which is a
process of its own.
"""

import contextlib
import functools
import hashlib
import os
import re
import time
from pathlib import Path

from isarflow.core.errors import InputError
from isarflow.scattering.fields import field_files

KEPT = Path(".snakemake/digests")  # a file for each digest: `<state of the file> <SHA-256>`
# ns. A file that is written twice in so short a time may show the same times: some systems count them in steps of 2 s.
SETTLED = 3_000_000_000


@functools.cache  # one answer in all of a run: what Snakemake notes of a job is what the file held before it
def sha256(path):
    """Return the SHA-256 of a file as text; that of a store's names and contents for a zarr store.

    Raises InputError for a file that cannot be read.
    """
    note, began = KEPT / hashlib.sha256(os.fsencode(os.path.abspath(path))).hexdigest(), time.time_ns()
    try:
        state, changed = _state(path)
        if kept := _read(note, state):
            return kept
        digest = field_files.digest(path)
    except OSError as error:
        raise InputError(f"{error.filename or path} cannot be read: {error.strerror}.") from None
    if changed + SETTLED < began:
        _keep(note, f"{state} {digest}\n")
    return digest


def _state(path):
    """Return what changes with a file, or with a store's, as text, and when the last of them changed, in ns.

    Of the times that of the last change of anything (ctime) cannot be set: a copy with the same size and date has
    another one.
    """
    stats = {str(file.relative_to(path)): file.stat() for file in field_files.files(path)}
    rows = [(name, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino) for name, stat in stats.items()]
    changed = max((stat.st_ctime_ns for stat in stats.values()), default=0)
    return hashlib.sha256(repr(rows).encode()).hexdigest(), changed


def _read(note, state):
    """Return the digest that was kept of a file in this state; None if none was, or what was kept is damaged."""
    with contextlib.suppress(OSError, UnicodeDecodeError):
        if said := re.fullmatch(rf"{state} ([0-9a-f]{{64}})\n", note.read_text()):
            return said[1]


def _keep(note, text):
    """Write a note at once, as other runs may read it; where nothing can be written, the file is read again."""
    part = note.with_name(f"{note.name}.{os.getpid()}")
    with contextlib.suppress(OSError):
        note.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text)
        part.replace(note)
