"""Stores on disk: zarr folders with a list of their files, written last, by which a reader knows that none is missing.

Zarr itself reads a missing chunk as zeros, and a changed one without a warning.
"""

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from isarflow.core.errors import InputError

SUMS = "SHA256SUMS"  # as sha256sum writes it: `sha256sum -c SHA256SUMS` in the store's folder checks it, too


def write(dataset: xr.Dataset, path: str | Path, encoding: Mapping[str, Any] | None = None) -> None:
    """Write a dataset as a store."""
    dataset.to_zarr(path, mode="w", encoding=encoding, zarr_format=2)
    sums = {name: _digest(Path(path, name)) for name in _files(path)}
    Path(path, SUMS).write_text("".join(f"{digest}  {name}\n" for name, digest in sums.items()))


def open_store(path: str | Path) -> xr.Dataset:
    """Open the dataset of a store, lazily. Raises InputError if any of its files is not as it was written."""
    problem = _problem(path)
    if problem:
        raise InputError(f"{path}: {problem}. Delete the store and run the same command: it is made again.")
    return xr.open_zarr(path)


def check_given(path: str | Path) -> None:
    """Raise InputError if a store that came from elsewhere has a list of its files and they differ from it."""
    problem = _problem(path) if Path(path, SUMS).exists() else None
    if problem:
        raise InputError(f"{path}: {problem}. Copy it anew; if you changed it on purpose, delete its {SUMS}.")


def _problem(path: str | Path) -> str | None:
    """Say as text what is wrong with the files of a store; None if nothing is."""
    if not Path(path).is_dir():
        return "there is no such store"
    if not Path(path, SUMS).is_file():
        return f"the store is not whole, its {SUMS}, which is written last, is missing"
    sums = dict(line.split("  ", 1)[::-1] for line in Path(path, SUMS).read_text().splitlines() if "  " in line)
    there = _files(path)
    for name in sorted(sums.keys() | set(there)):
        if name not in there:
            return f"the store's file {name} is missing"
        if name not in sums:
            return f"the file {name} is none that was written into the store"
        if _digest(os.path.join(path, name)) != sums[name]:
            return f"the store's file {name} is not what was written"
    return None


def _files(path: str | Path) -> list[str]:
    """The names of a store's files. Other hidden files belong to Snakemake or the desktop."""
    names = []
    for folder, _, files in os.walk(path):  # pathlib takes three times as long, and every job reads many stores
        inside = Path(folder).relative_to(path).as_posix()
        mine = [name for name in files if name != SUMS and (name[0] != "." or name.startswith(".z"))]
        names += mine if inside == "." else [f"{inside}/{name}" for name in mine]
    return sorted(names)


def _digest(path: str | Path) -> str:
    with open(path, "rb", buffering=0) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
