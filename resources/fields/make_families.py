"""The fields of config/<set>.yaml, one store for each model, so that a run that is cut off loses nothing.

    make_families.py missing [set]     the fields of models that are not kept yet, as targets for snakemake
    make_families.py keep [set]        keep those that the run has finished, azimuths 0 to 180 degrees:
                                       <set>/<target>.zarr
    make_families.py accuracy [set]    accuracy.csv: the kept fields beside those of a finer run (<set>/finer.yaml)
    make_families.py card [set]        the tables of <set>/README.md, from the stores and accuracy.csv, and
                                       config/<set>-fields.yaml, which takes the kept fields

A set is `families`, of metal, `flyers`, of plastic, flesh and feathers, or `flyers-metal`, the latter all of metal.

All models have the mirror plane xz, so the reader takes the other azimuths from these (docs/own-fields.md).
"""

import argparse
import json
import re
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
from check import FINER, apart
from make import put, said

from isarflow.core import store as stores
from isarflow.learning.evaluation.timing import cpu
from isarflow.mesh.families import stated_values
from isarflow.mesh.read.target import is_metal
from isarflow.scattering.fields.field_files import digest
from isarflow.scattering.fields.given_store import read_store
from isarflow.setup.config import load_config
from isarflow.setup.poses import ROLE as POSE
from isarflow.setup.yaml_file import read_yaml

HERE, CONFIGS = Path(__file__).parent, Path("config")
SETS = {  # the config of each, and what lies over it
    "families": ["families.yaml"],
    "flyers": ["flyers.yaml"],
    "flyers-metal": ["flyers.yaml", "flyers-metal.yaml"],
}
SAID = "role", "class", "kind", "symmetry"
HALF = 180 + 1e-4  # degrees
MIRRORED = 1e-3  # relative: the most that the other half may differ from the mirror image of the kept one


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    steps = {step.__name__: step for step in (missing, keep, accuracy, card)}
    parser.add_argument("what", choices=steps)
    parser.add_argument("set", nargs="?", choices=SETS, default="families")
    options = parser.parse_args()
    config = load_config(*(read_yaml(CONFIGS / name) for name in SETS[options.set]))
    steps[options.what](config, Path("results", config["name"]))


def missing(config, results):
    print(*(results / "scattering" / f"{name}.zarr" for name in _not_kept(config)))


def keep(config, results):
    for name in _not_kept(config):
        solved = results / "scattering" / f"{name}.zarr"
        if not (solved / stores.SUMS).exists():
            continue
        whole, path = stores.open_store(solved).load(), _kept(config, name)
        half = whole.sel(azimuth=whole.azimuth <= HALF)
        half.attrs |= _attributes(config, results, name)
        stores.write(half, path, {"field": {"chunks": half.field.shape}})
        if (off := _off(path, whole)) > MIRRORED:
            (path / stores.SUMS).unlink()  # so that it does not count as kept
            raise SystemExit(f"{name}: the field is {off:.1e} of itself from its mirror image; is it symmetric?")
        size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
        residual, seconds = max(half.attrs["residual"]), half.attrs["processor_s"]
        print(f"kept {name}: residual at most {residual:.1e}, {seconds:.0f} s of processors, {size / 1e3:.0f} kB")


def _not_kept(config):
    """The models without a whole store of their own parameters and poses."""
    for name in _models(config):
        target, path = config["targets"][name], _kept(config, name)
        if (path / stores.SUMS).exists():
            kept, poses = stores.open_store(path), 1 + len(target.get("poses", []))
            if kept.attrs["parameters"] == stated_values(target["family"]) and kept.sizes.get("pose", 1) == poses:
                continue
        yield name


def _models(config):
    """The names of the models; further poses of one that moves are in its own store."""
    return [name for name, target in config["targets"].items() if target["role"] != POSE]


def _kept(config, name):
    return HERE / config["name"] / f"{name}.zarr"


def _off(path, whole):
    """How far the field that the reader makes of a kept store is from the whole one, relative."""
    wanted = {name: whole[name].values for name in ("frequency", "elevation", "azimuth")}
    ways, every = [str(way) for way in whole.polarization.values], range(whole.sizes.get("pose", 0)) or [None]
    read = np.array([read_store(path, ways, wanted, ["xz"], pose)[0] for pose in every])
    return np.linalg.norm(read.reshape(whole.field.shape) - whole.field.values) / np.linalg.norm(whole.field.values)


def _attributes(config, results, name):
    target, bands = config["targets"][name], range(config["mesh"]["bands"])
    mesh = json.loads((results / "mesh" / f"{name}.json").read_text())
    poses = [name, *target.get("poses", [])]
    jobs = [f"scattering/bands/{pose}-{band}" for pose in poses for band in bands]
    metal = all(map(is_metal, target.get("parts", {}).values()))
    body = "perfectly conducting" if metal else "penetrable"  # the store's `parts` have the materials
    return {
        "title": f"Monostatic full-wave backscatter of a {body} model ({name}) in free space",
        "target": name,
        "role": target["role"],
        "class": target.get("class", ""),
        "kind": target["kind"],
        "symmetry": target["symmetry"],
        "family": mesh["family"],
        "parameters": mesh["parameters"],
        "box_m": mesh["source"]["box"],
        "licence": "CC-BY-4.0",
        "made_by": f"isarflow, commit {said('git', 'rev-parse', 'HEAD')}",
        "date": date.today().isoformat(),
        "processor": ", ".join(sorted({_device(results, job) for job in jobs})),
        "edges_per_wavelength": config["mesh"]["edges_per_wavelength"],
        "mesh_sha256": [digest(results / "mesh" / f"{pose}-{band}.ply") for pose in poses for band in bands],
        "mesh_processor_s": sum(_processor_seconds(results, f"mesh/{pose}") for pose in poses),
        "processor_s": round(sum(_processor_seconds(results, job) for job in jobs), 1),  # of all cores
    }


def _device(results, job):
    """What solved a band, as its log says."""
    device = re.search(r"^on (.+), with", (results / "logs" / f"{job}.log").read_text(), re.MULTILINE)[1]
    return cpu() if device == "cpu" else device


def _processor_seconds(results, job):
    return round(float(pd.read_csv(results / "benchmarks" / f"{job}.tsv", sep="\t").cpu_time.iloc[-1]), 1)


def accuracy(config, results):
    folder, rows = HERE / config["name"], []
    names = [CONFIGS / name for name in SETS[config["name"]]] + [folder / "finer.yaml"]
    finer = load_config(*(read_yaml(name) for name in names))
    assert finer["mesh"]["edges_per_wavelength"] == FINER
    for path in sorted(Path("results", finer["name"], "scattering").glob("*.zarr")):
        whole = stores.open_store(path).load()
        kept = stores.open_store(folder / path.name).load()
        kept = kept.isel(pose=0) if "pose" in kept.dims else kept
        references = whole.sel(azimuth=kept.azimuth, method="nearest").field.values
        for way, mine, other in zip(kept.polarization.values, kept.field.values, references, strict=True):
            for hertz, field, reference in zip(kept.frequency.values, mine, other, strict=True):
                row = {"target": path.stem, "ghz": round(hertz / 1e9, 4), "polarization": str(way)}
                rows.append(row | apart(field, reference))
    pd.DataFrame(rows).to_csv(folder / "accuracy.csv", index=False, float_format="%.4g")


def card(config, results):
    made = config["name"]
    there = [name for name in _models(config) if (_kept(config, name) / stores.SUMS).exists()]
    with open(CONFIGS / f"{made}-fields.yaml", "w") as file:
        file.write(f"# The models of {made}.yaml, from their kept fields: by `make_families.py card`.\n")
        file.write(f"name: {made}-fields\ntargets:\n  '*': null\n")
        for name in there:
            said = {key: config["targets"][name][key] for key in SAID if key in config["targets"][name]}
            said = {"field": f"resources/fields/{made}/{name}.zarr", **said}
            file.write(f"  {name}: {{{', '.join(f'{k}: {_flow(v)}' for k, v in said.items())}}}\n")
        file.write("learning:\n  experiments: {'*': null}\n")
    card = HERE / made / "README.md"
    put(card, "models", model_lines(config, there))
    if card.with_name("accuracy.csv").exists():
        put(card, "accuracy", accuracy_lines(pd.read_csv(card.with_name("accuracy.csv"))))


def _flow(value):
    """A text or a list of texts as YAML."""
    return f"[{', '.join(value)}]" if isinstance(value, list) else value


def model_lines(config, there):
    """A table in Markdown: of each kind its models' sizes, unknowns, residuals and times. there: their names."""
    rows = pd.DataFrame([stores.open_store(_kept(config, name)).attrs for name in there])
    yield "| kind | class | models | longest side | unknowns at the top | largest residual | processor time |"
    yield "|---" * 7 + "|"
    for kind, models in rows.groupby("kind", sort=False):
        longest, unknowns = models.box_m.map(max), models.unknowns.map(max)
        cells = [kind, models["class"].iloc[0] or "other", f"{len(models)}"]
        cells += [f"{longest.min():.2f} to {longest.max():.2f} m", f"{unknowns.min():,} to {unknowns.max():,}"]
        cells += [f"{models.residual.map(max).max():.1e}", f"{models.processor_s.sum() / 60:.0f} min"]
        yield "| " + " | ".join(cells) + " |"


def accuracy_lines(accuracy):
    """A table in Markdown: of each target and polarization the median over frequencies, and the worst."""
    yield "| target | polarization | level, median | level, 90 % | error, rms | error, worst frequency |"
    yield "|---" * 6 + "|"
    for (target, way), rows in accuracy.groupby(["target", "polarization"], sort=False):
        level, most = rows.level_median_db.median(), rows.level_90_percent_db.median()
        error, worst = rows.error_rms_db.median(), rows.error_rms_db.max()
        yield f"| {target} | {way} | {level:.2f} dB | {most:.2f} dB | {error:.0f} dB | {worst:.0f} dB |"


if __name__ == "__main__":
    main()
