import time

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm
from sklearn import metrics as reference

from isarflow.learning.data.split import blocks, divisions, folded, split
from isarflow.learning.evaluation.metrics import (
    confusion,
    draw_counts,
    equal_blocks,
    interval,
    metrics_of,
    resampled,
    separation,
)
from isarflow.learning.evaluation.scores import score
from isarflow.learning.experiments import runs

LABELS = ["dart", "disc", "wing"]


def outcomes(count=900, azimuths=30, seed=0, right=0.6):
    """Random truths, predictions that are often right, and azimuths: arrays (count,) of whole numbers."""
    random = np.random.default_rng(seed)
    truth = random.choice(3, count, p=[0.5, 0.3, 0.2])
    predicted = np.where(random.random(count) < right, truth, random.choice(3, count))
    return np.arange(count) % azimuths, truth, predicted


@pytest.mark.parametrize("never", [None, 1])
def test_metrics_agree_with_scikit_learn(never):
    _, truth, predicted = outcomes()
    if never is not None:
        predicted[predicted == never] = 0  # a class that is never predicted has no precision
    counts = confusion(np.zeros_like(truth), truth, predicted, (1, 3))[0]
    assert (counts == reference.confusion_matrix(truth, predicted)).all()
    ours = metrics_of(counts, LABELS, LABELS)
    precision, recall, _, _ = reference.precision_recall_fscore_support(truth, predicted, zero_division=np.nan)
    expected = {
        "accuracy": reference.accuracy_score(truth, predicted),
        "f1_weighted": reference.f1_score(truth, predicted, average="weighted"),
        "f1_macro": reference.f1_score(truth, predicted, average="macro"),
    }
    for index, label in enumerate(LABELS):
        expected |= {f"precision_{label}": precision[index], f"recall_{label}": recall[index]}
    assert ours.keys() == expected.keys()
    for name, value in expected.items():
        assert ours[name] == pytest.approx(value, abs=1e-12, nan_ok=True), name


def test_resampled_metrics_are_those_of_repeated_observations():
    groups, truth, predicted = outcomes(300, 10)
    counts = confusion(groups, truth, predicted, (10, 3))
    draw_counts = np.array([0, 3, 1, 1, 0, 2, 0, 1, 1, 1])
    rows = np.concatenate([np.flatnonzero(groups == group) for group in np.repeat(np.arange(10), draw_counts)])
    ours = metrics_of(np.tensordot(draw_counts, counts, axes=1), LABELS, LABELS)
    assert abs(ours["f1_macro"] - reference.f1_score(truth[rows], predicted[rows], average="macro")) < 1e-12


def intervals(counts, seed):
    values, draws = metrics_of(counts.sum(axis=0), LABELS, LABELS), resampled(counts, LABELS, LABELS, seed)
    equal = equal_blocks(counts.sum(axis=(1, 2)))
    return {name: interval(values[name], draws[name], equal) for name in values}


def test_precision_of_a_class_that_few_images_are_taken_for_has_the_interval_of_what_is_known_of_it():
    groups, truth, predicted = outcomes()
    predicted[(predicted == 1) & (groups > 2)] = 0  # named in three blocks of thirty: in many resamples in none
    counts = confusion(groups, truth, predicted, (30, 3))
    found, draws = intervals(counts, 0), resampled(counts, LABELS, LABELS, 0)
    named = np.tensordot(draw_counts(30, 0), counts, axes=1).sum(axis=1)[:, 1] > 0
    assert 0 < (~named).sum() < 100
    assert (np.isnan(draws["precision_disc"]) == ~named).all() and np.isfinite(draws["f1_macro"]).all()
    value = metrics_of(counts.sum(axis=0), LABELS, LABELS)["precision_disc"]
    low, high = found["precision_disc"]
    assert low < value < high and interval(value, draws["precision_disc"][named], 30) == (low, high)
    predicted[predicted == 1] = 0
    assert np.isnan(intervals(confusion(groups, truth, predicted, (30, 3)), 0)["precision_disc"]).all()


def test_intervals_are_seeded_and_contain_the_value():
    groups, truth, predicted = outcomes()
    counts = confusion(groups, truth, predicted, (30, 3))
    first, again, other = (intervals(counts, seed) for seed in (0, 0, 1))
    assert first == again != other
    for name, value in metrics_of(counts.sum(axis=0), LABELS, LABELS).items():
        low, high = first[name]
        assert low < value < high, name


def outcomes_of_a_sweep(random, aspects, accuracy, own):
    """Whether the images of each aspect (n,) are classified rightly, (n, 6): made-up data of a known accuracy.

    An image is right where what it shows of the target, the sum of the samples of its aperture, is large enough, plus
    noise of its own with a share `own` of the variance. Neighbours share samples, so their fates are correlated.
    """
    place = np.round((aspects - aspects.min()) / (360 / 242)).astype(int)
    shared = np.convolve(random.standard_normal(place.max() + 42), np.ones(21) / np.sqrt(21), "same")[21:][place]
    noise = random.standard_normal((len(aspects), 6))
    return np.sqrt(1 - own) * shared[:, None] + np.sqrt(own) * noise > norm.ppf(1 - accuracy)


@pytest.mark.parametrize(
    ("scheme", "planes", "count"), [("random", (), 12), ("random", ("xz",), 6), ("sector", ("xz",), 6)]
)
@pytest.mark.parametrize(("accuracy", "own"), [(0.6, 0.5), (0.8, 0.5), (0.9, 0.8)])
def test_intervals_cover_the_truth_where_neighbours_share_their_samples(scheme, planes, count, accuracy, own):
    azimuths, settings = np.arange(242) * 360 / 242, {"train": 0.7, "validation": 0.33, "folds": 6}
    tested, block = [], []
    for division in divisions(scheme, settings, 0, 21):
        tested.append(split([0.0], azimuths, planes, division)["test"].azimuth)
        block.append(blocks(azimuths, planes, division)[tested[-1]])
    aspects, block = folded(azimuths[np.concatenate(tested)], planes), np.concatenate(block)
    block -= block.min()
    assert block.max() + 1 == count
    random, covered, times = np.random.default_rng(7), 0, 1000
    for seed in range(times):
        right = np.concatenate([outcomes_of_a_sweep(random, aspects, accuracy, own) for _ in LABELS[:2]], axis=1)
        counts = np.zeros((count, 3, 3), int)
        np.add.at(counts, (block, 0, 0), right.sum(axis=1))
        np.add.at(counts, (block, 0, 1), (~right).sum(axis=1))
        low, high = intervals(counts, seed)["accuracy"]
        covered += low <= accuracy <= high
    assert 0.93 <= covered / times <= 0.97


def test_blocks_of_unequal_size_say_less():
    assert equal_blocks(np.array([5, 5, 5])) == pytest.approx(3)
    assert equal_blocks(np.array([8, 1, 1])) == pytest.approx(100 / 66)


def test_an_interval_of_many_independent_blocks_is_that_of_the_normal_distribution():
    # The spread of a mean of 400 blocks, but for what neighbours may have in common.
    random = np.random.default_rng(0)
    low, high = interval(0.2, 0.2 + 0.01 * random.standard_normal(100_000), 400, is_share=False)
    assert (high - low) / 2 == pytest.approx(1.966 * 0.01 * np.sqrt(1.5), rel=0.01)
    assert (high + low) / 2 == pytest.approx(0.2)
    share = interval(0.2, 0.2 + 0.01 * random.standard_normal(100_000), 400)
    assert share == pytest.approx((low, high), abs=2e-3) and share[1] - 0.2 > 0.2 - share[0]


def test_a_single_block_has_no_interval_and_no_error_has_no_width():
    assert np.isnan(interval(0.5, np.full(9, 0.5), 1)).all()
    assert interval(1.0, np.ones(9), 6) == (1, 1)
    assert interval(0.0, np.zeros(9), 6) == (0, 0)
    low, high = interval(0.99, 0.99 + 0.02 * np.random.default_rng(0).standard_normal(1000), 6)
    assert 0 < low < 0.99 < high < 1


def scored_images(seed=0, azimuths=12, count=600):
    """Known scores of known and unknown images, many of them equal: (scores, known, right, azimuth numbers)."""
    random = np.random.default_rng(seed)
    known = random.random(count) < 0.6
    scores = np.round(random.normal(np.where(known, 0.8, 0), 1), 1)
    return scores, known, random.random(count) < 0.8, random.integers(azimuths, size=count)


def separation_by_hand(scores, known, right):
    """AUROC and FPR by scikit-learn, OSCR by integrating its curve."""
    below, above, _ = reference.roc_curve(known, scores, drop_intermediate=False)
    thresholds = np.concatenate([[np.inf], np.unique(scores)[::-1]])
    correct = [(known & right & (scores >= t)).sum() / known.sum() for t in thresholds]
    false = [(~known & (scores >= t)).sum() / (~known).sum() for t in thresholds]
    return {
        "auroc": reference.roc_auc_score(known, scores),
        "fpr95": below[np.flatnonzero(above >= 0.95 - 1e-12)[0]],
        "oscr": np.trapezoid(correct, false),
    }


@pytest.mark.parametrize("seed", range(3))
def test_separation_agrees_with_scikit_learn(seed):
    scores, known, right, groups = scored_images(seed)
    ours = separation(scores, known, right, groups, np.ones((1, 12)))
    for name, value in separation_by_hand(scores, known, right).items():
        assert abs(ours[name][0] - value) < 1e-12, name


def test_resampled_separation_is_that_of_repeated_images():
    scores, known, right, groups = scored_images()
    draws = draw_counts(12, 0)[:5]
    ours = separation(scores, known, right, groups, draws)
    for row, draw in enumerate(draws):
        index = np.concatenate([np.flatnonzero(groups == group) for group in np.repeat(np.arange(12), draw)])
        for name, value in separation_by_hand(scores[index], known[index], right[index]).items():
            assert abs(ours[name][row] - value) < 1e-12, name


def test_separation_needs_both_kinds():
    scores, _, right, groups = scored_images()
    for known in (np.ones(600, bool), np.zeros(600, bool)):
        result = separation(scores, known, right, groups, np.ones((1, 12)))
        assert all(np.isnan(values).all() for values in result.values())


def with_blocks(frame, offset=3.0):
    """The table with the columns of a random split: four blocks of azimuths, and an SNR of its own for each image."""
    return frame.assign(fold=0, block=(frame["azimuth"] // 90).astype(int), snr_mean=-offset, snr_peak_3db=0.0)


def table(elevations=(0.0, 15.0), azimuths=12, seed=0, right=0.8):
    """A prediction table of three classes."""
    rows = [(name, e, a * 30.0, r) for name in LABELS for e in elevations for a in range(azimuths) for r in range(3)]
    frame = pd.DataFrame(rows, columns=["target", "elevation", "azimuth", "realization"])
    random = np.random.default_rng(seed)
    frame["truth"] = frame["target"]
    frame["role"], frame["side"] = "known", "test"
    frame = with_blocks(frame)
    frame["predicted"] = np.where(random.random(len(frame)) < right, frame["truth"], random.choice(LABELS, len(frame)))
    return frame


COLUMNS = [
    "experiment",
    "model",
    "split",
    "training",
    "train_snr_db",
    "test_snr_db",
    "elevation",
    "score",
    "threshold",
    "snr_definition",
    "fold",
    "metric",
    "value",
    "low",
    "high",
    "n",
]
TEXT = ("training", "score", "threshold", "fold")
EXPERIMENTS = {
    "single": {"train": {"elevation": [0], "snr_db": "clean"}, "models": ["knn"]},
    "multi": {"train": {"elevation": "all", "snr_db": 6}, "models": ["knn"]},
    "open": {"train": {"elevation": "all", "snr_db": {"each": [6]}}, "models": ["knn"], "open": True},
    "far": {"train": {"elevation": "all", "snr_db": 6}, "models": ["knn"], "open": True, "split": "sector"},
}
RUNS = runs(
    {
        "targets": {"kite": {"role": "unknown"}},
        "learning": {
            "split": {"scheme": "random", "train": 0.7, "validation": 0.33, "folds": 3},
            "experiments": EXPERIMENTS,
        },
        "seed": 0,
        "imaging": {"aperture": 3},
        "motion": {},
    }
)


def scored(folder, tables):
    paths = []
    for name, frame in tables.items():
        paths.append(folder / f"{name}.csv")
        paths[-1].parent.mkdir(parents=True, exist_ok=True)
        if set(frame["side"]) == {"test"}:  # no split leaves the validation without an image
            frame = pd.concat([frame, frame.assign(side="validation")])
        frame.to_csv(paths[-1], index=False)
    score(paths, RUNS, "peak_3db", 0, 2, folder / "scores.csv", folder / "confusion.csv", folder / "validation.csv")
    return [read(folder / f"{name}.csv") for name in ("scores", "confusion")]


def read(path):
    return pd.read_csv(path, dtype=dict.fromkeys(TEXT, str)).fillna(dict.fromkeys(TEXT, ""))


def test_the_scores_table(tmp_path):
    frame = table()
    scores, confusions = scored(tmp_path, {"single/knn/snr_-6dB": frame, "multi/knn/snr_2.5dB": frame})
    assert list(scores) == COLUMNS
    assert len(scores) == 3 * 9 and not scores.drop(columns="train_snr_db").isna().any(axis=None)
    assert set(zip(scores["experiment"], scores["training"], scores["test_snr_db"], strict=True)) == {
        ("single", "clean", -6.0),
        ("multi", "6 dB", 2.5),
    }
    numbers = scores.groupby("experiment")["train_snr_db"]  # plain numbers, as pandas reads them
    assert numbers.get_group("single").isna().all() and (numbers.get_group("multi") == 6).all()
    assert set(scores.query("experiment == 'multi'")["elevation"]) == {"all"}
    for subset, part in (("all", frame), ("trained", frame[frame["elevation"] == 0])):
        single = scores[(scores["experiment"] == "single") & (scores["elevation"] == subset)]
        row = single.set_index("metric").loc["f1_weighted"]
        assert abs(row["value"] - reference.f1_score(part["truth"], part["predicted"], average="weighted")) < 1e-12
        assert row["n"] == len(part)
        assert row["low"] <= row["value"] <= row["high"]
        cells = confusions[(confusions["experiment"] == "single") & (confusions["elevation"] == subset)]
        square = cells.pivot(index="target", columns="predicted", values="count")
        assert (square.to_numpy() == reference.confusion_matrix(part["truth"], part["predicted"])).all()


def test_precision_of_a_class_that_no_image_is_taken_for_is_an_empty_cell(tmp_path):
    frame = table()
    frame["predicted"] = frame["predicted"].replace("disc", "dart")
    scored(tmp_path, {"multi/knn/snr_0dB": frame})
    cells = pd.read_csv(tmp_path / "scores.csv", keep_default_na=False, dtype=str).set_index("metric")
    assert cells.loc["precision_disc", ["value", "low", "high"]].tolist() == ["", "", ""]
    assert float(cells.loc["recall_disc", "value"]) == 0 and float(cells.loc["precision_dart", "low"]) > 0


def test_a_run_has_the_same_scores_whatever_else_is_scored(tmp_path):
    alone, _ = scored(tmp_path / "a", {"multi/knn/snr_0dB": table()})
    both, _ = scored(tmp_path / "b", {"single/knn/snr_-6dB": table(seed=1), "multi/knn/snr_0dB": table()})
    rest = both[both["experiment"] == "multi"].reset_index(drop=True)
    pd.testing.assert_frame_equal(alone, rest)


def test_no_experiment_gives_tables_without_rows(tmp_path):
    score([], {}, "mean", 0, 1, *(tmp_path / f"{name}.csv" for name in ("scores", "confusion", "validation")))
    assert len(pd.read_csv(tmp_path / "scores.csv")) == len(pd.read_csv(tmp_path / "validation.csv")) == 0


def test_a_hundred_runs_are_scored_in_seconds(tmp_path):
    frame = table(np.arange(-45.0, 46, 15), 36)
    tables = {f"single/{model}/snr_{snr}dB": frame for model in "abcdef" for snr in range(17)}
    start = time.perf_counter()
    scored(tmp_path, tables)
    assert time.perf_counter() - start < 30  # about 2 s on an idle core; a loop over resamples takes minutes


def open_table(seed=0, azimuths=12):
    """A prediction table of an open run: two classes, two unknown targets and one of role other, on both sides."""
    random = np.random.default_rng(seed)
    roles = {"dart": "known", "disc": "known", "kite": "unknown", "wing": "unknown", "cube": "other"}
    rows = [
        (name, role, "validation" if a % 3 == 0 else "test", e, a * 30.0, r)
        for name, role in roles.items()
        for e in (0.0, 15.0)
        for a in range(azimuths)
        for r in range(4)
        if role != "other" or a % 3 == 0
    ]
    frame = pd.DataFrame(rows, columns=["target", "role", "side", "elevation", "azimuth", "realization"])
    known = frame["role"] == "known"
    frame["truth"] = frame["target"].where(known, "other")
    frame["predicted"] = np.where(known & (random.random(len(frame)) < 0.9), frame["target"], "disc")
    frame["known_energy"] = random.normal(np.where(known, 1.5, 0), 1)
    frame["known_flat"] = 0.5
    return with_blocks(frame)


def test_the_scores_of_an_open_run(tmp_path):
    frame = open_table()
    scores, confusions = scored(tmp_path, {"open_snr_6dB/knn/snr_0dB": frame})
    assert set(scores["experiment"]) == {"open"} and set(scores["train_snr_db"]) == {6}
    test = frame[(frame["side"] == "test") & (frame["role"] != "other")]
    known = test[test["role"] == "known"]
    row = scores.set_index(["score", "threshold", "metric"])
    # The closed set is the known targets alone.
    closed = row.loc["", "", "f1_weighted"]
    assert abs(closed["value"] - reference.f1_score(known["truth"], known["predicted"], average="weighted")) < 1e-12
    assert closed["n"] == len(known)
    auroc = row.loc["energy", "", "auroc"]
    assert abs(auroc["value"] - reference.roc_auc_score(test["role"] == "known", test["known_energy"])) < 1e-12
    assert auroc["low"] < auroc["value"] < auroc["high"]
    assert row.loc["flat", "", "auroc"]["value"] == 0.5
    for protocol in ("thesis", "blind"):
        threshold = row.loc["energy", protocol, "threshold"]["value"]
        predicted = np.where(test["known_energy"] >= threshold, test["predicted"], "other")
        for metric, value in {
            "accuracy": reference.accuracy_score(test["truth"], predicted),
            "f1_weighted": reference.f1_score(test["truth"], predicted, average="weighted"),
            "f1_macro": reference.f1_score(test["truth"], predicted, average="macro"),
            "recall_other": reference.recall_score(test["truth"] == "other", predicted == "other"),
            "precision_dart": reference.precision_score(test["truth"] == "dart", predicted == "dart"),
        }.items():
            one = row.loc["energy", protocol, metric]
            assert abs(one["value"] - value) < 1e-12, metric
            assert one["low"] <= one["value"] <= one["high"] and one["n"] == len(test)
        cells = confusions[(confusions["score"] == "energy") & (confusions["threshold"] == protocol)]
        square = cells.pivot(index="target", columns="predicted", values="count")
        assert (square == pd.crosstab(test["target"].to_numpy(), predicted)).all(axis=None)
        assert list(square.index) == ["dart", "disc", "kite", "wing"]


def test_a_class_other_counts_as_wrong_in_the_closed_set_and_no_more(tmp_path):
    frame = open_table()
    known = (frame["role"] == "known") & (frame["side"] == "test")
    frame.loc[known & (frame["realization"] == 0), "predicted"] = "other"
    scores, confusions = scored(tmp_path, {"open_snr_6dB/knn/snr_0dB": frame})
    closed = scores[scores["score"] == ""].set_index("metric")["value"]
    rows = frame[known]
    macro = reference.f1_score(rows["truth"], rows["predicted"], average="macro", labels=["dart", "disc"])
    assert abs(closed["f1_macro"] - macro) < 1e-12
    assert abs(closed["accuracy"] - reference.accuracy_score(rows["truth"], rows["predicted"])) < 1e-12
    assert not {"precision_other", "recall_other"} & set(closed.index)
    counted = confusions[(confusions["score"] == "") & (confusions["predicted"] == "other")]["count"]
    assert counted.sum() == (rows["predicted"] == "other").sum()


def test_a_target_may_be_called_na(tmp_path):
    frame = table().replace({"dart": "NA", "disc": "nan"})
    scores, _ = scored(tmp_path, {"multi/knn/snr_0dB": frame})
    assert {"recall_NA", "recall_nan"} < set(scores["metric"])


def test_all_elevations_written_out_are_all(tmp_path):
    scores, _ = scored(tmp_path, {"single/knn/snr_0dB": table(elevations=(0.0,))})
    assert set(scores["elevation"]) == {"all"}


def test_unknown_targets_of_the_validation_side_decide_under_the_thesis_protocol_only(tmp_path):
    frame = open_table()
    garbage = frame.copy()
    unknown = (frame["role"] == "unknown") & (frame["side"] == "validation")
    garbage.loc[unknown, "known_energy"] = 50.0
    before, after = (
        scored(tmp_path / name, {"open_snr_6dB/knn/snr_0dB": rows})[0].set_index(["score", "threshold", "metric"])
        for name, rows in (("a", frame), ("b", garbage))
    )
    for metric in ("threshold", "f1_weighted"):
        assert before.loc["energy", "blind", metric].equals(after.loc["energy", "blind", metric])
    assert before.loc["energy", "thesis", "threshold"]["value"] != after.loc["energy", "thesis", "threshold"]["value"]


def test_the_validation_table_of_closed_runs(tmp_path):
    test, held_out = table(), table(seed=5, right=0.5).assign(side="validation")
    scored(tmp_path, {"single/knn/snr_0dB": pd.concat([test, held_out]), "open_snr_6dB/knn/snr_0dB": open_table()})
    found = read(tmp_path / "validation.csv")
    assert list(found) == [name for name in COLUMNS if name not in ("snr_definition", "fold", "low", "high")]
    closed = found[found["experiment"] == "single"].set_index(["elevation", "metric"])
    assert len(closed) == 4
    for subset, rows in (("all", held_out), ("trained", held_out[held_out["elevation"] == 0])):
        for metric, value in {
            "accuracy": reference.accuracy_score(rows["truth"], rows["predicted"]),
            "f1_weighted": reference.f1_score(rows["truth"], rows["predicted"], average="weighted"),
        }.items():
            assert abs(closed.loc[(subset, metric), "value"] - value) < 1e-12
            assert closed.loc[(subset, metric), "n"] == len(rows)
    # The known scores are judged with the thresholds, under all protocols; that without any threshold is not.
    opened = found[(found["experiment"] == "open") & (found["score"] != "")]
    assert set(zip(opened["score"], opened["threshold"], opened["metric"], strict=True)) == {
        (score, protocol, "f1_weighted") for score in ("energy", "flat") for protocol in ("thesis", "blind", "kept")
    }


def test_what_is_compared_on_validation_images_does_not_know_the_test_images(tmp_path):
    frame = open_table()
    garbage = frame.copy()
    garbage.loc[frame["side"] == "test", ["known_energy", "predicted"]] = [9.0, "dart"]
    for name, rows in (("a", frame), ("b", garbage)):
        scored(tmp_path / name, {"open_snr_6dB/knn/snr_0dB": rows})
    files = [tmp_path / name / "validation.csv" for name in ("a", "b")]
    assert files[0].read_bytes() == files[1].read_bytes()


def folds_table(seed=0):
    """Predictions of three folds, each of its own azimuths, the first with worse models than the others."""
    parts = []
    for fold, right in ((1, 0.4), (2, 0.9), (3, 0.95)):
        frame = open_table(seed + fold)
        wrong = (frame["role"] == "known") & (np.random.default_rng(fold).random(len(frame)) > right)
        frame.loc[wrong, "predicted"] = "disc"
        # Scores of another fold's model do not compare with these.
        parts.append(frame.assign(fold=fold, block=fold, known_energy=frame["known_energy"] + 10 * fold))
    return parts


def test_folds_are_judged_each_by_its_own_models_and_count_together(tmp_path):
    parts = folds_table()
    paths = {f"far_fold{fold}/knn/snr_0dB": frame for fold, frame in enumerate(parts, start=1)}
    scores, confusions = scored(tmp_path, paths)
    assert set(scores["experiment"]) == {"far"} and set(scores["split"]) == {"sector"}
    row = scores[scores["fold"] == ""].set_index(["score", "threshold", "metric"])
    predicted, truth, threshold, auroc = [], [], [], []
    for frame in parts:
        one, _ = scored(tmp_path / "alone", {"open_snr_6dB/knn/snr_0dB": frame.assign(fold=0)})
        alone = one.set_index(["score", "threshold", "metric"])["value"]
        threshold.append(alone["energy", "blind", "threshold"])
        auroc.append(alone["energy", "", "auroc"])
        test = frame[(frame["side"] == "test") & (frame["role"] != "other")]
        predicted += np.where(test["known_energy"] >= threshold[-1], test["predicted"], "other").tolist()
        truth += test["truth"].tolist()
        fold = scores[scores["fold"] == str(test["fold"].iloc[0])].set_index(["score", "threshold", "metric"])
        assert fold.loc[("energy", "blind", "f1_weighted"), "value"] == pytest.approx(
            alone["energy", "blind", "f1_weighted"]
        )
        assert fold["low"].isna().all() and fold["high"].isna().all()
    every = row.loc["energy", "blind", "f1_weighted"]
    assert every["value"] == pytest.approx(reference.f1_score(truth, predicted, average="weighted"))
    assert every["n"] == len(truth) and every["low"] < every["value"] < every["high"]
    assert row.loc["energy", "blind", "threshold"]["value"] == pytest.approx(np.mean(threshold))
    assert row.loc["energy", "", "auroc"]["value"] == pytest.approx(np.mean(auroc))
    assert confusions[(confusions["score"] == "energy") & (confusions["threshold"] == "blind")]["count"].sum() == len(
        truth
    )


def test_scores_at_equal_snr_by_the_other_definition(tmp_path):
    """Images whose SNR by `mean` is 3 dB less for the dart and 4.5 dB less for the others."""
    snrs = (-6, -3, 0, 3, 6, 9)
    frames = {snr: table(seed=snr + 10, right=0.5 + 0.05 * (snr + 6) / 3) for snr in snrs}
    shifts = {}
    for snr, frame in frames.items():
        shifts[snr] = np.where(frame["target"] == "dart", 3.0, 4.5)
        frames[snr] = frame.assign(snr_peak_3db=float(snr), snr_mean=snr - shifts[snr])
    scores, _ = scored(tmp_path, {f"multi/knn/snr_{snr}dB": frame for snr, frame in frames.items()})
    found = scores[(scores["snr_definition"] == "mean") & (scores["metric"] == "accuracy")].set_index("test_snr_db")
    # At most 9 - 4.5 = 4.5 dB, at least -6 - 3 = -9 dB, of the SNRs that the run has.
    assert found.index.tolist() == [-6, -3, 0, 3]
    right = {snr: (frame["truth"] == frame["predicted"]).to_numpy() for snr, frame in frames.items()}
    dart = (frames[0]["target"] == "dart").to_numpy()
    for snr in (-6, -3, 0, 3):
        between = (right[snr + 3][~dart].mean() + right[min(snr + 6, 9)][~dart].mean()) / 2
        expected = right[snr + 3][dart].mean() * dart.mean() + between * (1 - dart.mean())
        row = found.loc[snr]
        assert row["value"] == pytest.approx(expected)
        assert row["low"] < row["value"] < row["high"] and row["n"] == len(dart)
    own = scores[scores["snr_definition"] == "peak_3db"]
    assert set(own["test_snr_db"]) == set(snrs) and {"accuracy", "recall_dart"} < set(own["metric"])
    assert set(scores[scores["snr_definition"] == "mean"]["metric"]) == {"accuracy", "f1_weighted", "f1_macro"}


def test_a_single_block_has_scores_without_intervals(tmp_path):
    scores, _ = scored(tmp_path, {"multi/knn/snr_0dB": table().assign(block=0)})
    assert scores["value"].notna().all() and scores["low"].isna().all() and scores["high"].isna().all()
