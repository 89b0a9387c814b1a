"""What was run: the facts at the head of the page, and how it was made at its end."""

import platform
import subprocess
import tomllib
from importlib import metadata
from pathlib import Path

import pandas as pd
import yaml

from core import sweep
from imaging.geometry import planned
from learning.experiments import runs
from report import thesis
from report.caveats import warnings
from report.layout import Section, Table, duration, number
from report.section_mesh import extent

ROOT = Path(__file__).parents[3]
STAGES = ("mesh", "scattering", "imaging")  # whose jobs are called so in benchmarks; all others are learning's
PACKAGES = ("snakemake", "numpy", "scipy", "jax", "pymeshlab", "scikit-learn", "xarray", "zarr", "matplotlib")
MAIN = ("jax", "numpy", "snakemake")  # named at the head of the page


def facts(results):
    """The run in pairs of what and how much, for the head of the page."""
    settings = results.settings
    radar, noise = settings["radar"], settings["noise"]
    frequency = sweep.frequencies(radar) / 1e9
    elevation, azimuth = sweep.elevations(settings["aspect"]), sweep.azimuths(settings["aspect"])
    band = f"{frequency[0]:g} GHz" if len(frequency) == 1 else f"{frequency[0]:g} to {frequency[-1]:g} GHz"
    pairs = [
        ("Run", f"{settings['name']}, seed {settings['seed']}; its whole config stands at the end of the page"),
        (
            "Radar",
            f"{band}, {_count(len(frequency), 'frequency', 'frequencies')}, {', '.join(radar['polarizations'])}",
        ),
        ("Aspect", f"{_angles('elevation', elevation)}; {_angles('azimuth', azimuth)}"),
    ]
    if results.images_are_made:
        pixels = planned(settings)
        pairs += [
            (
                "Images",
                f"{pixels['range_pixels']} × {pixels['crossrange_pixels']} pixels, {pixels['words']}",
            ),
            (
                "Noise",
                f"{_count(len(noise['snr_db']), 'SNR', 'SNRs')} from {min(noise['snr_db']):g} "
                f"to {max(noise['snr_db']):g} dB, "
                f"{_count(noise['realizations'], 'realization', 'realizations')}",
            ),
        ]
    if results.learns and networks(settings):
        pairs.append(("Capsule network", "; ".join(networks(settings))))
    if len(results.benchmarks):
        pairs.append(("Computed in", _times(results.benchmarks)))
    main = [text for text in _versions() if text.split()[0] in MAIN]
    pairs.append(("Made with", f"isarflow {version()}, commit {commit()}; {', '.join(main)}"))
    return pairs


def networks(settings):
    """How the run's capsule networks differ from the thesis's, each difference once."""
    models = dict.fromkeys(model for run in runs(settings).values() for model in run["models"])
    found = [thesis.difference(model, settings) for model in models if thesis.kind(model, settings) == "capsule"]
    return [text for text in dict.fromkeys(found) if text]


def warned(results):
    """The warnings of the run, (what it is about, sentence), each sentence once: as said before it started."""
    if not results.images_are_made:
        return []
    about = {}
    reaches = {name: mesh["source"]["reach"] for name, mesh in results.meshes.items()}
    for name, text in warnings(results.settings, reaches):
        about.setdefault(text, []).append(name)
    return [(", ".join(names), text) for text, names in about.items()]


def _times(benchmarks):
    """The time of all jobs, and of each stage's, in words."""
    stages = benchmarks["step"].where(benchmarks["step"].isin(STAGES), "learning")
    seconds = benchmarks.groupby(stages)["s"].sum()
    parts = ", ".join(f"{stage} {duration(seconds[stage])}" for stage in (*STAGES, "learning") if stage in seconds)
    return f"{duration(seconds.sum())} of jobs ({parts})"


def cards(results, thumbnails):
    """(name, its picture or None, lines of text) of every target: role, size and unknowns."""
    pictures = dict(zip(results.meshed, thumbnails, strict=True))
    table = targets_table(results).shown.set_index("target")
    found = []
    for name, row in zip(table.index, table.itertuples(index=False, name=None), strict=True):
        role, size, unknowns = row
        lines = [f"{size} m", f"{unknowns} unknowns"] if name in pictures else ["given by its field"]
        found.append((name, pictures.get(name), [role, *lines]))
    return found


def targets_table(results):
    """Size, role and unknowns of every target."""
    rows, shown = [], []
    for name in results.targets:
        meshed = name in results.meshed
        size = extent(results.surfaces[name][0]) if meshed else [None] * 3
        unknowns = results.meshes[name]["bands"][-1]["unknowns"] if meshed else None
        role = results.settings["targets"][name]["role"]
        rows.append(
            {"target": name, "role": role, "x_m": size[0], "y_m": size[1], "z_m": size[2], "unknowns": unknowns}
        )
        shown.append(
            {
                "target": name,
                "role": role,
                "size x × y × z [m]": " × ".join(f"{length:.2f}" for length in size) if meshed else "–",
                "unknowns, finest mesh": f"{unknowns:,}" if meshed else "–",
            }
        )
    data = pd.DataFrame(rows).astype({"unknowns": "Int64"})
    return Table("targets", pd.DataFrame(shown), data, "The targets, their sizes and unknowns.")


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
    steps = benchmarks.groupby("step", sort=True).agg(
        jobs=("job", "size"), total_s=("s", "sum"), longest_s=("s", "max"), memory_mb=("max_rss", "max")
    )
    shown = pd.DataFrame(
        {
            "step": steps.index,
            "jobs": [str(count) for count in steps["jobs"]],
            "all jobs": [duration(seconds) for seconds in steps["total_s"]],
            "longest job": [duration(seconds) for seconds in steps["longest_s"]],
            "peak memory [MB]": [number(memory) for memory in steps["memory_mb"]],
        }
    )
    caption = "Wall time and peak memory of the jobs. Jobs run side by side, so the run took less than their sum."
    return (Table("jobs", shown, benchmarks, caption),)


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
    found = []
    for package in PACKAGES:
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            continue
    return found


def _count(count, one, many):
    return f"{count} {one if count == 1 else many}"


def _angles(name, values):
    if len(values) == 1:
        return f"{name} {values[0]:g}°"
    return f"{len(values)} {name}s from {values[0]:g}° to {values[-1]:.4g}°"
