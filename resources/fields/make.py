"""The dataset, from a run of config/thesis.yaml: band by band, so that a run that is cut off loses nothing.

    make.py missing    the bands that are not kept yet, as targets for snakemake
    make.py keep       keep those that the run has finished, in bands/, with what each solve took
    make.py publish    join the bands of complete targets: <target>.zarr, solves.csv, meshes/

`make fields` does all three, and needs hours for what is missing.
"""

import argparse
import hashlib
import json
import platform
import re
import shutil
import subprocess
from datetime import date
from pathlib import Path

import pandas as pd

from core import store as stores
from core.sweep import sweeps
from scattering import needs
from scattering.store import join_bands
from setup.config import load
from setup.yaml_file import read_yaml

HERE = Path(__file__).parent
BANDS = HERE / "bands"
CONFIG = "config/thesis.yaml"
LINE = re.compile(
    r"([\d.]+) GHz: (\d+) unknowns, residual ([\d.e+-]+), "
    r"assembly ([\d.]+) s, factorization ([\d.]+) s, directions ([\d.]+) s"
)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["missing", "keep", "publish"])
    options = parser.parse_args()
    config = load(read_yaml(CONFIG))
    {"missing": missing, "keep": keep, "publish": publish}[options.what](config, Path("results", config["name"]))


def missing(config, results):
    names = [name for target in config["targets"] for name in _bands(config, target)]
    print(*(results / "scattering" / "bands" / f"{name}.zarr" for name in names if not _record(name).exists()))


def keep(config, results):
    for target in config["targets"]:
        for number, name in enumerate(_bands(config, target)):
            store = results / "scattering" / "bands" / f"{name}.zarr"
            if _record(name).exists() or not (store / stores.SUMS).exists():
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
    log = (results / "logs" / "scattering" / "bands" / f"{target}-{number}.log").read_text()
    names = ("ghz", "unknowns", "residual", "assembly_s", "factorization_s", "directions_s")
    return {
        "commit": _said("git", "rev-parse", "HEAD"),
        "date": date.today().isoformat(),
        "processor": _processor(),
        "cad_sha256": _sha256(config["targets"][target]["mesh"]),
        "mesh_sha256": _sha256(mesh),
        "triangles": figures["triangles"],
        "edge_mean_m": figures["edge"]["mean"],
        "planned_s": round(need["seconds"], 1),
        "planned_mb": round(need["megabytes"]),
        "solves": [dict(zip(names, map(float, found), strict=True)) for found in LINE.findall(log)],
    }


def publish(config, results):
    rows = []
    for target in config["targets"]:
        names = _bands(config, target)
        if not all(_record(name).exists() for name in names):
            print(f"{target}: not complete yet")
            continue
        records = [json.loads(_record(name).read_text()) for name in names]
        for number, record in enumerate(records):
            rows += [
                {"target": target, "band": number} | solve | {"planned_s": record["planned_s"] / len(record["solves"])}
                for solve in record["solves"]
            ]
        joined = HERE / f"{target}.zarr"
        join_bands([BANDS / f"{name}.zarr" for name in names], joined)
        with stores.open_store(joined) as dataset:
            dataset = dataset.load()
        dataset.attrs |= {
            "title": f"Monostatic full-wave backscatter of a perfectly conducting {target} in free space",
            "target": target,
            "role": config["targets"][target]["role"],
            "symmetry": config["targets"][target].get("symmetry", []),
            "licence": "CC-BY-4.0",
            "made_by": f"isarflow, commit {' '.join(sorted({record['commit'] for record in records}))}",
            "date": max(record["date"] for record in records),
            "cad_sha256": records[0]["cad_sha256"],
            "edges_per_wavelength": config["mesh"]["edges_per_wavelength"],
            "mesh_sha256": [record["mesh_sha256"] for record in records for _ in record["solves"]],
            "seconds": [_seconds(solve) for record in records for solve in record["solves"]],
        }
        shutil.rmtree(joined)
        chunks = {**dataset.field.sizes, "elevation": 1}
        dataset.field.encoding.clear()
        stores.write(dataset, joined, {"field": {"chunks": tuple(chunks.values())}})
        print(f"{joined}: {dict(dataset.sizes)}, residual at most {max(dataset.attrs['residual']):.1e}")
    pd.DataFrame(rows).to_csv(HERE / "solves.csv", index=False, float_format="%.6g")


def _seconds(solve):
    return round(sum(value for key, value in solve.items() if key.endswith("_s")), 1)


def _bands(config, target):
    return [f"{target}-{band}" for band in range(config["mesh"]["bands"])]


def _record(name):
    return BANDS / f"{name}.json"


def _sha256(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _said(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def _processor():
    info = Path("/proc/cpuinfo")
    named = re.search(r"model name\s*: (.*)", info.read_text()) if info.exists() else None
    return named.group(1) if named else platform.processor()


if __name__ == "__main__":
    main()
