"""Read what the other stages made, as far as the page shows it."""

import json
from functools import cached_property
from pathlib import Path

import pandas as pd
import xarray as xr

from common.radar import images_are_made
from mesh.io import read_ply
from report.selection import target_order

REFERENCE = Path("resources/reference")


class Results:
    """The results of one run, read when they are asked for.

    folder: results/<name>. settings: the config's sections (the rule's params). reference: folder of published figures.
    """

    def __init__(self, folder, settings, reference=REFERENCE):
        self.folder, self.settings, self.reference = Path(folder), settings, Path(reference)
        self.targets = target_order(settings["targets"])
        self.meshed = [name for name in self.targets if "mesh" in settings["targets"][name]]
        self.images_are_made = images_are_made(settings)
        self.learns = self.images_are_made and bool(settings["learning"]["experiments"])

    @cached_property
    def meshes(self):
        """Figures of the meshes, by target that has some."""
        return {name: json.loads((self.folder / "mesh" / f"{name}.json").read_text()) for name in self.meshed}

    @cached_property
    def surfaces(self):
        """Vertices in m and triangles of the finest mesh, by target that has one."""
        band = self.settings["mesh"]["bands"] - 1
        return {name: read_ply(self.folder / "mesh" / f"{name}-{band}.ply") for name in self.meshed}

    def scattering(self, target):
        """The scattering store of a target, opened lazily."""
        return xr.open_zarr(self.folder / "scattering" / f"{target}.zarr")

    def images(self, target, store):
        """A store of a target's images ('clean', 'snr_-6dB'), opened lazily: only the images shown are read."""
        return xr.open_zarr(self.folder / "imaging" / target / f"{store}.zarr")

    @cached_property
    def scores(self):
        """The scores of all experiments; test_snr_db as a number, elevation and train_snr_db as text."""
        scores = pd.read_csv(self.folder / "learning" / "scores.csv", dtype={"elevation": str, "train_snr_db": str})
        scores["test_snr_db"] = pd.to_numeric(scores["test_snr_db"], errors="coerce")
        return scores

    @cached_property
    def confusion(self):
        """Counts of predicted against true classes, with the columns of `scores` before them."""
        return pd.read_csv(self.folder / "learning" / "confusion.csv", dtype={"elevation": str, "train_snr_db": str})

    @cached_property
    def times(self):
        """Prediction times, one mapping per experiment and model."""
        records = []
        for experiment, settings in sorted(self.settings["learning"]["experiments"].items()):
            for model in settings["models"]:
                path = self.folder / "learning" / "times" / experiment / f"{model}.json"
                times = json.loads(path.read_text())
                records.append(
                    {
                        "experiment": experiment,
                        "model": model,
                        "training_observations": times["training_observations"],
                        "single_ms": times["single"]["milliseconds_per_observation"],
                        "batch_ms": times["batch"]["milliseconds_per_observation"],
                        "batch_size": times["batch"]["size"],
                        "machine": times["machine"]["cpu"],
                        "threads": times["threads"],
                    }
                )
        return records

    @cached_property
    def published_scores(self):
        """Published scores; `value` stays text, because its decimals say how exactly it was printed."""
        table = pd.read_csv(self.reference / "thesis_results.csv", dtype={"value": str}, keep_default_na=False)
        return table.astype({"snr_db": float})

    @cached_property
    def published_times(self):
        return pd.read_csv(self.reference / "thesis_prediction_times.csv", keep_default_na=False)

    @cached_property
    def benchmarks(self):
        """Seconds and peak memory of every job that kept a record: columns step, job, s, max_rss. May be empty."""
        rows, folder = [], self.folder / "benchmarks"
        # The folder may still hold records of targets and experiments that the config no longer names.
        named = {*self.targets, *self.settings["learning"]["experiments"]}
        for path in sorted(folder.rglob("*.tsv")):
            step, *job = path.relative_to(folder).with_suffix("").parts
            if step == "learning":
                step, *job = job
            if step != "report" and (not job or job[0].partition("-")[0] in named):
                line = pd.read_csv(path, sep="\t", na_values="-").iloc[-1]
                rows.append({"step": step, "job": "/".join(job), "s": line["s"], "max_rss": line["max_rss"]})
        return pd.DataFrame(rows, columns=["step", "job", "s", "max_rss"])
