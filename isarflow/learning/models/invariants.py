"""Invariants: boosted trees on named features of an image that a displacement does not change."""

import numpy as np
from threadpoolctl import threadpool_limits

from isarflow.learning import confidence
from isarflow.learning.classifier import Outcome, best_known
from isarflow.learning.data.features import by_channel
from isarflow.learning.scikit_learn import ScikitLearn

COPIES = 2  # of each training image, with noise of its own
NOISE = (0.003, 0.7)  # share of noise in an image's energy, least and most: its logarithm is uniform
SHARES = (0.5, 0.8, 0.95)  # of the power, for extents
STRONGEST = (1, 3, 10, 30)  # pixels, for shares of the power
LEVELS = (-6, -12, -18)  # dB below the peak, for counts of scatterers
BATCH = 4096  # images at a time, as their features take ten times their memory
TINY = 1e-12


class Model(ScikitLearn):
    """What a radar engineer would measure in an image, and a forest of boosted trees on it.

    `invariants` has the features, NAMES their names and units. Every training image is learned in COPIES with noise of
    an energy drawn from NOISE. Scores are logarithms of class probabilities, all classes weighed alike; the confidence
    score `margin` is the best known class's less OTHER's, where there is such a class.
    """

    LABELS = {"invariants": ("invariants", "boosted trees on invariants", 24)}
    SCORES = {"margin": ("margin", 19)}
    SETTINGS = {
        "rounds": {"type": "integer", "minimum": 1, "description": "trees of each class"},
        "leaves": {"type": "integer", "minimum": 2, "description": "of a tree, at most"},
        "learning_rate": {"type": "number", "exclusiveMinimum": 0, "description": "weight of a tree"},
    }
    learns_noise = True
    additive = True

    def estimator(self):
        from sklearn.ensemble import HistGradientBoostingClassifier

        how = {"max_iter": self.settings["rounds"], "max_leaf_nodes": self.settings["leaves"]}
        how |= {"learning_rate": self.settings["learning_rate"], "early_stopping": False, "l2_regularization": 10.0}
        return HistGradientBoostingClassifier(
            **how, min_samples_leaf=100, max_features=0.3, class_weight="balanced", random_state=self.seed
        )

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        random = np.random.default_rng(self.seed)
        parts = [by_channel(images[start : start + BATCH]) for start in range(0, len(images), BATCH)] * COPIES
        rows = np.concatenate([invariants(with_noise(part, self.noise, random)) for part in parts])
        with threadpool_limits(1):  # as a job has one core
            self.fitted = self.estimator().fit(rows, np.tile(labels, COPIES))
        self.classes_ = np.asarray(self.fitted.classes_)
        return self

    def evaluate(self, images):
        with threadpool_limits(1):
            shares = self.fitted.predict_proba(invariants(by_channel(images)))
        scores = np.log(np.maximum(shares, 1e-9))
        margin = confidence.margin(scores, self.classes_)
        return Outcome(best_known(scores, self.classes_), scores, {"margin": margin})


def with_noise(images, noise, random):
    """Images (n, channel, R, X) with images of noise (m, [channel,] R, X) added: a share of the energy of each."""
    energy = np.sqrt((np.abs(images) ** 2).sum(axis=(1, 2, 3), keepdims=True))
    drawn = by_channel(noise)[random.integers(len(noise), size=(len(images), images.shape[1]))]
    drawn = drawn[:, np.arange(images.shape[1]), np.arange(images.shape[1]) % drawn.shape[2]]
    drawn = drawn / np.maximum(np.sqrt((np.abs(drawn) ** 2).sum(axis=(1, 2, 3), keepdims=True)), TINY)
    share = np.exp(random.uniform(*np.log(NOISE), size=(len(images), 1, 1, 1)))
    return np.sqrt(1 - share) * images / np.maximum(energy, TINY) + np.sqrt(share) * drawn


def invariants(images):
    """Features (n, d), float32, of images (n, channel, R, X), in the order of `names`."""
    return np.stack(list(_named(images).values()), axis=1).astype(np.float32)


def names(channels=3):
    """The names of the features, with their units, for so many channels."""
    return [*_named(np.ones((1, channels, 4, 4), np.complex64))]


def _named(images):
    power = np.abs(images) ** 2
    power = power / np.maximum(power.mean(axis=(1, 2, 3), keepdims=True), TINY)
    found = _of_power(power.sum(axis=1), "all")
    for channel in range(images.shape[1] if images.shape[1] > 1 else 0):
        found |= _of_power(power[:, channel], f"channel {channel}")
    if images.shape[1] > 1:
        found |= _of_polarizations(images, power)
    return found


def _of_power(power, of):
    """Features of power images (n, R, X)."""
    found, total = {}, np.maximum(power.sum(axis=(1, 2)), TINY)
    for axis, along in ((2, "range"), (1, "cross-range")):
        profile = power.sum(axis=axis) / total[:, None]
        place = np.arange(profile.shape[1])
        mean = profile @ place
        moments = [np.einsum("np,np->n", profile, (place - mean[:, None]) ** order) for order in (2, 3, 4)]
        spread = np.sqrt(np.maximum(moments[0], TINY))
        found[f"{of}: spread in {along} [cells]"] = spread
        found[f"{of}: skewness in {along} [1]"] = moments[1] / spread**3
        found[f"{of}: kurtosis in {along} [1]"] = moments[2] / spread**4
        found[f"{of}: entropy of the {along} profile [nats]"] = -(profile * np.log(np.maximum(profile, TINY))).sum(
            axis=1
        )
        found[f"{of}: peak of the {along} profile [share]"] = profile.max(axis=1)
        running = np.cumsum(profile, axis=1)
        for share in SHARES:
            ends = [(running < (1 + sign * share) / 2).sum(axis=1) for sign in (-1, 1)]
            found[f"{of}: extent in {along} of {share:.0%} of the power [cells]"] = ends[1] - ends[0]
        found[f"{of}: roughness of the {along} profile [1]"] = np.abs(np.diff(profile, axis=1)).sum(axis=1)
    pixels = np.sort(power.reshape(len(power), -1), axis=1)[:, ::-1] / total[:, None]
    found[f"{of}: entropy [nats]"] = -(pixels * np.log(np.maximum(pixels, TINY))).sum(axis=1)
    found[f"{of}: contrast [1]"] = pixels.std(axis=1) / np.maximum(pixels.mean(axis=1), TINY)
    for count in STRONGEST:
        found[f"{of}: share of the {count} strongest pixels [1]"] = pixels[:, :count].sum(axis=1)
    found[f"{of}: faint quarter [dB below the mean]"] = _db(pixels[:, -max(1, pixels.shape[1] // 4) :].mean(axis=1))
    padded = np.pad(power, [(0, 0), (1, 1), (1, 1)])
    rows, columns = power.shape[1:]
    around = [padded[:, r : r + rows, c : c + columns] for r in range(3) for c in range(3) if (r, c) != (1, 1)]
    is_peak = (power >= np.max(around, axis=0)) & (power > 0)
    relative = _db(power / np.maximum(power.max(axis=(1, 2), keepdims=True), TINY))
    for level in LEVELS:
        found[f"{of}: scatterers above {level} dB [1]"] = (is_peak & (relative > level)).sum(axis=(1, 2))
    r, x = np.arange(rows)[:, None], np.arange(columns)
    middle = [((power * at).sum(axis=(1, 2)) / total)[:, None, None] for at in (r, x)]
    rr, xx, rx = (
        (power * (a - middle[i]) * (b - middle[j])).sum(axis=(1, 2)) / total
        for a, b, i, j in ((r, r, 0, 0), (x, x, 1, 1), (r, x, 0, 1))
    )
    half, apart = (rr + xx) / 2, np.sqrt(((rr - xx) / 2) ** 2 + rx**2)
    found[f"{of}: length of the major axis [cells]"] = np.sqrt(half + apart)
    found[f"{of}: length of the minor axis [cells]"] = np.sqrt(np.maximum(half - apart, 0))
    found[f"{of}: tilt of the major axis [rad]"] = np.abs(np.arctan2(2 * rx, rr - xx)) / 2
    return found


def _of_polarizations(images, power):
    """Features of two or more polarizations: of the first two, and of the first with each other one."""
    found, first, count = {}, images[:, 0], images.shape[1]
    sums = np.maximum(power.sum(axis=(2, 3)), TINY)
    strongest = power.sum(axis=1).reshape(len(images), -1).argsort(axis=1)[:, ::-1]
    flat, flat_images = power.reshape(*power.shape[:2], -1), images.reshape(*images.shape[:2], -1)
    for other in range(1, count):
        found[f"power of channel {other} over channel 0 [dB]"] = _db(sums[:, other] / sums[:, 0])
        for rank in range(3):
            at = strongest[:, rank, None]
            of = [np.take_along_axis(flat[:, one], at, 1)[:, 0] for one in (0, other)]
            found[f"the same at the pixel of rank {rank + 1} [dB]".replace("the same", f"channel {other} over 0")] = (
                _db(np.maximum(of[1], TINY) / np.maximum(of[0], TINY))
            )
    both = first * images[:, 1].conj()
    mean = both.sum(axis=(1, 2)) / np.maximum(np.sqrt((np.abs(images[:, :2]) ** 2).sum(axis=(2, 3)).prod(axis=1)), TINY)
    found["coherence of channels 0 and 1 [1]"] = np.abs(mean)
    found["cosine of their phase [1]"], found["sine of their phase, magnitude [1]"] = mean.real, np.abs(mean.imag)
    for rank in range(3):
        at = strongest[:, rank, None]
        pair = [np.take_along_axis(flat_images[:, one], at, 1)[:, 0] for one in (0, 1)]
        product = pair[0] * pair[1].conj()
        found[f"cosine of their phase at the pixel of rank {rank + 1} [1]"] = product.real / np.maximum(
            np.abs(product), TINY
        )
    odd, even = (np.abs(first + sign * images[:, 1]) ** 2 for sign in (1, -1))
    pauli = np.maximum((odd + even).sum(axis=(1, 2)), TINY)
    found["even bounces [share]"] = even.sum(axis=(1, 2)) / pauli
    share = even / np.maximum(odd + even, TINY)
    weight = (odd + even) / pauli[:, None, None]
    found["spread of even bounces over pixels [1]"] = np.sqrt(
        np.maximum((weight * share**2).sum(axis=(1, 2)) - (weight * share).sum(axis=(1, 2)) ** 2, 0)
    )
    return found


def _db(ratio):
    return 10 * np.log10(np.maximum(ratio, TINY))
