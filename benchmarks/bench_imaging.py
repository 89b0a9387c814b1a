"""The images of the reference experiment, from made-up fields: `make bench-imaging`.

Five targets of a few point scatterers each, at full size (config/thesis.yaml), are imaged through Snakemake: 1,172,490
noisy images and the clean ones. Prints time, throughput and the largest memory of a job beside the disk's write rate.
Needs about 11 GB of disk while it runs; removes what it made.
"""

import os
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from runner import options_of

from isarflow.core.sweep import C0, azimuths, elevations, frequencies, snr_label
from isarflow.scattering.fields.store import write_field
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

NAME = "bench_imaging"
FOLDER = Path("results", NAME)


def write_scatterers(path, radar, aspect, random):
    """A field of eight point scatterers within 0.4 m of the origin, as a store."""
    frequency, elevation, azimuth = frequencies(radar), elevations(aspect), azimuths(aspect)
    el, az = np.meshgrid(np.radians(elevation), np.radians(azimuth), indexing="ij")
    direction = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)
    k = 2 * np.pi * frequency / C0
    nearer = direction @ random.uniform(-0.4, 0.4, (8, 3)).T
    field = sum(np.exp(2j * k[:, None, None] * nearer[..., point]) for point in range(8)).astype(np.complex64)
    write_field(path, field[None], ["VV"], frequency, elevation, azimuth, {"formulation": "point scatterers"})


def disk_rate(path, megabytes=2000):
    """MB/s of a plain file, flushed to the disk."""
    block = np.random.default_rng(0).bytes(20_000_000)
    start = time.perf_counter()
    with open(path, "wb") as file:
        for _ in range(megabytes // 20):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
    rate = megabytes / (time.perf_counter() - start)
    path.unlink()
    return rate


def main():
    options = options_of(__doc__, config={"default": "config/thesis.yaml"})
    config = load_config(read_yaml(options.config))
    shutil.rmtree(FOLDER, ignore_errors=True)
    fields = Path("results", f"{NAME}_fields")
    fields.mkdir(parents=True, exist_ok=True)
    targets = {}
    for number, target in enumerate(config["targets"]):
        path = fields / f"{target}.zarr"
        write_scatterers(path, config["radar"], config["aspect"], np.random.default_rng(number))
        targets[target] = {"field": str(path), "role": "known"}
    settings = fields / "config.yaml"
    settings.write_text(yaml.safe_dump(read_yaml(options.config) | {"name": NAME, "targets": targets}))
    stores = ["clean", *map(snr_label, config["noise"]["snr_db"])]
    wanted = [f"{FOLDER}/imaging/{target}/{store}.zarr" for target in targets for store in stores]
    command = ["snakemake", "--cores", str(options.threads), "--quiet", "all", "--configfile", str(settings), "--"]
    start = time.perf_counter()
    subprocess.run([*command, *wanted], check=True)
    seconds = time.perf_counter() - start
    jobs = pd.concat(pd.read_csv(path, sep="\t", na_values="-") for path in FOLDER.rglob("benchmarks/imaging/*/*.tsv"))
    megabytes = sum(file.stat().st_size for file in FOLDER.rglob("imaging/**/*") if file.is_file()) / 1e6
    sweep = len(elevations(config["aspect"])) * len(azimuths(config["aspect"])) * len(targets)
    images = sweep * (1 + config["noise"]["realizations"] * len(config["noise"]["snr_db"]))
    print(
        f"{images:,} images ({images - sweep:,} of them noisy) in {seconds:.0f} s on {options.threads} cores: "
        f"{images / seconds:,.0f} images/s, {megabytes / 1000:.2f} GB at {megabytes / seconds:.0f} MB/s "
        f"(the disk writes {disk_rate(fields / 'rate'):.0f} MB/s). Largest job: {jobs.max_rss.max():.0f} MB; "
        f"{len(jobs)} jobs of {jobs.s.mean():.1f} s on average."
    )
    shutil.rmtree(FOLDER)
    shutil.rmtree(fields)


if __name__ == "__main__":
    main()
