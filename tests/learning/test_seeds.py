"""The interval over seeds holds the true mean as often as it says."""

import numpy as np
import pytest

from isarflow.learning.evaluation.metrics import around

SHARE = np.array([True])


def interval(mean, deviation, count, is_share):
    mean, deviation, count = (np.asarray(of, float) for of in (mean, deviation, count))
    return around(mean, deviation / np.sqrt(count), count - 1, is_share)


@pytest.mark.parametrize("seeds", [3, 10])
def test_it_covers_the_mean_of_all_seeds(seeds):
    random = np.random.default_rng(0)
    values = random.normal(0.6, 0.02, (4000, seeds))
    found = values.mean(axis=1), values.std(axis=1, ddof=1), np.full(4000, seeds)
    for is_share in (True, False):
        low, high = interval(*found, np.full(4000, is_share))
        # 0.95 with a deviation of 0.0034.
        assert abs(np.mean((low <= 0.6) & (high >= 0.6)) - 0.95) < 0.012


def test_a_share_stays_one_and_a_single_seed_says_nothing():
    low, high = interval([0.99], [0.02], [3], SHARE)
    assert 0 < low[0] < 0.99 < high[0] < 1
    low, high = interval([0.99], [0.02], [3], ~SHARE)
    assert high[0] > 1 and low[0] == pytest.approx(0.99 - 4.3027 * 0.02 / 3**0.5, abs=1e-5)  # t of 2 degrees
    assert np.isnan(interval([0.5], [np.nan], [1], SHARE)).all()
    assert [end[0] for end in interval([1.0], [0.0], [3], SHARE)] == [1, 1]  # no spread, no width
