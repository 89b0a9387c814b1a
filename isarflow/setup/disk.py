"""Check, before anything runs, that the results' folder has room for what a run will write."""

import logging
import shutil
import tempfile
from pathlib import Path

from isarflow.core.errors import InputError


def check_writable(*folders):
    """Raise InputError if nothing can be written to one of the folders, or to what it will be made in."""
    for folder in map(_existing, folders):
        try:
            with tempfile.TemporaryFile(dir=folder) as file:
                file.write(b"anything")
        except OSError as error:
            logging.raiseExceptions = False  # Snakemake's own log has no space either; once is enough
            raise InputError(f"{folder} cannot be written to: {error.strerror}. Make room, or allow it.") from None


def shortage(folder, most):
    """A line of text if the folder's disk has less space than stores of `most` bytes may still take, else none."""
    stores = (path for name in ("imaging", "moved") for path in Path(folder, name).rglob("*"))
    taken = sum(path.stat().st_size for path in stores if path.is_file())
    free = shutil.disk_usage(_existing(folder)).free
    if free >= most - taken:
        return []
    more = f"the stores of images may take {(most - taken) / 1e9:.3g} GB more"
    return [f"Warning: {free / 1e9:.3g} GB are free in {folder}, and {more}."]


def _existing(folder):
    """The folder, or the nearest one above it while it does not exist."""
    return next(path for path in (Path(folder).absolute(), *Path(folder).absolute().parents) if path.exists())
