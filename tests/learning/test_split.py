"""Who trains, validates and tests: no side sees another's samples, mirrored ones either, and every aspect is tested."""

import itertools

import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.learning.data.split import SIDES, Division, blocks, check, divisions, folded, split

SETTINGS = {"scheme": "random", "train": 0.7, "validation": 0.33, "folds": 6, "spacing": 0}
ELEVATIONS = np.arange(-45, 46, 15.0)
PLANES = [(), ("xz",), ("yz",), ("xz", "yz")]
SWEEPS = [(36, 5), (121, 11), (242, 21)]  # azimuths and aperture of config/smoke.yaml, config.yaml and thesis.yaml


def circle(count):
    return np.arange(count) * (360 / count)


def at_random(seed=0, aperture=5, **settings):
    (division,) = divisions("random", SETTINGS | settings, seed, aperture)
    return division


def by_sector(aperture, seed=0, **settings):
    return divisions("sector", SETTINGS | settings, seed, aperture)


def sides_of(azimuths, planes, division):
    """Indices of the azimuths of each side, of a scheme whose sides have all elevations."""
    sides = split(ELEVATIONS, azimuths, planes, division)
    assert all(side.elevation.tolist() == list(range(len(ELEVATIONS))) for side in sides.values())
    return {name: side.azimuth for name, side in sides.items()}


def mirrored(angles, planes):
    """The angles and their mirror images in degrees, (images, n)."""
    images = [angles]
    if "xz" in planes:
        images += [-angle for angle in images]
    if "yz" in planes:
        images += [180 - angle for angle in images]
    return np.array(images)


def samples(azimuths, index, aperture, planes, closed):
    """The angles in degrees whose field the images of these azimuths hold, mirror images with them: a set."""
    offsets = index[:, None] + np.arange(aperture) - aperture // 2
    step = azimuths[1] - azimuths[0]
    held = azimuths[0] + step * (offsets % len(azimuths) if closed else offsets).ravel()
    return set((np.round(mirrored(held, planes) % 360, 4) % 360).ravel().tolist())


@pytest.mark.parametrize("count", [10, 121, 242])
@pytest.mark.parametrize("planes", PLANES)
@pytest.mark.parametrize("share", [0.5, 0.57, 0.7])
def test_random_sides_are_disjoint_complete_and_of_the_right_size(count, planes, share):
    sides = sides_of(circle(count), planes, at_random(train=share))
    assert sorted(np.concatenate([*sides.values()])) == list(range(count))
    assert all((np.diff(index) > 0).all() for index in sides.values())
    aspects = {side: len(set(np.round(folded(circle(count)[index], planes), 6))) for side, index in sides.items()}
    every = sum(aspects.values())
    assert aspects["train"] == min((every * round(share * 100)) // 100, every - 2)
    assert aspects["validation"] == max(int(0.33 * (every - aspects["train"])), 1)


@pytest.mark.parametrize(("count", "aperture"), SWEEPS)
@pytest.mark.parametrize("planes", PLANES)
@pytest.mark.parametrize("scheme", ["random", "sector"])
def test_no_side_holds_a_mirror_image_of_anothers_view(count, aperture, planes, scheme):
    azimuths = circle(count)
    for division in divisions(scheme, SETTINGS, 0, aperture):
        sides = sides_of(azimuths, planes, division)
        views = {
            side: set((np.round(mirrored(azimuths[index], planes) % 360, 4) % 360).ravel().tolist())
            for side, index in sides.items()
        }
        for one, other in itertools.combinations(SIDES, 2):
            assert not views[one] & views[other]


@pytest.mark.parametrize(("count", "aperture"), SWEEPS)
@pytest.mark.parametrize("planes", PLANES)
@pytest.mark.parametrize("closed", [True, False])
def test_by_sector_no_side_shares_a_sample_or_a_mirrored_one(count, aperture, planes, closed):
    azimuths = circle(count) if closed else np.arange(count) * (300 / count) - 140
    every = by_sector(aperture)
    for division in every:
        sides = sides_of(azimuths, planes, division)
        held = {side: samples(azimuths, index, aperture, planes, closed) for side, index in sides.items()}
        for one, other in itertools.combinations(SIDES, 2):
            assert not held[one] & held[other]
        # Nothing is given away: whoever is on no side shares a sample with the test's or the validation's images, or is
        # nearer to them than an aperture where mirror images fall between the samples.
        left_out = np.setdiff1d(np.arange(count), np.concatenate([*sides.values()]))
        aspects = folded(azimuths, planes)
        others = aspects[np.concatenate([sides["validation"], sides["test"]])]
        distances = np.abs(aspects[left_out, None] - others)
        if closed and not planes:
            distances = np.minimum(distances, 360 - distances)
        assert (distances.min(axis=1, initial=np.inf) < aperture * (azimuths[1] - azimuths[0]) - 1e-9).all()
    # Every azimuth is tested by one of the folds.
    tested = np.concatenate([sides_of(azimuths, planes, division)["test"] for division in every])
    assert sorted(tested) == list(range(count))


@pytest.mark.parametrize(("count", "aperture"), SWEEPS)
@pytest.mark.parametrize("planes", PLANES[:3])
def test_every_fold_of_a_target_with_one_plane_or_none_trains_a_good_part(count, aperture, planes):
    for division in by_sector(aperture):
        check(split(ELEVATIONS, circle(count), planes, division), division, "a", count)
        sides = sides_of(circle(count), planes, division)
        if planes:
            assert len(sides["train"]) > 0.13 * count
        else:  # three guards, and no more
            assert sum(map(len, sides.values())) == count - 3 * (aperture - 1)
        assert len(sides["validation"]) >= 1 and len(sides["test"]) == pytest.approx(count / 6, abs=3)


def test_sectors_are_arcs():
    for division in by_sector(11):
        sides = sides_of(circle(121), ("xz",), division)
        for side in ("validation", "test"):
            aspects = np.unique(np.round(folded(circle(121)[sides[side]], ("xz",)), 6))
            np.testing.assert_allclose(np.diff(aspects), 360 / 121, rtol=1e-4)


@pytest.mark.parametrize("planes", PLANES)
def test_aspects_are_those_of_the_mirror_images(planes):
    azimuths = np.random.default_rng(1).uniform(0, 360, 50)
    aspects = folded(azimuths, planes)
    for image in mirrored(azimuths, planes):
        folded_image = folded(image % 360, planes) if planes else aspects
        np.testing.assert_allclose(folded_image, aspects, atol=1e-9)
    low, high = {(): (0, 360), ("xz",): (0, 180), ("yz",): (-90, 90), ("xz", "yz"): (0, 90)}[planes]
    assert aspects.min() >= low and aspects.max() <= high
    assert len(np.unique(np.round(aspects, 9))) == 50  # no two others become one


@pytest.mark.parametrize("planes", PLANES)
def test_shuffled_azimuths_are_divided_as_if_there_were_no_mirror_plane(planes):
    azimuths, (shuffled,) = circle(242), divisions("shuffled", SETTINGS, 0, 21)
    sides = sides_of(azimuths, planes, shuffled)
    for name, side in sides_of(azimuths, (), at_random()).items():
        assert (sides[name] == side).all()
    # Of most test images the mirror image trains.
    trained = np.round(mirrored(azimuths[sides["train"]], planes) % 360, 4) % 360
    seen = np.isin(np.round(azimuths[sides["test"]], 4), trained)
    assert seen.mean() > 0.6 if planes else not seen.any()


def test_the_seed_and_nothing_else_decides():
    first = sides_of(circle(121), ("xz",), at_random())
    np.random.default_rng(0).random(5)
    again = sides_of(circle(121), ("xz",), Division("random", 0, {"validation": 0.33, "train": 0.7}, 0, 5))
    assert [first[side].tolist() for side in SIDES] == [again[side].tolist() for side in SIDES]
    assert sides_of(circle(121), ("xz",), at_random(seed=1))["train"].tolist() != first["train"].tolist()


def test_training_azimuths_are_spread_over_the_circle():
    train = sides_of(circle(1000), (), at_random())["train"]
    quarters = np.bincount(train // 250)
    assert quarters.min() > 150 and quarters.max() < 200


@pytest.mark.parametrize(
    ("count", "planes", "division", "left"),
    [
        (2, (), at_random(), r"split\.train': 0\.7 of kite's 2 azimuths.*1 to validate, 0 to test"),
        (30, ("xz",), by_sector(11)[1], r"split\.folds': fold 2 of 6.*kite's 30.*0 to train.* 10 as a guard"),
    ],
)
def test_an_empty_side_is_refused(count, planes, division, left):
    with pytest.raises(InputError, match=left):
        check(split(ELEVATIONS, circle(count), planes, division), division, "kite", count)


@pytest.mark.parametrize("count", [3, 4, 5, 8])
@pytest.mark.parametrize("share", [0.5, 0.7, 0.99])
def test_a_few_azimuths_leave_one_for_each_side(count, share):
    sides = sides_of(circle(count), (), at_random(train=share))
    assert all(len(index) >= 1 for index in sides.values())


@pytest.mark.parametrize(("count", "aperture"), SWEEPS)
@pytest.mark.parametrize("planes", PLANES)
def test_blocks_are_arcs_of_an_aperture_or_folds(count, aperture, planes):
    azimuths = circle(count)
    found = blocks(azimuths, planes, at_random(aperture=aperture))
    aspects = folded(azimuths, planes)
    for block in range(found.max() + 1):
        assert np.ptp(aspects[found == block]) < aperture * 360 / count
    lengths = {(): 360, ("xz",): 180, ("yz",): 180, ("xz", "yz"): 90}[planes]
    assert found.max() + 1 == pytest.approx(lengths / (aperture * 360 / count), abs=1.01)
    # A view and its mirror image are in the same block.
    if count % 2 == 0 or "yz" not in planes:
        for image in mirrored(azimuths, planes):
            place = np.round((image % 360) / (360 / count)).astype(int) % count
            assert (found[place] == found).all()
    assert set(blocks(azimuths, planes, by_sector(aperture)[3])) == {4}


def by_elevation(**settings):
    return divisions("elevation", SETTINGS | settings, 0, 5)


SPACED = [
    (0, 4),
    (0, 5),
    (0, 19),
    (5, 19),
    (7, 19),
    (10, 37),
    (12.5, 40),
]  # spacing and number of elevations by 5 degrees


@pytest.mark.parametrize(("spacing", "count"), SPACED)
def test_by_elevation_sides_are_disjoint_complete_and_apart(spacing, count):
    elevations, azimuths = 5.0 * np.arange(count) - 45, circle(36)
    every = [split(elevations, azimuths, ("xz",), division) for division in by_elevation(spacing=spacing)]
    used = set()
    for sides in every:
        assert all(side.azimuth.tolist() == list(range(36)) and len(side.elevation) for side in sides.values())
        index = [number for side in sides.values() for number in side.elevation]
        assert len(index) == len(set(index))
        used |= set(index)
        train, test = elevations[sides["train"].elevation], elevations[sides["test"].elevation]
        # As near as is asked for, in whole steps of the sweep.
        nearest = np.abs(test[:, None] - train).min(axis=1)
        np.testing.assert_allclose(nearest, 5 * np.ceil(spacing / 5) if spacing else 5)
    one, other = every
    assert one["train"].elevation.tolist() == other["train"].elevation.tolist()
    # Each of those between is tested once, and validates in the other fold.
    assert one["test"].elevation.tolist() == other["validation"].elevation.tolist()
    assert one["validation"].elevation.tolist() == other["test"].elevation.tolist()
    assert len(used) == count or spacing > 5


def test_every_second_elevation_trains():
    one, _ = by_elevation()
    sides = split(np.array([-10.0, 0, 5, 30, 31, 40, 41]), circle(8), (), one)
    assert [sides[name].elevation.tolist() for name in SIDES] == [[0, 2, 4, 6], [3], [1, 5]]
    guarded = split(np.array([-10.0, 0, 5, 30, 31, 40, 41]), circle(8), (), by_elevation(spacing=10)[1])
    assert [guarded[name].elevation.tolist() for name in SIDES] == [[0, 3], [1], [5]]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_too_few_elevations_are_refused(count):
    for division in by_elevation():
        sides = split(5.0 * np.arange(count), circle(8), (), division)
        with pytest.raises(
            InputError, match=rf"'aspect\.elevation'.* four elevations at least, .* the sweep has {count}\."
        ):
            check(sides, division, "kite", 8)
    near = by_elevation(spacing=10)[0]
    with pytest.raises(
        InputError, match=r"each 10 degrees or more above .*'learning\.split\.spacing'.* the sweep has 3"
    ):
        check(split(5.0 * np.arange(6), circle(8), (), near), near, "kite", 8)


def test_by_elevation_blocks_are_arcs_in_both_folds():
    one, other = by_elevation()
    arcs = blocks(circle(36), ("xz",), one)
    np.testing.assert_array_equal(arcs, blocks(circle(36), ("xz",), other))
    np.testing.assert_array_equal(arcs, blocks(circle(36), ("xz",), at_random()))
