import json
import shutil
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scenes import (
    ALL_TARGETS,
    APERTURE,
    AZIMUTHS,
    CROSSRANGE,
    ELEVATION,
    FCNN,
    PLANES,
    RANGE,
    ROLES,
    SETTINGS,
    aspects,
    digest,
    fitted,
    scene,
    sides_of,
    tables_of,
    write,
)

from isarflow.core.errors import InputError
from isarflow.learning.classifier import build_classifier, load_classifier
from isarflow.learning.data import images
from isarflow.learning.evaluation import timing
from isarflow.learning.evaluation.thresholds import choose
from isarflow.learning.predict import classify
from isarflow.learning.tables import write_table


def every(azimuth):
    """These azimuths of every target."""
    return dict.fromkeys(ROLES, azimuth)


def test_rows_carry_where_they_come_from(stores):
    pixels, rows = images.read(
        stores("snr_0dB", ("disc", "dart")), {"disc": aspects()[[3, 5]], "dart": aspects()[[5]]}, [15]
    )
    assert set(rows.label) == {"snr_0dB"}
    assert rows.target.tolist() == ["dart"] * 2 + ["disc"] * 4
    assert rows.azimuth.tolist() == [75, 75, 45, 45, 75, 75]
    assert rows.realization.tolist() == [0, 1] * 3
    assert set(rows.elevation) == {15}
    with xr.open_zarr(stores("snr_0dB", ["disc"])[0]) as dataset:
        expected = dataset["image"].sel(realization=1, elevation=15, azimuth=75).values
    np.testing.assert_array_equal(pixels[5], expected)


def test_an_angle_that_no_store_has_is_refused(stores):
    with pytest.raises(KeyError, match="elevation"):
        images.read(stores("clean"), every(aspects()[:2]), [7])


def test_images_that_are_not_finite_are_refused(tmp_path):
    broken = scene("dart")
    broken[0, 0, 1, 1] = np.nan
    write(tmp_path / "dart" / "clean.zarr", broken, aspects())
    with pytest.raises(InputError, match="not finite"):
        images.read([tmp_path / "dart" / "clean.zarr"], every(aspects()))


def test_the_model_folder(stores, tmp_path):
    fitted(stores("clean"), tmp_path / "knn", selection={"elevation": [0], "snr_db": "clean"})
    config = json.loads((tmp_path / "knn" / "config.json").read_text())
    train_count = int(0.7 * AZIMUTHS)
    assert config["run"]["elevation"] == [0]
    assert config["classes"] == ["dart", "disc"]
    assert config["observations"] == {"dart": train_count, "disc": train_count}
    assert (config["model"], config["settings"], config["image_shape"]) == ("knn", {"k": 1}, [RANGE, CROSSRANGE])
    assert len(load_classifier(tmp_path / "knn").references_) == 2 * train_count
    assert not (tmp_path / "knn" / "curve.csv").exists()  # nothing is iterated


def test_a_training_curve_is_stored(stores, tmp_path):
    fitted(stores("clean"), tmp_path / "fcnn", "fcnn")
    curve = pd.read_csv(tmp_path / "fcnn" / "curve.csv")
    assert curve["epoch"].tolist() == list(range(1, 13))
    assert not curve.isna().any(axis=None) and curve["loss"].iloc[-1] < curve["loss"].iloc[0]
    seconds = pd.read_csv(tmp_path / "fcnn" / "seconds.csv")
    assert (seconds["epoch"] == curve["epoch"]).all() and seconds["seconds"].is_monotonic_increasing


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
        sides_of(fitted(stores("clean", names), tmp_path / str(len(names))))
        for names in (("dart", "disc"), ("dart", "disc", "cube", "wing"))
    )
    assert two == four


def test_no_test_azimuth_was_trained_on(stores, tmp_path):
    """From the stored indices, and from the training images themselves."""
    folder = fitted(stores("snr_0dB"), tmp_path / "knn")
    sides = sides_of(folder)
    index = [number for side in ("train", "validation", "test") for number in sides[side]["index"]]
    assert sorted(index) == list(range(AZIMUTHS))
    table = tables_of(stores("snr_0dB"), folder, tmp_path)["snr_0dB"]
    tested = table.loc[table["side"] == "test", "azimuth"]
    assert np.allclose(np.sort(tested.unique()), aspects()[sides["test"]["index"]])
    # One training image at distance 0 from a test image would be the image itself.
    unseen, _ = images.read(stores("snr_0dB"), every(sides["test"]["azimuth"]))
    assert load_classifier(folder).evaluate(unseen).scores.max() < -0.01
    seen, _ = images.read(stores("snr_0dB"), every(sides["train"]["azimuth"]))
    assert (load_classifier(folder).evaluate(seen).scores.max(axis=1) > -0.01).all()


def test_in_sector_no_test_image_shares_a_sample_with_a_training_one(stores, tmp_path):
    folder = fitted(stores("snr_0dB"), tmp_path / "knn", split="sector")
    sides = sides_of(folder)
    assert json.loads((folder / "split.json").read_text())["division"]["scheme"] == "sector"
    half = APERTURE // 2
    samples = {
        side: {(number + offset) % AZIMUTHS for number in sides[side]["index"] for offset in range(-half, half + 1)}
        for side in ("train", "validation", "test")
    }
    assert not samples["train"] & samples["test"] and not samples["validation"] & samples["test"]
    table = tables_of(stores("snr_0dB"), folder, tmp_path)["snr_0dB"]
    tested = table.loc[table["side"] == "test", "azimuth"]
    assert np.allclose(np.sort(tested.unique()), aspects()[sides["test"]["index"]])


def test_the_prediction_table(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "svm", "svm", {"elevation": [0], "snr_db": "clean"})
    table = tables_of(stores("snr_-6dB"), folder, tmp_path / "one")["snr_-6dB"]
    keys = ["target", "elevation", "azimuth", "realization"]
    known = ["truth", "predicted", "role", "side", "fold", "block", "snr_mean", "snr_peak_3db"]
    assert list(table) == [*keys, *known, "score_dart", "score_disc"]
    held_out = AZIMUTHS - int(0.7 * AZIMUTHS)
    validation = int(0.33 * held_out)
    assert len(table) == 2 * len(ELEVATION) * held_out * 2
    assert table["side"].value_counts().to_dict() == {
        "test": 2 * len(ELEVATION) * (held_out - validation) * 2,
        "validation": 2 * len(ELEVATION) * validation * 2,
    }
    split = sides_of(folder)
    for side, rows in table.groupby("side"):
        assert np.allclose(np.sort(rows["azimuth"].unique()), aspects()[split[side]["index"]])
    assert set(table["role"]) == {"known"}
    assert not table.duplicated(keys).any()
    assert table[keys].equals(table.sort_values(keys)[keys])
    assert (table["truth"] == table["target"]).all()
    assert set(table["elevation"]) == set(ELEVATION)
    best = table[["score_dart", "score_disc"]].idxmax(axis=1).str.removeprefix("score_")
    assert (table["predicted"] == best).all()
    tables_of(stores("snr_-6dB", ("disc", "dart")), folder, tmp_path / "two")
    files = [(tmp_path / run / "snr_-6dB.csv").read_bytes() for run in ("one", "two")]
    assert files[0] == files[1]


def test_a_table_is_written_as_by_pandas(tmp_path):
    random = np.random.default_rng(0)
    numbers = {"score": random.normal(size=9) * 10.0 ** np.arange(-20, 16, 4), "snr": [np.nan, 1 / 3, 0, *range(6)]}
    exact = {"known": random.normal(size=9).astype(np.float32), "lost": [np.inf, -np.inf, *[np.nan] * 7]}
    table = pd.DataFrame({"target": ["nan", "NA", *"abcdefg"], "fold": 1, "block": range(9), **numbers, **exact})
    write_table(table, tmp_path / "mine.csv")
    table.to_csv(tmp_path / "theirs.csv", index=False, float_format="%.9g")
    assert (tmp_path / "mine.csv").read_text() == (tmp_path / "theirs.csv").read_text()
    read = pd.read_csv(tmp_path / "mine.csv", keep_default_na=False, na_values={"snr": ""})
    assert (read["known"].astype(np.float32) == table["known"]).all()


def test_each_image_carries_its_fold_block_and_own_snr(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "knn", split="sector")
    table = tables_of(stores("snr_0dB"), folder, tmp_path)["snr_0dB"]
    assert set(table["fold"]) == set(table["block"]) == {1}
    elevation, azimuth = (
        np.searchsorted(of, table[name]) for name, of in (("elevation", ELEVATION), ("azimuth", aspects()))
    )
    assert (table["snr_mean"] == elevation * AZIMUTHS + azimuth).all() and (table["snr_peak_3db"] == 2).all()
    random = tables_of(stores("snr_0dB"), fitted(stores("clean"), tmp_path / "random"), tmp_path)["snr_0dB"]
    assert (random["fold"] == 0).all()
    assert (random["block"] == random["azimuth"] // (APERTURE * 360 / AZIMUTHS)).all()


def test_every_target_is_divided_by_its_own_mirror_planes(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "knn", open=True)
    table = tables_of(stores("snr_0dB", ALL_TARGETS), folder, tmp_path, is_open=True)["snr_0dB"]
    cube = table[table["target"] == "cube"].groupby("side")["azimuth"].agg(set)
    for side, angles in cube.items():
        assert {(-angle) % 360 for angle in angles} == angles, side
    dart = table[table["target"] == "dart"].groupby("side")["azimuth"].agg(set)
    assert {(-angle) % 360 for angle in dart["test"]} != dart["test"]


def test_fewer_realizations_are_the_first_of_them(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "knn")
    both = tables_of(stores("snr_0dB"), folder, tmp_path / "two")["snr_0dB"]
    one = tables_of(stores("snr_0dB"), folder, tmp_path / "one", realizations=1)["snr_0dB"]
    first = both[both["realization"] == 0].reset_index(drop=True)
    pd.testing.assert_frame_equal(one, first, atol=1e-5)


def test_an_snr_has_the_same_table_whatever_else_is_predicted(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "knn")
    tables_of(stores("snr_0dB"), folder, tmp_path / "alone")
    tables_of(stores("snr_0dB") + stores("snr_30dB"), folder, tmp_path / "both")
    assert (tmp_path / "alone/snr_0dB.csv").read_bytes() == (tmp_path / "both/snr_0dB.csv").read_bytes()


def test_the_table_of_an_open_run(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "fcnn", "fcnn", open=True)
    table = tables_of(stores("snr_30dB", ALL_TARGETS), folder, tmp_path, is_open=True)["snr_30dB"]
    known = [name.removeprefix("known_") for name in table if name.startswith("known_")]
    assert {"softmax", "max_logit", "energy", "openmax", "openmax_shifted", "neighbour", "mahalanobis"} < set(known)
    assert set(table.loc[table["role"] != "known", "truth"]) == {"other"}
    sides = sides_of(folder)
    for role, expected in (("known", 2), ("unknown", 2), ("other", 1)):
        assert table.loc[table["role"] == role, "side"].nunique() == expected
    for side in ("test", "validation"):
        azimuths = np.sort(table.loc[(table["side"] == side) & (table["target"] == "dart"), "azimuth"].unique())
        assert np.allclose(azimuths, aspects()[sides[side]["index"]])
    assert set(table.loc[table["role"] == "other", "side"]) == {"validation"}


def test_what_unknown_targets_hold_changes_no_model(stores, tmp_path):
    """Garbage instead of the unknown targets: the same model byte for byte, and the same predictions of the rest."""
    folder = fitted(stores("clean"), tmp_path / "fcnn", "fcnn", open=True)
    before = tables_of(stores("snr_30dB", ALL_TARGETS), folder, tmp_path / "before", is_open=True)["snr_30dB"]
    elsewhere = tmp_path / "imaging"
    for name in ("dart", "disc", "wing"):
        shutil.copytree(stores("snr_30dB", [name])[0], elsewhere / name / "snr_30dB.zarr")
        shutil.copytree(stores("clean", [name])[0], elsewhere / name / "clean.zarr")
    garbage = np.random.default_rng(0).standard_normal((2, len(ELEVATION), AZIMUTHS, RANGE, CROSSRANGE)) * 9
    write(elsewhere / "cube" / "snr_30dB.zarr", garbage, aspects())
    known = [str(elsewhere / name / "clean.zarr") for name in ("dart", "disc")]
    again = fitted(known, tmp_path / "again", "fcnn", open=True)
    assert digest(again) == digest(folder)
    spoilt = [str(elsewhere / name / "snr_30dB.zarr") for name in ALL_TARGETS]
    after = tables_of(spoilt, again, tmp_path / "after", is_open=True)["snr_30dB"]
    rest = before["role"] != "unknown"
    assert before[rest].equals(after[rest])
    assert not before[~rest].equals(after[~rest])
    assert choose(before, "known_energy", "blind") == choose(after, "known_energy", "blind")
    assert choose(before, "known_energy", "thesis") != choose(after, "known_energy", "thesis")


def test_a_class_other_is_learned_from_other_targets_and_noise(stores, tmp_path):
    noise = tmp_path / "imaging" / "pure-noise" / "clean.zarr"
    random = np.random.default_rng(2)
    write(noise, random.standard_normal((len(ELEVATION), AZIMUTHS, RANGE, CROSSRANGE, 2)) @ [1, 1j], aspects())
    learned = [*stores("clean", ("dart", "disc", "wing")), str(noise)]
    folder = fitted(learned, tmp_path / "fcnn", "fcnn", settings=FCNN | {"kind": "fcnn", "other": True}, open=True)
    config = json.loads((folder / "config.json").read_text())
    each = len(ELEVATION) * int(0.7 * AZIMUTHS)
    assert config["classes"] == ["dart", "disc", "other"]
    assert config["observations"] == {"dart": each, "disc": each, "other": 2 * each}
    assert "kind" not in config["settings"] and "other" not in config["settings"]
    table = tables_of(stores("snr_30dB", ALL_TARGETS), folder, tmp_path, is_open=True)["snr_30dB"]
    rows = table.groupby("role")["predicted"]
    assert (rows.get_group("other") == "other").mean() > 0.9
    assert (rows.get_group("known") == "other").mean() < 0.1
    assert "score_other" in table


def test_several_snrs_are_learned_at_once_or_one_in_each_batch(stores, tmp_path):
    both = stores("clean") + stores("snr_0dB")
    together = fitted(both, tmp_path / "a", "fcnn", {"elevation": "all", "snr_db": ["clean", 0]})
    drawn = fitted(both, tmp_path / "b", "fcnn", {"elevation": "all", "snr_db": {"random": ["clean", 0]}})
    counts = [json.loads((folder / "config.json").read_text())["observations"]["dart"] for folder in (together, drawn)]
    assert counts == [3 * len(ELEVATION) * int(0.7 * AZIMUTHS)] * 2  # one without noise, two realizations
    assert digest(together)["model.npz"] != digest(drawn)["model.npz"]
    again = fitted(both[::-1], tmp_path / "c", "fcnn", {"elevation": "all", "snr_db": {"random": [0, "clean"]}})
    assert digest(again) == digest(drawn)
    scores = [tables_of(stores("snr_0dB"), folder, tmp_path)["snr_0dB"] for folder in (together, drawn)]
    assert all((table["truth"] == table["predicted"]).mean() > 0.8 for table in scores)


def test_choices_are_made_on_the_validation_azimuths(stores, tmp_path):
    settings = {"kind": "lr", "penalty": [1e-9, 0.1, 1.0]}
    folder = fitted(stores("snr_0dB"), tmp_path / "lr_tuned", "lr_tuned", settings=settings)
    search = pd.read_csv(folder / "search.csv")
    assert search["penalty"].tolist() == [1e-9, 0.1, 1.0]
    sides = sides_of(folder)
    (held_out, truth), (seen, origin) = (
        images.read(stores("snr_0dB"), every(sides[side]["azimuth"])) for side in ("validation", "train")
    )
    for line in search.itertuples():
        model = build_classifier("lr", {"penalty": line.penalty}, 0).fit(seen, origin["target"].to_numpy(str))
        assert line.validation_accuracy == (model.predict(held_out) == truth["target"]).mean()
    chosen = json.loads((folder / "config.json").read_text())["settings"]
    assert chosen == {"penalty": search["penalty"][search["validation_accuracy"].idxmax()]}


def test_the_first_of_equal_choices_is_kept(stores, tmp_path):
    settings = {"kind": "svm", "C": [900.0, 930.66, 950.0], "scale": 2.75}
    folder = fitted(stores("clean"), tmp_path / "svms", "svms", settings=settings)
    assert pd.read_csv(folder / "search.csv")["validation_accuracy"].nunique() == 1
    assert json.loads((folder / "config.json").read_text())["settings"]["C"] == 900


def test_known_scores_that_are_no_numbers_are_refused(stores, tmp_path, monkeypatch):
    folder = fitted(stores("clean"), tmp_path / "knn", open=True)
    kind = type(build_classifier("knn", {}, 0))
    plain = kind.evaluate
    monkeypatch.setattr(
        kind, "evaluate", lambda self, some: plain(self, some)._replace(known={"odd": np.full(len(some), -np.inf)})
    )
    with pytest.raises(InputError, match="model knn of multi: its known score 'odd' is not a finite number"):
        tables_of(stores("snr_0dB", ALL_TARGETS), folder, tmp_path, is_open=True)


def test_images_are_up_sampled_for_one_run_only(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "knn", upsample=9)
    assert json.loads((folder / "config.json").read_text())["image_shape"] == [9, 9]
    assert len(tables_of(stores("snr_30dB"), folder, tmp_path)["snr_30dB"]) > 0


@pytest.mark.parametrize("name", SETTINGS)
def test_separable_classes_are_told_apart(name, stores, tmp_path):
    names = ("dart", "disc", "cube")
    roles = dict.fromkeys(names, "known")
    folder = fitted(stores("clean", names), tmp_path / name, name, roles=roles)
    accuracy = {}
    for label in ("snr_30dB", "snr_-6dB"):
        table = tables_of(stores(label, names), folder, tmp_path, roles=roles)[label]
        accuracy[label] = (table["truth"] == table["predicted"]).mean()
    assert accuracy["snr_30dB"] == 1
    assert 1 / 3 < accuracy["snr_-6dB"] < 1


@pytest.mark.parametrize("name", SETTINGS)
def test_shuffled_labels_give_chance(name, stores):
    pixels, rows = images.read(stores("snr_0dB"), every(aspects()))
    seen, targets = np.isin(rows.azimuth, aspects()[::2]), rows.target.to_numpy(str)
    right = []
    for seed in range(8):
        labels = np.random.default_rng(seed).permutation(targets[seen])
        model = build_classifier(name, SETTINGS[name], 0).fit(pixels[seen], labels)
        right.append((classify(model, pixels[~seen]).labels == targets[~seen]).mean())
    assert abs(np.mean(right) - 0.5) < 0.12


def test_batches_do_not_change_predictions(stores, tmp_path, monkeypatch):
    folder = fitted(stores("clean"), tmp_path / "knn")
    pixels, _ = images.read(stores("snr_0dB"), every(aspects()))
    whole = classify(load_classifier(folder), pixels)
    monkeypatch.setattr("isarflow.learning.predict.BATCH", 50)
    parts = classify(load_classifier(folder), pixels)
    assert (whole.labels == parts.labels).all()
    np.testing.assert_allclose(whole.scores, parts.scores, atol=1e-3)
    np.testing.assert_allclose(whole.known["distance"], parts.known["distance"], atol=1e-3)


def test_the_times_file(stores, tmp_path, monkeypatch):
    monkeypatch.setattr(timing, "CALLS", {1: (50, 5), timing.BATCH_IMAGES: (5, 3)})
    folders = [fitted(stores("clean"), tmp_path / name, name) for name in ("knn", "lr")]
    timing.measure(stores("clean"), PLANES, folders, 2, tmp_path / "times.json")
    times = json.loads((tmp_path / "times.json").read_text())
    assert times["machine"]["cpu"] and times["machine"]["cores"] >= 1 and times["threads"] == 2
    assert [record["model"] for record in times["models"]] == ["knn", "lr"]
    for record in times["models"]:
        assert record["training_observations"] == 2 * len(ELEVATION) * int(0.7 * AZIMUTHS)
        assert (record["experiment"], record["run"]) == ("multi", "multi")
        assert (record["single"]["size"], record["batch"]["size"]) == (1, 256)
        assert (record["single"]["repeats"], record["batch"]["repeats"]) == (5, 3)
        assert all(0 < record[kind]["milliseconds_per_observation"] < 1000 for kind in ("single", "batch"))


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
        "import sys; from isarflow.learning.predict import Tested, predict; "
        f"tested = Tested({ROLES!r}, {PLANES!r}, True, 1); "
        f"predict({stores('snr_0dB')!r}, tested, {str(folder)!r}, [{str(tmp_path / 'snr_0dB.csv')!r}]); "
        "print(*sorted({'sklearn', 'jax', 'matplotlib'} & set(sys.modules)), 'end')"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env={"PYTHONPATH": ":".join(sys.path)}
    )
    assert done.stdout.splitlines()[-1].split() == ["end"], done.stderr
