"""Folds over whole models: which side each has, its roles in tables, and F1 at several mixes."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from sklearn.metrics import f1_score

from isarflow.core.errors import InputError
from isarflow.learning.caveats import warnings
from isarflow.learning.classifier import OTHER
from isarflow.learning.data.split import Division, apart, blocks, by_family, split
from isarflow.learning.evaluation import judge, metrics, thresholds
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

KNOWN = {"drone": ("quad", "hexa", "octo", "wing"), "missile": ("cruise", "plain", "bomb", "cross")}
OTHERS = [f"kind{number:02}" for number in range(15)]


def targets():
    every = {
        f"{kind}_{number}": {"role": "known", "class": name, "kind": kind}
        for name, kinds in KNOWN.items()
        for kind in kinds
        for number in range(1, 6)
    }
    for kind in OTHERS:
        every |= {f"{kind}_{number}": {"role": "other", "class": kind, "kind": kind} for number in range(1, 5)}
    return every | {"saucer": {"role": "unknown", "class": "saucer", "kind": "saucer"}}


def sides(others, fold, seed=0):
    return by_family(targets(), Division("family", fold, {"others": others}, seed, 11))


@pytest.mark.parametrize("others", ["novel", "seen"])
def test_every_model_is_tested_once_and_validates_once(others):
    folds = [sides(others, fold) for fold in range(1, 6)]
    for name, target in targets().items():
        own = [fold[name] for fold in folds]
        if target["role"] == "unknown":
            assert own == ["test"] * 5
            continue
        assert own.count("test") == 1
        # By kinds one of three that would validate trains instead.
        assert own.count("validation") in ((0, 1) if others == "novel" and target["role"] == "other" else (1,))
    for name_of_class, kinds in KNOWN.items():
        for fold in folds:
            of = [fold[name] for name, target in targets().items() if target["class"] == name_of_class]
            assert [of.count(side) for side in ("train", "validation", "test")] == [12, 4, 4]
            tested = {targets()[name]["kind"] for name in fold if fold[name] == "test"}
            assert set(kinds) <= tested  # a model of each kind


def test_novel_kinds_are_on_one_side_and_seen_ones_train_too():
    for fold in range(1, 6):
        novel, seen = sides("novel", fold), sides("seen", fold)
        of_kinds = {kind: {novel[f"{kind}_{number}"] for number in range(1, 5)} for kind in OTHERS}
        assert all(len(of) == 1 for of in of_kinds.values())
        counts = [sum(of == {side} for of in of_kinds.values()) for side in ("train", "validation", "test")]
        assert counts == [10, 2, 3]
        trained = {name[:6] for name in seen if name.startswith("kind") and seen[name] == "train"}
        assert {name[:6] for name in seen if name.startswith("kind") and seen[name] == "test"} <= trained


def test_the_order_of_kinds_follows_from_the_seed():
    assert sides("novel", 1) == sides("novel", 1) != sides("novel", 1, seed=1)


def test_all_views_train_and_those_tested_share_no_sample():
    division = Division("family", 1, {"others": "seen", "sides": {"a": "train", "b": "test", "c": "test"}}, 0, 11)
    azimuths, elevations = np.arange(121) * 360 / 121, np.arange(3.0)
    views = {name: split(elevations, azimuths, ("xz",), division, name) for name in "abc"}
    assert views["a"]["train"].count == 363 and views["a"]["test"].count == views["a"]["validation"].count == 0
    assert views["b"]["train"].count == 0 and views["b"]["test"].count == 33
    steps = np.diff(np.append(views["b"]["test"].azimuth, views["b"]["test"].azimuth[0] + 121))
    assert (steps == 11).all()
    for count in (121, 100, 12):
        numbers = apart(np.arange(count), "b", division)
        assert np.diff(numbers).min(initial=11) >= 11 and numbers[0] + count - numbers[-1] >= 11
    assert len({blocks(azimuths, (), division, name)[0] for name in "abc"}) == 3  # each target is a block


def test_f1_at_a_mix_is_that_of_weighted_images():
    random = np.random.default_rng(0)
    labels = ["a", "b", OTHER]
    truth, predicted = random.choice(labels, 300, p=[0.5, 0.3, 0.2]), random.choice(labels, 300)
    counts = metrics.confusion(0, *(np.searchsorted(labels, of) for of in (truth, predicted)), (1, 3))[0]
    for share, wanted in ((0.8, {"a": 0.1, "b": 0.1, OTHER: 0.8}), (None, dict.fromkeys(labels, 1 / 3))):
        weights = [wanted[label] / (truth == label).sum() for label in truth]
        expected = f1_score(truth, predicted, average="weighted", sample_weight=weights)
        mixed = metrics.at_mix(counts, labels, share)
        assert metrics.metrics_of(mixed, labels, labels)["f1_weighted"] == pytest.approx(expected, abs=1e-12)


def test_rejecting_all_has_the_f1_of_the_mix():
    labels, counts = ["a", "b", OTHER], np.array([[0, 0, 5], [0, 0, 7], [0, 0, 3]])
    rejected = metrics.metrics_of(metrics.at_mix(counts, labels, metrics.UNKNOWN_MIX), labels, labels)
    assert rejected["f1_weighted"] == pytest.approx(0.8 * 2 * 0.8 / 1.8, abs=1e-12)


def table(count=40):
    random, rows = np.random.default_rng(1), []
    for fold, side, name, role, mean in (
        (fold, side, f"{name}{fold}{side}", role, mean)
        for fold in (1, 2)
        for side in ("validation", "test")
        for name, role, mean in (("a", "known", 1.5), ("b", "known", 1), ("o", "other", 0))
    ):
        truth, tested = (name[0], "known") if role == "known" else (OTHER, "unknown")
        rows.append(
            pd.DataFrame(
                {
                    "fold": fold,
                    "side": side,
                    "target": name,
                    "block": len(rows),
                    "truth": truth,
                    "role": tested if side == "test" else role,
                    "predicted": random.choice(["a", "b"], count, p=[0.9, 0.1] if name[0] == "a" else [0.1, 0.9]),
                    "known_margin": random.normal(mean, 1, count),
                }
            )
        )
    return pd.concat(rows, ignore_index=True)


def test_an_open_set_by_family_has_f1_at_mixes_with_thresholds_of_models_that_do_not_test():
    rows = table()
    decided = {
        of.threshold: of for of in judge.decide(rows, kinds={name: name[0] for name in rows["target"]}) if of.score
    }
    assert set(decided) == {"", "blind", "kept", "mix"}
    found = {metric: value for _, metric, value, *_ in judge.rows(decided["mix"], 0)}
    assert 0 < found["f1_balanced"] < 1 and 0 < found["f1_mix"] < 1
    for fold in (1, 2):
        held_out = rows[(rows["fold"] == fold) & (rows["side"] == "validation")]
        blind, mix = (thresholds.choose(held_out, "known_margin", name) for name in ("blind", "mix"))
        assert mix > blind  # four of five are to be rejected
    separated = {metric: value for _, metric, value, *_ in judge.rows(decided[""], 0)}
    aurocs = []
    for fold in (1, 2):
        test = rows[(rows["fold"] == fold) & (rows["side"] == "test")]
        known = test[test["role"] == "known"]["known_margin"].to_numpy()
        unknown = test[test["role"] == "unknown"]["known_margin"].to_numpy()
        aurocs.append((known[:, None] > unknown).mean())
    assert separated["auroc"] == pytest.approx(np.mean(aurocs), abs=1e-12)


def test_intervals_by_family_are_of_models_drawn_within_their_kinds():
    """Three kinds of ten models, whose shares of right images differ by kind: only the spread within kinds counts."""
    random, rows = np.random.default_rng(3), []
    shares = {
        f"{kind}{number}": mean + 0.05 * random.standard_normal()
        for kind, mean in (("p", 0.6), ("q", 0.75), ("r", 0.9))
        for number in range(10)
    }
    for block, (name, share) in enumerate(shares.items()):
        right = np.arange(100) < round(100 * share)
        rows.append(
            pd.DataFrame(
                {
                    "fold": 1,
                    "side": "test",
                    "target": name,
                    "block": block,
                    "truth": "a",
                    "role": "known",
                    "predicted": np.where(right, "a", "b"),
                }
            )
        )
    rows = pd.concat([*rows, rows[0].assign(side="validation")], ignore_index=True)

    def found(kinds):
        (closed,) = judge.decide(rows, kinds=kinds)
        return next(row[2:5] for row in judge.rows(closed, 0) if row[1] == "accuracy")

    value, low, high = found({name: name[0] for name in shares})
    within = np.sqrt(np.mean([np.var([shares[f"{kind}{n}"] for n in range(10)], ddof=1) for kind in "pqr"]) / 30)
    assert (high - low) / 2 == pytest.approx(stats.t.ppf(0.975, 27) * within, rel=0.1)
    whole = found(dict.fromkeys(shares, "one"))
    assert whole[0] == value and whole[2] - whole[1] > 1.8 * (high - low)
    assert found({name: name for name in shares}) == whole  # kinds of one model each vary together


def test_too_few_models_are_refused_by_name():
    experiment = {
        "train": {"elevation": "all", "snr_db": "clean"},
        "models": ["lr"],
        "open": True,
        "split": {"scheme": "family", "others": "seen"},
    }
    with pytest.raises(InputError, match="takes 5 models of the class drone at least; there are 1"):
        load_config({"learning": {"experiments": {"*": None, "kinds": experiment}}})


@pytest.mark.parametrize("scheme", ["family", "elevation"])
def test_by_family_an_open_experiment_needs_no_target_of_role_unknown(scheme):
    config, clean = read_yaml("config/families-fields.yaml"), {"elevation": "all", "snr_db": "clean"}
    kinds = {"train": clean, "models": ["invariants"], "open": True, "split": {"scheme": scheme}}
    config["learning"] = {"experiments": {"*": None, "kinds": kinds}}
    full = load_config(config)
    sentences = [sentence for _, sentence in warnings(full, dict.fromkeys(full["targets"]))]
    lacking = "experiment 'kinds' is open, but no target has role unknown: it is a closed one."
    assert (lacking in sentences) == (scheme == "elevation")
