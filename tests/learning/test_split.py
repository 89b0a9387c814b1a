import itertools

import numpy as np
import pytest

from core.errors import InputError
from learning.split import SIDES, split

SETTINGS = {"scheme": "random", "train": 0.7, "validation": 0.33}


def circle(count):
    return np.arange(count) * (360 / count)


@pytest.mark.parametrize("count", [10, 121, 242])
@pytest.mark.parametrize("share", [0.5, 0.57, 0.7])
def test_random_sides_are_disjoint_complete_and_of_the_right_size(count, share):
    sides = split(circle(count), SETTINGS | {"train": share}, 0, 5, "random")
    assert sorted(np.concatenate([*sides.values()])) == list(range(count))
    assert len(sides["train"]) == (count * round(share * 100)) // 100
    assert len(sides["validation"]) == max(int(0.33 * (count - len(sides["train"]))), 1)
    assert all((np.diff(index) > 0).all() for index in sides.values())


@pytest.mark.parametrize("scheme", ["random", "sector"])
def test_the_seed_and_nothing_else_decides(scheme):
    first = split(circle(121), SETTINGS, 0, 11, scheme)
    np.random.default_rng(0).random(5)
    again = split(circle(121), dict(reversed(SETTINGS.items())), 0, 11, scheme)
    assert [first[side].tolist() for side in SIDES] == [again[side].tolist() for side in SIDES]
    assert split(circle(121), SETTINGS, 1, 11, scheme)["train"].tolist() != first["train"].tolist()


def test_training_azimuths_are_spread_over_the_circle():
    train = split(circle(1000), SETTINGS, 0, 5, "random")["train"]
    quarters = np.bincount(train // 250)
    assert quarters.min() > 150 and quarters.max() < 200


@pytest.mark.parametrize(("count", "aperture"), [(36, 5), (121, 11), (242, 21)])
@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_images_of_two_sectors_share_no_sample(count, aperture, closed, seed):
    azimuths = circle(count) if closed else np.arange(count) * (300 / count)
    sides = split(azimuths, SETTINGS, seed, aperture, "sector")
    samples = {}
    for side, index in sides.items():
        offsets = index[:, None] + np.arange(aperture) - aperture // 2
        samples[side] = set((offsets % count if closed else offsets).ravel().tolist())
    for one, other in itertools.combinations(SIDES, 2):
        assert not samples[one] & samples[other]
    # No azimuth is given away beyond the guards, and each side is one sector.
    guards = 3 if closed else 2
    used = count - guards * (aperture - 1)
    assert sum(map(len, sides.values())) == used
    assert len(sides["train"]) == (7 * used) // 10
    for index in sides.values():
        gaps = np.diff(np.concatenate([index, [index[0] + count]])) if closed else np.diff(index)
        assert (gaps != 1).sum() == (1 if closed else 0)


def test_the_seed_turns_the_sectors():
    starts = {split(circle(121), SETTINGS, seed, 11, "sector")["test"][0] for seed in range(20)}
    assert len(starts) > 10


@pytest.mark.parametrize(
    ("count", "scheme", "left"),
    [(2, "random", "1 to train, 1 to validate, 0 to test"), (30, "sector", "0 to train, .* and 10 as a guard")],
)
def test_an_empty_side_is_refused(count, scheme, left):
    with pytest.raises(InputError, match=rf"split\.train': 0\.7 of {count} azimuths.*{left}.*aspect\.azimuth"):
        split(circle(count), SETTINGS, 0, 11, scheme)


@pytest.mark.parametrize("count", [3, 4, 5, 8])
@pytest.mark.parametrize("share", [0.5, 0.7, 0.99])
def test_a_few_azimuths_leave_one_for_each_side(count, share):
    sides = split(circle(count), SETTINGS | {"train": share}, 0, 3, "random")
    assert all(len(index) >= 1 for index in sides.values())
