"""Several looks at a target: which rows make a track, and what their sum reaches."""

import itertools

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from isarflow.learning.evaluation.looks import LOOKS, fused
from isarflow.learning.evaluation.scores import score

STEP, APERTURE = 10.0, 3  # degrees, azimuths: 36 of them on a circle


def table(azimuths, elevations=(0.0,), side="test", separation=0.0, seed=0, role="known"):
    """Predictions of two classes by Gaussian likelihoods whose means are `separation` standard deviations apart."""
    random, truth = np.random.default_rng(seed), ["a", "b"] if role == "known" else ["u"]
    frame = pd.DataFrame(
        itertools.product(truth, elevations, azimuths, [0, 1]),
        columns=["target", "elevation", "azimuth", "realization"],
    )
    mean = frame["target"].map({"a": separation / 2, "b": -separation / 2, "u": 0.0})
    ratio = separation * (mean + random.standard_normal(len(frame)))  # log p(x | a) - log p(x | b)
    known = random.normal(0.5 if role == "known" else -0.5, 1, len(frame))  # and of known against unknown
    frame = frame.assign(
        score_a=ratio / 2, score_b=-ratio / 2, known_ratio=known, role=role, side=side, fold=0, block=0
    )
    frame["truth"] = frame["target"] if role == "known" else "other"
    frame["predicted"] = np.where(ratio > 0, "a", "b")
    return frame


def test_looks_of_a_track_are_an_aperture_apart_on_one_side_at_one_elevation():
    circle = np.arange(36) * STEP
    frame = table(circle, (0.0, 5.0), separation=1.0)
    frame.loc[(frame["azimuth"] >= 300) & (frame["elevation"] == 5), "side"] = "validation"
    found = fused(frame, 3, STEP, APERTURE)
    values = frame.set_index(["target", "elevation", "azimuth", "realization"])["score_a"]
    for row in found.itertuples():
        along = [
            values[row.target, row.elevation, (row.azimuth + 30 * look) % 360, row.realization] for look in range(3)
        ]
        assert row.score_a == pytest.approx(sum(along)) and row.predicted == ("a" if row.score_a > row.score_b else "b")
    # Round the circle at 0 degrees; at 5 degrees tracks of three begin at 0 to 230 degrees and none within 60 degrees.
    begins = found.groupby(["elevation", "side"])["azimuth"].unique()
    assert sorted(begins[0, "test"]) == circle.tolist()
    assert sorted(begins[5, "test"]) == circle[:24].tolist() and (5, "validation") not in begins


def test_other_things_are_never_named_by_several_looks():
    """As of one look: only a threshold rejects, though a model with a margin scores other things as a class."""
    frame = table(np.arange(36) * STEP, separation=1.0)
    with_other = frame.assign(score_other=frame[["score_a", "score_b"]].max(axis=1) + 1)
    found = fused(with_other, 3, STEP, APERTURE)
    assert found["predicted"].equals(fused(frame, 3, STEP, APERTURE)["predicted"])


@pytest.mark.parametrize(
    ("azimuths", "count", "begins"), [(12, 2, 9), (12, 4, 3), (12, 5, 0), (36, 12, 36), (36, 13, 0)]
)
def test_a_track_needs_room(azimuths, count, begins):
    frame = table(np.arange(azimuths) * STEP + (7 if azimuths < 36 else 0))
    assert len(fused(frame, count, STEP, APERTURE)) == begins * 2 * 2


@pytest.mark.parametrize("count", LOOKS)
def test_what_looks_reach_together_is_what_their_likelihoods_say(count):
    frame = table(np.arange(36) * STEP, np.arange(60.0), separation=1.0)
    right = fused(frame, count, STEP, APERTURE).eval("truth == predicted").mean()
    assert right == pytest.approx(norm.cdf(np.sqrt(count) / 2), abs=0.02)


def test_scores_have_rows_for_several_looks_of_models_that_add_up(tmp_path):
    circle, frames = np.arange(36) * STEP, []
    for seed, (side, role) in enumerate(itertools.product(("test", "validation"), ("known", "unknown", "other"))):
        if (side, role) != ("test", "other"):
            part = table(circle, (0.0, 5.0), side, 1.5, seed, role)
            frames.append(part.replace({"target": {"u": "o"}}) if role == "other" else part)
    frame = pd.concat(frames)
    frame["block"] = (frame["azimuth"] // 30).astype(int)
    run = {"experiment": "e", "elevation": "all", "snrs": ["clean"], "random_snr": False, "open": True, "without": []}
    runs, paths, found = {"e": run | {"split": "elevation", "motion": {}}}, [], {}
    for model in ("adds", "not"):
        paths.append(tmp_path / "e" / model / "snr_0dB.csv")
        paths[-1].parent.mkdir(parents=True)
        frame.to_csv(paths[-1], index=False)
    for name, track in (("with", (["adds"], STEP, APERTURE)), ("without", None)):
        tables = [tmp_path / f"{kind}_{name}.csv" for kind in ("scores", "confusion", "validation")]
        score(paths, runs, "mean", 0, 1, *tables, track=track)
        found[name] = pd.read_csv(tables[0], keep_default_na=False)
    own = found["with"]["metric"].str.contains("_looks")
    assert found["with"][~own].reset_index(drop=True).equals(found["without"])
    rows = found["with"][own]
    assert set(rows["model"]) == {"adds"} and set(rows["threshold"]) == {"", "blind", "thesis", "kept"}
    for case in (("", ""), ("ratio", "blind"), ("ratio", "kept")):
        several = rows[(rows["score"] == case[0]) & (rows["threshold"] == case[1])]
        single = found["without"].query("model == 'adds' and metric == 'f1_weighted' and score == @case[0]")
        single = single[single["threshold"] == case[1]]["value"].item()
        assert several["metric"].tolist() == [f"f1_weighted_{count}_looks" for count in LOOKS]
        assert single < several["value"].iloc[0] < several["value"].iloc[-1]
        assert set(several["n"]) == {(2 + bool(case[0])) * 2 * 36 * 2}  # targets, elevations, azimuths, realizations
