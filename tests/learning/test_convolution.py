"""The convolution by slices and by transforms, their gradients, and the choice between them."""

import jax
import numpy as np
import pytest

from learning import capsules, convolution
from learning.convolution import KERNEL, by_slices, by_transforms, spectra, transforms_pay

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


def transformed(images, weights, offset, stride):
    return by_transforms(images, spectra(weights, images.shape[1:3], stride), offset, stride)


def of_jax(images, weights, offset, stride):
    kernel, layout = weights.reshape(KERNEL, KERNEL, images.shape[-1], -1), ("NHWC", "HWIO", "NHWC")
    return offset + jax.lax.conv_general_dilated(images, kernel, (stride, stride), "VALID", dimension_numbers=layout)


@pytest.mark.parametrize("way", [by_slices, transformed])
@pytest.mark.parametrize("stride", [1, 2, 3])
def test_convolution_is_that_of_jax(random, way, stride):
    images, weights, offset, _ = arrays_of(random, (14, 17), stride)
    assert difference(way(images, weights, offset, stride), of_jax(images, weights, offset, stride)) < 4e-6  # 1.3e-6


@pytest.mark.parametrize("size", SIZES)
def test_transforms_give_the_outputs_of_slices(random, size):
    images, weights, offset, _ = arrays_of(random, size)
    expected = by_slices(images.astype(float), weights.astype(float), offset, 2)
    found = transformed(images, weights, offset, 2)
    assert isinstance(found, np.ndarray) and found.dtype == np.float32 and found.shape == expected.shape
    assert difference(found, expected) < 3e-6  # 8e-7 measured at most


@pytest.mark.parametrize("size", SIZES)
def test_gradients_are_those_of_jax(random, size):
    images, weights, offset, ends = arrays_of(random, size)

    def gradients(way):
        return jax.vjp(lambda *inputs: way(*inputs, 2), images, weights, offset)[1](ends)

    for found, expected in zip(gradients(transformed), gradients(of_jax), strict=True):
        assert found.dtype == np.float32 and difference(found, expected) < 3e-6  # 8e-7 measured at most


def test_two_outputs_are_two_scalar_products(random):
    of_pixels, of_weights, of_outputs = convolution.transforms(2, 1, 3)
    pixels, weights = random.standard_normal((4, 3)), random.standard_normal((3, 3))
    found = of_outputs @ ((of_pixels @ pixels.ravel()) * (of_weights @ weights.ravel()))
    np.testing.assert_allclose(found, [(pixels[:3] * weights).sum(), (pixels[1:] * weights).sum()], atol=1e-6)


def test_transforms_are_taken_where_they_take_less_time():
    # The reference network: a phase's 12 x 12 pixels have 4 real frequencies and 70 pairs of complex ones. By slices an
    # image takes 340 million multiplications and writes 1.33 million numbers, by transforms 92 and 0.28; the weights'
    # transform takes 1,416 and 57 for all images.
    assert len(convolution.transforms(8, 8, 5)[0]) == 4 + 3 * 70
    assert [transforms_pay((count, 24, 24, 256), 256, 2) for count in (1, 27, 28, 114)] == [False, False, True, True]
    # The default config's, and a first convolution, which has one channel, however many the images.
    assert [transforms_pay((count, 24, 24, 16), 16, 2) for count in (1, 16)] == [False, True]
    assert not transforms_pay((10**6, 32, 32, 1), 256, 1)


def test_a_few_images_keep_slices_and_their_bits(random):
    images, weights, offset, _ = arrays_of(random, (24, 24), count=2, channels=16, filters=16)
    assert (convolution.convolve(images, weights, offset, 2) == by_slices(images, weights, offset, 2)).all()


def test_a_network_with_spectra_gives_the_same_activations(random):
    # Of fewer filters, spectra never pay for images of this size.
    images = random.random((40, 32, 32, 1)).astype(np.float32)
    weights = capsules.initial_weights(random, images.shape[1:], 2, width=128, capsules=16, decoder=4)
    assert capsules.spectra_pay(weights, images.shape) and not capsules.spectra_pay(weights, (8, 32, 32, 1))
    ready = weights | {"primary": capsules.primary_spectra(weights, images.shape)}
    expected = capsules.activations(weights, images[:8], 3)
    np.testing.assert_allclose(capsules.activations(ready, images[:8], 3), expected, atol=1e-6)
    # Of many images they are made without being asked for, in NumPy and JAX.
    np.testing.assert_allclose(capsules.activations(weights, images, 3)[:8], expected, atol=1e-6)
    traced = jax.jit(capsules.activations, static_argnums=2)(weights, images, 3)
    np.testing.assert_allclose(traced[:8], expected, atol=1e-6)
