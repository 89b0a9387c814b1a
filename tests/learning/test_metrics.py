import time

import numpy as np
import pandas as pd
import pytest
from sklearn import metrics as reference

from learning.metrics import confusion, figures, intervals
from learning.scores import score

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
        predicted[predicted == never] = 0  # a class that is never predicted has precision 0
    counts = confusion(np.zeros_like(truth), truth, predicted, (1, 3))[0]
    assert (counts == reference.confusion_matrix(truth, predicted)).all()
    ours = figures(counts, LABELS)
    precision, recall, _, _ = reference.precision_recall_fscore_support(truth, predicted, zero_division=0)
    expected = {
        "accuracy": reference.accuracy_score(truth, predicted),
        "f1_weighted": reference.f1_score(truth, predicted, average="weighted"),
        "f1_macro": reference.f1_score(truth, predicted, average="macro"),
    }
    for index, label in enumerate(LABELS):
        expected |= {f"precision_{label}": precision[index], f"recall_{label}": recall[index]}
    assert ours.keys() == expected.keys()
    for name, value in expected.items():
        assert abs(ours[name] - value) < 1e-12, name


def test_resampled_metrics_are_those_of_repeated_observations():
    groups, truth, predicted = outcomes(300, 10)
    counts = confusion(groups, truth, predicted, (10, 3))
    weights = np.array([0, 3, 1, 1, 0, 2, 0, 1, 1, 1])
    rows = np.concatenate([np.flatnonzero(groups == group) for group in np.repeat(np.arange(10), weights)])
    ours = figures(np.tensordot(weights, counts, axes=1), LABELS)
    assert abs(ours["f1_macro"] - reference.f1_score(truth[rows], predicted[rows], average="macro")) < 1e-12


def test_intervals_are_seeded_and_contain_the_value():
    groups, truth, predicted = outcomes()
    counts = confusion(groups, truth, predicted, (30, 3))
    first, again, other = (intervals(counts, LABELS, seed) for seed in (0, 0, 1))
    assert first == again != other
    for name, value in figures(counts.sum(axis=0), LABELS).items():
        low, high = first[name]
        assert low < value < high, name


def test_intervals_cover_the_truth_where_images_of_an_azimuth_share_their_fate():
    # Each azimuth's 20 images are all right or all wrong: 60 independent draws, not 1200.
    covered, widths = 0, []
    for seed in range(200):
        right = np.random.default_rng(seed).random(60) < 0.7
        counts = np.zeros((60, 3, 3), int)
        counts[:, 0, 0], counts[:, 0, 1] = 20 * right, 20 * ~right
        low, high = intervals(counts, LABELS, seed)["accuracy"]
        covered += low <= 0.7 <= high
        widths.append(high - low)
    assert 0.89 <= covered / 200 <= 0.99
    assert np.mean(widths) == pytest.approx(2 * 1.96 * np.sqrt(0.7 * 0.3 / 60), rel=0.1)


def table(elevations=(0.0, 15.0), azimuths=12, seed=0, right=0.8):
    """A prediction table of three classes."""
    rows = [(name, e, a * 30.0, r) for name in LABELS for e in elevations for a in range(azimuths) for r in range(3)]
    frame = pd.DataFrame(rows, columns=["target", "elevation", "azimuth", "realization"])
    random = np.random.default_rng(seed)
    frame["truth"] = frame["target"]
    frame["predicted"] = np.where(random.random(len(frame)) < right, frame["truth"], random.choice(LABELS, len(frame)))
    return frame


COLUMNS = [
    "experiment",
    "model",
    "split",
    "train_snr_db",
    "test_snr_db",
    "elevation",
    "metric",
    "value",
    "low",
    "high",
    "n",
]
EXPERIMENTS = {
    "single": {"train": {"elevation": [0], "snr_db": "clean"}, "models": ["knn"]},
    "multi": {"train": {"elevation": "all", "snr_db": 6}, "models": ["knn"]},
}


def scored(folder, tables):
    paths = []
    for name, frame in tables.items():
        paths.append(folder / f"{name}.csv")
        paths[-1].parent.mkdir(parents=True, exist_ok=True)
        frame.to_csv(paths[-1], index=False)
    score(paths, EXPERIMENTS, "random", 0, folder / "scores.csv", folder / "confusion.csv")
    return pd.read_csv(folder / "scores.csv", dtype={"train_snr_db": str}), pd.read_csv(folder / "confusion.csv")


def test_the_scores_table(tmp_path):
    frame = table()
    scores, confusions = scored(tmp_path, {"single/knn/snr_-6dB": frame, "multi/knn/snr_2.5dB": frame})
    assert list(scores) == COLUMNS
    assert len(scores) == 3 * 9 and not scores.isna().any(axis=None)
    assert set(zip(scores["experiment"], scores["train_snr_db"], scores["test_snr_db"], strict=True)) == {
        ("single", "clean", -6.0),
        ("multi", "6", 2.5),
    }
    assert set(scores.query("experiment == 'multi'")["elevation"]) == {"all"}
    for subset, part in (("all", frame), ("trained", frame[frame["elevation"] == 0])):
        single = scores[(scores["experiment"] == "single") & (scores["elevation"] == subset)]
        row = single.set_index("metric").loc["f1_weighted"]
        assert abs(row["value"] - reference.f1_score(part["truth"], part["predicted"], average="weighted")) < 1e-12
        assert row["n"] == len(part)
        assert row["low"] <= row["value"] <= row["high"]
        cells = confusions[(confusions["experiment"] == "single") & (confusions["elevation"] == subset)]
        square = cells.pivot(index="truth", columns="predicted", values="count")
        assert (square.to_numpy() == reference.confusion_matrix(part["truth"], part["predicted"])).all()


def test_a_run_has_the_same_scores_whatever_else_is_scored(tmp_path):
    alone, _ = scored(tmp_path / "a", {"multi/knn/snr_0dB": table()})
    both, _ = scored(tmp_path / "b", {"single/knn/snr_-6dB": table(seed=1), "multi/knn/snr_0dB": table()})
    rest = both[both["experiment"] == "multi"].reset_index(drop=True)
    pd.testing.assert_frame_equal(alone, rest)


def test_no_experiment_gives_tables_without_rows(tmp_path):
    score([], {}, "random", 0, tmp_path / "scores.csv", tmp_path / "confusion.csv")
    assert len(pd.read_csv(tmp_path / "scores.csv")) == 0


def test_a_hundred_runs_are_scored_in_seconds(tmp_path):
    frame = table(np.arange(-45.0, 46, 15), 36)
    tables = {f"single/{model}/snr_{snr}dB": frame for model in "abcdef" for snr in range(17)}
    start = time.perf_counter()
    scored(tmp_path, tables)
    assert time.perf_counter() - start < 30  # about 2 s on an idle core; a loop over resamples takes minutes
