import numpy as np
import pytest

from common.errors import InputError
from learning.split import split

SETTINGS = {"scheme": "random", "train": 0.7}


@pytest.mark.parametrize("count", [2, 10, 121, 242])
@pytest.mark.parametrize("share", [0.5, 0.57, 0.7])
def test_sides_are_disjoint_complete_and_of_the_right_size(count, share):
    train, test = split(np.arange(count), {"scheme": "random", "train": share}, 0)
    assert sorted([*train, *test]) == list(range(count))
    assert len(train) == (count * round(share * 100)) // 100
    assert (np.diff(train) > 0).all() and (np.diff(test) > 0).all()


def test_the_seed_and_nothing_else_decides():
    azimuths = np.arange(121) * 360 / 121
    first = split(azimuths, SETTINGS, 0)
    np.random.default_rng(0).random(5)
    for side, same in zip(first, split(azimuths, dict(reversed(SETTINGS.items())), 0), strict=True):
        assert side.tolist() == same.tolist()
    assert split(azimuths, SETTINGS, 1)[0].tolist() != first[0].tolist()


def test_training_azimuths_are_spread_over_the_circle():
    train, _ = split(np.arange(1000), SETTINGS, 0)
    quarters = np.bincount(train // 250)
    assert quarters.min() > 150 and quarters.max() < 200


@pytest.mark.parametrize(("count", "share"), [(1, 0.7), (3, 0.2)])
def test_an_empty_side_is_refused(count, share):
    with pytest.raises(InputError, match=r"learning\.split\.train.*aspect\.azimuth"):
        split(np.arange(count), {"scheme": "random", "train": share}, 0)
