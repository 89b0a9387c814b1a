"""The capsule networks as models, on small images, and the scores that follow from its reconstructions."""

import numpy as np
import pytest
from scipy.stats import rayleigh
from sklearn.mixture import GaussianMixture

from isarflow.core import kinds
from isarflow.learning import confidence
from isarflow.learning.classifier import OTHER, build_classifier
from isarflow.learning.conformance import of_face, of_fitted, of_restored
from isarflow.learning.models import capsule
from isarflow.learning.networks import capsules, training_loop
from isarflow.learning.networks.convolution import outputs

SETTINGS = {
    "width": 8,
    "capsules": 2,
    "routings": 3,
    "decoder": 16,
    "epochs": 12,
    "patience": 12,
    "batch": 8,
    "learning_rate": 0.005,
    "decay": 0.95,
    "reconstruction": 0.5,
    "denoise": False,
    "complex": False,
}
PLACES = {"left": (8, 4), "right": (8, 14), "top": (2, 9)}  # where each target's blob is, in pixels


def blobs(name, count, seed, noise=0.05):
    """Complex images 17 x 19 of one blob that wanders by a pixel, its phase at random, peak 1."""
    random = np.random.default_rng(seed)
    row, column = (centre + random.integers(-1, 2, count) for centre in PLACES[name])
    rows, columns = np.arange(17)[:, None], np.arange(19)
    image = np.exp(-((rows - row[:, None, None]) ** 2 + (columns - column[:, None, None]) ** 2) / 8).astype(complex)
    image *= np.exp(2j * np.pi * random.random(count))[:, None, None]
    image += noise * (random.standard_normal(image.shape) + 1j * random.standard_normal(image.shape))
    return (image / np.abs(image).max(axis=(1, 2), keepdims=True)).astype(np.complex64)


def set_of(names, count, seed, noise=0.05):
    images = np.concatenate([blobs(name, count, seed + place, noise) for place, name in enumerate(names)])
    return images, np.repeat(names, count)


TRAIN, HELD_OUT = set_of(["left", "right"], 60, 0), set_of(["left", "right"], 20, 10)


def fit(kind="capsule", **settings):
    return build_classifier(kind, SETTINGS | settings, seed=3).fit(*TRAIN, HELD_OUT)


@pytest.fixture(scope="module", params=["capsule", "matrix_capsule"])
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def model(kind):
    return fit(kind)


def test_it_learns_and_reconstructs(model):
    assert (model.predict(HELD_OUT[0]) == HELD_OUT[1]).mean() > 0.97
    seen, made, predicted = model.reconstruct(HELD_OUT[0])
    assert seen.shape == made.shape == HELD_OUT[0].shape
    np.testing.assert_allclose(seen, np.abs(HELD_OUT[0]), atol=1e-6)
    outcome = model.evaluate(HELD_OUT[0])
    np.testing.assert_allclose(outcome.known["mse"], -((seen - made) ** 2).mean(axis=(1, 2)), atol=1e-6)
    expected = [np.corrcoef(one.ravel(), two.ravel())[0, 1] for one, two in zip(seen, made, strict=True)]
    np.testing.assert_allclose(outcome.known["zncc"], expected, atol=1e-4)
    np.testing.assert_allclose(outcome.known[model.certainty], outcome.scores.max(axis=1))
    assert (outcome.labels == model.classes_[outcome.scores.argmax(axis=1)]).all()
    assert (outcome.labels == predicted).all()


def test_what_it_cannot_reconstruct_is_unknown(model):
    own, strange = (model.evaluate(images).known for images in (HELD_OUT[0], blobs("top", 40, 30)))
    for score in ("mse", "zncc", "noise_zncc"):
        assert np.median(own[score]) > np.quantile(strange[score], 0.9)


def test_it_is_as_every_model(model, kind, tmp_path):
    assert not [*of_face(model), *of_fitted(model, TRAIN[1], HELD_OUT[0])]
    model.save(tmp_path)
    assert not [*of_restored(model, build_classifier(kind, SETTINGS, seed=0), tmp_path, HELD_OUT[0])]


def test_both_networks_state_the_same_abilities():
    first, second = kinds.kind(kinds.MODELS, "capsule"), kinds.kind(kinds.MODELS, "matrix_capsule")
    assert first.methods == second.methods and first.settings is not None
    names = set(first.stated) - {"LABELS", "SCORES", "certainty"}
    assert {name: first.stated[name] for name in names} == {name: second.stated[name] for name in names}


def test_a_loaded_model_is_the_saved_one(model, kind, tmp_path):
    model.save(tmp_path)
    other = build_classifier(kind, SETTINGS, seed=0).load(tmp_path)
    first, second = model.evaluate(HELD_OUT[0]), other.evaluate(HELD_OUT[0])
    assert (first.scores == second.scores).all()
    assert all((first.known[name] == second.known[name]).all() for name in first.known)


def test_images_in_batches_or_alone_get_the_same_scores(model):
    together = model.evaluate(HELD_OUT[0][:20])
    alone = [model.evaluate(HELD_OUT[0][place : place + 1]) for place in range(20)]
    np.testing.assert_allclose(together.scores, np.concatenate([one.scores for one in alone]), atol=1e-5)
    for name, values in together.known.items():
        np.testing.assert_allclose(values, [one.known[name][0] for one in alone], rtol=1e-3, atol=1e-4)


def lengths(model, images):
    return capsules.lengths(model._vectors(model._inputs(images)))


def test_a_wide_network_gives_many_images_the_scores_of_few():
    # So wide that many images are seen by tiles and few by slices; they shall be those of the weights it now has.
    random = np.random.default_rng(0)
    images = random.standard_normal((40, 32, 32)).astype(np.complex64)
    wide = build_classifier("capsule", SETTINGS | {"width": 128, "capsules": 16}, 0)
    for _ in range(2):
        wide._keep(capsules.initial_weights(random, (32, 32, 1), 2, 128, 16, 16))
        few = [lengths(wide, images[start : start + 4]) for start in range(0, 40, 4)]
        np.testing.assert_allclose(lengths(wide, images), np.concatenate(few), atol=1e-6)


def test_the_curve_has_losses_accuracies_and_seconds(model):
    assert tuple(model.curve_) == training_loop.COLUMNS and len(model.curve_["loss"]) == SETTINGS["epochs"]
    assert model.curve_["loss"][-1] < 0.5 * model.curve_["loss"][0]


def test_a_killed_fit_goes_on_to_the_same_weights(model, kind, tmp_path, monkeypatch):
    monkeypatch.setattr(training_loop, "BETWEEN", 0.0)
    write = training_loop.Checkpoint.write

    def dies(self, arrays, notes):
        write(self, arrays, notes)
        if len(notes["rows"]) == 5:
            raise KeyboardInterrupt

    def start():
        one = build_classifier(kind, SETTINGS, seed=3)
        one.checkpoints = tmp_path
        return one

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(training_loop.Checkpoint, "write", dies)
        start().fit(*TRAIN, HELD_OUT)
    resumed = start().fit(*TRAIN, HELD_OUT)
    for name in model.network.WEIGHTS:
        assert getattr(resumed, f"{name}_").tobytes() == getattr(model, f"{name}_").tobytes()
    assert resumed.curve_["loss"] == model.curve_["loss"]
    assert (resumed.evaluate(HELD_OUT[0]).known["mixture"] == model.evaluate(HELD_OUT[0]).known["mixture"]).all()


def test_the_smallest_images_leave_one_primary_capsule():
    size = [capsule.Model.smallest] * 2
    assert outputs(outputs(size, 1), capsules.STRIDE) == [1, 1]


def noisy_rows():
    """Each view without noise and twice with much of it: images, labels, snrs, views."""
    parts = []
    for label, noise in (("clean", 0.0), ("snr_0dB", 0.3), ("snr_0dB", 0.4)):
        # The same seed puts the same blob at the same place, whatever the noise.
        images, labels = set_of(["left", "right"], 40, 0, noise)
        parts.append((images, labels, np.full(len(images), label), np.arange(len(images))))
    return [np.concatenate(column) for column in zip(*parts, strict=True)]


@pytest.fixture(scope="module")
def denoising():
    """Learned over two SNRs, with images of no class among them."""
    images, labels, snrs, views = noisy_rows()
    images = np.concatenate([images, blobs("top", 60, 40, 0.3)])
    labels = np.concatenate([labels, np.full(60, OTHER)])
    snrs, views = np.concatenate([snrs, np.full(60, "any")]), np.concatenate([views, 1000 + np.arange(60)])
    model = build_classifier("capsule", SETTINGS | {"denoise": True, "epochs": 15}, 1)
    return model.fit(images, labels, (images, labels, snrs, views), snrs, views)


def test_a_denoising_decoder_is_nearer_to_the_truth_than_the_input_is(denoising):
    truth, noisy = blobs("left", 40, 70, 0.0), blobs("left", 40, 70, 0.3)
    seen, made, _ = denoising.reconstruct(noisy)
    error = [((one - np.abs(truth)) ** 2).mean() for one in (seen, made)]
    assert error[1] < 0.5 * error[0]


def test_images_of_no_class_do_not_count_in_the_accuracy(denoising):
    images, labels, *_ = noisy_rows()
    right = (denoising.predict(images) == labels).mean()
    assert max(denoising.curve_["validation_accuracy"]) == pytest.approx(right, abs=0.05) and right > 0.9


def test_another_validation_set_starts_anew(tmp_path, monkeypatch):
    monkeypatch.setattr(training_loop, "BETWEEN", 0.0)
    model = build_classifier("capsule", SETTINGS | {"epochs": 1}, seed=3)
    model.checkpoints = tmp_path
    for count in (20, 19, 20):
        model.fit(*TRAIN, (HELD_OUT[0][:count], HELD_OUT[1][:count]))
    assert len(list(tmp_path.glob("*.joblib"))) == 2


def test_images_of_no_class_have_short_capsules(denoising):
    assert denoising.classes_.tolist() == ["left", "right"]
    strange = denoising.evaluate(blobs("top", 40, 50, 0.3)).known["length"]
    own = denoising.evaluate(HELD_OUT[0]).known["length"]
    assert np.median(strange) < 0.3 < 0.7 < np.median(own)


def test_denoising_aims_at_the_view_without_noise():
    images, labels, snrs, views = noisy_rows()
    model = build_classifier("capsule", SETTINGS | {"denoise": True}, 1)
    model.classes_ = np.unique(labels)
    order = np.random.default_rng(2).permutation(len(images))
    _, sources, _ = model._prepared(images[order], labels[order], snrs[order], views[order])
    assert (snrs[order][sources] == "clean").all() and (views[order][sources] == views[order]).all()


def test_complex_images_are_judged_whatever_their_phase():
    model = fit(complex=True, epochs=20)
    turned = HELD_OUT[0] * np.exp(1j)
    first, second = model.evaluate(HELD_OUT[0]), model.evaluate(turned.astype(np.complex64))
    assert (first.labels == HELD_OUT[1]).mean() > 0.9 and (second.labels == HELD_OUT[1]).mean() > 0.9
    assert set(first.known) == {"mse", "coherence", "length", "mixture"}
    own, strange = first.known["coherence"], model.evaluate(blobs("top", 40, 30)).known["coherence"]
    assert np.median(own) > np.quantile(strange, 0.9)


def test_turning_a_pair_of_channels_turns_the_phase():
    x = np.random.default_rng(0).standard_normal((3, 4, 5, 2))
    (turned,) = capsule._turned((x,), np.array([0.3, -1, 2]))
    expected = (x[..., 0] + 1j * x[..., 1]) * np.exp(1j * np.array([0.3, -1, 2]))[:, None, None]
    np.testing.assert_allclose(turned[..., 0] + 1j * turned[..., 1], expected, atol=1e-6)


def test_the_mixture_score_is_scikit_learns_density(model):
    vectors = model._vectors(model._inputs(TRAIN[0]))[TRAIN[1] == "left", 0]
    count = model.mixture_means_.shape[1]
    own = GaussianMixture(count, reg_covar=1e-5, random_state=3).fit(vectors).score_samples(vectors)
    found = model._mixture_score(vectors, np.zeros(len(vectors), int)) - 0.5 * vectors.shape[1] * np.log(2 * np.pi)
    np.testing.assert_allclose(found, own, rtol=1e-3)


def test_zncc_is_the_direct_formula():
    random = np.random.default_rng(0)
    x, y = random.random((2, 6, 30))
    expected = [
        np.mean((one - one.mean()) / one.std() * (two - two.mean()) / two.std()) for one, two in zip(x, y, strict=True)
    ]
    np.testing.assert_allclose(confidence.zncc(x, y), expected, atol=1e-12)
    np.testing.assert_allclose(confidence.zncc(3 * x + 1, y), expected, atol=1e-12)
    assert confidence.zncc(np.ones((1, 30)), y[:1])[0] == 0


def test_the_noise_is_taken_out_of_the_zncc():
    # A target in few pixels, noise in all of them: the noise-free ZNCC comes back, to a few percent.
    random = np.random.default_rng(0)
    truth = np.zeros((200, 1024))
    truth[:, :200] = 1 + random.random((200, 200))
    for sigma in (0.1, 0.3):
        noise = sigma * (random.standard_normal(truth.shape) + 1j * random.standard_normal(truth.shape))
        image = np.abs(truth + noise)
        plain, mended = (
            confidence.zncc(image, truth, noise).mean() for noise in (0.0, confidence.noise_variance(image))
        )
        assert abs(1 - mended) < 0.5 * abs(1 - plain)
    # Noise alone: its power follows from the first quartile.
    alone = rayleigh.rvs(scale=0.2, size=(1, 100_000), random_state=0)
    np.testing.assert_allclose(confidence.noise_variance(alone), alone.var(), rtol=0.02)


def test_coherence_by_hand():
    x, r = np.array([[1, 1j], [1, 0], [0, 0]]), np.array([[1j, -1], [0, 2], [1, 1]])
    np.testing.assert_allclose(confidence.coherence(x, r), [1, 0, 0], atol=1e-12)
