"""Differences of two runs: on common images, from the same draws, with intervals that hold what they say."""

import numpy as np
import pandas as pd

from isarflow.learning.evaluation.judge import Decision
from isarflow.learning.evaluation.paired import IMAGE, difference

NAMES = np.array(["a", "b"])


def decision(right, first=0, block=4):
    """Two classes at as many azimuths as `right` (azimuths, 2) has, from the azimuth number `first` on."""
    azimuth, truth = np.meshgrid(np.arange(len(right)) + first, [0, 1], indexing="ij")
    azimuth, truth = azimuth.ravel(), truth.ravel()
    columns = {"target": NAMES[truth], "elevation": 0.0, "azimuth": azimuth * 3.0, "realization": 0}
    test = pd.DataFrame(columns).assign(truth=NAMES[truth], block=azimuth // block, fold=0)
    return Decision("", "", test, NAMES[np.where(right.ravel(), truth, 1 - truth)])


def found(*arguments, seed=0):
    return {name: row for name, *row in difference(*arguments, seed)}


def test_a_run_does_not_differ_from_itself():
    one = decision(np.random.default_rng(0).random((40, 2)) < 0.7)
    for value, of_other, *differs, images in found(one, one).values():
        assert value == of_other and differs == [0, 0, 0] and images == 80


def test_images_that_one_run_alone_has_do_not_count():
    random = np.random.default_rng(1)
    right = random.random((2, 40, 2)) < [[[0.9]], [[0.5]]]
    whole = found(decision(right[0][8:32], 8), decision(right[1][8:32], 8))
    assert whole["accuracy"][0] == right[0][8:32].mean() and whole["accuracy"][-1] == 48
    assert found(decision(right[0][8:], 8), decision(right[1][:32])) == whole
    assert found(decision(right[0][:8]), decision(right[1][8:], 8)) == {}


def test_the_order_of_rows_says_nothing():
    one, other = (decision(np.random.default_rng(seed).random((40, 2)) < 0.7) for seed in (0, 1))
    shuffled = np.random.default_rng(2).permutation(80)
    again = Decision("", "", other.test.iloc[shuffled], other.predicted[shuffled])
    assert found(one, other) == found(one, again)
    assert set(one.test) >= set(IMAGE)


def test_intervals_of_pairs_hold_the_true_difference_and_are_narrower_than_of_strangers():
    """200 times 96 azimuths in blocks of 4; what is hard for one run is hard for the other, too."""
    random, held, widths = np.random.default_rng(3), [], []
    for _ in range(200):
        hard = np.repeat(random.uniform(-0.25, 0.25, (24, 1)), 4, axis=0) + random.uniform(-0.1, 0.1, (96, 2))
        chance = random.random((96, 2))  # the same noise for both
        one = decision(chance < 0.6 + hard)
        *_, low, high, _ = found(one, decision(chance < 0.5 + hard))["accuracy"]
        *_, least, most, _ = found(one, decision(random.random((96, 2)) < 0.5 + hard))["accuracy"]
        held.append(low <= 0.1 <= high)
        widths.append([high - low, most - least])
    assert np.mean(held) > 0.92  # 0.95 with a deviation of 0.015; measured 0.95
    paired, apart = np.mean(widths, axis=0)
    assert paired < 0.6 * apart  # measured 0.44
