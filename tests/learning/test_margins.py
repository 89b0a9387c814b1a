"""Models whose confidence is that of the known classes less that of other things: invariants, network, sum."""

import json

import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.learning.classifier import CONFIG, OTHER, build_classifier
from isarflow.learning.models import cnn, invariants
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

SHAPE = (3, 14, 11)
SETTINGS = {
    "invariants": {"rounds": 20, "leaves": 4, "learning_rate": 0.2},
    "cnn": {"width": 6, "epochs": 12, "batch": 32, "learning_rate": 0.02, "dropout": 0.0},
}


def examples(seed, count=80):
    """Images of points of three arrangements, anywhere, the third OTHER; (n, channel, R, X), and labels."""
    random = np.random.default_rng(seed)
    numbers = random.integers(3, size=count)
    images = np.zeros((count, *SHAPE), complex)
    for image, number in zip(images, numbers, strict=True):
        r, x = random.integers(2, 6), random.integers(2, 5)
        for step in range((4, 2, 1)[number]):  # a long line, a short one, one point
            image[:, r + (2 * step if number == 0 else 0), x + (0 if number == 0 else 3 * step)] = 1, 0.8, 0.1
    images *= np.exp(2j * np.pi * random.random((count, 1, 1, 1)))
    return images.astype(np.complex64), np.array(["line", "pair", OTHER])[numbers]


def noise(count=50):
    parts = np.random.default_rng(3).standard_normal((2, count, *SHAPE))
    return (parts[0] + 1j * parts[1]).astype(np.complex64)


def fitted(kind, settings=None, beside=None):
    model = build_classifier(kind, settings or SETTINGS[kind], 0)
    model.noise, model.beside = noise(), beside
    images, labels = examples(0, 400)
    return model.fit(images, labels, (*examples(1), None, None))


def kept(folder, name, kind):
    """Fit a model and write it as the job does: the folder of its name."""
    model, path = fitted(kind), folder / name
    path.mkdir()
    model.save(path)
    config = {"kind": kind, "settings": SETTINGS[kind], "seed": 0, "run": {"motion": {}}}
    (path / CONFIG).write_text(json.dumps(config))
    return model


@pytest.mark.parametrize("kind", SETTINGS)
def test_margins_tell_known_classes_from_other_things(kind, tmp_path):
    model, (images, labels) = fitted(kind), examples(2)
    outcome, known = model.evaluate(images), labels != OTHER
    assert (outcome.labels[known] == labels[known]).mean() > 0.9 and OTHER not in outcome.labels
    first = next(iter(outcome.known.values()))
    assert (first[known][:, None] > first[~known]).mean() > 0.9
    less = outcome.scores[:, model.classes_ != OTHER].max(axis=1) - outcome.scores[:, model.classes_ == OTHER][:, 0]
    np.testing.assert_allclose(outcome.known["margin"], less, atol=1e-9)
    model.save(tmp_path)
    loaded = build_classifier(kind, SETTINGS[kind], 0).load(tmp_path)
    np.testing.assert_array_equal(loaded.evaluate(images).scores, outcome.scores)


def test_invariants_do_not_change_with_place_level_and_phase():
    images = np.zeros((1, *SHAPE), complex)
    parts = np.random.default_rng(4).standard_normal((2, 3, 4, 3))
    images[0, :, 3:7, 3:6] = parts[0] + 1j * parts[1]
    images[0, 1] *= 0.5 + 0.2j
    moved = 7 * np.exp(0.4j) * np.roll(images, (3, 2), (2, 3))
    here, there = (invariants.invariants(of)[0] for of in (images, moved))
    names = invariants.names()
    assert len(names) == len(here) == len(set(names)) and all(name.endswith("]") for name in names)
    np.testing.assert_allclose(there, here, rtol=1e-4, atol=1e-4)


def test_invariants_are_what_they_say():
    images = np.zeros((1, *SHAPE), complex)
    images[0, 0, 2, 5], images[0, 0, 8, 5] = 1, 1
    images[0, 1, 2, 5], images[0, 1, 8, 5] = 1, -1  # an odd bounce and an even one
    found = dict(zip(invariants.names(), invariants.invariants(images)[0], strict=True))
    assert found["all: spread in range [cells]"] == pytest.approx(3)
    assert found["all: spread in cross-range [cells]"] == pytest.approx(0, abs=1e-5)
    assert found["all: scatterers above -6 dB [1]"] == 2
    assert found["all: share of the 1 strongest pixels [1]"] == pytest.approx(0.5)
    assert found["all: entropy [nats]"] == pytest.approx(np.log(2), rel=1e-5)
    assert found["power of channel 1 over channel 0 [dB]"] == pytest.approx(0, abs=1e-5)
    assert found["even bounces [share]"] == pytest.approx(0.5)
    assert found["coherence of channels 0 and 1 [1]"] == pytest.approx(0, abs=1e-6)


def test_added_noise_has_its_share_of_the_energy():
    images = np.tile(examples(0, 1)[0], (4000, 1, 1, 1))
    noisy = invariants.with_noise(images, noise(500), np.random.default_rng(0))
    clean = images / np.linalg.norm(images[0])
    along = np.einsum("ncrx,ncrx->n", noisy, clean.conj()).real ** 2  # near 1 - share, as noise is along all pixels
    low, high = invariants.NOISE
    mean = (high - low) / np.log(high / low)
    assert np.mean(1 - along) == pytest.approx(mean, rel=0.05)


def test_a_sum_is_of_fitted_models_scores_over_their_spreads(tmp_path):
    members = [kept(tmp_path, name, kind) for name, kind in (("trees", "invariants"), ("network", "cnn"))]
    settings, (images, labels) = {"of": "trees + network"}, examples(2)
    model = fitted("sum", settings, tmp_path)
    parts = [member.evaluate(images).known["margin"] for member in members]
    expected = sum(part / spread for part, spread in zip(parts, model.spreads_, strict=True))
    outcome, known = model.evaluate(images), labels != OTHER
    np.testing.assert_allclose(outcome.known["sum"], expected)
    assert (model.spreads_ > 0).all() and (outcome.labels[known] == labels[known]).mean() > 0.9
    (tmp_path / "sum").mkdir()
    model.save(tmp_path / "sum")
    loaded = build_classifier("sum", settings, 0).load(tmp_path / "sum")
    np.testing.assert_array_equal(loaded.evaluate(images).scores, outcome.scores)


def test_a_sum_takes_models_of_its_experiment_that_learn_the_same_classes():
    config = read_yaml("config/families-fields.yaml")
    novel = {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["sum"]}
    novel["split"] = {"scheme": "family", "others": "novel"}
    config["learning"] = {"experiments": {"*": None, "novel": novel}}
    with pytest.raises(InputError, match="sum takes the scores of likelihood_other; name likelihood_other among them"):
        load_config(config)
    novel["models"] = ["likelihood_other", "invariants", "sum"]
    assert load_config(config)
    config["learning"]["models"] = {"invariants": {"other": False}}
    with pytest.raises(InputError, match="sum takes the scores of invariants; both or neither must have 'other: true'"):
        load_config(config)


def test_the_network_sees_magnitudes_at_twice_the_band():
    images, _ = examples(5, 3)
    centre = cnn._centre(images)
    features = np.asarray(cnn._features(images, centre))
    assert features.shape == (3, 28, 22, 5)
    # Every second one of the finer pixels is a pixel of the image.
    coarse = np.abs(images) ** 2
    finer = features[:, ::2, ::2, :3] ** 4
    finer = np.moveaxis(finer, -1, 1)
    ratio = finer.sum(axis=(1, 2, 3)) / coarse.sum(axis=(1, 2, 3))
    np.testing.assert_allclose(finer / ratio[:, None, None, None], coarse, atol=2e-3)
