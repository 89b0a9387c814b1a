"""What a method gains over the reference thesis's, with an interval from the same resamples."""

import itertools

import numpy as np
import pandas as pd
import pytest

from isarflow.learning.evaluation import judge
from isarflow.learning.evaluation.scores import score
from isarflow.learning.experiments import REFERENCE

MODEL, _, KNOWN_SCORE = REFERENCE
KEYS = ["experiment", "model", "split", "score", "threshold", "test_snr_db"]


def table(seed, quality):
    """Predictions whose known score tells known from unknown images the better the larger `quality` is."""
    random, parts = np.random.default_rng(seed), []
    for role, target in (("known", "a"), ("known", "b"), ("unknown", "u"), ("other", "o")):
        frame = pd.DataFrame({"azimuth": np.repeat(np.arange(24.0), 5)})
        frame = frame.assign(target=target, role=role, elevation=0.0, realization=0)
        frame["truth"] = target if role == "known" else "other"
        frame["predicted"] = np.where(random.random(len(frame)) < 0.8, frame["truth"], "a")
        frame.loc[frame["predicted"] == "other", "predicted"] = "b"
        frame["side"] = np.where(frame["azimuth"] < 8, "validation", "test")
        frame["fold"], frame["block"] = 0, (frame["azimuth"] // 4).astype(int)
        frame[f"known_{KNOWN_SCORE}"] = random.normal(quality * (role == "known"), 1)
        parts.append(frame)
    return pd.concat(parts, ignore_index=True)


@pytest.fixture
def scores(tmp_path):
    """Of the thesis's method, another on the same azimuths, and those of another split, training SNR or target."""
    shared = {
        "elevation": "all",
        "snrs": ["clean"],
        "random_snr": False,
        "open": True,
        "split": "random",
        "motion": {},
        "without": [],
    }
    runs = {
        "theirs": shared | {"experiment": "theirs"},
        "ours": shared | {"experiment": "ours"},
        "far": shared | {"experiment": "far", "split": "sector"},
        "noisy": shared | {"experiment": "noisy", "snrs": ["clean", 0]},
        "away": shared | {"experiment": "away", "without": ["b"]},
    }
    paths = []
    learned = (("theirs", MODEL, 0.3), ("ours", "mine", 3.0), *((run, "mine", 3.0) for run in ("far", "noisy", "away")))
    for run, model, quality in learned:
        for snr in (0, 20):
            path = tmp_path / run / model / f"snr_{snr}dB.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            table(len(run) + snr, quality + snr / 20).to_csv(path, index=False)
            paths.append(path)
    tables = [tmp_path / f"{name}.csv" for name in ("scores", "confusion", "validation")]
    score(paths, runs, "mean", 0, 1, *tables)
    return pd.read_csv(tmp_path / "scores.csv", keep_default_na=False, na_values={"value": [""]}).astype(
        {"value": float, "test_snr_db": float}
    )


def test_the_gain_is_the_difference_of_the_weighted_f1(scores):
    f1 = scores[(scores["metric"] == "f1_weighted") & (scores["threshold"] != "")].set_index(KEYS)["value"]
    gains = scores[scores["metric"] == "f1_weighted_gain"].set_index(KEYS)["value"]
    assert len(gains) == 12
    for where in itertools.product(("thesis", "blind", "kept"), (0, 20)):
        ours = f1["ours", "mine", "random", KNOWN_SCORE, *where]
        theirs = f1["theirs", MODEL, "random", KNOWN_SCORE, *where]
        assert gains["ours", "mine", "random", KNOWN_SCORE, *where] == pytest.approx(ours - theirs, abs=1e-12)
        assert gains["theirs", MODEL, "random", KNOWN_SCORE, *where] == 0


def test_the_interval_is_of_the_same_resamples(scores):
    rows = scores[scores["metric"] == "f1_weighted_gain"].astype({"low": float, "high": float}).set_index("experiment")
    # The method against itself: every resample is the same, so there is nothing between the two.
    assert (rows.loc["theirs", ["low", "high"]].to_numpy() == 0).all()
    ours = rows.loc["ours"]
    assert (ours["low"] > 0).all() and (ours["low"] < ours["value"]).all() and (ours["value"] < ours["high"]).all()


def test_another_split_and_other_training_are_not_compared(scores):
    assert set(scores[scores["metric"] == "f1_weighted_gain"]["experiment"]) == {"theirs", "ours"}


def test_the_gain_is_over_the_folds_that_both_have():
    """The reference was fitted for the second and third of three folds only."""
    frames = [table(fold, 2.0).assign(fold=fold, block=fold) for fold in (1, 2, 3)]
    references = [table(fold + 9, 0.3).assign(fold=fold, block=fold) for fold in (2, 3)]

    def decided(parts):
        found = judge.decide(pd.concat(parts, ignore_index=True))
        return next(one for one in found if one.threshold == "blind")

    value, low, high, images = judge.gain(decided(frames), decided(references), 0)
    ours, theirs = (judge.rows(decided(parts), 0) for parts in (frames[1:], references))
    f1 = [next(row[2] for row in rows if row[:2] == ("", "f1_weighted")) for rows in (ours, theirs)]
    assert value == pytest.approx(f1[0] - f1[1]) and low < value < high
    assert images == sum((part["side"] == "test").sum() - 16 * 5 for part in frames[1:])  # less those of role other
    assert judge.gain(decided(frames[:1]), decided(references), 0) is None
