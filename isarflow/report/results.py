"""Read what the other stages made, as far as the page shows it."""

import json
from functools import cache, cached_property
from pathlib import Path

import pandas as pd

from isarflow.core.folders import ROOT, of_fields
from isarflow.core.store import open_store
from isarflow.core.sweep import images_are_made, snr_label
from isarflow.imaging.geometry import PURE_NOISE
from isarflow.learning.experiments import class_of, runs
from isarflow.mesh.io import read_parts, read_ply
from isarflow.mesh.read.target import hides
from isarflow.report.selection import KINDS, drawn, full_size, target_order
from isarflow.report.thesis import DEFINITION
from isarflow.report.vocabulary import PROTOCOLS, Names, select

REFERENCE = ROOT / "resources" / "reference"  # published values
# Of the full-size runs (see selection.FULL_SIZE): the experiments that train at all elevations, by the polarizations of
# their images, sorted; and the targets, known and unknown ones.
SIZED = {
    "thesis": {"VV": ("multi_elevation", "fcnn_open", "sector", "capsule_open", "capsule_sector", "noisy_capsule")},
    "recognition": {"HH, HV, VV": ("random", "elevation"), "VV": ("random_vv", "elevation_vv")},
}
SIZED_TARGETS = [["drone", "missile"], ["aircraft", "ufo"]]
# What of a model's prediction times is read, and what its column is called.
TIMES = {name: name for name in ("experiment", "run", "model", "training_observations")}
TIMES |= {f"{how}.milliseconds_per_observation": f"{how}_ms" for how in ("single", "batch")}
TIMES |= {"batch.size": "batch_size"}


def _learned(table):
    """Return a property of Results: a table of the learning stage."""
    return cached_property(lambda self: read_learned(self.folder / "learning" / f"{table}.csv"))


def read_learned(path):
    """Return a table of the learning stage, whose columns of text stay text where they are empty."""
    text = dict.fromkeys(("elevation", "training", "score", "threshold", "fold"), str)
    numbers = {column: [""] for column in ("train_snr_db", "test_snr_db", "value", "low", "high")}
    return pd.read_csv(path, dtype=text, keep_default_na=False, na_values=numbers)  # a target may be called NA


@cache
def _sized(path):
    """Return the rows as in `mean_scores` of a full-size run. path: of its scores in the repository."""
    return select(read_learned(ROOT / path), snr_definition=DEFINITION, fold="")


def _published(table, types=None):
    """Return a property of Results: a table of published values, columns of these types."""
    path = REFERENCE / f"thesis_{table}.csv"
    return cached_property(lambda _: pd.read_csv(path, dtype=types, keep_default_na=False))


def _json(path):
    return json.loads(path.read_text())


class Results:
    """The results of one run, results/<name>, read when asked for. stated: as of `vocabulary.Names`."""

    every_score = _learned("scores")  # by both definitions of SNR; of a fold alone, too, whose low and high are NaN
    confusion = _learned("confusion")  # counts of predicted classes by target, after columns as of `scores`
    validation = _learned("validation")  # rows as in `scores`, without intervals: the best is chosen by them
    # Columns as the files have them; what was printed stays text, because its decimals say how exactly it was.
    published_scores = _published("results", {"value": str, "snr_db": float})
    published_times = _published("prediction_times")
    published_confusion = _published("confusion")
    published_settings = _published("settings", str)  # columns model, setting, value and source

    def __init__(self, folder, settings, stated):
        models = {name for one in settings["learning"]["experiments"].values() for name in one["models"]}
        self.folder, self.settings, self.names = Path(folder), settings, Names(stated, models)
        self.fields = of_fields(folder, settings)
        self.targets, self.drawn = target_order(settings["targets"]), drawn(settings["targets"])
        # Further poses of targets that move come last.
        every = [*self.targets, *(name for name in settings["targets"] if name not in self.targets)]
        self.meshed = [name for name in every if "field" not in settings["targets"][name]]
        self.drawn_meshes = [name for name in self.drawn if name in self.meshed]
        self.images_are_made = images_are_made(settings)
        self.compares_imagers = self.images_are_made and bool(settings.get("imagers"))
        self.learns = self.images_are_made and bool(settings["learning"]["experiments"])

    polarizations = property(lambda self: self.settings["imaging"]["polarizations"])  # the channels of an image
    definition = property(lambda self: self.settings["noise"]["definition"])  # of SNR
    # As `experiments.runs`, by name; none where no images are made.
    runs = cached_property(lambda self: dict(sorted(runs(self.settings).items())) if self.images_are_made else {})
    # The classes of the known targets, in the order of the page.
    classes = cached_property(lambda self: list(dict.fromkeys(map(self.class_of, self.of_role("known")))))
    # Measures by target that has a mesh; of those that are drawn also vertices in m and triangles of the finest mesh.
    meshes = cached_property(lambda self: {name: _json(self.fields / "mesh" / f"{name}.json") for name in self.meshed})
    finest = property(lambda self: self.settings["mesh"]["bands"] - 1)  # the band of the finest meshes
    surfaces = cached_property(lambda self: {name: self.mesh(name, self.finest) for name in self.drawn_meshes})
    # What the run's solver made of a sphere (see scattering/sphere.py); None where nothing is solved.
    sphere = cached_property(lambda self: _json(self.fields / "scattering/check/sphere.json") if self.meshed else None)
    # Settings tried and the validation accuracy of each, by (run, model), of the models that had a choice.
    searches = cached_property(lambda self: self._fitted("search.csv"))
    # Scores of all folds together, by the config's definition of SNR, and by the thesis's, of which there may be few or
    # none. Of the closed set score and threshold are empty.
    scores = cached_property(lambda self: select(self.every_score, snr_definition=self.definition, fold=""))
    mean_scores = cached_property(lambda self: select(self.every_score, snr_definition=DEFINITION, fold=""))

    def of_role(self, role):
        return [name for name in self.targets if self.settings["targets"][name]["role"] == role]

    def class_of(self, target):
        return class_of(self.settings["targets"], target)

    def mesh(self, target, part):
        """Return vertices in m and triangles of a target's mesh in a band, or of its 'source'."""
        return read_ply(self.fields / "mesh" / f"{target}-{part}.ply")

    def part(self, target, band):
        """Return the part of each triangle of such a mesh, (T,), and {name: no sheet?}; None and {} without parts."""
        part, names = read_parts(self.fields / "mesh" / f"{target}-{band}.ply")
        return part, {name: hides(self.settings["targets"][target]["parts"][name]) for name in names}

    def scattering(self, target):
        """Return the scattering store of a target, opened lazily; of one that moves, its first pose."""
        dataset = open_store(self.fields / "scattering" / f"{target}.zarr")
        return dataset.isel(pose=0, drop=True) if "pose" in dataset.dims else dataset

    def reach(self, target):
        """Return how far from the origin a target reaches, in m; None of one that is given by its field."""
        return self.meshes[target]["source"]["reach"] if target in self.meshed else None

    def every_channel(self, target, store):
        """Return a store of a target's images ('clean', 'snr_-6dB'), opened lazily."""
        return open_store(self.folder / "imaging" / target / f"{store}.zarr")

    def images(self, target, store):
        """Return the same in the first channel alone, which stands for all where one image is shown or compared."""
        return self.every_channel(target, store).isel(channel=0, drop=True, missing_dims="ignore")

    @cached_property
    def opened(self):
        """Names of the experiments that are tested on unknown targets too."""
        return self.names.values(self.scores[self.scores["score"] != ""], "experiment") if self.learns else []

    @cached_property
    def moved(self):
        """Names of the open experiments whose targets are displaced or drift, and no more."""
        limits = {run["experiment"]: {*run["motion"].get("limits", ())} for run in self.runs.values()}
        return [name for name in self.opened if limits[name] and limits[name] <= {"place", "drift"}]

    def rejecting(self, experiments):
        """Return the weighted F1 of rejecting all images of the open set, ascending; of alike values one."""
        known = self.classes
        return self._of_one_answer(experiments, PROTOCOLS, lambda images: images.drop(known, errors="ignore").sum())

    def guessing(self, experiments):
        """Return the same of naming the most frequent class for all images of the closed set."""
        return self._of_one_answer(experiments, [""], lambda images: images.max())

    def _of_one_answer(self, experiments, thresholds, right):
        """right: of how many it is right, from the number of images of each class, or target of none."""
        counts = select(self.confusion, experiment=list(experiments), threshold=thresholds, elevation="all")
        found = {}
        for _, rows in counts.groupby("experiment"):
            # All models, SNRs and confidence scores of an experiment are judged on the same images.
            same = rows.merge(rows[["model", "training", "test_snr_db", "score", "threshold"]].head(1))
            images = same.groupby(same["target"].map(self.class_of))["count"].sum()
            share = float(right(images) / images.sum())
            value = share * 2 * share / (1 + share)  # the answer's precision is its share, and its recall is 1
            found[round(value, 2)] = value
        return sorted(found.values())

    def _fitted(self, file):
        cases = [(run, model) for run, settings in self.runs.items() for model in settings["models"]]
        paths = {case: self.folder.joinpath("learning/models", *case, file) for case in cases}
        return {case: pd.read_csv(path) for case, path in paths.items() if path.exists()}

    @cached_property
    def curves(self):
        """Training curves by (run, model), with the seconds until each epoch; of several folds the first one's."""
        times = self._fitted("seconds.csv")
        curves = {case: of for case, of in self._fitted("curve.csv").items() if self.runs[case[0]]["first"]}
        return {case: of.merge(times[case], on="epoch") if case in times else of for case, of in curves.items()}

    @cached_property
    def decoders(self):
        """(run, model) of all that reconstruct images and are tested on unknown targets; of several folds the first."""
        folder, opened = self.folder / "learning" / "reconstructions", [of for of in self.runs.values() if of["open"]]
        every = [(run["name"], model) for run in opened if run["first"] for model in run["models"]]
        return [(run, model) for run, model in every if (folder / run / f"{model}.zarr").exists()]

    def reconstructions(self, run, model):
        """Return some test images, and what a model makes of them (see learning/evaluation/reconstructions.py)."""
        return open_store(self.folder / "learning" / "reconstructions" / run / f"{model}.zarr")

    def predictions(self, run, model, snr):
        """Return the predictions of a model at one SNR in dB (see learning/predict.py)."""
        path = self.folder / "learning" / "predictions" / run / model / f"{snr_label(snr)}.csv"
        return pd.read_csv(path, keep_default_na=False)

    @cached_property
    def times(self):
        times = _json(self.folder / "learning" / "times.json")
        same = {"machine": times["machine"]["cpu"], "threads": times["threads"]}
        return pd.json_normalize(times["models"])[[*TIMES]].rename(columns=TIMES).assign(**same)

    @cached_property
    def full_size(self):
        """Rows as in `mean_scores` of the repository's full-size runs of the same targets, with their polarizations."""
        parts = [self.mean_scores.iloc[:0].assign(polarizations="")]
        same = [self.of_role(role) for role in ("known", "unknown")] == SIZED_TARGETS
        for run, path in full_size(self.settings["name"]).items() if same else ():
            parts += [select(_sized(path), experiment=of).assign(polarizations=seen) for seen, of in SIZED[run].items()]
        return pd.concat(parts)

    # Rows as in `mean_scores` of the repository's run by family.
    by_family = cached_property(lambda _: _sized(KINDS))

    @cached_property
    def benchmarks(self):
        """Seconds of every job that Snakemake kept a record of: columns run, by whose name it was made, stage and s.

        May be empty. Meshes and fields, and so their jobs, may be another run's.
        """
        rows = []
        for folder, stages in (self.fields, ("mesh", "scattering")), (self.folder, ("imaging", "learning")):
            for stage in stages:
                records = folder / "benchmarks" / stage
                for path in sorted(records.rglob("*.tsv")):
                    if self._is_made(stage, *path.relative_to(records).with_suffix("").parts):
                        seconds = pd.read_csv(path, sep="\t", na_values="-").iloc[-1]["s"]
                        rows.append((folder.name, stage, seconds))
        return pd.DataFrame(rows, columns=["run", "stage", "s"])

    def _is_made(self, *record):
        """Tell whether the config has the job of a record: a folder keeps those of targets that it had before, too."""
        match record:
            case "mesh", target:
                return target in self.meshed
            case "scattering", "check", _:
                return bool(self.meshed)
            case "scattering", "bands", solve:
                target, _, band = solve.rpartition("-")
                return target in self.meshed and int(band) < self.settings["mesh"]["bands"]
            case ("scattering", target) | ("imaging", target, _):
                return target in (*self.settings["targets"], PURE_NOISE)
            case "learning", _, run, _:
                return run in self.runs
            case "learning", _:
                return True
        return False
