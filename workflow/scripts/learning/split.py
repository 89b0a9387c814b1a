"""Division of the viewing azimuths between training and test."""

import numpy as np

from common.errors import InputError


def split(azimuths, settings, seed):
    """Indices into `azimuths` (degrees) that train and that test, both ascending: (train, test).

    settings: `learning.split` of the config. Azimuths are divided, not images: one azimuth's images at all
    elevations, of all targets and with all noise realizations fall on the same side. The division depends on nothing
    but the number of azimuths, the settings and the seed.
    Raises InputError if one side is left empty.
    """
    train, test = SCHEMES[settings["scheme"]](np.asarray(azimuths), settings, seed)
    if not len(train) or not len(test):
        raise InputError(
            f"config key 'learning.split.train': {settings['train']} of {len(azimuths)} azimuths leaves "
            f"{len(train)} to train and {len(test)} to test; both need at least one "
            "(a larger 'aspect.azimuth' has more)."
        )
    return np.sort(train), np.sort(test)


def random(azimuths, settings, seed):
    """A share `train` of the azimuths (rounded down), drawn at random.

    Neighbouring images share most of their aperture, so test images have near-copies among the training images:
    figures from this split flatter every model.
    """
    order = np.random.default_rng([seed, *b"random split"]).permutation(len(azimuths))
    count = int(np.floor(settings["train"] * len(azimuths) + 1e-9))  # 0.57 x 100 is 56.99...
    return order[:count], order[count:]


SCHEMES = {"random": random}
