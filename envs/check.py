"""What `make` asks of a machine before it installs anything: says the one command that mends what is missing.

Only what every Python has, in words that every Python since 3.6 reads.
"""

import ctypes
import importlib.util
import os
import shutil
import sys

OLDEST = (3, 11)
SIZE = 3  # GB: the environment takes 1.5 GB, and its installation as much again for a while


def problems(folder):
    """What is wrong, a list of texts, and the Debian packages that mend what they can."""
    wrong, packages = [], []
    version = ".".join(map(str, sys.version_info[:2]))
    if set("{}") & set(folder):
        wrong.append(f"Snakemake takes braces in a path for wildcards: {folder}. Move it.")
    if os.pathsep in folder:
        wrong.append(
            f"This folder's path has a '{os.pathsep}' in it, which separates folders in PATH: {folder}. Move it."
        )
    if sys.version_info < OLDEST:
        wrong.append(
            f"isarflow needs python {'.'.join(map(str, OLDEST))} or later, and this is {version} ({sys.executable}). "
            "If there is a later one, name it: make PYTHON=python3.12"
        )
        return wrong, packages
    if not all(map(importlib.util.find_spec, ("venv", "ensurepip"))):
        wrong.append(f"Python {version} has no venv module to make an environment with.")
        packages.append(f"python{version}-venv")
    free = shutil.disk_usage(folder).free / 1e9
    if free < SIZE:
        wrong.append(f"{free:.2g} GB are free here, and installing the environment takes {SIZE} GB. Make room.")
    if sys.platform == "linux":
        try:
            ctypes.CDLL("libGL.so.1")
        except OSError:
            wrong.append("The mesh tools need the OpenGL library, and libGL.so.1 is not there.")
            packages.append("libgl1")
    return wrong, packages


if __name__ == "__main__":
    wrong, packages = problems(os.getcwd())
    if packages:
        root = "" if os.getuid() == 0 else "sudo "
        wrong.append(f"On Debian or Ubuntu: {root}apt-get install -y {' '.join(packages)}")
    sys.exit("\n".join(wrong) or 0)
