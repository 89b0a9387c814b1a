"""What was run: the facts at the head of the page, and how it was made at its end."""

import platform
import subprocess
import tomllib
from importlib import metadata

import pandas as pd
import yaml

from isarflow.core import sweep
from isarflow.core.folders import ROOT
from isarflow.imaging.geometry import planned
from isarflow.learning.caveats import warnings
from isarflow.mesh import measures
from isarflow.report import draw_mesh, thesis
from isarflow.report.conditions import noise_words
from isarflow.report.layout import Section, canvas, duration, figure, number, several, span, table

PLACE, NEEDS = ("run", 2), "targets"  # on the page, see page.py
STAGES = ("mesh", "scattering", "imaging")  # whose jobs are called so in benchmarks; all others are learning's
PACKAGES = ("snakemake", "numpy", "scipy", "jax", "pymeshlab", "scikit-learn", "xarray", "zarr", "matplotlib")
MAIN = ("jax", "numpy", "snakemake")  # named at the head of the page


def facts(results):
    """Return the run in pairs of what and how much, for the head of the page."""
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
        stages = results.benchmarks["step"].where(results.benchmarks["step"].isin(STAGES), "learning")
        seconds = results.benchmarks.groupby(stages)["s"].sum()
        parts = ", ".join(f"{stage} {duration(seconds[stage])}" for stage in (*STAGES, "learning") if stage in seconds)
        pairs["Computed in"] = f"{duration(seconds.sum())} of jobs ({parts})"
    main = [text for text in _versions() if text.split()[0] in MAIN]
    pairs["Made with"] = f"isarflow {version()}, commit {commit()}; {', '.join(main)}"
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
    """How the run's capsule networks differ from the thesis's, each difference once."""
    settings, models = results.settings, dict.fromkeys(name for run in results.runs.values() for name in run["models"])
    texts = [thesis.difference(model, settings) for model in models if thesis.kind(model, settings) == "capsule"]
    return [text for text in dict.fromkeys(texts) if text]


def warned(results):
    """The warnings of the run, (what it is about, sentence), each sentence once: of its meshes, then of its images."""
    about, found = {}, meshes_warned(results)
    if results.images_are_made:
        found += warnings(results.settings, {name: mesh["source"]["reach"] for name, mesh in results.meshes.items()})
    for name, text in found:
        about.setdefault(text, []).append(name)
    return [(", ".join(names), text) for text, names in about.items()]


def meshes_warned(results):
    """What the meshes' measures warn of: (target, sentence)."""
    return [(name, text) for name, measured in results.meshes.items() for text in measures.warnings(measured)]


def thumbnail(target, surface):
    """A small picture of a target's shape for the head of the page. surface: vertices in m and triangles."""
    drawing = canvas(2.2, 1.5)
    axes = drawing.add_subplot()
    draw_mesh.draw(axes, *surface, draw_mesh.OBLIQUE, edges=False)
    axes.set_axis_off()
    data = pd.DataFrame({"target": [target], **_extent(surface)})
    return figure(f"target_{target}", drawing, data, f"The target {target}, seen obliquely from above.", target)


def _extent(surface):
    """Size of the target along x, y and z in m; None for none. surface: vertices and triangles, or None."""
    lengths = [None] * 3 if surface is None else (surface[0].max(axis=0) - surface[0].min(axis=0)).tolist()
    return dict(zip(("x_m", "y_m", "z_m"), lengths, strict=True))


def cards(results, thumbnails):
    """(name, its picture or None, lines of text) of every target: role, size and unknowns. thumbnails: by target."""
    listed = []
    for name, role, size, unknowns in targets_table(results).shown.itertuples(index=False, name=None):
        lines = [f"{size} m", f"{unknowns} unknowns"] if name in thumbnails else ["given by its field"]
        listed.append((name, thumbnails.get(name), [role, *lines]))
    return listed


def targets_table(results):
    """Size, role and unknowns of every target."""
    rows = [
        {
            "target": name,
            "role": results.settings["targets"][name]["role"],
            **_extent(results.surfaces.get(name)),
            "unknowns": results.meshes[name]["bands"][-1]["unknowns"] if name in results.meshed else None,
        }
        for name in results.targets
    ]

    def of_mesh(text):
        return lambda row: text.format(**row) if row["target"] in results.meshed else "–"

    shown = {
        "target": "{target}",
        "role": "{role}",
        "size x × y × z [m]": of_mesh("{x_m:.2f} × {y_m:.2f} × {z_m:.2f}"),
        "unknowns, finest mesh": of_mesh("{unknowns:,}"),
    }
    data = pd.DataFrame(rows).astype({"unknowns": "Int64"})
    return table("targets", data, shown, "The targets, their sizes and unknowns.")


def section(results):
    """How the page was made: jobs, versions and the whole config."""
    return Section(
        id="made",
        title="How this was made",
        text=(
            f"isarflow {version()}, commit {commit()}, Python {platform.python_version()}, {', '.join(_versions())}.",
        ),
        tables=(targets_table(results), *jobs_table(results.benchmarks)),
        code=yaml.safe_dump(results.settings, sort_keys=True, default_flow_style=None, width=100),
    )


def jobs_table(benchmarks):
    """Wall time and memory of the jobs of each step; nothing where no job kept a record."""
    if not len(benchmarks):
        return ()
    jobs = benchmarks.groupby("step")
    shown = [
        {
            "step": step,
            "jobs": str(len(rows)),
            "all jobs": duration(rows["s"].sum()),
            "longest job": duration(rows["s"].max()),
            "peak memory [MB]": number(rows["max_rss"].max()),
        }
        for step, rows in jobs
    ]
    caption = "Wall time and peak memory of the jobs. Jobs run side by side, so the run took less than their sum."
    return (table("jobs", benchmarks, shown, caption),)


def version():
    """isarflow's version."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def commit():
    """The commit of the code, with '-dirty' where files were changed since; 'unknown' outside a git checkout."""
    try:
        run = subprocess.run(
            ["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return run.stdout.strip()


def _versions():
    texts = []
    for package in PACKAGES:
        try:
            texts.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            continue
    return texts
