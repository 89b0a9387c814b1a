"""What was run: the facts and targets at the head of the page, and the whole config at its end."""

import platform
import subprocess
import tomllib
from contextlib import suppress
from importlib import metadata

import numpy as np
import pandas as pd
import yaml

from isarflow.core import sweep
from isarflow.core.folders import ROOT
from isarflow.learning.caveats import warnings
from isarflow.mesh import measures
from isarflow.report import draw_mesh
from isarflow.report.layout import Section, canvas, duration, figure

PLACE, NEEDS = ("run", 2), "targets"  # on the page, see page.py
STAGES = ("mesh", "scattering", "imaging", "learning")
PACKAGES = ("snakemake", "numpy", "scipy", "jax", "pymeshlab", "scikit-learn", "xarray", "zarr", "matplotlib")


def facts(results):
    """Return the run in pairs of what and how much, as the page lists them."""
    settings = results.settings
    pairs = {"Run": f"{settings['name']}, seed {settings['seed']}; its whole config is at the end of the page"}
    if not results.images_are_made:
        pairs["Images"] = f"none: {sweep.why_no_images(settings)}"
    if len(results.benchmarks):
        seconds = results.benchmarks.groupby("stage")["s"].sum()
        parts = ", ".join(f"{stage} {duration(seconds[stage])}" for stage in STAGES if stage in seconds)
        pairs["Computed in"] = f"{duration(seconds.sum())} of jobs ({parts})"
    made = [f"isarflow {version()}", f"commit {commit()}", f"Python {platform.python_version()}"]
    for package in PACKAGES:
        with suppress(metadata.PackageNotFoundError):
            made.append(f"{package} {metadata.version(package)}")
    return list((pairs | {"Made with": ", ".join(made)}).items())


def warned(results):
    """Return the warnings of the run, (what it is about, sentence), each once: of its meshes, then of its images."""
    found = [(name, text) for name, measured in results.meshes.items() for text in measures.warnings(measured)]
    if results.images_are_made:
        found += warnings(results.settings, {name: results.reach(name) for name in results.meshed})
    about = {}
    for name, text in found:
        about.setdefault(text, []).append(name)
    return [(", ".join(names), text) for text, names in about.items()]


def cards(results):
    """Return (name, a small picture or None, lines of text) of every target: role, size and unknowns."""
    listed = []
    for name in results.targets:
        drawn, lines = None, ["given by its field"]
        if name in results.meshed:
            size = np.ptp(results.surfaces[name][0], axis=0).tolist()
            drawing = canvas(2.2, 1.5)
            axes = drawing.add_subplot()
            draw_mesh.draw(axes, *results.surfaces[name], draw_mesh.OBLIQUE, edges=False)
            axes.set_axis_off()
            data = pd.DataFrame([[name, *size]], columns=["target", "x_m", "y_m", "z_m"])
            drawn = figure(f"target_{name}", drawing, data, f"The target {name}, seen obliquely from above.")
            lines = [" × ".join(f"{length:.2f}" for length in size) + " m"]
            lines.append(f"{results.meshes[name]['bands'][-1]['unknowns']:,} unknowns")
        listed.append((name, drawn, [results.settings["targets"][name]["role"], *lines]))
    return listed


def section(results):
    """Return the Section of the whole config."""
    code = yaml.safe_dump(results.settings, sort_keys=True, default_flow_style=None, width=100)
    return Section(id="made", title="How this was made", code=code)


def version():
    """Return isarflow's version."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def commit():
    """Return the commit of the code, with '-dirty' where files were changed since; 'unknown' outside a git checkout."""
    describe = ["git", "describe", "--always", "--dirty"]
    try:
        return subprocess.run(describe, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
