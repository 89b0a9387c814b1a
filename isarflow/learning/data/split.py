"""Division of a target's views between training, validation and test."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.sweep import closes_circle

SIDES = ("train", "validation", "test")
LEFT_OUT = "left out"  # side in predictions: training views that a model judged without their own aspect
# Settings of each scheme in the config: shares of the aspects, number of folds, degrees between elevations.
SETTINGS = {"random": ("train", "validation"), "sector": ("folds", "validation"), "elevation": ("spacing",)}
SETTINGS["shuffled"] = SETTINGS["random"]
SETTINGS["family"] = ("others",)
FAMILY_FOLDS = 5  # of models, or of kinds
ROUNDING = 1e-6  # degrees: two angles nearer than this are the same one


class Views(NamedTuple):
    """All pairs of some elevations and some azimuths: indices into a sweep's, ascending."""

    elevation: np.ndarray
    azimuth: np.ndarray

    @property
    def count(self):
        return len(self.elevation) * len(self.azimuth)


@dataclass(frozen=True)
class Division:
    """A run's division of the views of every target."""

    scheme: str  # one of SETTINGS
    fold: int  # number of the scheme's fold, from 1; 0 if it has none
    settings: dict  # those of `learning.split` in the config that SETTINGS names; by family also `sides`, of targets
    seed: int  # the config's
    aperture: int  # azimuth samples of an image


def divisions(scheme, settings, seed, aperture, targets=None):
    """The Division of every fold of a scheme. settings: `learning.split` of the config; targets: as of `by_family`."""
    own = {key: settings[key] for key in SETTINGS[scheme]}
    every = [Division(scheme, fold, own, seed, aperture) for fold in folds(scheme, settings)]
    if scheme == "family":
        every = [replace(one, settings=own | {"sides": by_family(targets, one)}) for one in every]
    return every


def folds(scheme, settings):
    """The numbers of a scheme's folds, from 1; [0] if it has none. settings: `learning.split` of the config."""
    count = {"sector": settings["folds"], "elevation": 2, "family": FAMILY_FOLDS}.get(scheme)
    return [*range(1, count + 1)] if count else [0]


def by_family(targets, division):
    """The side of each target, a mapping, by a fold over models: each is tested in one of FAMILY_FOLDS folds.

    targets: a mapping of name to role, class and kind. Of each known class a fifth of the models tests and another
    fifth validates; models of a kind are spread over the folds. So are those of role other with `others: seen`. With
    `others: novel` they are divided by whole kinds, in an order that follows from the seed, and two of three kinds
    validate where three test. Targets of role unknown are tested in every fold.
    """
    sides, groups = {}, {}
    for name, target in sorted(targets.items(), key=lambda item: (item[1]["kind"], item[0])):
        groups.setdefault((target["role"], target["class"] if target["role"] == "known" else ""), []).append(name)
    for (role, _), names in groups.items():
        units = [[name] for name in names]
        if role == "other" and division.settings["others"] == "novel":
            kinds = sorted({targets[name]["kind"] for name in names})
            np.random.default_rng([division.seed, *b"kinds"]).shuffle(kinds)
            units = [[name for name in names if targets[name]["kind"] == kind] for kind in kinds]
        test, validation = (units[(division.fold - 1 + by) % FAMILY_FOLDS :: FAMILY_FOLDS] for by in (0, 1))
        if len(units) < len(names) and len(validation) > 2:
            validation = validation[:2]
        sides |= {name: "train" if role != "unknown" else "test" for name in names}
        for side, parts in (("test", test), ("validation", validation)):
            sides |= {name: side for part in parts for name in part if role != "unknown"}
    return dict(sorted(sides.items()))


def apart(azimuths, target, division):
    """Indices of azimuths of which no two images share a sample, from one on that follows from the target's name."""
    first = np.random.default_rng([division.seed, *target.encode()]).integers(division.aperture)
    numbers = np.arange(first % len(azimuths), len(azimuths), division.aperture)
    return numbers[numbers <= len(azimuths) - division.aperture + numbers[0]]


def split(elevations, azimuths, planes, division, target=""):
    """Divide views into sides: a mapping train, validation, test to `Views`. A side may be empty.

    elevations: (m,) and azimuths: (n,) in degrees, ascending, the latter uniform; planes: the target's mirror planes,
    `xz` and `yz`; target: its name, by which the scheme `family` gives it one side. All views of a model train; those
    that validate or test are `apart`. By the other schemes a view and its mirror image (of the same elevation) are on
    the same side, except by `shuffled`, which is `random` without regard to mirror planes. The sides differ either in
    elevation or in azimuth, so that two of them together are `Views`, too.
    """
    if division.scheme == "shuffled":
        planes = ()
    if division.scheme == "family":
        side, none, every = division.settings["sides"].get(target, "train"), np.array([], int), np.arange(len(azimuths))
        views = every if side == "train" else apart(azimuths, target, division)
        sides = [Views(np.arange(len(elevations)), views if side == name else none) for name in SIDES]
    elif division.scheme == "elevation":
        every = np.arange(len(azimuths))
        sides = [Views(index, every) for index in elevation(elevations, division)]
    else:
        aspects, owners = np.unique(_rounded(folded(azimuths, planes)), return_inverse=True)
        if division.scheme == "sector":
            circle = 360.0 if closes_circle(azimuths) and not {"xz", "yz"} & set(planes) else None
            found = sector(aspects, _least(azimuths, division), circle, division)
        else:
            found = random(len(aspects), division)
        every = np.arange(len(elevations))
        sides = [Views(every, np.flatnonzero(np.isin(owners, index))) for index in found]
    return dict(zip(SIDES, sides, strict=True))


def check(sides, division, target, count):
    """Raise InputError if a side of a target that trains is empty. sides: of `split`, for `count` azimuths."""
    if all(side.count for side in sides.values()):
        return
    if division.scheme == "elevation":
        used, spacing = sum(len(side.elevation) for side in sides.values()), division.settings["spacing"]
        apart = f", each {spacing:g} degrees or more above the one before ('learning.split.spacing')" if spacing else ""
        raise InputError(
            f"config key 'aspect.elevation': the split by elevation takes four elevations at least{apart}, of which "
            f"every second trains and the others validate and test by turns; the sweep has {used}."
        )
    left = "{} to train, {} to validate, {} to test".format(*(len(sides[side].azimuth) for side in SIDES))
    if division.scheme == "sector":
        raise InputError(
            f"config key 'learning.split.folds': fold {division.fold} of {division.settings['folds']} leaves of "
            f"{target}'s {count} azimuths {left}, with {division.aperture - 1} as a guard between two sides; every "
            "side needs one at least (more folds, a shorter 'imaging.aperture' or a larger 'aspect.azimuth' help)."
        )
    raise InputError(
        f"config key 'learning.split.train': {division.settings['train']} of {target}'s {count} azimuths leaves "
        f"{left}; every side needs at least one (a larger 'aspect.azimuth' has more)."
    )


def blocks(azimuths, planes, division, target=""):
    """The number of the block of each azimuth's images, (n,): images of two blocks count as independent.

    Blocks are arcs of an aperture of the folded aspects at all elevations, as nearer images share samples. By sector
    the fold is the block, as its test images share one fitted model; by family the target is.
    """
    if division.scheme == "sector":
        return np.full(len(azimuths), division.fold)
    if division.scheme == "family":
        return np.full(len(azimuths), [*division.settings["sides"], target].index(target))
    aspects = _rounded(folded(azimuths, planes))
    return ((aspects - aspects.min() + ROUNDING) // _least(azimuths, division)).astype(int)


def folded(azimuths, planes):
    """The aspect of each azimuth in degrees, (n,): the same for a view and its images in the target's mirror planes.

    0 to 180 degrees for the plane xz (a and -a are one), -90 to 90 for yz (a and 180 - a), 0 to 90 for both.
    """
    aspects = np.asarray(azimuths, float)
    if "yz" in planes:
        aspects = np.degrees(np.arcsin(np.clip(np.sin(np.radians(aspects)), -1, 1)))
    if "xz" in planes:
        aspects = np.abs((aspects + 180) % 360 - 180)
    return aspects


def random(count, division):
    """Draw a share `train` of so many aspects at random, and a share `validation` of the others; the rest tests.

    Neighbouring images share most of their aperture, so test images have near-copies among the training images:
    figures from this split flatter every model.
    """
    order, settings = np.random.default_rng([division.seed, *b"random split"]).permutation(count), division.settings
    train = int(np.floor(settings["train"] * count + 1e-9))  # 0.57 x 100 is 56.99...
    train = min(train, max(count - 2, 1))  # few aspects leave one to validate and one to test
    validation = max(int(np.floor(settings["validation"] * (count - train) + 1e-9)), 1)
    return np.split(order, (train, train + validation))


def sector(aspects, least, circle, division):
    """Test one arc of the aspects, validate on another far from it, and train on the rest, with guards between.

    Over all folds every aspect is tested once. Two sides are `least` degrees, an aperture, apart, so that no image of
    one side shares a sample, or a mirrored one, with an image of another. The validation arc is the share
    `validation` of itself and the test arc together, and is placed where the most is left to train. circle: 360 where
    the aspects close a circle, else None.
    """
    test = np.array_split(np.arange(len(aspects)), division.settings["folds"])[division.fold - 1]
    if not len(test):
        return test, test, test
    share = division.settings["validation"]
    wanted = max(round(len(test) * share / (1 - share)), 1)
    free = _apart(np.arange(len(aspects)), test, aspects, least, circle)
    parts = [free] if circle else np.split(free, [np.searchsorted(free, test[0])])
    arcs = [arc for part in parts for arc in (part[:wanted], part[-wanted:]) if len(arc)]
    trained = [_apart(free, arc, aspects, least, circle) for arc in arcs]
    if not arcs:
        return free, free, test
    # First some aspects to train, then a whole validation arc, then as many as possible to train.
    best = max(range(len(arcs)), key=lambda i: (len(trained[i]) > 0, len(arcs[i]), len(trained[i])))
    return trained[best], arcs[best], test


def elevation(elevations, division):
    """Train on every second elevation; of those between, validate on every second and test on the others.

    In fold 2 the latter two are exchanged, so that each of those is tested once. An elevation less than `spacing`
    degrees above the last one with a side is a guard, without a side: tests are `spacing` or more from training.
    """
    used = []
    for number, angle in enumerate(elevations):
        if not used or angle - elevations[used[-1]] >= division.settings["spacing"] - ROUNDING:
            used.append(number)
    train, first, second = (np.array(part, int) for part in (used[::2], used[1::4], used[3::4]))
    return (train, second, first) if division.fold == 1 else (train, first, second)


def _apart(numbers, arc, aspects, least, circle):
    """Numbers of the aspects that are `least` degrees or more from an arc of them, in order from its end."""
    after, before = aspects[numbers] - aspects[arc[-1]], aspects[arc[0]] - aspects[numbers]
    if circle is None:
        return numbers[(after >= least) | (before >= least)]
    after, before = after % circle, before % circle
    # Within the arc both go nearly all the way round.
    far = (after >= least) & (before >= least) & (after + before < circle)
    order = np.argsort(after, kind="stable")
    return numbers[order[far[order]]]


def _least(azimuths, division):
    """Least degrees between the centres of two images that share no sample, less a margin for rounding."""
    return division.aperture * (azimuths[1] - azimuths[0]) - 2 * ROUNDING if len(azimuths) > 1 else 360.0


def _rounded(aspects):
    return np.round(aspects / ROUNDING) * ROUNDING
