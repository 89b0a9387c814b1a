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
from isarflow.imaging.geometry import planned
from isarflow.learning.caveats import warnings
from isarflow.mesh import measures
from isarflow.report import draw_mesh, thesis
from isarflow.report.conditions import noise_words
from isarflow.report.layout import Section, canvas, duration, figure, several, span

PLACE, NEEDS = ("run", 2), "targets"  # on the page, see page.py
STAGES = ("mesh", "scattering", "imaging", "learning")
PACKAGES = ("snakemake", "numpy", "scipy", "jax", "pymeshlab", "scikit-learn", "xarray", "zarr", "matplotlib")


def facts(results):
    """Return the run in pairs of what and how much, as the page lists them."""
    settings = results.settings
    radar, aspect, noise = settings["radar"], settings["aspect"], settings["noise"]
    frequency = sweep.frequencies(radar) / 1e9
    pairs = {
        "Run": f"{settings['name']}, seed {settings['seed']}; its whole config is at the end of the page",
        "Radar": f"{span('frequency', frequency, ' GHz', 'frequencies')}, {', '.join(radar['polarizations'])}",
        "Aspect": _directions(aspect),
    }
    if results.images_are_made:
        images, tested = planned(settings), settings["learning"]["realizations"]
        some = "" if tested == "all" or tested >= noise["realizations"] else f", of which {tested} tested"
        pairs["Images"] = f"{images['range_pixels']} × {images['crossrange_pixels']} pixels, {images['words']}"
        pairs["Noise"] = (
            f"{span('SNR', sorted(noise['snr_db']), ' dB')}, by {noise_words(noise, noise['definition'])}; "
            f"{several(noise['realizations'], 'realization')} of each {noise['per']}{some}"
        )
    else:
        pairs["Images"] = f"none: {sweep.why_no_images(settings)}"
    if results.learns:
        pairs["Splits"] = _splits(results)
        if networks(results):
            pairs["Capsule network"] = "; ".join(networks(results))
    if len(results.benchmarks):
        seconds = results.benchmarks.groupby("stage")["s"].sum()
        parts = ", ".join(f"{stage} {duration(seconds[stage])}" for stage in STAGES if stage in seconds)
        pairs["Computed in"] = f"{duration(seconds.sum())} of jobs ({parts})"
    pairs["Made with"] = f"isarflow {version()}, commit {commit()}, {', '.join(_versions())}"
    return list(pairs.items())


def _directions(aspect):
    """Return where the radar is, in words."""
    if "great_circle" in aspect:
        circle = aspect["great_circle"]
        through = " through ".join("({:g}°, {:g}°)".format(*circle[key]) for key in ("from", "through"))
        count = several(len(sweep.angles(circle["angle"])), "direction")
        return f"{count} on the great circle from {through}, (elevation, azimuth)"
    if not sweep.is_grid(aspect):
        return several(len(aspect["directions"]), "direction")
    every = ("elevation", sweep.elevations(aspect)), ("azimuth", sweep.azimuths(aspect))
    return "; ".join(span(name, values, "°") for name, values in every)


def _splits(results):
    """Return the splits that experiments use, in words."""
    split = results.settings["learning"]["split"]
    guard = f", {split['spacing']:g}° away or more" if split["spacing"] else ""
    words = {
        "elevation": f"by elevation: every second elevation trains, those between are tested{guard}",
        "sector": f"by sector: {split['folds']} arcs of the aspects take turns to be tested",
        "random": f"at random: {100 * split['train']:.3g} % of the aspects train",
        "shuffled": f"at random, a view and its mirror image apart: {100 * split['train']:.3g} % of the azimuths train",
    }
    used = {run["split"] for run in results.runs.values()}
    return "; ".join(text for name, text in words.items() if name in used)


def networks(results):
    """Return how the run's capsule networks differ from the thesis's, each difference once."""
    settings, models = results.settings, dict.fromkeys(name for run in results.runs.values() for name in run["models"])
    texts = [thesis.difference(model, settings) for model in models if thesis.kind(model, settings) == "capsule"]
    return [text for text in dict.fromkeys(texts) if text]


def warned(results):
    """Return the warnings of the run, (what it is about, sentence), each once: of its meshes, then of its images."""
    found = [(name, text) for name, measured in results.meshes.items() for text in measures.warnings(measured)]
    if results.images_are_made:
        found += warnings(results.settings, {name: results.reach(name) for name in results.meshed})
    about = {}
    for name, text in found:
        about.setdefault(text, []).append(name)
    return [(", ".join(names), text) for text, names in about.items()]


def thumbnail(target, surface):
    """Draw a small picture of a target's shape for the head of the page. surface: vertices in m and triangles."""
    drawing = canvas(2.2, 1.5)
    axes = drawing.add_subplot()
    draw_mesh.draw(axes, *surface, draw_mesh.OBLIQUE, edges=False)
    axes.set_axis_off()
    sizes = dict(zip(("x_m", "y_m", "z_m"), np.ptp(surface[0], axis=0).tolist(), strict=True))
    data = pd.DataFrame({"target": [target], **sizes})
    return figure(f"target_{target}", drawing, data, f"The target {target}, seen obliquely from above.", target)


def cards(results, thumbnails):
    """Return (name, its picture or None, lines of text) of every target: role, size and unknowns.

    thumbnails: by target.
    """
    listed = []
    for name in results.targets:
        lines = ["given by its field"]
        if name in results.meshed:
            size = " × ".join(f"{length:.2f}" for length in np.ptp(results.surfaces[name][0], axis=0))
            lines = [f"{size} m", f"{results.meshes[name]['bands'][-1]['unknowns']:,} unknowns"]
        listed.append((name, thumbnails.get(name), [results.settings["targets"][name]["role"], *lines]))
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


def _versions():
    """Return Python and the packages that there are, with their versions."""
    texts = [f"Python {platform.python_version()}"]
    for package in PACKAGES:
        with suppress(metadata.PackageNotFoundError):
            texts.append(f"{package} {metadata.version(package)}")
    return texts
