"""Experiments of every kind through Snakemake, on fields of point scatterers, and what reruns after an edit."""

import json
import os
import re
import signal
import time

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from test_docs import blocks

from isarflow.core.sweep import C0, azimuths, elevations, frequencies
from isarflow.scattering.fields.store import write_field
from isarflow.setup.check import training_images
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

LEARN = ("--configfile", "config/learn.yaml")
CONFIG = """
name: learn
targets:
  '*': null
  dart: {field: fields/dart.zarr, role: known, symmetry: [xz]}
  disc: {field: fields/disc.zarr, role: known}
  kite: {field: fields/kite.zarr, role: unknown}
  cube: {field: fields/cube.zarr, role: other}
radar: {center_frequency: 1.0e+9, bandwidth: 0.4e+9, frequencies: 6, polarizations: [VV, HH]}
aspect: {elevation: {start: 0, stop: 30, step: 10}, azimuth: {count: 40}}
imaging: {aperture: 5}
noise: {snr_db: [0, 20], realizations: 2}
learning:
  models:
    lr_tuned: {penalty: [0.01, 1]}
    knn: {features: magnitude}
    fcnn: {width: 32, batch: 8, epochs: 10}
    capsule: {width: 8, capsules: 2, decoder: 16, batch: 8}
    capsule_denoise: {epochs: 15}
  experiments:
    '*': null
    closed:
      train: {elevation: [0], snr_db: clean}
      models: [lr_tuned, knn]
    opened:
      train: {elevation: all, snr_db: clean}
      models: [matched_filter, fcnn_other]
      open: true
      channels: [VV]
    far:
      train: {elevation: all, snr_db: clean}
      models: [matched_filter]
      test: {snr_db: [20]}
      split: sector
      folds: [2, 5]
    between:
      train: {elevation: all, snr_db: clean}
      models: [knn]
      open: true
      split: elevation
    moved:
      train: {elevation: all, snr_db: clean}
      models: [matched_filter, knn]
      open: true
      motion: {place: 0.1, missing: 0.2}
    noisy:
      train: {elevation: all, snr_db: {each: [0, 20]}}
      models: [lr]
      upsample: 12
      channels: [VV]
    mixed:
      train: {elevation: all, snr_db: {random: [clean, 20]}}
      models: [fcnn]
      channels: [VV]
    encoded:
      train: {elevation: all, snr_db: {random: [clean, 20]}}
      models: [capsule_denoise, adaptive_filter]
      open: true
      upsample: 18
"""
RUNS = {
    "closed": ["lr_tuned", "knn"],
    "opened": ["matched_filter", "fcnn_other"],
    "far_fold2": ["matched_filter"],
    "far_fold5": ["matched_filter"],
    "between_fold1": ["knn"],
    "between_fold2": ["knn"],
    "moved": ["matched_filter", "knn"],
    "noisy_snr_0dB": ["lr"],
    "noisy_snr_20dB": ["lr"],
    "mixed": ["fcnn"],
    "encoded": ["capsule_denoise", "adaptive_filter"],
}
FITTED = [f"{run}/{model}" for run, models in RUNS.items() for model in models]
# Point scatterers in metres: every target has its own.
POINTS = {
    "dart": [(0.4, 0, 0), (-0.3, 0.1, 0), (-0.3, -0.1, 0)],
    "disc": [(0.05, 0, 0)],
    "kite": [(0.2, 0.2, 0), (-0.2, 0.2, 0), (0.2, -0.3, 0)],
    "cube": [(0.1, 0.1, 0.1), (-0.1, 0.1, -0.1)],
}


def with_fields(project, name, text, points):
    """The project with config/<name>.yaml, this text, and the fields of these point scatterers that it takes."""
    (project.folder / "fields").mkdir()
    config = read_yaml(project.folder / project.write(f"config/{name}.yaml", text))
    sweep = frequencies(config["radar"]), elevations(config["aspect"]), azimuths(config["aspect"])
    el, az = np.meshgrid(np.radians(sweep[1]), np.radians(sweep[2]), indexing="ij")
    direction = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)
    k = 2 * np.pi * sweep[0] / C0
    for target, places in points.items():
        nearer = direction @ np.array(places).T
        echoes = np.exp(2j * k[:, None, None, None] * nearer)
        # In HH scatterers are the weaker the farther back they lie, on both sides alike.
        field = np.stack([echoes.sum(axis=-1), echoes @ (0.5 + np.array(places)[:, 0])])
        path = project.folder / f"fields/{target}.zarr"
        write_field(path, field.astype(np.complex64), ["VV", "HH"], *sweep, {"formulation": "points"})
    return project


@pytest.fixture(scope="module")
def project(project_of):
    project = with_fields(project_of("learn"), "learn", CONFIG, POINTS)
    finished = project.run("--cores", 2, "report", *LEARN)
    assert finished.returncode == 0, finished.stdout
    assert "Traceback" not in finished.stdout  # nor from a library that says goodbye
    return project


@pytest.fixture
def results(project):
    return project.folder / "results/learn"


def test_models_learn_from_as_many_images_as_a_config_is_checked_for(project, results, monkeypatch):
    monkeypatch.chdir(project.folder)
    config = load_config(read_yaml("config/learn.yaml"))
    for path in results.glob("learning/models/*/*/config.json"):
        fitted = json.loads(path.read_text())
        settings = config["learning"]["models"][fitted["model"]]
        assert sum(fitted["observations"].values()) == training_images(config, fitted["run"], settings)


@pytest.fixture
def restored(project):
    path = project.folder / "config/learn.yaml"
    text = path.read_text()
    yield project
    path.write_text(text)


@pytest.fixture(scope="module")
def scores(project):
    table = pd.read_csv(project.folder / "results/learn/learning/scores.csv")
    return table.fillna({"score": "", "threshold": ""})


def test_every_run_has_its_models_and_predictions(results):
    for fitted in FITTED:
        assert json.loads((results / f"learning/models/{fitted}/config.json").read_text())["model"]
        tested = (20,) if fitted.startswith("far") else (0, 20)
        for snr in tested:
            assert len(pd.read_csv(results / f"learning/predictions/{fitted}/snr_{snr}dB.csv"))
        assert len([*(results / f"learning/predictions/{fitted}").iterdir()]) == len(tested)
    assert (results / "learning/models/mixed/fcnn/curve.csv").exists()
    assert len(pd.read_csv(results / "learning/models/closed/lr_tuned/search.csv")) == 2
    shapes = {
        run: json.loads((results / f"learning/models/{run}/config.json").read_text())["image_shape"] for run in FITTED
    }
    assert shapes["noisy_snr_0dB/lr"] == [12, 12] and shapes["mixed/fcnn"] == [6, 5]
    assert shapes["far_fold2/matched_filter"] == [2, 6, 5] and shapes["encoded/capsule_denoise"] == [2, 18, 18]


def test_the_scores_name_experiment_split_and_training_snr(scores):
    found = set(map(tuple, scores[["experiment", "model", "split", "training"]].drop_duplicates().to_numpy()))
    assert found == {
        ("moved", "knn", "random, moved", "clean"),
        ("moved", "matched_filter", "random, moved", "clean"),
        ("closed", "lr_tuned", "random", "clean"),
        ("closed", "knn", "random", "clean"),
        ("opened", "matched_filter", "random", "clean"),
        ("opened", "fcnn_other", "random", "clean"),
        ("far", "matched_filter", "sector", "clean"),
        ("between", "knn", "elevation", "clean"),
        ("noisy", "lr", "random", "0 dB"),
        ("noisy", "lr", "random", "20 dB"),
        ("mixed", "fcnn", "random", "random: clean, 20 dB"),
        ("encoded", "capsule_denoise", "random", "random: clean, 20 dB"),
        ("encoded", "adaptive_filter", "random", "random: clean, 20 dB"),
    }
    assert set(scores.loc[scores["score"] != "", "experiment"]) == {"opened", "encoded", "between", "moved"}
    assert set(scores["threshold"]) == {"", "thesis", "blind", "kept"}


def test_every_run_is_judged_on_validation_images(project, scores):
    found = pd.read_csv(project.folder / "results/learn/learning/validation.csv").fillna({"score": "", "threshold": ""})
    method = ["experiment", "model", "split", "training", "test_snr_db", "elevation", "score", "threshold"]
    judged = scores[(scores["metric"] == "f1_weighted") & ((scores["score"] == "") | (scores["threshold"] != ""))]
    assert set(map(tuple, found.query("metric == 'f1_weighted'")[method].to_numpy())) == set(
        map(tuple, judged[method].to_numpy())
    )
    assert set(found["metric"]) == {"accuracy", "f1_weighted"} and found["value"].between(0, 1).all()


def test_by_elevation_both_folds_train_on_the_same_and_test_what_is_between(results, scores):
    for fold, tested in ((1, 10), (2, 30)):
        model = results / f"learning/models/between_fold{fold}/knn"
        sides = json.loads((model / "split.json").read_text())["targets"]["dart"]
        assert {name: side["elevation"] for name, side in sides.items()} == {
            "train": [0, 20],
            "validation": [40 - tested],
            "test": [tested],
        }
        table = pd.read_csv(results / f"learning/predictions/between_fold{fold}/knn/snr_20dB.csv")
        assert set(table.loc[table["side"] == "test", "elevation"]) == {tested}
    rows = scores.query("experiment == 'between' and metric == 'f1_weighted' and threshold == 'blind'")
    rows = rows.query("test_snr_db == 20 and snr_definition == 'peak_3db'")
    assert sorted(rows["fold"].fillna(0)) == [0, 1, 2]
    assert rows.loc[rows["fold"].isna(), "n"].item() == 3 * 2 * 40  # three targets at two elevations, each once
    assert rows.loc[rows["fold"].isna(), "low"].notna().all()


def test_models_learn(scores):
    accuracy = scores.query("metric == 'accuracy' and score == '' and test_snr_db == 20 and elevation == 'all'")
    accuracy = accuracy.set_index(["experiment", "model"])["value"]
    assert accuracy["opened", "matched_filter"] > 0.9 and accuracy["mixed", "fcnn"] > 0.8
    auroc = scores.query("metric == 'auroc' and test_snr_db == 20 and experiment != 'moved'")
    auroc = auroc.set_index(["model", "score"])["value"]
    assert auroc["matched_filter", "correlation"] > 0.8


def test_pure_noise_is_an_image_store_of_its_own(results):
    noise = xr.open_zarr(results / "imaging/pure-noise/clean.zarr").load()
    like = xr.open_zarr(results / "imaging/dart/clean.zarr").load()
    assert noise.image.dims == like.image.dims and noise.image.shape == like.image.shape
    assert noise.image.dims == ("elevation", "azimuth", "channel", "range", "crossrange")
    np.testing.assert_allclose(np.abs(noise.image).max(["channel", "range", "crossrange"]), 1, rtol=1e-6)
    # Neighbouring images of noise have nothing in common, unlike those of a target.
    flat = noise.image.values.reshape(4, 40, -1)
    flat = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
    correlation = np.abs((flat[:, 1:] * flat[:, :-1].conj()).sum(axis=-1))
    assert correlation.mean() < 0.4


def test_reconstructions_are_stored_beside_the_truth(results):
    store = xr.open_zarr(results / "learning/reconstructions/encoded/capsule_denoise.zarr").load()
    assert store.sizes == {"target": 3, "example": 5, "range": 18, "crossrange": 18, "snr": 2}
    assert store.target.values.tolist() == ["dart", "disc", "kite"] and store.snr.values.tolist() == [0, 20]
    assert store.predicted.dtype.kind == "U" and set(store.predicted.values.ravel()) <= {"dart", "disc"}
    # What the network sees at 20 dB is nearly the truth, at 0 dB it is not.
    error = ((store.seen - store.truth) ** 2).mean(["target", "example", "range", "crossrange"]).values
    assert error[1] < 0.2 * error[0]
    assert not (results / "learning/checkpoints").exists()


def test_the_report_has_every_experiment(results):
    page = (results / "report/index.html").read_text()
    for name in ("closed", "opened", "far", "between", "moved", "noisy", "mixed", "encoded"):
        assert f'id="figure-learning_{name}"' in page
    assert 'id="figure-open_opened"' in page and 'id="table-tried"' in page


def test_targets_that_move_have_images_of_their_own_and_are_found(results):
    """Predictions say where the library found a target; the images without noise are those of the turntable."""
    folder = results / "moved/missing_0.2_place_0.1"
    assert sorted(path.name for path in folder.glob("dart/*")) == ["snr_0dB.zarr", "snr_20dB.zarr"]
    store = xr.open_zarr(folder / "dart/snr_20dB.zarr").load()
    assert store.received.dims == ("realization", "elevation", "azimuth", "pulse")
    table = pd.read_csv(results / "learning/predictions/moved/matched_filter/snr_20dB.csv")
    assert {"found_range", "found_crossrange"} <= {*table} and not {"found_drift", "received"} & {*table}
    dart = table[(table.truth == "dart") & (table.predicted == "dart")]
    place = store.place_range.sel(realization=0).to_series().rename("place")
    joined = dart.round(3).merge(place.reset_index().round(3), on=["elevation", "azimuth"])
    assert len(joined) > 20 and np.corrcoef(joined.found_range, joined.place)[0, 1] > 0.8
    scores = pd.read_csv(results / "learning/scores.csv")
    assert set(scores[scores.experiment == "moved"].split) == {"random, moved"}


def test_nothing_reruns_by_itself(project):
    assert project.planned("report", *LEARN) == {}


UNLIKE = ("times.json", "seconds.csv")  # files that are others in every run
TABLES = ("scores.csv", "confusion.csv", "validation.csv")
PREDICT = {"predict": 13, "predict_2": 2}  # the latter where some SNRs are tested
AFTER_TEST = {"scores": 1, "report": 1}
AFTER = {"timing": 1, "scores": 1, "report": 1}
MOVED = {"noise": 4, "train": 2, "predict": 2, **AFTER}  # of one experiment
# Beside the edits of test_smoke.py, those that only many experiments show.
EDITS = {
    "a training SNR": ("{each: [0, 20]}", "{each: [0, 20, clean]}", {"train": 1, "predict": 1, **AFTER}),
    "all SNRs tested": ("      test: {snr_db: [20]}\n", "", AFTER_TEST | {"predict": 2}),
    "SNRs in another order": ("{random: [clean, 20]}", "{random: [20, clean]}", {"report": 1}),
    "a hyper-parameter": ("epochs: 10", "epochs: 9", {"train": 2, "predict": 2, **AFTER}),
    "a choice": ("penalty: [0.01, 1]", "penalty: [0.01, 2]", {"train": 1, "predict": 1, **AFTER}),
    "choices in another order": ("penalty: [0.01, 1]", "penalty: [1, 0.01]", {}),
    "another split": ("      split: sector\n      folds: [2, 5]\n", "", {"train": 1, "predict_2": 1, **AFTER}),
    "one more fold": ("folds: [2, 5]", "folds: [2, 5, 6]", {"train": 1, "predict_2": 1, "scores": 1, "report": 1}),
    "between elevations no more": ("      split: elevation\n", "", {"train": 1, "predict": 1, **AFTER}),
    "more arcs": ("learning:\n", "learning:\n  split: {folds: 7}\n", {"train": 2, "predict_2": 2, **AFTER}),
    "realizations tested": (
        "learning:\n",
        "learning:\n  realizations: all\n",
        {**PREDICT, "scores": 1, "report": 1},
    ),
    "closed": ("      open: true\n", "", AFTER_TEST | {"predict": 2}),
    "channels of an experiment": (
        "[lr_tuned, knn]\n",
        "[lr_tuned, knn]\n      channels: [HH]\n",
        {"train": 2, "predict": 2, **AFTER},
    ),
    "channels of all images": (
        "imaging: {aperture: 5}",
        "imaging: {aperture: 5, polarizations: [VV]}",
        {"image": 4, "noise": 8, "pure_noise": 1, "train": 15, **PREDICT, "reconstruct": 1, **AFTER},
    ),
    "the default split's share": (
        "learning:\n",
        "learning:\n  split: {train: 0.6}\n",
        {"train": 11, "predict": 11, "reconstruct": 1, **AFTER},
    ),
    "the seed": (
        "name: learn\n",
        "name: learn\nseed: 4\n",
        {"noise": 8, "pure_noise": 1, "train": 15, **PREDICT, "reconstruct": 1, **AFTER},
    ),
    "how far its targets are displaced": ("place: 0.1,", "place: 0.12,", MOVED),
    "how many pulses are lost": ("missing: 0.2", "missing: 0.3", MOVED),
    "targets that drift as well": ("missing: 0.2", "missing: 0.2, drift: 0.1", MOVED),
    "a turn that is not known": ("missing: 0.2", "missing: 0.2, turn: 0.05", MOVED),
    "pulses that jitter": ("missing: 0.2", "missing: 0.2, jitter: 0.02", MOVED),
    "no motion": ("      motion: {place: 0.1, missing: 0.2}\n", "", {"train": 2, "predict": 2, **AFTER}),
    "the motion of all": (
        "learning:\n",
        "motion: {place: 0.1}\nlearning:\n",
        {"noise": 4, "train": 13, "predict": 11, "predict_2": 2, "reconstruct": 1, **AFTER},
    ),
    "an unknown target": (
        "  cube:",
        "  bird: {field: fields/cube.zarr, role: unknown}\n  cube:",
        {"field": 1, "image": 1, "noise": 2, "predict": 8, "reconstruct": 1, "scores": 1, "report": 1},
    ),
}


@pytest.mark.parametrize("case", EDITS)
def test_an_edit_reruns_what_it_concerns_and_no_more(restored, case):
    old, new, expected = EDITS[case]
    text = (restored.folder / "config/learn.yaml").read_text()
    assert old in text
    restored.write("config/learn.yaml", text.replace(old, new, 1))
    assert restored.planned("report", *LEARN) == expected


def test_the_code_of_a_model_reruns_its_own_jobs(project):
    path = project.folder / "isarflow/learning/models/fcnn.py"
    text = path.read_text()
    path.write_text(text + "ADDED = 1\n")
    found = project.planned("report", *LEARN)
    path.write_text(text)
    assert found == {"train": 2, "predict": 2, **AFTER}


def test_a_model_of_ones_own_is_one_file(restored):
    restored.write(
        "own/mine.py",
        '''"""The class with the more similar mean magnitude."""

import numpy as np

from isarflow.learning.classifier import Classifier, Outcome


class Model(Classifier):
    def fit(self, images, labels, validation=None, snrs=None, views=None):
        self.classes_ = np.unique(labels)
        self.means_ = np.stack([np.abs(images[labels == name]).mean(axis=0) for name in self.classes_])
        return self

    def evaluate(self, images):
        scores = -np.stack([((np.abs(images) - mean) ** 2).sum(axis=(1, 2)) for mean in self.means_], axis=1)
        return Outcome(self.classes_[scores.argmax(axis=1)], scores, {"likeness": scores.max(axis=1)})
''',
    )
    (forest,) = [code for code in blocks("adding-a-model.md", "python") if "RandomForest" in code]
    (restored.folder / "isarflow/learning/models/forest.py").write_text(forest)
    restored.edit(
        "config/learn.yaml",
        "models: [matched_filter, fcnn_other]",
        "models: [matched_filter, fcnn_other, mine, forest]",
    )
    restored.edit(
        "config/learn.yaml",
        "    fcnn: {width",
        "    mine: {kind: own/mine.py}\n    forest: {trees: 20}\n    fcnn: {width",
    )
    assert restored.planned("report", *LEARN) == {"train": 2, "predict": 2, **AFTER}
    finished = restored.run("--cores", 2, "results/learn/learning/scores.csv", *LEARN)
    assert finished.returncode == 0, finished.stdout
    scores = pd.read_csv(restored.folder / "results/learn/learning/scores.csv")
    aurocs = scores[scores["metric"] == "auroc"].set_index(["model", "score"])["value"]
    for own in (("mine", "likeness"), ("forest", "probability")):
        assert (aurocs.loc[[own]] > 0).all()


# The last: it makes everything of learning anew.
def test_after_a_kill_and_on_one_core_the_bytes_are_the_same(project, results):
    """A checkpoint after every epoch and kill -9 after one; then one core does all, and goes on from the checkpoint.

    The code that is edited for it leaves all of learning stale.
    """

    def content():
        folder = results / "learning"
        kept = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in UNLIKE]
        return {str(path.relative_to(folder)): path.read_bytes() for path in kept if "snakemake" not in path.name}

    before, name = content(), "encoded/capsule_denoise"
    model, loop = results / "learning/models" / name, "isarflow/learning/networks/training_loop.py"
    project.edit(loop, "BETWEEN = 20.0", "BETWEEN = 0.0")
    every = project.folder / "isarflow/learning/train.py"  # the loop is that of networks alone
    every.write_bytes(every.read_bytes() + b"\nADDED = 1\n")
    run = project.start("--cores", 1, model.relative_to(project.folder), *LEARN, start_new_session=True)
    while not list((results / "learning/checkpoints" / name).glob("*.joblib")):
        assert run.poll() is None, "the run ended before it could be killed"
        time.sleep(0.05)
    os.killpg(run.pid, signal.SIGKILL)
    run.communicate()
    assert not (model / "model.npz").exists()
    scores = f"{results.relative_to(project.folder)}/learning/scores.csv"
    finished = project.run("--cores", 1, scores, "--forcerun", "noise", "pure_noise", *LEARN)
    assert finished.returncode == 0, finished.stdout
    log = (results / f"logs/learning/train/{name}.log").read_text()
    assert re.search(r"goes on after epoch \d+, from results/learn/learning/checkpoints", log)
    assert not (results / "learning/checkpoints").exists()
    assert len(re.findall(r"train \S+/\S+ \(progress in", finished.stdout)) >= 10
    after = content()
    assert after[f"models/{name}/model.npz"] == before[f"models/{name}/model.npz"]
    mine = {name for name in before if "/mine/" in name or "/forest/" in name or name in (*TABLES, "scores.json")}
    assert {name for name in after if before.get(name) != after[name]} <= mine
