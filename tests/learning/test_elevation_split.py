"""Split by elevation from images to scores: what a fold's model sees, what its tables say, and what counts together."""

import h5py
import numpy as np
import pandas as pd
import pytest
import scenes
import xarray as xr

from isarflow.learning import experiments
from isarflow.learning.classifier import config_of, load_classifier
from isarflow.learning.data import images
from isarflow.learning.data.export import export
from isarflow.learning.evaluation import timing
from isarflow.learning.evaluation.judge import Decision, gain
from isarflow.learning.evaluation.scores import score

ELEVATIONS = [-20.0, -10.0, 0.0, 10.0, 20.0]  # the first, third and last train
FOLDS = (1, 2)
TESTED = {1: -10, 2: 10}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The folder of images at five elevations, and models fitted on both folds with their prediction tables."""
    folder = tmp_path_factory.mktemp("elevations")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scenes, "ELEVATION", ELEVATIONS)
        for name in scenes.ROLES:
            scenes.write(folder / name / "clean.zarr", scenes.scene(name), scenes.aspects())
            scenes.write(folder / name / "snr_0dB.zarr", scenes.noisy(name, 0), scenes.aspects())
    learning = {"split": scenes.SPLIT, "experiments": {"e": {"train": scenes.ALL, "models": ["knn"], "open": True}}}
    learning["experiments"]["e"]["split"] = "elevation"
    sweep = {"seed": 0, "imaging": {"aperture": scenes.APERTURE}, "motion": {}}
    runs = experiments.runs({"targets": {"cube": {"role": "unknown"}}, "learning": learning, **sweep})
    tables = {}
    for name, run in runs.items():
        known = {target: scenes.ROLES[target] for target in ("dart", "disc")}
        training = scenes.Training(run, "knn", {"k": 1}, known, scenes.PLANES, 0)
        scenes.train([str(folder / target / "clean.zarr") for target in known], training, folder / name / "knn")
        tested = scenes.Tested(scenes.ROLES, scenes.PLANES, True, 1)
        path = folder / "predictions" / name / "knn" / "snr_0dB.csv"
        scenes.predict(
            [str(folder / target / "snr_0dB.zarr") for target in scenes.ROLES], tested, folder / name / "knn", [path]
        )
        tables[run["division"]["fold"]] = pd.read_csv(path)
    return folder, runs, tables


def test_each_fold_trains_on_the_same_and_tests_what_the_other_validates_on(made):
    folder, runs, tables = made
    assert list(runs) == ["e_fold1", "e_fold2"]
    for fold, table in tables.items():
        sides = scenes.sides_of(folder / f"e_fold{fold}" / "knn")
        assert sides["train"]["elevation"] == [-20, 0, 20]
        assert sides["test"]["elevation"] == [TESTED[fold]] and sides["validation"]["elevation"] == [-TESTED[fold]]
        assert all(len(side["azimuth"]) == scenes.AZIMUTHS for side in sides.values())
        for side, elevation in (("test", TESTED[fold]), ("validation", -TESTED[fold])):
            rows = table[table["side"] == side]
            assert set(rows["elevation"]) == {elevation}
            every = scenes.ROLES if side == "validation" else {"dart", "disc", "cube"}  # role other is never tested
            assert len(rows) == len(every) * scenes.AZIMUTHS and set(rows["target"]) == set(every)
        assert set(table["fold"]) == {fold}
        # Arcs of an aperture, the same in both folds.
        dart = table[table["target"] == "dart"]
        assert (dart["block"] == dart["azimuth"] // (scenes.APERTURE * 360 / scenes.AZIMUTHS)).all()


def test_a_model_has_its_training_elevations_alone(made):
    folder, *_ = made
    model = load_classifier(folder / "e_fold1" / "knn")
    assert len(model.references_) == 2 * 3 * scenes.AZIMUTHS
    stores = [str(folder / target / "clean.zarr") for target in ("dart", "disc")]
    run = config_of(folder / "e_fold1" / "knn")["run"]
    divided = images.divide(stores, scenes.PLANES, run)
    distances = {
        side: -model.evaluate(images.read_side(stores, divided, run, side)[0]).scores.max(axis=1)
        for side in ("train", "validation", "test")
    }
    assert (distances["train"] < 0.01).all() and min(distances["validation"].min(), distances["test"].min()) > 0.01


def test_scores_count_each_image_once_over_both_folds(made, tmp_path):
    folder, runs, tables = made
    paths = [folder / "predictions" / name / "knn" / "snr_0dB.csv" for name in runs]
    written = [tmp_path / f"{name}.csv" for name in ("scores", "confusion", "validation")]
    score(paths, runs, "mean", 0, 1, *written)
    found = pd.read_csv(written[0], keep_default_na=False).query("metric == 'accuracy' and snr_definition == 'mean'")
    known = pd.concat(tables.values()).query("side == 'test' and role == 'known'")
    assert not known.duplicated(["target", "elevation", "azimuth"]).any()
    closed = found[found["score"] == ""].set_index("fold")
    right = known["truth"] == known["predicted"]
    assert closed["value"].loc[""] == pytest.approx(right.mean()) and closed["n"].loc[""] == len(known)
    for fold in FOLDS:
        own = right[known["fold"] == fold]
        assert closed["value"].loc[str(fold)] == pytest.approx(own.mean()) and closed["n"].loc[str(fold)] == len(own)
    opened = pd.read_csv(written[0], keep_default_na=False).query("metric == 'auroc'").iloc[0]
    alone = []
    for table in tables.values():
        test = table[table["side"] == "test"]
        scores = [test.loc[test["role"] == role, "known_distance"].to_numpy() for role in ("known", "unknown")]
        alone.append((scores[0][:, None] > scores[1]).mean() + 0.5 * (scores[0][:, None] == scores[1]).mean())
    assert opened["value"] == pytest.approx(np.mean(alone))
    assert float(opened["low"]) < opened["value"] < float(opened["high"])


def test_a_gain_counts_only_folds_that_both_have(made):
    _, _, tables = made
    test = pd.concat(tables.values()).query("side == 'test' and role == 'known'").reset_index(drop=True)
    right = Decision("x", "blind", test, test["truth"].to_numpy())
    wrong = Decision("x", "blind", test, np.where(test["fold"] == 1, test["truth"], "disc"))
    assert gain(right, wrong.of_folds(["1"]), 0)[0] == 0  # of fold 2 it says nothing
    assert gain(right, wrong, 0)[0] > 0.1
    assert gain(right.of_folds(["1"]), wrong.of_folds(["2"]), 0) is None


def test_times_are_of_test_images_and_exports_know_the_split(made, tmp_path):
    folder, *_ = made
    stores = [str(folder / target / "clean.zarr") for target in scenes.ROLES]
    timing.measure(stores, scenes.PLANES, [folder / "e_fold1" / "knn"], 1, tmp_path / "times.json")
    export(
        stores, tmp_path / "clean.h5", scenes.ROLES, scenes.PLANES, scenes.SPLIT | {"spacing": 5}, 0, scenes.APERTURE
    )
    with h5py.File(tmp_path / "clean.h5") as file:
        sides = np.array(file.attrs["sides"], str)
        elevation = file["elevation"][:]
        for fold in FOLDS:
            side = sides[file[f"split_elevation_{fold}"][:]]
            assert set(elevation[side == "test"]) == {TESTED[fold]} and set(elevation[side == "train"]) == {-20, 0, 20}
            assert set(elevation[side == "validation"]) == {-TESTED[fold]} and "guard" not in side
    with xr.open_zarr(stores[0]) as store:
        assert store.elevation.values.tolist() == ELEVATIONS
