"""The capsule network's layers against written-out examples, closed forms and JAX's own convolution."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isarflow.learning.networks import capsules


@pytest.fixture
def random():
    return np.random.default_rng(0)


def weights_of(random, shape=(19, 21, 1), classes=2):
    return capsules.initial_weights(random, shape, classes, width=3, capsules=2, decoder=5)


def test_squash_by_hand():
    # Length 5 becomes 25/26; length 1 becomes 1/2.
    vectors = np.array([[3.0, 4.0], [0.0, -1.0], [0.0, 0.0]])
    expected = [[3 / 5 * 25 / 26, 4 / 5 * 25 / 26], [0, -0.5], [0, 0]]
    np.testing.assert_allclose(capsules.squash(vectors), expected, atol=1e-7)


@pytest.mark.parametrize("function", [capsules.squash, capsules.lengths])
def test_gradients_at_zero_are_finite(function):
    gradient = jax.grad(lambda x: function(x).sum())(jnp.zeros((2, 4)))
    assert np.isfinite(gradient).all()


def test_routing_by_hand():
    # Two capsules, one image, two classes, two dimensions: (capsules, n, classes, d).
    votes = np.array([[[[1.0, 0.0], [0.0, 2.0]]], [[[1.0, 0.0], [0.0, -2.0]]]])
    # One iteration: every vote counts half. Class 0 gets (1, 0) -> length 1/2; class 1 gets nothing.
    np.testing.assert_allclose(capsules.route(votes, 1), [[[0.5, 0], [0, 0]]], atol=1e-6)
    # Then both capsules agree with class 0 by 1/2 and with class 1 by 0: the coupling is 1 / (1 + exp(-1/2)).
    coupling = 1 / (1 + np.exp(-0.5))
    length = (2 * coupling) ** 2 / (1 + (2 * coupling) ** 2)
    np.testing.assert_allclose(capsules.route(votes, 2), [[[length, 0], [0, 0]]], atol=1e-6)


def test_routing_of_many_is_the_loop_of_the_paper(random):
    votes = random.standard_normal((5, 3, 4, 6))
    for image in range(3):
        logits = np.zeros((5, 4))
        for _ in range(3):
            coupling = np.exp(logits) / np.exp(logits).sum(axis=1, keepdims=True)
            vectors = np.zeros((4, 6))
            for j in range(4):
                total = sum(coupling[i, j] * votes[i, image, j] for i in range(5))
                size = np.linalg.norm(total)
                vectors[j] = size**2 / (1 + size**2) * total / size
            for i in range(5):
                for j in range(4):
                    logits[i, j] += vectors[j] @ votes[i, image, j]
        np.testing.assert_allclose(capsules.route(votes, 3)[image], vectors, atol=1e-6)


def test_margin_loss_by_hand():
    vectors = np.array([[[0.5, 0.0], [0.0, 0.3]], [[0.95, 0.0], [0.05, 0.0]], [[0.6, 0.0], [0.0, 0.0]]])
    truth = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 0.0]])  # the last image is of no class
    expected = [0.4**2 + 0.5 * 0.2**2, 0, 0.5 * 0.5**2]
    np.testing.assert_allclose(capsules.margin_loss(vectors, truth), expected, atol=1e-6)


def test_votes_begin_as_small_as_those_of_the_listings_library(random):
    """Keras takes weights (classes, capsules, 16, 8) for a convolution's, and the first two for a kernel's size."""
    votes = capsules.initial_weights(random, (32, 32, 1), 2, width=2, capsules=32, decoder=4)["votes"]
    bound = (6 / (2 * 2048 * (16 + 8))) ** 0.5
    assert 0.99 * bound < abs(votes).max() <= bound


def test_encoder_has_as_many_weights_as_the_published_one(random):
    weights = capsules.initial_weights(random, (28, 28, 1), 10, width=256, capsules=32, decoder=512)
    encoder = {name: value for name, value in weights.items() if not name.startswith("decoder")}
    # 256 filters of 81 pixels; 256 of 81 x 256; 1,152 capsules with a matrix of 8 x 16 for each of 10 classes.
    assert sum(value.size for value in encoder.values()) == 82 * 256 + (81 * 256 + 1) * 256 + 1152 * 8 * 16 * 10
    assert {weights[f"decoder{layer}"].shape for layer in range(3)} == {(160, 512), (512, 1024), (1024, 784)}


def test_numpy_and_jax_agree(random):
    weights = weights_of(random)
    images = random.random((4, 19, 21, 1)).astype(np.float32)
    found = capsules.activations(weights, images, 3)
    traced = jax.jit(lambda weights, images: capsules.activations(weights, images, 3))(weights, images)
    assert isinstance(found, np.ndarray) and found.dtype == np.float32 and found.shape == (4, 2, capsules.CLASS)
    np.testing.assert_allclose(found, traced, atol=1e-5)
    assert (capsules.lengths(found) < 1).all()


def test_loss_of_black_images_has_a_finite_gradient(random):
    weights, images, truth = weights_of(random), jnp.zeros((2, 19, 21, 1)), jnp.eye(2)

    def loss(weights):
        vectors = capsules.activations(weights, images, 3)
        return capsules.margin_loss(vectors, truth).sum() + capsules.reconstruct(weights, vectors, truth, True).sum()

    gradient = jax.grad(loss)({name: jnp.asarray(value) for name, value in weights.items()})
    assert all(np.isfinite(value).all() for value in gradient.values())


def test_the_decoder_sees_the_masked_class_alone(random):
    weights = weights_of(random)
    vectors = random.standard_normal((1, 2, capsules.CLASS)).astype(np.float32)
    changed = vectors.copy()
    changed[:, 1] += 1
    mask = np.array([[1.0, 0.0]], np.float32)
    first, second = (capsules.reconstruct(weights, one, mask, True) for one in (vectors, changed))
    assert (first == second).all() and first.shape == (1, 19 * 21) and (first > 0).all() and (first < 1).all()
    assert (capsules.reconstruct(weights, changed, 1 - mask, True) != first).any()
    linear = capsules.reconstruct(weights, vectors, mask, False)
    np.testing.assert_allclose(first, 1 / (1 + np.exp(-linear)), atol=1e-6)
