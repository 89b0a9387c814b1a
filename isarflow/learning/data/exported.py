"""Load exported images as NumPy arrays. A copy of this file works on its own, with NumPy and h5py alone.

`snakemake export` writes the files; docs/exported-images.md describes them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np


@dataclass(frozen=True)
class Images:
    """Images with their labels and origin, arrays of one length n."""

    x: np.ndarray  # complex64 (n, [channel,] range, crossrange), divided by its peak magnitude
    y: np.ndarray  # the target's name
    role: np.ndarray  # the target's: known, unknown or other
    side: np.ndarray  # train, validation, test or guard, which no side uses
    snr: np.ndarray  # dB, infinite without noise
    elevation: np.ndarray  # degrees, of the radar
    azimuth: np.ndarray
    realization: np.ndarray  # number of the noise sample

    def __len__(self) -> int:
        return len(self.y)

    def __getitem__(self, chosen: Any) -> "Images":
        """Some of the images, by booleans (n,), numbers or a slice: `images[images.side == "train"]`."""
        return Images(*(getattr(self, field.name)[chosen] for field in fields(self)))


ROLES = ("known", "unknown", "other")


def load(*paths: str | Path, split: str = "random", roles: str | Sequence[str] = ("known",)) -> Images:
    """The `Images` of one or more exported HDF5 files, one file's after another's.

    split: random, or sector_1, sector_2 ...: which division `side` tells. roles: of the targets that are loaded.
    Raises FileNotFoundError for a file that is not there, ValueError for one that is no exported HDF5 file, for a split
    that it does not have, for an unknown role, and without any file.

    >>> images = load("results/example/learning/export/snr_0dB.h5", roles=["known", "unknown"])
    >>> train = images[(images.side == "train") & (images.role == "known")]
    >>> train.x.shape[0] == len(train.y), sorted({*train.y.tolist()})
    (True, ['dart', 'disc'])
    """
    roles = (roles,) if isinstance(roles, str) else tuple(roles)
    if not paths:
        raise ValueError("which files? isarflow.load('results/<name>/learning/export/snr_0dB.h5')")
    if unknown := [role for role in roles if role not in ROLES]:
        raise ValueError(f"there is no role '{unknown[0]}'; roles are {', '.join(ROLES)}")
    parts = [_load(Path(path), split, roles) for path in paths]
    return Images(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Images)))


def _load(path: Path, split: str, roles: Sequence[str]) -> Images:
    if path.is_dir():
        raise ValueError(f"{path} is a folder; take the HDF5 file beside it, {path.with_suffix('.h5')}")
    if not path.is_file():
        make = f"snakemake --cores 2 {path}, with your --configfile, in whose noise.snr_db its SNR stands"
        raise FileNotFoundError(f"there is no {path}; make it: {make}")
    if not h5py.is_hdf5(path):
        raise ValueError(f"{path} is no HDF5 file")
    with h5py.File(path) as file:
        if "sides" not in file.attrs:
            raise ValueError(f"{path} holds no exported images")
        targets, role_of, sides = (np.array(file.attrs[name], str) for name in ("targets", "roles", "sides"))
        splits = [name.removeprefix("split_") for name in file if name.startswith("split_")]
        if split not in splits:
            raise ValueError(f"{path} has no split '{split}'; it has {', '.join(splits)}")
        label = file["label"][:]
        chosen = np.isin(role_of[label], roles)
        own = (file[name][:][chosen] for name in ("snr", "elevation", "azimuth", "realization"))
        side = sides[file[f"split_{split}"][:][chosen]]
        return Images(file["image"][:][chosen], targets[label[chosen]], role_of[label[chosen]], side, *own)
