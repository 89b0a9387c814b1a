"""Division of the viewing azimuths between training, validation and test."""

import numpy as np

from core.errors import InputError
from core.sweep import closes_circle

SIDES = ("train", "validation", "test")


def split(azimuths, settings, seed, aperture, scheme):
    """Indices into `azimuths` (degrees, uniform) of each side, ascending: a mapping train, validation, test.

    settings: `learning.split` of the config, for its shares; scheme: `random` or `sector`; aperture: azimuth samples of
    an image. Azimuths are divided, not images: one azimuth's images at all elevations, of all targets and
    with all noise realizations fall on the same side. The division depends on nothing but the azimuths, the settings,
    the aperture and the seed.
    Raises InputError if a side is left empty.
    """
    sides = dict(zip(SIDES, SCHEMES[scheme](np.asarray(azimuths), settings, seed, aperture), strict=True))
    if not all(map(len, sides.values())):
        guard = f" and {aperture - 1} as a guard between two sides" if scheme == "sector" else ""
        raise InputError(
            f"config key 'learning.split.train': {settings['train']} of {len(azimuths)} azimuths leaves "
            f"{len(sides['train'])} to train, {len(sides['validation'])} to validate, {len(sides['test'])} to test"
            f"{guard}; every side needs at least one (a larger 'aspect.azimuth' has more)."
        )
    return {side: np.sort(index) for side, index in sides.items()}


def random(azimuths, settings, seed, aperture):
    """A share `train` of the azimuths, drawn at random, and of the others a share `validation`; the rest tests.

    Neighbouring images share most of their aperture, so test images have near-copies among the training images:
    figures from this split flatter every model.
    """
    order = np.random.default_rng([seed, *b"random split"]).permutation(len(azimuths))
    return np.split(order, _ends(len(azimuths), settings))


def sector(azimuths, settings, seed, aperture):
    """One contiguous sector each, with aperture - 1 azimuths between two of them that no side uses.

    So no image of one side shares a sample with an image of another. The shares are of the azimuths that are left.
    On a closed circle the seed turns the sectors; a part of a circle is cut in the order train, validation, test.
    """
    count, guard = len(azimuths), aperture - 1
    if closes_circle(azimuths):
        order = (np.arange(count) + np.random.default_rng([seed, *b"sector split"]).integers(count)) % count
        order = order[: count - guard]
    else:
        order = np.arange(count)
    first, second = _ends(max(len(order) - 2 * guard, 0), settings)
    return order[:first], order[first + guard : second + guard], order[second + 2 * guard :]


def _ends(count, settings):
    """Where training and validation end among `count` azimuths; both rounded down, but for one to validate."""
    train = int(np.floor(settings["train"] * count + 1e-9))  # 0.57 x 100 is 56.99...
    train = min(train, max(count - 2, 1))  # few azimuths leave one to validate and one to test
    validation = max(int(np.floor(settings["validation"] * (count - train) + 1e-9)), 1)
    return train, train + validation


SCHEMES = {"random": random, "sector": sector}
