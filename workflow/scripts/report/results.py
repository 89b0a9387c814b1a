"""Read what the other stages made, as far as the page shows it."""

import json
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from isarflow.core.folders import ROOT, of_fields
from isarflow.core.store import open_store
from isarflow.core.sweep import images_are_made, snr_label, sweeps
from isarflow.imaging.geometry import PURE_NOISE
from isarflow.learning.classifier import OTHER
from isarflow.learning.experiments import runs
from isarflow.learning.metrics import metrics_of
from isarflow.mesh.io import read_ply
from isarflow.report.selection import target_order
from isarflow.report.thesis import DEFINITION
from isarflow.report.vocabulary import PROTOCOLS, Names, select
from isarflow.scattering import needs

REFERENCE = ROOT / "resources" / "reference"  # published values
FULL_SIZE = REFERENCE.parent / "results"  # of the run of config/thesis.yaml, once it is made


class Results:
    """The results of one run, read when they are asked for.

    folder: results/<name>. settings: the config's sections. stated: what the models' files say of themselves (see
    `vocabulary.Names`). The latter two are the rule's params.
    """

    def __init__(self, folder, settings, stated):
        self.folder, self.settings, self.names = Path(folder), settings, Names(stated, _models(settings))
        self.fields = of_fields(folder, settings)
        self.targets = target_order(settings["targets"])
        self.meshed = [name for name in self.targets if "mesh" in settings["targets"][name]]
        self.images_are_made = images_are_made(settings)
        self.learns = self.images_are_made and bool(settings["learning"]["experiments"])

    def of_role(self, role):
        """The names of the targets of a role."""
        return [name for name in self.targets if self.settings["targets"][name]["role"] == role]

    @cached_property
    def runs(self):
        """What each run trains on and is tested on, by its name (see `experiments.runs`)."""
        return dict(sorted(runs(self.settings).items()))

    @cached_property
    def meshes(self):
        """Measures of the meshes and, in each band, what its `solve` was planned to need, by target that has some."""
        meshes = {name: json.loads((self.fields / "mesh" / f"{name}.json").read_text()) for name in self.meshed}
        for name, measures in meshes.items():
            planes, how = len(self.settings["targets"][name].get("symmetry", [])), needs.method(self.settings, name)
            stages = ("radar", "aspect", "mesh", "scattering")
            radar, aspect, mesh, scattering = (self.settings[name] for name in stages)
            asked = sweeps(radar, aspect, mesh["bands"], scattering)
            for band, sweep in zip(measures["bands"], asked, strict=True):
                band["solve"] = needs.need(band, planes, sweep, how)
        return meshes

    def mesh(self, target, part):
        """Vertices in m and triangles of a target's mesh in a band, or of its 'source'."""
        return read_ply(self.fields / "mesh" / f"{target}-{part}.ply")

    @cached_property
    def surfaces(self):
        """Vertices in m and triangles of the finest mesh, by target that has one."""
        return {name: self.mesh(name, self.settings["mesh"]["bands"] - 1) for name in self.meshed}

    @cached_property
    def sphere(self):
        """What the run's solver made of a sphere (see scattering/sphere.py); None where nothing is solved."""
        path = self.fields / "scattering" / "check" / "sphere.json"
        return json.loads(path.read_text()) if self.meshed else None

    def scattering(self, target):
        """The scattering store of a target, opened lazily."""
        return open_store(self.fields / "scattering" / f"{target}.zarr")

    def reach(self, target):
        """How far from the origin a target reaches, in m; None of one that is given by its field."""
        return self.meshes[target]["source"]["reach"] if target in self.meshed else None

    def every_channel(self, target, store):
        """A store of a target's images ('clean', 'snr_-6dB'), opened lazily: only the images shown are read."""
        return open_store(self.folder / "imaging" / target / f"{store}.zarr")

    def images(self, target, store):
        """The same in the first channel alone, which stands for all where one image is shown or compared."""
        dataset = self.every_channel(target, store)
        return dataset.isel(channel=0, drop=True) if "channel" in dataset.dims else dataset

    @property
    def polarizations(self):
        """The channels of an image."""
        return self.settings["imaging"]["polarizations"]

    @property
    def definition(self):
        """The config's definition of SNR."""
        return self.settings["noise"]["definition"]

    @cached_property
    def _every_score(self):
        return self._learning_table("scores")

    @cached_property
    def scores(self):
        """Scores of the test images of all folds together, by the config's definition of SNR.

        score and threshold are empty text in the rows of the closed set; low and high are NaN for a single fold.
        """
        return select(self._every_score, snr_definition=self.definition, fold="")

    @cached_property
    def fold_scores(self):
        """Accuracy and weighted F1 of each fold's test images alone; `fold` is its number as text, low and high NaN."""
        return self._every_score[self._every_score["fold"] != ""]

    @cached_property
    def mean_scores(self):
        """Rows as in `scores` by the reference thesis's definition of SNR, the mean power.

        Where the config's is another one, only accuracy and F1, and maybe none at all.
        """
        return select(self._every_score, snr_definition=DEFINITION, fold="")

    @cached_property
    def by_definition(self):
        """Rows as in `scores` by each definition of SNR, the config's first: a mapping; the other's may be few."""
        every = self._every_score
        names = sorted(every["snr_definition"].unique(), key=lambda name: (name != self.definition, name))
        return {name: select(every, snr_definition=name, fold="") for name in names}

    @cached_property
    def confusion(self):
        """Counts of predicted classes by target, with the columns of `scores` before them."""
        return self._learning_table("confusion")

    @cached_property
    def validation(self):
        """Accuracy and weighted F1 on validation images, to choose the best by; rows as in `scores`, no intervals."""
        return self._learning_table("validation")

    def _learning_table(self, name):
        return _read_learning(self.folder / "learning" / f"{name}.csv")

    @cached_property
    def opened(self):
        """Names of the experiments that are tested on unknown targets too."""
        return self.names.values(self.scores[self.scores["score"] != ""], "experiment") if self.learns else []

    @cached_property
    def _rejecting(self):
        """The weighted F1 of rejecting every test image of the open set, by experiment: from each target's images."""
        counts = select(self.confusion, threshold=PROTOCOLS, elevation="all")
        # Every model and confidence score is judged on the same images.
        case = ["model", "training", "test_snr_db", "score", "threshold"]
        images = {
            experiment: rows.merge(rows[case].iloc[:1], on=case).groupby("target")["count"].sum()
            for experiment, rows in counts.groupby("experiment")
        }
        return {experiment: rejecting_f1(count, self.of_role("known")) for experiment, count in images.items()}

    def guessing(self, experiments):
        """The weighted F1 of naming one class for all images of the closed set, ascending; of alike values one."""
        counts = select(self.confusion, threshold="", score="", elevation="all", experiment=list(experiments))
        found = {}
        for _, rows in counts.groupby("experiment"):
            # Every model and SNR is judged on the same images.
            case = ["model", "training", "test_snr_db"]
            images = rows.merge(rows[case].iloc[:1], on=case).groupby("target")["count"].sum()
            share = images.max() / images.sum()
            found[round(share, 2)] = share * 2 * share / (1 + share)  # precision is its share, recall is 1
        return sorted(found.values())

    def rejecting(self, experiments):
        """The same of these experiments, ascending; of values that are alike to two decimals one."""
        return sorted({round(value, 2): value for value in map(self._rejecting.get, experiments)}.values())

    @cached_property
    def folds(self):
        """The numbers of the folds that each experiment is tested on; 0 for one split at random, which has none."""
        folds = {}
        for run in self.runs.values():
            folds.setdefault(run["experiment"], set()).add(run["division"]["fold"])
        return {experiment: sorted(numbers) for experiment, numbers in folds.items()}

    def _fitted(self, file):
        """(run, model, path) of every fitted model that has such a file."""
        for run, settings in self.runs.items():
            for model in settings["models"]:
                path = self.folder / "learning" / "models" / run / model / file
                if path.exists():
                    yield run, model, path

    @cached_property
    def curves(self):
        """Training curves by (run, model), with the seconds until each epoch; of several folds the first one's."""
        curves = {}
        for run, model, path in self._fitted("curve.csv"):
            if self.runs[run]["first"]:
                curves[run, model] = pd.read_csv(path)
                seconds = path.with_name("seconds.csv")
                if seconds.exists():
                    curves[run, model] = curves[run, model].merge(pd.read_csv(seconds), on="epoch")
        return curves

    @cached_property
    def searches(self):
        """Settings tried and the validation accuracy of each, by (run, model), of the models that had a choice."""
        return {(run, model): pd.read_csv(path) for run, model, path in self._fitted("search.csv")}

    @cached_property
    def decoders(self):
        """(run, model) of the models that reconstruct images, in runs that are tested on unknown targets.

        Of several folds the first.
        """
        return [
            (run, model)
            for run, settings in self.runs.items()
            for model in settings["models"]
            if settings["open"] and settings["first"] and self._reconstructions(run, model).exists()
        ]

    def _reconstructions(self, run, model):
        return self.folder / "learning" / "reconstructions" / run / f"{model}.zarr"

    def reconstructions(self, run, model):
        """Some test images, and what a model makes of them (see learning/reconstructions.py)."""
        return open_store(self._reconstructions(run, model))

    def predictions(self, run, model, snr):
        """The predictions of a model at one SNR in dB (see learning/predict.py)."""
        path = self.folder / "learning" / "predictions" / run / model / f"{snr_label(snr)}.csv"
        return pd.read_csv(path, keep_default_na=False)

    @cached_property
    def times(self):
        """Prediction times: a row per run and model."""
        times = json.loads((self.folder / "learning" / "times.json").read_text())
        return pd.DataFrame(
            {
                **{key: record[key] for key in ("experiment", "run", "model", "training_observations")},
                "single_ms": record["single"]["milliseconds_per_observation"],
                "batch_ms": record["batch"]["milliseconds_per_observation"],
                "batch_size": record["batch"]["size"],
                "machine": times["machine"]["cpu"],
                "threads": times["threads"],
            }
            for record in times["models"]
        )

    @cached_property
    def full_size(self):
        """The scores of the full-size run that the repository keeps, with `scores`, `validation` and `definition`.

        None while it keeps none, and for that run itself.
        """
        paths = [FULL_SIZE / f"{name}.csv.xz" for name in ("scores", "validation")]
        if self.settings["name"] == "thesis" or not all(path.exists() for path in paths):
            return None
        scores, validation = map(_read_learning, paths)
        scores = select(scores, snr_definition=DEFINITION, fold="")
        return SimpleNamespace(scores=scores, validation=validation, definition=DEFINITION)

    @cached_property
    def published_scores(self):
        """Published scores; `value` stays text, because its decimals say how exactly it was printed."""
        table = pd.read_csv(REFERENCE / "thesis_results.csv", dtype={"value": str}, keep_default_na=False)
        return table.astype({"snr_db": float})

    @cached_property
    def published_times(self):
        return pd.read_csv(REFERENCE / "thesis_prediction_times.csv", keep_default_na=False)

    @cached_property
    def published_galleries(self):
        """What the figures of images show that were published, by target."""
        return pd.read_csv(REFERENCE / "thesis_galleries.csv", dtype=str)

    @cached_property
    def published_confusion(self):
        return pd.read_csv(REFERENCE / "thesis_confusion.csv")

    @cached_property
    def published_settings(self):
        """Hyper-parameters: columns model, setting, value (text, as it was printed) and source."""
        return pd.read_csv(REFERENCE / "thesis_settings.csv", dtype=str, keep_default_na=False)

    @cached_property
    def benchmarks(self):
        """Seconds and peak memory of every job that kept a record: columns step, job, s, max_rss. May be empty."""
        rows, folder = [], self.folder / "benchmarks"
        # The folder may still hold records of targets and experiments that the config no longer names.
        named = {*self.targets, PURE_NOISE, *self.runs}
        for path in sorted(folder.rglob("*.tsv")):
            step, *job = path.relative_to(folder).with_suffix("").parts
            if step == "learning":
                step, *job = job
            # Solves stand in a folder of their own, <target>-<band>: a target's name may hold hyphens, too.
            whose = job[1].rpartition("-")[0] if job[:1] == ["bands"] else "".join(job[:1])
            if step not in ("report", "thesis_page") and (not job or whose in named):
                line = pd.read_csv(path, sep="\t", na_values="-").iloc[-1]
                rows.append({"step": step, "job": "/".join(job), "s": line["s"], "max_rss": line["max_rss"]})
        return pd.DataFrame(rows, columns=["step", "job", "s", "max_rss"])


def _models(settings):
    """The names of all models that an experiment has."""
    return {model for experiment in settings["learning"]["experiments"].values() for model in experiment["models"]}


def _read_learning(path):
    """A table of the learning stage. Columns of text stay text where they are empty."""
    text = dict.fromkeys(("elevation", "training", "score", "threshold", "fold"), str)
    numbers = {column: [""] for column in ("train_snr_db", "test_snr_db", "value", "low", "high")}
    return pd.read_csv(path, dtype=text, keep_default_na=False, na_values=numbers)  # a target may be called NA


def rejecting_f1(images, known):
    """The weighted F1 of rejecting everything. images: how many each target has; known: names of known targets."""
    labels = [*(name for name in images.index if name in known), OTHER]
    counts = np.zeros((len(labels), len(labels)))
    for name, count in images.items():
        counts[labels.index(name) if name in labels else -1, -1] += count
    return float(metrics_of(counts, labels, labels)["f1_weighted"])
