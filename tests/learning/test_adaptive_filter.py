"""The adaptive matched filter against the formula, its limits, and noise of several levels."""

import tracemalloc

import numpy as np
import pytest

from isarflow.core.kinds import MODELS, kind
from isarflow.learning.classifier import OTHER, build_classifier
from isarflow.learning.experiments import cleanest, megabytes


def complex_noise(random, *shape):
    return (random.standard_normal(shape) + 1j * random.standard_normal(shape)) / np.sqrt(2)


@pytest.fixture
def random():
    return np.random.default_rng(0)


def problem(random, count=40, common=0.0):
    """Images 4 x 3 around one pattern for each of two classes, with `common` times a part that all share, its phase
    at random: (images, labels).
    """
    fixed = np.random.default_rng(7)
    patterns, shared = complex_noise(fixed, 2, 4, 3), complex_noise(fixed, 4, 3)
    labels = np.repeat(["a", "b"], count)
    images = patterns[np.repeat([0, 1], count)] + 0.3 * complex_noise(random, 2 * count, 4, 3)
    images += common * complex_noise(random, 2 * count)[:, None, None] * shared
    return images.astype(np.complex64), labels


def test_scores_are_the_formula(random):
    images, labels = problem(random)
    model = build_classifier("adaptive_filter", {"loading": 0.1}, 0).fit(images, labels)
    x = images.reshape(len(images), -1).astype(complex)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    covariance = sum(np.outer(row, row.conj()) for row in x) / len(x)
    covariance += 0.1 * np.trace(covariance).real / 12 * np.eye(12)
    inverse = np.linalg.inv(covariance)

    def product(one, two):
        return one.conj() @ inverse @ two

    tests = complex_noise(random, 5, 4, 3)
    expected = np.zeros((5, 2))
    for row, test in enumerate(tests.reshape(5, -1)):
        for template, label in zip(x, labels, strict=True):
            column = "ab".index(label)
            value = abs(product(template, test)) ** 2 / (product(template, template) * product(test, test)).real
            expected[row, column] = max(expected[row, column], np.sqrt(value))
    outcome = model.evaluate(tests.astype(np.complex64))
    np.testing.assert_allclose(outcome.scores, expected, atol=2e-5)
    np.testing.assert_allclose(outcome.known["coherence"], expected.max(axis=1), atol=2e-5)
    assert (outcome.labels == np.array(["a", "b"])[expected.argmax(axis=1)]).all()


def test_much_loading_makes_it_the_matched_filter(random):
    images, labels = problem(random)
    tests, _ = problem(random, 10)
    plain = build_classifier("matched_filter", {}, 0).fit(images, labels).evaluate(tests)
    loaded = build_classifier("adaptive_filter", {"loading": 1e6}, 0).fit(images, labels).evaluate(tests)
    np.testing.assert_allclose(loaded.scores, plain.scores, atol=1e-5)


def test_amplitude_and_phase_do_not_matter(random):
    images, labels = problem(random)
    model = build_classifier("adaptive_filter", {"loading": 0.01}, 0).fit(images, labels)
    turned = (images * 7 * np.exp(2j)).astype(np.complex64)
    np.testing.assert_allclose(model.evaluate(images).scores, model.evaluate(turned).scores, atol=1e-5)


def test_what_all_images_share_does_not_hide_an_unknown_target(random):
    images, labels = problem(random, common=5)
    tests, _ = problem(random, common=5)
    fixed = np.random.default_rng(7)
    patterns, _ = complex_noise(fixed, 2, 4, 3), complex_noise(fixed, 4, 3)
    # The same common part, around a third pattern.
    strange = tests - patterns[(labels == "b").astype(int)] + complex_noise(fixed, 4, 3)
    auroc = {}
    for name, settings in (("matched_filter", {}), ("adaptive_filter", {"loading": 0.1})):
        model = build_classifier(name, settings, 0).fit(images, labels)
        own, other = (model.evaluate(one.astype(np.complex64)).known.popitem()[1] for one in (tests, strange))
        auroc[name] = (own[:, None] > other).mean()
    assert auroc["adaptive_filter"] > 0.95 > 0.88 > auroc["matched_filter"]


def at_levels(random, levels, count=60):
    images, labels = problem(random, count)
    parts = [(images, labels, np.full(len(images), "clean"))]
    for snr in levels:
        noisy = images + 10 ** (-snr / 20) * complex_noise(random, *images.shape) * np.sqrt(np.mean(abs(images) ** 2))
        parts.append((noisy.astype(np.complex64), labels, np.full(len(images), f"snr_{snr}dB")))
    return [np.concatenate(column) for column in zip(*parts, strict=True)]


def test_each_image_gets_the_covariance_of_its_own_noise(random):
    images, labels, snrs = at_levels(random, (0, 20))
    model = build_classifier("adaptive_filter", {"loading": 1e-4}, 0).fit(images, labels, snrs=snrs)
    assert model.inverses_.shape == (3, 12, 12) and model.templates_.shape == (12, 120)
    # Templates are the images without noise.
    assert np.allclose(np.abs(model.evaluate(images[snrs == "clean"]).known["coherence"]), 1, atol=0.02)
    alone = {
        name: build_classifier("adaptive_filter", {"loading": 1e-4}, 0).fit(images[own], labels[own])
        for name in ("snr_0dB", "clean")
        for own in [snrs == name]
    }
    # With the 0 dB covariance alone the noisiest images get what the whole model gives most of them.
    noisy = images[snrs == "snr_0dB"]
    alone["snr_0dB"].templates_, alone["snr_0dB"].sizes_ = model.templates_, model.sizes_[[1]]
    same = np.isclose(model.evaluate(noisy).scores, alone["snr_0dB"].evaluate(noisy).scores, atol=1e-3).all(axis=1)
    assert same.mean() > 0.8


def test_a_class_other_is_no_known_score(random):
    images, labels = problem(random)
    labels = np.where(np.arange(len(labels)) % 4 == 0, OTHER, labels)
    outcome = build_classifier("adaptive_filter", {"loading": 0.01}, 0).fit(images, labels).evaluate(images)
    assert outcome.scores.shape == (80, 3)
    np.testing.assert_array_equal(outcome.known["coherence"], outcome.scores[:, :2].max(axis=1))


def test_a_zero_image_has_no_coherence(random):
    images, labels = problem(random)
    images[3] = 0  # nor has one among the templates, and the others are as before
    model = build_classifier("adaptive_filter", {"loading": 0.01}, 0).fit(images, labels)
    assert (model.evaluate(np.zeros((1, 4, 3), np.complex64)).scores == 0).all()
    assert np.isfinite(model.evaluate(images).scores).all()


def test_the_cleanest_of_some_snrs():
    assert cleanest(["snr_-3dB", "clean", "snr_24dB"]) == "clean"
    assert cleanest(np.array(["snr_-3dB", "snr_2.5dB", "any"])) == "snr_2.5dB"
    assert cleanest(["any"]) == "any"


def test_memory_stays_within_the_plan_where_covariances_are_most_of_it(random):
    images = complex_noise(random, 40, 32, 32).astype(np.complex64)
    labels, snrs = np.repeat(["a", "b"], 20), np.tile(["snr_0dB", "snr_6dB"], 20)
    planned = megabytes(len(images), 32 * 32, covariances=2, pairs=False) - megabytes(0, 0, 0, False)
    tracemalloc.start()
    build_classifier("adaptive_filter", {"loading": 1e-4}, 0).fit(images, labels, snrs=snrs)
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    assert planned / 2 < peak < planned
    assert kind(MODELS, "adaptive_filter").stated["covariances"] and "covariances" not in kind(MODELS, "knn").stated
