import hashlib
import json
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from common.errors import InputError
from learning import images, timing
from learning.predict import classify, predict
from learning.train import build, fit, load, train

SPLIT = {"scheme": "random", "train": 0.7}
ELEVATION, AZIMUTHS, RANGE, CROSSRANGE = [-15.0, 0.0, 15.0], 24, 6, 5
ALL = {"elevation": "all", "snr_db": "clean"}
SETTINGS = {"lr": {"penalty": 0.1}, "svm": {"C": 930.66, "scale": 2.75}, "knn": {"k": 1}}


def aspects():
    return np.arange(AZIMUTHS) * (360 / AZIMUTHS)


def scene(name):
    """A target's images (elevation, azimuth, range, crossrange): its own bright cell, sides that turn with azimuth."""
    cell = {"dart": (1, 1), "disc": (4, 3), "cube": (2, 4), "wing": (3, 0)}[name]
    images = np.zeros((len(ELEVATION), AZIMUTHS, RANGE, CROSSRANGE), np.complex64)
    images[..., *cell] = 1
    turn = np.exp(1j * np.deg2rad(aspects()))
    images[..., 0, 2] = 0.3 * turn
    images[..., 5, 2] = 0.2 * np.deg2rad(np.array(ELEVATION))[:, None] * turn.conj()
    return images


def write(path, images, azimuth):
    """A store as the imaging stage writes it; images with five dimensions have noise realizations in front."""
    names = ["realization", "elevation", "azimuth", "range", "crossrange"][-images.ndim :]
    coordinates = {"elevation": ELEVATION, "azimuth": azimuth}
    coordinates |= {"range": np.arange(RANGE) * 0.1, "crossrange": np.arange(CROSSRANGE) * 0.1}
    if images.ndim == 5:
        coordinates["realization"] = np.arange(len(images))
    xr.Dataset({"image": (names, images.astype(np.complex64))}, coordinates).to_zarr(path, mode="w", zarr_format=2)


def noisy(name, snr_db, realizations=2):
    """The target's images with white noise whose power is `snr_db` below the brightest cell's."""
    clean = scene(name)
    random = np.random.default_rng([7, *name.encode()])
    parts = random.standard_normal((2, realizations, *clean.shape)) * np.sqrt(10 ** (-snr_db / 10) / 2)
    return clean + parts[0] + 1j * parts[1]


@pytest.fixture(scope="session")
def stores(tmp_path_factory):
    """A function of label and target names: the stores of images, made once."""
    folder = tmp_path_factory.mktemp("results") / "imaging"
    snrs = {"snr_30dB": 30, "snr_0dB": 0, "snr_-6dB": -6}

    def make(label, targets=("dart", "disc")):
        paths = []
        for name in targets:
            path = folder / name / f"{label}.zarr"
            if not path.exists():
                images = scene(name) if label == "clean" else noisy(name, snrs[label])
                write(path, images / np.abs(images).max(axis=(-2, -1), keepdims=True), aspects())
            paths.append(str(path))
        return paths

    return make


def fitted(stores, folder, name="knn", selection=ALL, seed=0, experiment="multi"):
    train(stores, experiment, name, selection, SETTINGS[name], SPLIT, seed, folder)
    return folder


def digest(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def test_rows_carry_where_they_come_from(stores):
    rows = images.read(stores("snr_0dB", ("disc", "dart")), aspects()[[3, 5]], [15])
    assert rows.target.tolist() == ["dart"] * 4 + ["disc"] * 4
    assert rows.azimuth.tolist() == [45, 45, 75, 75] * 2
    assert rows.realization.tolist() == [0, 1] * 4
    assert set(rows.elevation) == {15}
    with xr.open_zarr(stores("snr_0dB", ["disc"])[0]) as dataset:
        expected = dataset["image"].sel(realization=1, elevation=15, azimuth=75).values
    np.testing.assert_array_equal(rows.images[7], expected)


def test_an_angle_that_no_store_has_is_named(stores):
    with pytest.raises(InputError, match=r"dart.clean\.zarr has no elevation 7 degrees; it has -15, 0, 15"):
        images.read(stores("clean"), aspects()[:2], [7])


def test_images_that_are_not_finite_are_refused(tmp_path):
    broken = scene("dart")
    broken[0, 0, 1, 1] = np.nan
    write(tmp_path / "dart" / "clean.zarr", broken, aspects())
    with pytest.raises(InputError, match="not finite"):
        images.read([tmp_path / "dart" / "clean.zarr"], aspects())


def test_the_model_folder(stores, tmp_path):
    fitted(stores("clean"), tmp_path / "knn", selection={"elevation": [0], "snr_db": "clean"})
    config = json.loads((tmp_path / "knn" / "config.json").read_text())
    train_count = int(0.7 * AZIMUTHS)
    assert config["classes"] == ["dart", "disc"]
    assert config["observations"] == {"dart": train_count, "disc": train_count}
    assert (config["model"], config["settings"], config["image_shape"]) == ("knn", {"k": 1}, [RANGE, CROSSRANGE])
    assert len(load(tmp_path / "knn").references_) == 2 * train_count
    assert not (tmp_path / "knn" / "curve.csv").exists()  # nothing is iterated


def test_a_training_curve_is_stored(stores, tmp_path, monkeypatch):
    model = build("knn", {"k": 1}, 0)
    monkeypatch.setattr(type(model), "curve_", {"epoch": [1, 2], "loss": [0.5, 0.25]})
    fitted(stores("clean"), tmp_path / "knn")
    assert pd.read_csv(tmp_path / "knn" / "curve.csv")["loss"].tolist() == [0.5, 0.25]


@pytest.mark.parametrize("name", SETTINGS)
def test_same_seed_same_bytes_and_order_of_targets_does_not_matter(name, stores, tmp_path):
    first = digest(fitted(stores("snr_0dB"), tmp_path / "a", name))
    assert digest(fitted(stores("snr_0dB", ("disc", "dart")), tmp_path / "b", name)) == first
    assert digest(fitted(stores("snr_0dB"), tmp_path / "c", name, seed=1)) != first


def test_random_numbers_of_a_model_are_its_own(stores, tmp_path):
    seeds = [
        json.loads((fitted(stores("clean"), tmp_path / str(i), name, experiment=e) / "config.json").read_text())["seed"]
        for i, (name, e) in enumerate([("knn", "multi"), ("lr", "multi"), ("knn", "single")])
    ]
    assert len(set(seeds)) == 3


def test_an_added_target_leaves_the_split_alone(stores, tmp_path):
    two, four = (
        json.loads((fitted(stores("clean", names), tmp_path / str(len(names))) / "split.json").read_text())
        for names in (("dart", "disc"), ("dart", "disc", "cube", "wing"))
    )
    assert two == four


def test_no_test_azimuth_was_trained_on(stores, tmp_path):
    """From the stored indices, and from the training images themselves."""
    folder = fitted(stores("snr_0dB"), tmp_path / "knn")
    sides = json.loads((folder / "split.json").read_text())
    assert not set(sides["train"]["index"]) & set(sides["test"]["index"])
    assert sorted(sides["train"]["index"] + sides["test"]["index"]) == list(range(AZIMUTHS))
    predict(stores("snr_0dB"), folder, tmp_path / "table.csv")
    tested = pd.read_csv(tmp_path / "table.csv")["azimuth"].unique()
    assert np.allclose(np.sort(tested), aspects()[sides["test"]["index"]])
    # One training image at distance 0 from a test image would be the image itself.
    unseen = images.read(stores("snr_0dB"), sides["test"]["azimuth"])
    assert load(folder).decision_function(unseen.images).max() < -0.01
    seen = images.read(stores("snr_0dB"), sides["train"]["azimuth"])
    assert (load(folder).decision_function(seen.images).max(axis=1) > -0.01).all()


def test_a_class_without_images_is_refused(stores):
    rows = images.read(stores("clean"), aspects())
    with pytest.raises(InputError, match="class 'wing' has no training image"):
        fit(build("knn", {"k": 1}, 0), rows, ["dart", "disc", "wing"])


def test_the_prediction_table(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "svm", "svm", {"elevation": [0], "snr_db": "clean"})
    predict(stores("snr_-6dB"), folder, tmp_path / "one.csv")
    table = pd.read_csv(tmp_path / "one.csv")
    keys = ["target", "elevation", "azimuth", "realization"]
    assert list(table) == [*keys, "truth", "predicted", "score_dart", "score_disc"]
    assert len(table) == 2 * len(ELEVATION) * (AZIMUTHS - int(0.7 * AZIMUTHS)) * 2
    assert not table.duplicated(keys).any()
    assert table[keys].equals(table.sort_values(keys)[keys])
    assert (table["truth"] == table["target"]).all()
    assert set(table["elevation"]) == set(ELEVATION)
    best = table[["score_dart", "score_disc"]].idxmax(axis=1).str.removeprefix("score_")
    assert (table["predicted"] == best).all()
    predict(stores("snr_-6dB", ("disc", "dart")), folder, tmp_path / "two.csv")
    assert (tmp_path / "two.csv").read_bytes() == (tmp_path / "one.csv").read_bytes()


@pytest.mark.parametrize("name", SETTINGS)
def test_separable_classes_are_told_apart(name, stores, tmp_path):
    names = ("dart", "disc", "cube")
    folder = fitted(stores("clean", names), tmp_path / name, name)
    accuracy = {}
    for label in ("snr_30dB", "snr_-6dB"):
        predict(stores(label, names), folder, tmp_path / "table.csv")
        table = pd.read_csv(tmp_path / "table.csv")
        accuracy[label] = (table["truth"] == table["predicted"]).mean()
    assert accuracy["snr_30dB"] == 1
    assert 1 / 3 < accuracy["snr_-6dB"] < 1


@pytest.mark.parametrize("name", SETTINGS)
def test_shuffled_labels_give_chance(name, stores):
    rows = images.read(stores("snr_0dB"), aspects())
    seen = np.isin(rows.azimuth, aspects()[::2])
    right = []
    for seed in range(8):
        labels = np.random.default_rng(seed).permutation(rows.target[seen])
        predicted, _ = classify(build(name, SETTINGS[name], 0).fit(rows.images[seen], labels), rows.images[~seen])
        right.append((predicted == rows.target[~seen]).mean())
    assert abs(np.mean(right) - 0.5) < 0.12


def test_batches_do_not_change_predictions(stores, tmp_path, monkeypatch):
    folder = fitted(stores("clean"), tmp_path / "knn")
    rows = images.read(stores("snr_0dB"), aspects())
    whole = classify(load(folder), rows.images)
    monkeypatch.setattr("learning.predict.BATCH", 50)
    parts = classify(load(folder), rows.images)
    assert (whole[0] == parts[0]).all()
    np.testing.assert_allclose(whole[1], parts[1], atol=1e-3)


def test_the_times_file(stores, tmp_path, monkeypatch):
    monkeypatch.setattr(timing, "REPEATS", {1: 5, timing.BATCH: 3})
    folder = fitted(stores("clean"), tmp_path / "knn")
    timing.measure(stores("clean"), folder, 2, tmp_path / "knn.json")
    times = json.loads((tmp_path / "knn.json").read_text())
    assert times["training_observations"] == 2 * len(ELEVATION) * int(0.7 * AZIMUTHS)
    assert (times["experiment"], times["model"], times["threads"]) == ("multi", "knn", 2)
    assert times["machine"]["cpu"] and times["machine"]["cores"] >= 1
    assert (times["single"]["size"], times["batch"]["size"]) == (1, 256)
    assert (times["single"]["repeats"], times["batch"]["repeats"]) == (5, 3)
    assert all(0 < times[kind]["milliseconds_per_observation"] < 1000 for kind in ("single", "batch"))


def test_a_slow_model_is_timed_fewer_times(monkeypatch):
    clock = iter(np.arange(0.0, 1000.0, 4.0))
    monkeypatch.setattr(timing.time, "perf_counter", lambda: next(clock))
    result = timing.time_batches(lambda batch: None, np.zeros((3, 2, 2)), 256)
    assert 1 <= result["repeats"] < 5
    assert result["milliseconds_per_observation"] == pytest.approx(4e3 / 256)


@pytest.mark.parametrize("name", SETTINGS)
def test_predictions_import_nothing_heavy(name, stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / name, name)
    program = (
        "import sys; from learning.predict import predict; "
        f"predict({stores('snr_0dB')!r}, {str(folder)!r}, {str(tmp_path / 'table.csv')!r}); "
        "print(*sorted({'sklearn', 'jax', 'matplotlib'} & set(sys.modules)), 'end')"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env={"PYTHONPATH": ":".join(sys.path)}
    )
    assert done.stdout.splitlines()[-1].split() == ["end"], done.stderr
