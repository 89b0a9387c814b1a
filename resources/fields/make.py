"""The dataset, from a run of config/fields.yaml: band by band, so that a run that is cut off loses nothing.

    make.py missing    the bands of targets without a store that are not kept yet, as targets for snakemake
    make.py keep       keep those that the run has finished, in bands/, with what each solve took
    make.py publish    join the bands of each target that has all: <target>.zarr and its rows of solves.csv
    make.py splits     splits.csv and splits_by_elevation.csv: the side of every view under the config's splits
    make.py card       the tables and the figure of README.md, from solves.csv and accuracy.csv

`make fields` does the first four, and takes hours for what is missing; `make check-fields` makes accuracy.csv (see
check.py) and the card.
"""

import argparse
import json
import re
import shutil
import subprocess
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd

from isarflow.core import store as stores
from isarflow.core.sweep import azimuths, elevations, sweeps
from isarflow.learning.data import export
from isarflow.learning.data.split import SIDES
from isarflow.learning.evaluation.timing import cpu
from isarflow.scattering import needs
from isarflow.scattering.fields.field_files import digest
from isarflow.scattering.fields.store import join_bands
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

HERE = Path(__file__).parent
BANDS = HERE / "bands"
CONFIG = "config/thesis.yaml", "config/fields.yaml"
LINE = re.compile(
    r"([\d.]+) GHz: (\d+) unknowns, residual ([\d.e+-]+), "
    r"assembly ([\d.]+) s, factorization ([\d.]+) s, directions ([\d.]+) s"
)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    steps = {step.__name__: step for step in (missing, keep, publish, splits, card)}
    parser.add_argument("what", choices=steps)
    options = parser.parse_args()
    config = load_config(*map(read_yaml, CONFIG))
    steps[options.what](config, Path("results", config["name"]))


def missing(config, results):
    names = [name for target in config["targets"] if not _store(target).exists() for name in _bands(config, target)]
    print(*(results / "scattering" / "bands" / f"{name}.zarr" for name in names if not _record(name).exists()))


def keep(config, results):
    for target in config["targets"]:
        for number, name in enumerate(_bands(config, target)):
            store = results / "scattering" / "bands" / f"{name}.zarr"
            if _store(target).exists() or _record(name).exists() or not (store / stores.SUMS).exists():
                continue
            stores.open_store(store)  # is it whole?
            copy = BANDS / store.name
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(store, copy, ignore=shutil.ignore_patterns(".snakemake_timestamp"))
            _record(name).write_text(json.dumps(_took(config, results, target, number), indent=1) + "\n")
            print(f"kept {name}")


def _took(config, results, target, number):
    """What is known of a finished band's solves: their mesh, the commit and the machine, and each one's figures."""
    mesh = results / "mesh" / f"{target}-{number}.ply"
    figures = json.loads((results / "mesh" / f"{target}.json").read_text())["bands"][number]
    sweep = sweeps(config["radar"], config["aspect"], config["mesh"]["bands"])[number]
    planes = len(config["targets"][target].get("symmetry", []))
    need = needs.need(figures, planes, sweep, needs.method(config, target))
    name = f"scattering/bands/{target}-{number}"
    log = (results / "logs" / f"{name}.log").read_text()
    device = re.search(r"^on (.+), with", log, re.MULTILINE)[1]
    job = pd.read_csv(results / "benchmarks" / f"{name}.tsv", sep="\t").iloc[-1]
    names = ("ghz", "unknowns", "residual", "assembly_s", "factorization_s", "directions_s")
    return {
        "commit": said("git", "rev-parse", "HEAD"),
        "date": date.today().isoformat(),
        "processor": cpu() if device == "cpu" else device,
        "cad_sha256": digest(config["targets"][target]["mesh"]),
        "mesh_sha256": digest(mesh),
        "triangles": figures["triangles"],
        "edge_mean_m": figures["edge"]["mean"],
        "planned_s": round(need["seconds"], 1),
        "planned_mb": round(need["megabytes"]),
        "processor_s": round(float(job["cpu_time"]), 1),  # of all cores, whatever else ran beside it
        "solves": [dict(zip(names, map(float, found), strict=True)) for found in LINE.findall(log)],
    }


def publish(config, results):
    path = HERE / "solves.csv"
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    for target in config["targets"]:
        names = _bands(config, target)
        if not all(_record(name).exists() for name in names):
            print(f"{target}: {'there' if _store(target).exists() else 'not complete yet'}")
            continue
        records = [json.loads(_record(name).read_text()) for name in names]
        bands = [BANDS / f"{name}.zarr" for name in names]
        join_bands(bands, _store(target), _attributes(config, target, records))
        rows = [row for row in rows if row["target"] != target] + [
            {"target": target, "band": band}
            | solve
            | {key: record[key] / len(record["solves"]) for key in ("processor_s", "planned_s")}
            for band, record in enumerate(records)
            for solve in record["solves"]
        ]
        pd.DataFrame(rows).to_csv(path, index=False, float_format="%.6g")
        _forget_accuracy(target)
        for name, band in zip(names, bands, strict=True):
            shutil.rmtree(band)
            _record(name).unlink()
        worst = max(solve["residual"] for record in records for solve in record["solves"])
        print(f"{target}: {sum(len(record['solves']) for record in records)} frequencies, residual at most {worst:.1e}")


def _forget_accuracy(target):
    """Drop what accuracy.csv says of the field that a target had before."""
    path = HERE / "accuracy.csv"
    if path.exists():
        accuracy = pd.read_csv(path)
        accuracy[accuracy.target != target].to_csv(path, index=False, float_format="%.4g")


def _attributes(config, target, records):
    return {
        "title": f"Monostatic full-wave backscatter of a perfectly conducting target ({target}) in free space",
        "target": target,
        "role": config["targets"][target]["role"],
        "symmetry": config["targets"][target].get("symmetry", []),
        "licence": "CC-BY-4.0",
        "made_by": f"isarflow, commit {' '.join(sorted({record['commit'] for record in records}))}",
        "date": max(record["date"] for record in records),
        "processor": ", ".join(sorted({record["processor"] for record in records})),
        "cad_sha256": records[0]["cad_sha256"],
        "edges_per_wavelength": config["mesh"]["edges_per_wavelength"],
        "mesh_sha256": [record["mesh_sha256"] for record in records for _ in record["solves"]],
        "seconds": [_seconds(solve) for record in records for solve in record["solves"]],
    }


def splits(config, results):
    """One row for each target and azimuth, and one for each elevation; a guard is between two sides and on none."""
    targets, elevation, azimuth = config["targets"], elevations(config["aspect"]), azimuths(config["aspect"])
    roles, planes = ({name: of.get(key, []) for name, of in targets.items()} for key in ("role", "symmetry"))
    divided = config["learning"]["split"], config["seed"], config["imaging"]["aperture"]
    rows = pd.MultiIndex.from_product([sorted(targets), azimuth.round(6)], names=["target", "azimuth"])
    names, sides, of_elevations = np.array([*SIDES, export.GUARD]), {}, {}
    for name, table in export.splits(elevation, azimuth, roles, planes, *divided).items():
        if name.startswith("elevation"):  # the same for every target and azimuth
            of_elevations[name] = names[table[0, :, 0]]
        else:  # the same at every elevation
            sides[name] = names[table[:, 0]].ravel()
    pd.DataFrame(sides, rows).to_csv(HERE / "splits.csv")
    pd.DataFrame(of_elevations, pd.Index(elevation, name="elevation")).to_csv(HERE / "splits_by_elevation.csv")


def card(config, results):
    accuracy, solves = pd.read_csv(HERE / "accuracy.csv"), pd.read_csv(HERE / "solves.csv")
    draw_accuracy(accuracy, HERE / "accuracy.png")
    put(HERE / "README.md", "accuracy", accuracy_lines(accuracy))
    put(HERE / "README.md", "times", time_lines(solves))


def put(path, name, lines):
    """Put lines into a text of Markdown, between its marks of this name."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    before, rest = path.read_text().split(begin)
    path.write_text(before + begin + "\n".join(lines) + "\n" + rest[rest.index(end) :])


def accuracy_lines(accuracy):
    """A table in Markdown: of each target and frequency the worst of the polarizations."""
    worst = accuracy.groupby(["target", "ghz", "reference"], sort=False).max(numeric_only=True)
    head = ["target", "GHz", *("finer: level, median", "90 %", "error"), *("cfie: level, median", "90 %", "error")]
    yield "| " + " | ".join(head) + " |"
    yield "|---" * len(head) + "|"
    for (target, ghz), rows in worst.groupby(["target", "ghz"], sort=False):
        cells = [target, f"{ghz:.2f}"]
        for reference in ("finer", "cfie"):
            row = rows.loc[(target, ghz, reference)] if (target, ghz, reference) in rows.index else None
            cells += ["", "", ""] if row is None else [
                f"{row.level_median_db:.2f} dB", f"{row.level_90_percent_db:.2f} dB", f"{row.error_rms_db:.0f} dB"
            ]  # fmt: skip
        yield "| " + " | ".join(cells) + " |"


def time_lines(solves):
    """A table in Markdown: unknowns, residual, times of each target, beside what was planned."""
    parts = ["assembly_s", "factorization_s", "directions_s"]
    solves = solves.assign(took=solves[parts].sum(axis=1))
    yield "| target | solves | unknowns | largest residual | took | of processors | planned | longest solve |"
    yield "|---" * 8 + "|"
    groups = [*solves.groupby("target", sort=False), ("all", solves)]
    for target, rows in groups:
        cells = [target, f"{len(rows)}", f"{rows.unknowns.min():,.0f} to {rows.unknowns.max():,.0f}"]
        cells += [
            f"{rows.residual.max():.1e}",
            f"{rows.took.sum() / 3600:.2f} h",
            f"{rows.processor_s.sum() / 3600:.2f} h",
            f"{rows.planned_s.sum() / 3600:.2f} h",
        ]
        yield "| " + " | ".join([*cells, f"{rows.took.max():.0f} s"]) + " |"


def draw_accuracy(accuracy, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    styles = {"finer": ("o-", "14 edges a wavelength"), "cfie": ("d--", "CFIE, same mesh")}
    worst = accuracy.groupby(["target", "ghz", "reference"], sort=False).max(numeric_only=True).reset_index()
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    colors = dict(zip(worst.target.unique(), plt.cm.tab20.colors, strict=False))
    for (target, reference), line in worst.groupby(["target", "reference"], sort=False):
        look, color = styles[reference][0], colors[target]
        axes[0].plot(line.ghz, line.level_median_db, look, color=color)
        axes[1].plot(line.ghz, line.error_rms_db, look, color=color)
    axes[0].set(xlabel="frequency [GHz]", ylabel="median difference of level [dB]", ylim=(0, None))
    axes[1].set(xlabel="frequency [GHz]", ylabel="rms error, relative to the peak [dB]")
    for target, color in colors.items():
        axes[1].plot([], [], color=color, label=target)
    for look, name in styles.values():
        axes[1].plot([], [], look, color="grey", label=name)
    axes[1].legend(fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    for ax in axes:
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=120)


def _seconds(solve):
    return round(sum(value for key, value in solve.items() if key.endswith("_s")), 1)


def _bands(config, target):
    return [f"{target}-{band}" for band in range(config["mesh"]["bands"])]


def _store(target):
    return HERE / f"{target}.zarr"


def _record(name):
    return BANDS / f"{name}.json"


def said(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    main()
