"""The search of a library for a target's place and drift: where it is, what is lost, and what is the same elsewhere."""

import numpy as np
import pytest

from isarflow.core.sweep import C0
from isarflow.imaging.formation import form_images
from isarflow.learning.classifier import build_classifier, load_classifier
from isarflow.learning.conformance import of_fitted, of_restored
from isarflow.learning.data.moves import Moves
from isarflow.learning.search import BLOCK, HYPOTHESES, Search

IMAGING = {"imager": "fourier", "aperture": 13, "polarizations": ["VV", "HH"], "window": "hamming", "reformat": "polar"}
IMAGING["upsample"] = "none"
VIEWS, PLACE = 40, 0.15
ALL = np.ones((BLOCK, 13), bool)


def moves(**limits):
    return Moves({"limits": limits, "frequencies": [3e9, 5e9, 16], "step": 2.0, "imaging": IMAGING})


def samples_of(number, views=VIEWS):
    """Samples (views, channel, F * A) of a class of its own scatterers, turning from view to view."""
    made, random = moves(), np.random.default_rng(number)
    points, strength = random.uniform(-0.35, 0.35, (7, 2)), random.uniform(0.3, 1, (7, 2))
    k = 2 * np.pi / C0 * made.frequency
    found = []
    for turn in np.radians(9.0 * np.arange(views)):
        at = turn + made.angle
        path = points[:, :1] * np.cos(at) + points[:, 1:] * np.sin(at)
        wave = np.exp(2j * k[:, None] * path[:, None])
        found.append(np.einsum("pc,pfa->cfa", strength, wave).reshape(2, -1))
    return np.array(found, np.complex64)


def moved(samples, snr_db, seed, still=(), **limits):
    """Images of samples, moved within limits and in noise, and the errors. still: numbers without noise and motion."""
    from isarflow.imaging.motion import displaced, draw

    random, made = np.random.default_rng(seed), moves(**limits)
    errors = draw(made.limits, [(seed, number) for number in range(len(samples))], len(made.angle))
    noise = random.standard_normal((*samples.shape, 2)).view(complex)[..., 0] * np.sqrt(0.5)
    level = np.sqrt((np.abs(samples) ** 2).mean(axis=(1, 2), keepdims=True) / 10 ** (snr_db / 10))
    noisy = displaced(samples, made.frequency, made.angle, errors) + level * noise
    noisy = noisy.reshape(*samples.shape[:2], len(made.frequency), -1) * errors.received[:, None, None]
    return form_images(made.imager, noisy.reshape(samples.shape).astype(np.complex64))[0], errors


@pytest.fixture(scope="module")
def library():
    samples = [samples_of(number) for number in (1, 2)]
    images = np.concatenate([form_images(moves().imager, each)[0] for each in samples])
    return samples, images, np.repeat(["one", "two"], VIEWS)


def fitted(library, kind="likelihood", **limits):
    settings = {"likelihood": {"candidates": 8, "mismatch": 0.03}, "matched_filter": {"features": "magnitude"}}[kind]
    model = build_classifier(kind, settings, 0)
    model.moves = moves(**limits) if limits else None
    random = np.random.default_rng(0)
    noise = random.standard_normal((400, 2, 16 * 13, 2)).view(complex)[..., 0].astype(np.complex64)
    model.noise = form_images(moves().imager, noise)[0]
    _, images, labels = library
    return model.fit(images, labels)


def test_places_are_searched_within_half_an_extent():
    """An image repeats beyond it: without a bound its memory would grow with the square of `place`."""
    random = np.random.default_rng(0)
    templates = (random.standard_normal((8, 2, *moves().shape, 2)) @ [1, 1j]).astype(np.complex64)
    for place in (PLACE, 500.0):
        search = Search(moves(place=place), templates, [0, 4], None)
        assert all(most <= count for most, count in zip(search.largest_offsets, moves().shape, strict=True))


def test_no_drift_is_searched_where_images_are_focused():
    assert moves(place=PLACE, drift=1.0).limits.drift == 1.0
    motion = {"limits": {"place": PLACE, "drift": 1.0}, "frequencies": [3e9, 5e9, 16], "step": 2.0}
    focused = Moves(motion | {"imaging": IMAGING | {"focus": "entropy"}})
    assert (focused.limits.place, focused.limits.drift) == (PLACE, 0.0)


def test_images_moved_by_their_samples_are_the_images_of_moved_samples(library):
    """The samples that an image tells of are enough: -25 dB at two cells, where the image fills half its extent."""
    samples = library[0][0]
    made = moves(place=PLACE)
    images, peaks = form_images(made.imager, samples)
    factor = made.phases(0.1, -0.12)
    again, again_peaks = form_images(made.imager, (samples.reshape(-1, 2, 16, 13) * factor).reshape(samples.shape))
    found = made.images(made.samples(images * peaks[:, None, None, None]) * factor)
    wanted = again * again_peaks[:, None, None, None]
    error = 10 * np.log10((np.abs(found - wanted) ** 2).sum() / (np.abs(wanted) ** 2).sum())
    assert error < -25  # -31
    assert np.abs(made.images(made.samples(images)) - images).max() < 0.1


def test_places_are_found_to_half_a_pixel(library):
    model = fitted(library, place=PLACE)
    images, errors = moved(np.concatenate(library[0]), 12, 3, place=PLACE)
    outcome = model.evaluate(images)
    assert np.mean(outcome.labels == library[2]) > 0.98
    off = outcome.found["range"] - errors.place_range, outcome.found["crossrange"] - errors.place_crossrange
    assert "drift" not in outcome.found  # as none was looked for
    for error, cell in zip(off, model.moves.cells, strict=True):
        assert np.mean(np.abs(error) < cell / 2) > 0.98 and np.median(np.abs(error)) < 0.15 * cell
    known = fitted(library).evaluate(images)
    assert np.mean(known.labels == library[2]) < 0.95  # without a search


def test_drifts_are_found_to_their_step(library):
    model = fitted(library, place=PLACE, drift=0.5)
    images, errors = moved(np.concatenate(library[0]), 15, 4, place=PLACE, drift=0.5)
    outcome = model.evaluate(images)
    assert np.mean(outcome.labels == library[2]) > 0.98
    assert np.mean(np.abs(outcome.found["drift"] - errors.drift) < 0.25) > 0.9


@pytest.mark.parametrize("kind", ["likelihood", "matched_filter"])
def test_scores_of_a_searched_image_are_those_of_the_image_at_its_place(library, kind):
    """Nearly: the place is found to a share of a cell."""
    images, _ = moved(np.concatenate(library[0]), 15, 5, place=PLACE)
    still, _ = moved(np.concatenate(library[0]), 15, 5)
    found, placed = (fitted(library, kind, place=PLACE).evaluate(each).scores.max(axis=1) for each in (images, still))
    centred = fitted(library, kind).evaluate(still).scores.max(axis=1)
    lost = fitted(library, kind).evaluate(images).scores.max(axis=1)
    assert np.median(np.abs(found - placed)) < 0.15 * np.median(np.abs(placed - lost))
    assert np.median(centred - found) < 0.3 * np.median(centred - lost)


def test_jitter_and_lost_pulses_cost_less_when_they_are_accounted_for(library):
    limits = {"place": PLACE, "jitter": 0.033, "missing": 0.15}
    images, errors = moved(np.concatenate(library[0]), 15, 6, **limits)
    model = fitted(library, **limits)
    told = model.evaluate(images, received=errors.received).known["likelihood"]
    untold = model.evaluate(images).known["likelihood"]
    placed = fitted(library, place=PLACE).evaluate(images).known["likelihood"]
    assert np.median(told) > np.median(untold) > np.median(placed)


def test_templates_of_lost_pulses_are_images_of_the_samples_that_there_are(library):
    made, images = moves(place=PLACE), library[1]
    search, received = Search(made, images, [0, VIEWS], None), ALL[:3].copy()
    received[0, [2, 7]] = received[2, 5] = False
    found = search.templates_received(images[None, :4].repeat(3, axis=0), received)
    for row in range(3):
        wanted = made.samples(images[:4]) * received[row]
        unseen = images[:4] - made.images(made.samples(images[:4]))  # of which samples do not tell
        assert np.abs(found[row] - made.images(wanted) - unseen).max() < 1e-5


def test_a_search_judges_each_image_by_itself_and_survives_saving(library, tmp_path):
    model = fitted(library, place=PLACE)
    images, _ = moved(np.concatenate(library[0]), 12, 7, place=PLACE)
    assert list(of_fitted(model, library[2], images)) == []
    few, every = model.evaluate(images[:3]), model.evaluate(images)
    np.testing.assert_allclose(few.scores, every.scores[:3], rtol=1e-4)
    model.save(tmp_path)
    fresh = build_classifier("likelihood", model.settings, 0)
    fresh.moves = model.moves
    assert list(of_restored(model, fresh, tmp_path, images)) == []


def test_an_aspect_left_out_is_not_found(library):
    model = fitted(library, place=PLACE)
    model.aspects_ = np.array([f"{number}" for number in range(2 * VIEWS)])
    vars(model).pop("_search", None)
    images, _ = moved(np.concatenate(library[0]), 20, 8, place=PLACE)
    whole = model.evaluate(images).known["likelihood"]
    without = model.evaluate(images, np.arange(2 * VIEWS).astype(str)).known["likelihood"]
    assert np.mean(without < whole) > 0.9


def test_hypotheses_are_distinct_and_a_blocks_own(library):
    search = Search(moves(place=PLACE, drift=0.25), library[1], [0, VIEWS], None)
    images, _ = moved(np.concatenate(library[0])[:BLOCK], 12, 9, place=PLACE)
    found = search.hypotheses(images)
    assert found.images.shape[0] == BLOCK * HYPOTHESES
    assert np.abs(found.range).max() <= PLACE + search.steps[0] * 1.6
    assert set(found.drift) <= {-0.25, 0.0, 0.25}


def test_moved_training_images_follow_from_names_and_keep_their_peak(library):
    made, images = moves(place=PLACE, missing=0.2), library[1][:6]
    one, same, other = (made.drawn(images, 0, "run", "knn", copy) for copy in (0, 0, 1))
    assert np.array_equal(one, same) and not np.array_equal(one, other)
    assert np.abs(one).max(axis=(1, 2, 3)) == pytest.approx(np.ones(6), rel=1e-6)


def test_a_loaded_model_knows_its_motion(library, tmp_path):
    import json

    model = fitted(library, place=PLACE)
    model.save(tmp_path)
    motion = {"limits": {"place": PLACE}, "frequencies": [3e9, 5e9, 16], "step": 2.0, "imaging": IMAGING}
    config = {
        "run": {"motion": motion, "upsample": "none"},
        "kind": "likelihood",
        "settings": model.settings,
        "seed": 0,
    }
    (tmp_path / "config.json").write_text(json.dumps(config))
    images, _ = moved(np.concatenate(library[0])[:9], 12, 3, place=PLACE)
    np.testing.assert_allclose(
        load_classifier(tmp_path).evaluate(images).scores, model.evaluate(images).scores, rtol=1e-5
    )
