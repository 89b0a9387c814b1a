"""Stores on disk: zarr folders with a list of their files, written last, by which a reader knows that none is missing.

Zarr itself reads a missing chunk as zeros, and a changed one without a warning. Data are compared with the list when
they are read: stores are large, and many jobs read a part of each.
"""

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr

from isarflow.core.errors import InputError

SUMS = "SHA256SUMS"  # as sha256sum writes it: `sha256sum -c SHA256SUMS` in the store's folder checks it, too


def write(dataset: xr.Dataset, path: str | Path, encoding: Mapping[str, Any] | None = None) -> None:
    """Write a dataset as a store, with chunks of nothing but zeros, too, which zarr would leave out."""
    dataset.to_zarr(path, mode="w", encoding=encoding, zarr_format=2, write_empty_chunks=True)
    sums = {name: _digest(Path(path, name)) for name in _files(path)}
    Path(path, SUMS).write_text("".join(f"{digest}  {name}\n" for name, digest in sums.items()))


def open_store(path: str | Path, indexed: bool = True) -> xr.Dataset:
    """Open the dataset of a store, lazily. indexed: read its axes at once, so that it can be selected by their values.

    Raises InputError if any of its files is missing, is none that was written, or, of metadata here and of data when
    they are read, is not as it was written.
    """
    problem = _problem(path, with_data=False)
    if problem:
        raise InputError(_refusal(path, problem))
    return xr.open_zarr(_Files(path), create_default_indexes=indexed)


class _Files(zarr.storage.LocalStore):
    """The files of a store with a list of them, each compared with the list when it is read."""

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, read_only=True)
        self.path, self.sums = path, _listed(path)

    async def get(self, key: str, *how: Any, **named: Any) -> Any:
        """Return the content of a file. InputError if it is not as it was written; None for one that never was."""
        content = await super().get(key, *how, **named)
        digest = hashlib.sha256(b"" if content is None else content.to_bytes()).hexdigest()
        if digest != self.sums.get(key, digest):
            raise InputError(_refusal(self.path, f"the store's file {key} is not what was written"))
        return content


def has_list(path: str | Path) -> bool:
    """Tell whether a store has a list of its files."""
    return Path(path, SUMS).exists()


def check_given(path: str | Path) -> bool:
    """Tell whether a store that came from elsewhere has a list of its files. InputError if they differ from it."""
    listed = has_list(path)
    problem = _problem(path) if listed else None
    if problem:
        raise InputError(f"{path}: {problem}. Copy it anew; if you changed it on purpose, delete its {SUMS}.")
    return listed


def absent_chunks(path: str | Path, name: str) -> int:
    """Count the chunks of a variable without a file; those within a shard that is there are not looked for."""
    array = _array(path, name)
    return array.nchunks - array.nchunks_initialized


def absent_samples(path: str | Path, name: str, places: Sequence[np.ndarray]) -> np.ndarray:
    """Tell of each sample of a variable, at these places along each of its axes, whether its chunk is absent.

    Zarr reads an absent chunk, also one within a shard, as the fill value: where two fill values are read, it is.
    """
    array = _array(path, name)
    absent = np.ones([len(positions) for positions in places], bool)
    for value in (0, 1):
        metadata: Any = replace(array.metadata, fill_value=array.dtype.type(value))
        refilled = zarr.Array(zarr.AsyncArray(metadata, array.store_path))
        absent &= np.asarray(refilled.oindex[tuple(places)]) == value
    return absent


def chunk_of(path: str | Path, name: str, index: Sequence[int]) -> tuple[str, tuple[slice, ...]]:
    """The file in a store that has, or would have, a variable's sample at this index, and its chunk's range there."""
    array = _array(path, name)
    files = tuple(int(i) // size for i, size in zip(index, array.shards or array.chunks, strict=True))
    starts = [int(i) // size * size for i, size in zip(index, array.chunks, strict=True)]
    spans = (slice(start, start + size) for start, size in zip(starts, array.chunks, strict=True))
    return f"{name}/{array.metadata.encode_chunk_key(files)}", tuple(spans)


def _array(path: str | Path, name: str) -> zarr.Array:
    """A variable of a store as zarr has it. Raises KeyError if there is none."""
    array = zarr.open_group(path, mode="r")[name]
    if not isinstance(array, zarr.Array):
        raise KeyError(name)
    return array


def _refusal(path: str | Path, problem: str) -> str:
    return f"{path}: {problem}. Delete the store and run the same command: it is made again."


def _problem(path: str | Path, with_data: bool = True) -> str | None:
    """Say as text what is wrong with the files of a store; None if nothing is. with_data: compare the data, too."""
    if not Path(path).is_dir():
        return "there is no such store"
    if not Path(path, SUMS).is_file():
        return f"the store is not whole, its {SUMS}, which is written last, is missing"
    sums, present = _listed(path), _files(path)
    for name in sorted(sums.keys() | set(present)):
        if name not in present:
            return f"the store's file {name} is missing"
        if name not in sums:
            return f"the file {name} is none that was written into the store"
        is_read = with_data or os.path.basename(name).startswith(".z")
        if is_read and _digest(os.path.join(path, name)) != sums[name]:
            return f"the store's file {name} is not what was written"
    return None


def _listed(path: str | Path) -> dict[str, str]:
    """The checksum of each file that was written into a store."""
    lines = Path(path, SUMS).read_text().splitlines()
    return {name: digest for digest, name in (line.split("  ", 1) for line in lines if "  " in line)}


def _files(path: str | Path) -> list[str]:
    """The names of a store's files. Other hidden files belong to Snakemake or the desktop."""
    names = []
    for folder, _, files in os.walk(path):  # pathlib takes three times as long, and every job reads many stores
        inside = Path(folder).relative_to(path).as_posix()
        listed = [name for name in files if name != SUMS and (name[0] != "." or name.startswith(".z"))]
        names += listed if inside == "." else [f"{inside}/{name}" for name in listed]
    return sorted(names)


def _digest(path: str | Path) -> str:
    with open(path, "rb", buffering=0) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
