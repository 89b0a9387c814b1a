"""Scatterers found in an image, and their assignment to those of the library: places, closed forms, what stays."""

import itertools

import numpy as np
import pytest

from isarflow.core.sweep import C0
from isarflow.imaging.formation import form_images
from isarflow.learning.classifier import build_classifier
from isarflow.learning.conformance import of_face, of_fitted, of_restored
from isarflow.learning.data.moves import Moves
from isarflow.learning.models.blobs import assigned, scatterers

IMAGING = {"imager": "fourier", "aperture": 13, "polarizations": ["VV", "HH"], "window": "hamming", "reformat": "none"}
IMAGING["upsample"] = "none"
SETTINGS = {"scatterers": 8, "spread": 1.0, "candidates": 6}
PIXELS = np.array([16.0, 13.0])


def moves(**limits):
    return Moves({"limits": limits or {"place": 0.2}, "frequencies": [3e9, 5e9, 16], "step": 2.0, "imaging": IMAGING})


def samples_of(points, strength):
    """The moves, and samples (n, channel, 16, 13) of point scatterers at (n, k, 2).

    Places are in pixels of range and cross-range from the middle; strength: (n, k, channels). Each is a wave over the
    samples, which no polar grid bends.
    """
    made = moves()
    away = points * np.array(made.cells)
    k = 2 * np.pi * made.frequency / C0
    wave = np.exp(-2j * k[:, None, None, None] * away[..., 0]) * np.exp(
        2j * k[len(k) // 2] * made.angle[:, None, None] * away[..., 1]
    )
    return made, np.einsum("nkc,fank->ncfa", strength, wave)


def fields_of(number, views=12):
    """Places and strengths of a class of its own scatterers, turning from view to view."""
    random = np.random.default_rng(number)
    at, strength = random.uniform(-4, 4, (5, 2)), random.uniform(0.4, 1, (5, 2))
    turns = np.radians(8.0 * np.arange(views))
    points = [[(x * np.cos(t) - y * np.sin(t), x * np.sin(t) + y * np.cos(t)) for x, y in at] for t in turns]
    return np.array(points), np.tile(strength, (views, 1, 1))


def images_moved(points, strength, by=(0, 0)):
    made, samples = samples_of(points + np.array(by), strength)
    return form_images(made.imager, samples.reshape(*samples.shape[:2], -1).astype(np.complex64))[0]


@pytest.fixture(scope="module")
def library():
    images = np.concatenate([images_moved(*fields_of(number)) for number in (1, 2)])
    return images, np.repeat(["one", "two"], 12)


def fitted(library, **settings):
    return build_classifier("blobs", SETTINGS | settings, 0).fit(*library)


def test_point_scatterers_are_found_within_a_tenth_of_a_pixel():
    random = np.random.default_rng(3)
    by = random.uniform(-0.5, 0.5, (40, 1, 2))
    points = np.tile([[-4.0, -3.0], [3.0, 2.0]], (40, 1, 1)) + by
    strength = np.tile([[1.0, 0.5], [0.3, 0.6]], (40, 1, 1))
    place, amplitudes = scatterers(images_moved(points, strength), 2)
    middle = scatterers(images_moved(np.zeros((1, 1, 2)), np.ones((1, 1, 2))), 1)[0][0, 0]
    assert abs(place - middle - points).max() < 0.1  # 0.064
    np.testing.assert_allclose(np.abs(amplitudes[:, 1, 1] / amplitudes[:, 0, 0]), 0.6, rtol=0.02)  # 0.0054
    np.testing.assert_allclose((np.abs(amplitudes) ** 2).sum(axis=(1, 2)), 1, rtol=1e-5)


def test_noise_alone_has_few_scatterers_and_a_zero_image_none():
    random = np.random.default_rng(0)
    noise = (random.standard_normal((200, 3, 27, 21, 2)) @ [1, 1j]).astype(np.complex64)
    found = scatterers(noise, 64)[1].any(axis=2).sum(axis=1)
    assert 0.7 * 0.003 * 27 * 21 < found.mean() < 1.2 * 0.003 * 27 * 21  # 1.06
    assert not any(part.any() for part in scatterers(np.zeros((1, 3, 27, 21), np.complex64), 5))


def test_the_assignment_is_the_best_of_all_permutations():
    random = np.random.default_rng(1)
    place, others = random.uniform(0, 6, (5, 2)), random.uniform(0, 6, (4, 5, 2))
    others[0] = place[random.permutation(5)] + 0.3 * random.standard_normal((5, 2)) + 2
    strength, amplitudes = ((random.standard_normal((*shape, 3, 2)) @ [1, 1j]) for shape in ((5,), (4, 5)))
    fits, apart = assigned((place, strength), (others, amplitudes), PIXELS, 1.0)
    assert np.ptp(abs(apart)) > 0
    for fit, by, places, of in zip(fits, apart, others, amplitudes, strict=True):
        rest = place[:, None] - places - by
        rest -= PIXELS * np.round(rest / PIXELS)
        weights = abs(strength.conj() @ of.T) * np.exp(-(rest**2).sum(axis=2) / 2)
        best = max(weights[range(5), order].sum() for order in itertools.permutations(range(5)))
        assert fit == pytest.approx(best, rel=1e-9)


def test_a_set_fits_itself_best_wherever_it_is():
    """Score 1, by Cauchy and Schwarz the largest, and the displacement itself, also across an image's end."""
    random = np.random.default_rng(2)
    place = random.uniform(0, 13, (7, 2))
    amplitudes = random.standard_normal((7, 3, 2)) @ [1, 1j]
    amplitudes /= np.linalg.norm(amplitudes)
    for by in ([0, 0], [1.3, -2.2], [7.4, 6.1]):
        moved = (place + by) % PIXELS, amplitudes * np.exp(2j)
        fits, apart = assigned(moved, (place[None], amplitudes[None]), PIXELS, 0.7)
        np.testing.assert_allclose(fits, 1, atol=1e-9)
        np.testing.assert_allclose(apart, [by], atol=1e-9)


def test_scores_stay_where_the_target_moves(library):
    """By whole pixels, and by parts of one as far as the parabola is not exact."""
    model = fitted(library)
    points, strength = fields_of(1)
    here = model.evaluate(images_moved(points + 0.3, strength))
    whole = model.evaluate(images_moved(points + 0.3, strength, (3, -2)))
    part = model.evaluate(images_moved(points + 0.3, strength, (2.5, -1.7)))
    assert here.scores.max() < 1 and np.ptp(here.scores) > 0.1
    np.testing.assert_allclose(whole.scores, here.scores, atol=2e-3)  # 1.0e-3, by the waves' rounding and curvature
    np.testing.assert_allclose(part.scores, here.scores, atol=0.03)  # 0.012
    assert (part.labels == "one").all()


def test_the_place_of_a_target_is_found(library):
    model = build_classifier("blobs", SETTINGS, 0)
    model.moves = moves()
    outcome = model.fit(*library).evaluate(np.roll(library[0], (2, -1), (-2, -1)))
    cells = np.array(moves().cells)
    np.testing.assert_allclose(outcome.found["range"], 2 * cells[0], atol=0.01 * cells[0])
    np.testing.assert_allclose(outcome.found["crossrange"], -cells[1], atol=0.01 * cells[1])
    assert not fitted(library).evaluate(library[0]).found


def test_a_view_is_judged_without_its_own_template(library):
    images, labels = library
    model = build_classifier("blobs", SETTINGS | {"candidates": 24}, 0)
    model.aspects = np.arange(24).astype(str)
    model.fit(images, labels)
    with_own, without = model.evaluate(images), model.evaluate(images, model.aspects)
    np.testing.assert_allclose(with_own.known["assignment"], 1, rtol=1e-5)
    assert (without.known["assignment"] < 0.9999).all()
    rest = build_classifier("blobs", SETTINGS | {"candidates": 24}, 0).fit(images[1:], labels[1:])
    np.testing.assert_allclose(without.scores[:1], rest.evaluate(images[:1]).scores, rtol=1e-5)


def test_the_candidates_hold_the_best_of_all_templates(library):
    few, every = (fitted(library, candidates=count) for count in (6, 12))
    tests = images_moved(*fields_of(1), (1.4, 0.6))
    np.testing.assert_allclose(few.evaluate(tests).scores[:, 0], every.evaluate(tests).scores[:, 0], rtol=1e-6)


def test_the_model_has_the_interface_of_all(library, tmp_path):
    images, labels = library
    model = fitted(library)
    noisy = images + 0.1 * np.random.default_rng(0).standard_normal(images.shape).astype(np.complex64)
    assert not [*of_face(model), *of_fitted(model, labels, noisy)]
    model.save(tmp_path)
    assert not [*of_restored(model, build_classifier("blobs", SETTINGS, 0), tmp_path, noisy)]
    empty = model.evaluate(np.zeros_like(images[:1]))
    assert not empty.scores.any()
