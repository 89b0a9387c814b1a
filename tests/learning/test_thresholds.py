import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import f1_score

from isarflow.core.errors import InputError
from isarflow.learning.evaluation import judge, thresholds


def validation(seed=0, count=60):
    """Validation rows with scores that overlap: two known classes, an unknown target and one of role other."""
    random = np.random.default_rng(seed)
    parts = []
    for name, role, mean in (("a", "known", 1.5), ("b", "known", 1), ("u", "unknown", 0), ("o", "other", -2)):
        known = role == "known"
        parts.append(
            pd.DataFrame(
                {
                    "target": name,
                    "role": role,
                    "side": "validation",
                    "truth": name if known else "other",
                    "predicted": np.where(random.random(count) < 0.9, name if known else "a", "b"),
                    "known_x": np.round(random.normal(mean, 1, count), 1),  # with equal scores among them
                }
            )
        )
    table = pd.concat(parts, ignore_index=True)
    table.loc[random.random(len(table)) < 0.2, "predicted"] = "other"  # some models have such a class
    return table


def weighted_f1(rows, threshold, protocol):
    predicted = thresholds.apply(rows["known_x"], rows["predicted"], threshold)
    known = rows["role"] == "known"
    # But under the thesis protocol both halves count alike.
    weights = None if protocol == "thesis" else np.where(known, 1, known.sum() / (~known).sum())
    return f1_score(rows["truth"], predicted, average="weighted", zero_division=0, sample_weight=weights)


@pytest.mark.parametrize("protocol", ["thesis", "blind"])
@pytest.mark.parametrize("seed", range(5))
def test_no_threshold_has_a_larger_f1(protocol, seed):
    table = validation(seed)
    rows = table[table["role"].isin(thresholds.ROLES[protocol])]
    chosen = weighted_f1(rows, thresholds.choose(table, "known_x", protocol), protocol)
    values = np.sort(rows["known_x"].unique())
    every = [values[0] - 1, *((values[1:] + values[:-1]) / 2), values[-1] + 1]
    assert chosen == pytest.approx(max(weighted_f1(rows, threshold, protocol) for threshold in every), abs=1e-12)
    # The same is said of the threshold, from the validation rows alone.
    more = pd.concat([table, table.assign(side="test", predicted="b")])
    assert thresholds.threshold_and_f1(more, "known_x", protocol)[1:] == (pytest.approx(chosen, abs=1e-12), len(rows))


def test_the_blind_threshold_does_not_depend_on_how_many_images_are_of_role_other():
    table = validation()
    others = table[table["role"] == "other"]
    chosen = thresholds.choose(table, "known_x", "blind")
    more = pd.concat([table, others, others], ignore_index=True)
    assert thresholds.choose(more, "known_x", "blind") == pytest.approx(chosen)
    # The thesis protocol takes the mixture as it is.
    unknown = table[table["role"] == "unknown"]
    more = pd.concat([table, *[unknown] * 5], ignore_index=True)
    assert thresholds.choose(more, "known_x", "thesis") > thresholds.choose(table, "known_x", "thesis")


def test_a_gap_is_cut_in_its_middle():
    scores, truth = np.array([5.0, 4.0, 1.0, 0.0]), np.array(["a", "b", "other", "other"])
    assert thresholds.best(scores, truth, np.array(["a", "b", "a", "b"])) == 2.5


def test_of_a_plateau_the_middle_is_taken():
    scores, predicted = np.array([5.0, 4, 3, 2, 1]), np.array(["a", "other", "other", "other", "a"])
    assert thresholds.best(scores, np.array(["a", "other", "other", "other", "other"]), predicted) == 2.5


def test_what_was_predicted_other_stays_other():
    scores, truth = np.array([3.0, 2.0, 1.0]), np.array(["a", "other", "a"])
    predicted = np.array(["a", "other", "a"])
    threshold = thresholds.best(scores, truth, predicted)
    assert threshold <= 1
    assert thresholds.apply(scores, predicted, threshold).tolist() == ["a", "other", "a"]


def test_the_blind_threshold_does_not_depend_on_unknown_targets():
    """Their rows may hold anything, on any side: garbage changes nothing."""
    table = validation()
    chosen = thresholds.choose(table, "known_x", "blind")
    unknown = table["role"] == "unknown"
    garbage = table.assign(known_x=np.where(unknown, np.nan, table["known_x"]))
    garbage.loc[unknown, ["truth", "predicted"]] = "nonsense"
    assert thresholds.choose(garbage, "known_x", "blind") == chosen
    assert thresholds.choose(table[~unknown], "known_x", "blind") == chosen
    assert thresholds.choose(table, "known_x", "thesis") != chosen


@pytest.mark.parametrize("protocol", thresholds.ROLES)
def test_no_threshold_depends_on_test_images(protocol):
    table = validation()
    tests = validation(seed=1).assign(side="test", known_x=100.0)
    both = pd.concat([table, tests], ignore_index=True)
    assert thresholds.choose(both, "known_x", protocol) == thresholds.choose(table, "known_x", protocol)


def test_a_fold_without_validation_images_of_known_targets_is_refused():
    """It has no threshold, and so its test images no label."""
    table, tests = validation().assign(fold=1), validation(seed=1).assign(side="test", block=0)
    both = pd.concat([table, tests.assign(fold=1), tests.assign(fold=2)], ignore_index=True)
    for more in (table.iloc[:0], table.query("role != 'known'"), table.assign(side="left out")):
        with pytest.raises(InputError, match="fold 2 has no validation image of a known target: no threshold can be"):
            judge.decide(pd.concat([both, more.assign(fold=2)], ignore_index=True))
    decided = judge.decide(pd.concat([both, table.assign(fold=2)], ignore_index=True))
    assert {label for one in decided if one.threshold for label in one.predicted} == {"a", "b", "other"}
    closed, *opened = judge.decide(both.drop(columns="known_x"))  # needs none
    assert len(closed.test) == 2 * 120 and opened == []


def test_with_known_images_alone_95_percent_are_kept():
    table = validation(count=400)
    table = table[table["role"] == "known"]
    threshold = thresholds.choose(table, "known_x", "blind")
    assert (table["known_x"] >= threshold).mean() == pytest.approx(0.95, abs=0.02)


@pytest.mark.parametrize("kept", [0.5, 0.8, 0.95, 0.99])
@pytest.mark.parametrize("seed", range(5))
def test_exactly_the_share_of_the_known_images_is_kept(kept, seed):
    table = validation(seed, count=200).assign(known_x=np.random.default_rng(seed).permutation(800))
    known = table["role"] == "known"
    threshold = thresholds.choose(table, "known_x", "kept", kept)
    assert (table.loc[known, "known_x"] >= threshold).sum() == round(kept * 400)
    # Nothing but the known images decides.
    others = table.assign(known_x=np.where(known, table["known_x"], 1e9))
    assert thresholds.choose(others, "known_x", "kept", kept) == threshold
    assert thresholds.choose(table[known], "known_x", "kept", kept) == threshold
    assert thresholds.choose(table[known], "known_x", "blind", kept) == threshold  # has nothing else to choose by


def test_what_is_kept_is_judged_as_what_is_chosen_blindly():
    """So that methods compare: by the known images alone the best would be the one that rejects them for no reason."""
    table = validation()
    rows = table[table["role"].isin({"known", "other"})]
    threshold, value, count = thresholds.threshold_and_f1(table, "known_x", "kept")
    assert value == pytest.approx(weighted_f1(rows, threshold, "kept"), abs=1e-12) and count == len(rows)
    assert value <= thresholds.threshold_and_f1(table, "known_x", "blind")[1]
