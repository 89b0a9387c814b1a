"""The capsule network's convolution: by slices, or by Fourier transforms where these take less time to train.

All functions of arrays take NumPy's as well as JAX's, and give the same kind back.
"""

import functools

import numpy as np

KERNEL = 9  # pixels a side
MOVED = 200  # multiplications in the time in which a number is written to memory, and its gradient


def convolve(images, weights, offset, stride):
    """Images (n, rows, columns, channels) to outputs (n, rows', columns', filters).

    weights: (KERNEL^2 channels, filters), or their `spectra` for images of this size; offset: (filters,).
    """
    if weights.ndim == 2 and transforms_pay(images.shape, weights.shape[-1], stride):
        weights = spectra(weights, images.shape[1:3], stride)
    return (by_slices if weights.ndim == 2 else by_transforms)(images, weights, offset, stride)


def by_slices(images, weights, offset, stride):
    """As `convolve`, by slices and one matrix product.

    XLA's own convolution has a gradient that is 30 times slower on CPUs, and one slice for each of the weights takes it
    three times as long to compile as first those of a row and then those of a column.
    """
    rows, columns = (stride * (size - 1) + 1 for size in outputs(images.shape[1:3], stride))
    concatenate = images.__array_namespace__().concatenate
    seen = concatenate([images[:, :, first : first + columns : stride] for first in range(KERNEL)], axis=-1)
    seen = concatenate([seen[:, first : first + rows : stride] for first in range(KERNEL)], axis=-1)
    # NumPy would make of four dimensions as many small products.
    return (seen.reshape(-1, len(weights)) @ weights + offset).reshape(*seen.shape[:3], -1)


def by_transforms(images, spectra, offset, stride):
    """As `convolve`, with the weights' `spectra` (products, stride^2 channels, filters).

    Every stride-th row and column, from one of the first on, are a phase of the image, of which there are stride^2. On
    each the convolution has stride 1 and `taps` a side, and the sum over phases is one over more channels (Vaidyanathan
    1993, Multirate systems and filter banks, sec. 4.3). `transforms` make of it products without any sum over pixels.
    """
    (count, *size, channels), library = images.shape, images.__array_namespace__()
    rows, columns = outputs(size, stride)
    height, width = rows + taps(stride) - 1, columns + taps(stride) - 1  # of a phase
    images = images[:, : stride * height, : stride * width]
    missing = stride * height - images.shape[1], stride * width - images.shape[2]
    if any(missing):  # a row or column that only zeros among the taps meet
        images = library.pad(images, ((0, 0), (0, missing[0]), (0, missing[1]), (0, 0)))
    phases = images.reshape(count, height, stride, width, stride, channels).transpose(1, 3, 0, 2, 4, 5)
    of_pixels, _, of_outputs = transforms(rows, columns, taps(stride))
    seen = (of_pixels @ phases.reshape(height * width, -1)).reshape(len(spectra), count, -1)
    made = of_outputs @ library.matmul(seen, spectra).reshape(len(spectra), -1)
    return made.reshape(rows, columns, count, -1).transpose(2, 0, 1, 3) + offset


def spectra(weights, size, stride):
    """Transforms (products, stride^2 channels, filters) of weights (KERNEL^2 channels, filters), for `by_transforms`.

    size: rows and columns of the images.
    """
    library, side, filters = weights.__array_namespace__(), taps(stride), weights.shape[-1]
    kernels, zeros = weights.reshape(KERNEL, KERNEL, -1, filters), (0, stride * side - KERNEL)
    kernels = library.pad(kernels, (zeros, zeros, (0, 0), (0, 0)))
    phases = kernels.reshape(side, stride, side, stride, -1, filters).transpose(0, 2, 1, 3, 4, 5)
    _, of_weights, _ = transforms(*outputs(size, stride), side)
    return (of_weights @ phases.reshape(side**2, -1)).reshape(len(of_weights), -1, filters)


@functools.cache
def transforms(rows, columns, side):
    """Matrices A, B and C, float32, of a convolution of stride 1: outputs = C (A pixels * B weights), each an element.

    A: (products, pixels), B: (products, side^2), C: (rows columns, products). rows, columns: of the outputs; side: of
    the kernel; there are rows + side - 1 by columns + side - 1 pixels.

    A circular correlation of all pixels has these among its outputs, and its discrete Fourier transform is the pixels'
    times the weights' conjugate. As all are real, half of the frequencies will do: four are real themselves at most,
    and each other takes three real products (Gauss; Blahut 2010, Fast algorithms for signal processing, sec. 1.1):
    (a + ib) (c + id) = k - m + i (k + l) with k = (a + b) c, l = a (d - c), m = b (c + d).
    """
    shape = rows + side - 1, columns + side - 1
    frequencies = np.indices(shape).reshape(2, -1).T
    number, mirrored = (np.ravel_multi_index(one.T, shape) for one in (frequencies, -frequencies % shape))
    own, one_of_two = number == mirrored, number < mirrored

    def waves(chosen, *points):
        return np.exp(2j * np.pi * (frequencies[chosen] / shape) @ np.indices(points).reshape(2, -1))

    x, w, y = waves(one_of_two, *shape).conj(), waves(one_of_two, side, side), 2 * waves(one_of_two, rows, columns)
    a, b, c, d = x.real, x.imag, w.real, w.imag
    of_pixels = [waves(own, *shape).real, a + b, a, b]
    of_weights = [waves(own, side, side).real, c, d - c, c + d]
    of_outputs = [waves(own, rows, columns).real, y.real - y.imag, -y.imag, -y.real]
    of_pixels, of_weights, of_outputs = (np.concatenate(one) for one in (of_pixels, of_weights, of_outputs))
    return [one.astype(np.float32) for one in (of_pixels, of_weights, of_outputs.T / np.prod(shape))]


def transforms_pay(shape, filters, stride):
    """Whether transforms take less time than slices.

    shape: (n, rows, columns, channels) of the images; the weights are transformed once for all n of them. Slices write
    KERNEL^2 numbers for each place and channel, and most of their time goes with these.
    """
    count, *size, channels = shape
    places = np.prod(outputs(size, stride))
    pixels = np.prod([one + taps(stride) - 1 for one in outputs(size, stride)])
    inputs, products = stride**2 * channels, 1.5 * pixels
    image = products * (pixels * inputs + inputs * filters + filters * places + MOVED * (inputs + filters))
    weights = products * (taps(stride) ** 2 + MOVED) * inputs * filters
    return count * image + weights <= count * places * KERNEL**2 * channels * (filters + MOVED)


def outputs(size, stride):
    """Rows and columns of the outputs, for those of the images."""
    return [(pixels - KERNEL) // stride + 1 for pixels in size]


def taps(stride):
    """Taps a side of a phase's kernel."""
    return -(-KERNEL // stride)
