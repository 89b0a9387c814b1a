"""Confidence scores and OpenMax against examples written out by hand, and against what they were made from."""

import numpy as np
import pytest
from scipy.stats import weibull_min

from isarflow.learning import confidence
from isarflow.learning.data.features import unit
from isarflow.learning.networks import openmax

CLASSES = np.array(["a", "b"])


def test_scores_of_logits_written_out():
    logits = np.array([[2.0, 0.0, 1.0], [-1.0, -3.0, 5.0]])
    scores = confidence.of_logits(logits, np.array(["a", "b", "other"]))
    total = np.exp(logits).sum(axis=1)
    np.testing.assert_allclose(scores["softmax"], [np.exp(2) / total[0], np.exp(-1) / total[1]], rtol=1e-14)
    np.testing.assert_allclose(scores["max_logit"], [2, -1])
    np.testing.assert_allclose(scores["energy"], [np.log(np.exp(2) + 1), np.log(np.exp(-1) + np.exp(-3))], rtol=1e-14)


def test_energy_of_large_logits_does_not_overflow():
    np.testing.assert_allclose(confidence.of_logits(np.array([[1e4, 1e4]]), CLASSES)["energy"], 1e4 + np.log(2))


def test_neighbour_score_is_the_fifth_nearest_direction():
    random = np.random.default_rng(0)
    references, tests = random.standard_normal((30, 4)), random.standard_normal((6, 4))
    scores = confidence.neighbour_score(3 * tests, unit(references))
    directions = [some / np.linalg.norm(some, axis=1, keepdims=True) for some in (tests, references)]
    distances = np.linalg.norm(directions[0][:, None] - directions[1], axis=2)
    np.testing.assert_allclose(scores, -np.sort(distances, axis=1)[:, 4], rtol=1e-6)


def test_mahalanobis_written_out():
    """Covariances of enough points are shrunk by next to nothing, and these can be written down."""
    corner = np.array([[2.0, 0.5], [-2.0, -0.5], [2.0, -0.5], [-2.0, 0.5]])
    points = np.tile(corner, (50_000, 1))
    features = np.concatenate([points + np.array([0, 3]), points - np.array([0, 3])])
    labels = np.repeat(CLASSES, len(points))
    gaussians = confidence.fit_gaussians(features, labels, CLASSES)
    scores = confidence.mahalanobis_scores(np.array([[2.0, 3.5], [0.0, 0.0]]), gaussians)
    # Within the classes the variances are 4 and 0.25, of all points 4 and 9.25 about 0.
    np.testing.assert_allclose(scores["mahalanobis"], [-(4 / 4 + 0.25 / 0.25), -(9 / 0.25)], rtol=1e-3)
    background = np.array([4 / 4 + 3.5**2 / 9.25, 0])
    np.testing.assert_allclose(scores["relative_mahalanobis"], [background[0] - 2, -36], rtol=1e-3)


def test_relative_mahalanobis_looks_only_where_the_classes_differ():
    """Fewer images than dimensions: what lies across the line between the two means changes nothing."""
    random = np.random.default_rng(0)
    features, labels = random.standard_normal((40, 100)), np.repeat(CLASSES, 20)
    features[:20] += 1
    gaussians = confidence.fit_gaussians(features, labels, CLASSES)
    whitening = gaussians["whitening"]
    between = (gaussians["means"][0] - gaussians["means"][1]) @ whitening
    tests = random.standard_normal((5, 100))
    # A step that is perpendicular to the difference of the means, as the Mahalanobis distance measures it.
    step = random.standard_normal(100)
    step -= (step @ between) / (between @ between) * between
    moved = tests + 3 * step @ np.linalg.inv(whitening)
    before, after = (confidence.mahalanobis_scores(some, gaussians) for some in (tests, moved))
    np.testing.assert_allclose(after["relative_mahalanobis"], before["relative_mahalanobis"], rtol=1e-6, atol=1e-6)
    assert (np.abs(after["mahalanobis"] - before["mahalanobis"]) > 10).all()


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_features_that_never_vary_are_no_error(value):
    gaussians = confidence.fit_gaussians(np.full((20, 3), value), np.repeat(CLASSES, 10), CLASSES)
    scores = confidence.mahalanobis_scores(np.array([[value] * 3, [value + 1] * 3]), gaussians)
    assert all(np.isfinite(values).all() for values in scores.values())
    assert scores["mahalanobis"][0] > scores["mahalanobis"][1]


@pytest.mark.parametrize(("shape", "scale"), [(1.2, 200.0), (2.5, 40.0), (4.0, 10.0)])
def test_the_weibull_fit_recovers_its_parameters(shape, scale):
    """Of samples that begin 1 above the location, where the fit takes them to; so few lie below that none is missed."""
    samples = 7 + weibull_min.rvs(shape, scale=scale, size=50_000, random_state=0)
    samples = np.append(samples[samples > 8], 8.0)
    location, fitted_shape, fitted_scale = openmax.fit_weibull(samples, len(samples))
    assert location == pytest.approx(7)
    assert (fitted_shape, fitted_scale) == pytest.approx((shape, scale), rel=0.02)


def test_only_the_largest_distances_count():
    tail = np.array([5.0, 6.0, 6.5, 7.0, 9.0])
    many = np.concatenate([np.linspace(0, 4.9, 100), tail])
    np.testing.assert_allclose(openmax.fit_weibull(many, 5), openmax.fit_weibull(tail, 5))


def test_equal_distances_give_a_step():
    location, shape, scale = openmax.fit_weibull(np.full(5, 3.0), 5)
    assert weibull_min.cdf(2.9, shape, location, scale) < 0.01
    assert weibull_min.cdf(3.1, shape, location, scale) > 0.99


def test_means_are_of_correctly_classified_images():
    logits = np.array([[4.0, 0.0], [6.0, 0.0], [0.0, 9.0], [1.0, 3.0], [1.0, 5.0]])
    means, tails = openmax.fit(logits, np.array(["a", "a", "a", "b", "b"]), CLASSES, 2)
    np.testing.assert_allclose(means, [[5, 0], [1, 4]])
    assert tails.shape == (2, 3)


def openmax_by_hand(logits, means, tails, alpha, shift):
    """Equations 5.9 to 5.12 of the thesis, with the weight (alpha + 1 - i) / alpha of the published code."""
    rows = []
    for vector in logits:
        order = np.argsort(-vector)
        base = vector - (vector.min() if shift else 0)
        weight = np.ones(len(vector))
        for place in range(alpha):
            index = order[place]
            location, shape, scale = tails[index]
            beyond = max(np.linalg.norm(vector - means[index]) - location, 0)
            weight[index] = 1 - (alpha - place) / alpha * (1 - np.exp(-((beyond / scale) ** shape)))
        revised = [*(base * weight), (base * (1 - weight)).sum()]
        rows.append(np.exp(revised) / np.exp(revised).sum())
    return np.array(rows)


@pytest.mark.parametrize("alpha", [1, 2, 3])
@pytest.mark.parametrize("shift", [False, True])
def test_openmax_by_hand(alpha, shift):
    logits = np.array([[3.0, -1.0, 0.5], [-2.0, -4.0, -3.0], [1.0, 2.0, 8.0], [1.0, 3.0, 2.0], [2.0, 1.0, 3.0]])
    means = np.array([[3.0, -1.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 5.0]])
    tails = np.array([[0.2, 1.5, 2.0], [0.1, 1.0, 3.0], [0.5, 2.0, 4.0]])
    ours = openmax.probabilities(logits, means, tails, alpha, shift)
    np.testing.assert_allclose(ours, openmax_by_hand(logits, means, tails, alpha, shift), rtol=1e-12)
    np.testing.assert_allclose(ours.sum(axis=1), 1)


def test_as_published_a_negative_logit_gains_and_shifted_it_does_not():
    """Far from its class all of the largest logit is lost: as published a negative one becomes 0, which is more."""
    logits, means = np.array([[-2.0, -4.0]]), np.array([[50.0, 0.0], [0.0, 50.0]])
    tails = np.array([[0.0, 2.0, 1.0]] * 2)
    published, shifted = (openmax.probabilities(logits, means, tails, 1, shift)[0] for shift in (False, True))
    softmax = 1 / (1 + np.exp(-2))
    assert published[0] > softmax * (1 - published[2]) and published[0] > published[2]
    assert shifted[2] > shifted[0]


def test_near_its_mean_openmax_is_softmax():
    means = np.array([[4.0, -4.0], [-4.0, 4.0]])
    tails = np.array([[2.0, 1.5, 1.0]] * 2)
    logits = means + 0.1
    for shift in (False, True):
        known_part = openmax.probabilities(logits, means, tails, 1, shift)[:, :2]
        expected = confidence.of_logits(logits, CLASSES)["softmax"]
        np.testing.assert_allclose((known_part / known_part.sum(axis=1, keepdims=True)).max(axis=1), expected)
