"""Paths of a field from another program: the values of `targets.<target>.field`. Light to import."""

import hashlib
import os
from pathlib import Path

from isarflow.core.errors import InputError

STEPS = "background", "calibrate", "gate"  # keys of a target whose field was measured, in their order


def paths(field):
    """All paths that a target's `field` names: one, a list, or either of them for V and H."""
    if isinstance(field, dict):
        return [path for polarization in sorted(field) for path in paths(field[polarization])]
    return [field] if isinstance(field, str) else list(field)


def of_target(target):
    """All paths that a target with a `field` names, those of the steps of its measurement too."""
    background = [target["background"]] if "background" in target else []
    return [*paths(target["field"]), *background, *target.get("calibrate", {}).values()]


def is_store(field):
    """True for a zarr store, False for FEKO's files."""
    return isinstance(field, str | os.PathLike) and Path(field).suffix.lower() == ".zarr"


def by_transmission(field, polarizations):
    """{transmitted polarization: paths of its .ffe files} for all that `polarizations` (VV, HV, ...) need.

    A .ffe file does not say how its incident wave is polarized, so for two polarizations the config names the files.
    """
    needed = sorted({polarization[1] for polarization in polarizations})
    given = field if isinstance(field, dict) else dict.fromkeys(needed[:1], field)
    missing = [polarization for polarization in needed if polarization not in given]
    if missing:
        example = ", ".join(f"{polarization}: {polarization.lower()}.ffe" for polarization in needed)
        raise InputError(
            f"'radar.polarizations' {', '.join(polarizations)} need incident waves in {' and '.join(needed)}, and no "
            f"file is named for {' and '.join(missing)}. A .ffe file does not say how its wave is polarized: write "
            f"{{{example}}}."
        )
    files = {polarization: paths(given[polarization]) for polarization in needed}
    shared = set.intersection(*map(set, files.values())) if len(needed) > 1 else ()
    if shared:
        raise InputError(f"{min(shared)} is named for {' and '.join(needed)}; a file has one incident polarization.")
    return files


def files(path):
    """The files that a path names: itself, or those in a store, also where its folders are links."""
    if not is_store(path):
        return [Path(path)]
    inside = (Path(folder, name) for folder, _, names in os.walk(path, followlinks=True) for name in names)
    # Other hidden files belong to Snakemake or the desktop.
    return sorted(file for file in inside if file.is_file() and (file.name[0] != "." or file.name.startswith(".z")))


def digest(path):
    """SHA-256 of a file, or of the names and contents of a store's files."""
    sha = hashlib.sha256()
    for file in files(path):
        if is_store(path):
            sha.update(f"{file.relative_to(path)}\0{file.stat().st_size}\0".encode())
        with open(file, "rb") as stream:
            while block := stream.read(1 << 20):
                sha.update(block)
    return sha.hexdigest()
