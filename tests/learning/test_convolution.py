"""The convolution by slices and by tiles, their gradients, and the choice between them."""

import jax
import numpy as np
import pytest

from isarflow.learning.networks import capsules, convolution
from isarflow.learning.networks.convolution import (
    KERNEL,
    OF_OUTPUTS,
    OF_PIXELS,
    OF_WEIGHTS,
    POINTS,
    TAPS,
    TILE,
    by_slices,
    by_tiles,
    tiling,
    transformed,
    transforms_pay,
)

# Rows and columns with one output, odd ones, a prime number of pixels, and the reference network's.
SIZES = [(9, 9), (9, 20), (12, 11), (25, 14), (19, 30), (24, 24)]


@pytest.fixture
def random():
    return np.random.default_rng(0)


def arrays_of(random, size, stride=2, count=3, channels=4, filters=5):
    """Images as after a rectifier, weights, an offset, and the outputs' share in a gradient, float32."""
    images = np.maximum(random.standard_normal((count, *size, channels)), 0)
    weights = random.uniform(-1, 1, (KERNEL**2 * channels, filters))
    ends = random.standard_normal((count, *convolution.outputs(size, stride), filters))
    return [one.astype(np.float32) for one in (images, weights, random.standard_normal(filters), ends)]


def difference(found, expected):
    """The largest, relative to the largest value."""
    return np.abs(found - expected).max() / np.abs(expected).max()


def tiled(images, weights, offset, stride):
    assert stride == convolution.STRIDE
    return by_tiles(images, transformed(weights), offset)


def of_jax(images, weights, offset, stride):
    kernel, layout = weights.reshape(KERNEL, KERNEL, images.shape[-1], -1), ("NHWC", "HWIO", "NHWC")
    return offset + jax.lax.conv_general_dilated(images, kernel, (stride, stride), "VALID", dimension_numbers=layout)


@pytest.mark.parametrize(("way", "stride"), [(by_slices, 1), (by_slices, 2), (by_slices, 3), (tiled, 2)])
def test_convolution_is_that_of_jax(random, way, stride):
    images, weights, offset, _ = arrays_of(random, (14, 17), stride)
    assert difference(way(images, weights, offset, stride), of_jax(images, weights, offset, stride)) < 4e-6  # 1.3e-6


@pytest.mark.parametrize("size", SIZES)
def test_tiles_give_the_outputs_of_slices(random, size):
    images, weights, offset, _ = arrays_of(random, size)
    expected = by_slices(images.astype(float), weights.astype(float), offset, 2)
    found = tiled(images, weights, offset, 2)
    assert isinstance(found, np.ndarray) and found.dtype == np.float32 and found.shape == expected.shape
    assert difference(found, expected) < 1e-5  # 4.5e-6 measured at most


@pytest.mark.parametrize("size", SIZES)
def test_gradients_are_those_of_jax(random, size):
    images, weights, offset, ends = arrays_of(random, size)

    def gradients(way):
        return jax.vjp(lambda *inputs: way(*inputs, 2), images, weights, offset)[1](ends)

    for found, expected in zip(gradients(tiled), gradients(of_jax), strict=True):
        assert found.dtype == np.float32 and difference(found, expected) < 1e-5  # 7e-6 measured at most


def test_a_tile_of_outputs_is_so_many_scalar_products(random):
    pixels, weights = random.standard_normal(POINTS), random.standard_normal(TAPS)
    found = OF_OUTPUTS @ ((OF_PIXELS @ pixels) * (OF_WEIGHTS @ weights))
    np.testing.assert_allclose(found, [pixels[start : start + TAPS] @ weights for start in range(TILE)], atol=1e-5)


def test_tiles_cover_all_outputs_and_no_more():
    tiles, of_pixels, of_outputs = tiling(6)
    assert tiles == 2 and of_pixels.shape == (2 * 8, 12) and of_outputs.shape == (6, 8, 2)


def test_tiles_are_taken_where_they_take_less_time():
    # The reference network: four tiles of 8 x 8 points. By slices an image takes 340 million multiplications and writes
    # 1.33 million numbers, by tiles 76 and 0.33; the weights' transform takes 420 and 17 for all images.
    assert [transforms_pay((count, 24, 24, 256), 256) for count in (1, 8, 9, 114)] == [False, False, True, True]
    # The default config's.
    assert [transforms_pay((count, 24, 24, 16), 16) for count in (1, 16)] == [False, True]


def test_a_few_images_keep_slices_and_their_bits(random):
    images, weights, offset, _ = arrays_of(random, (24, 24), count=1, channels=16, filters=16)
    assert (convolution.convolve(images, weights, offset, 2) == by_slices(images, weights, offset, 2)).all()


def test_a_gpu_takes_slices(random, monkeypatch):
    """It trains by JAX; predictions, by NumPy, are the processor's."""
    images, weights, offset, _ = arrays_of(random, (24, 24), count=16, channels=16, filters=16)
    by_numpy = convolution.convolve(images, weights, offset, 2)
    assert (by_numpy == by_tiles(images, transformed(weights), offset)).all()
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    on_device = [jax.numpy.asarray(array) for array in (images, weights, offset)]
    assert (convolution.convolve(*on_device, 2) == by_slices(*on_device, 2)).all()
    assert (convolution.convolve(images, weights, offset, 2) == by_numpy).all()


def test_a_network_with_prepared_weights_gives_the_same_activations(random):
    images = random.random((40, 32, 32, 1)).astype(np.float32)
    weights = capsules.initial_weights(random, images.shape[1:], 2, width=128, capsules=16, decoder=4)
    ready = capsules.prepared(weights, images.shape)
    assert ready["primary"].ndim == 3 and capsules.prepared(weights, (4, 32, 32, 1)) is weights
    expected = capsules.activations(weights, images[:4], 3)
    np.testing.assert_allclose(capsules.activations(ready, images[:4], 3), expected, atol=1e-6)
    # Of many images they are made without being asked for, in NumPy and JAX.
    np.testing.assert_allclose(capsules.activations(weights, images, 3)[:4], expected, atol=1e-6)
    traced = jax.jit(capsules.activations, static_argnums=2)(weights, images, 3)
    np.testing.assert_allclose(traced[:4], expected, atol=1e-6)
