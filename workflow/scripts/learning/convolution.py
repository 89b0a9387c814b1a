"""The capsule network's convolution: by slices, or by Winograd's products where these take less time to train.

All functions of arrays take NumPy's as well as JAX's, and give the same kind back.
"""

import functools
from typing import NamedTuple

import numpy as np

KERNEL = 9  # pixels a side
TILE = 4  # outputs a side of a tile
# Where the polynomials of a tile are evaluated, and at infinity: as many as a tile has pixels a side. With these the
# outputs are right to 4e-6 of the largest; eight outputs a side would take five points more, and keep 1e-4.
POINTS = 0, 1, -1, 0.5, -2, 2, -0.5
MOVED = 200  # multiplications in the time in which a number and its gradient are written to memory


def convolve(images, weights, offset, stride):
    """Images (n, rows, columns, channels) to outputs (n, rows', columns', filters).

    weights: (KERNEL^2 channels, filters), or the result of `transformed`; offset: (filters,).
    """
    if weights.ndim == 2 and transforms_pay(images.shape, weights.shape[-1], stride):
        weights = transformed(weights, stride)
    return (by_slices if weights.ndim == 2 else by_tiles)(images, weights, offset, stride)


def by_slices(images, weights, offset, stride):
    """As `convolve`, by slices and one matrix product.

    XLA's own convolution has a gradient that is 30 times slower on CPUs. One slice for each of the weights takes XLA
    three times as long to compile as slices of a row first and then of a column.
    """
    rows, columns = (stride * (size - 1) + 1 for size in outputs(images.shape[1:3], stride))
    concatenate = images.__array_namespace__().concatenate
    seen = concatenate([images[:, :, first : first + columns : stride] for first in range(KERNEL)], axis=-1)
    seen = concatenate([seen[:, first : first + rows : stride] for first in range(KERNEL)], axis=-1)
    # With four dimensions NumPy would compute many small products.
    return (seen.reshape(-1, len(weights)) @ weights + offset).reshape(*seen.shape[:3], -1)


def by_tiles(images, weights, offset, stride):
    """As `convolve`, with `transformed` weights (points^2, stride^2 channels, filters).

    Every stride-th row and column, from one of the first on, are a phase of the image, of which there are stride^2. On
    each the convolution has stride 1 and `taps` a side, and the sum over phases is one over more channels (Vaidyanathan
    1993, Multirate systems and filter banks, sec. 4.3). The outputs are cut into tiles of TILE a side, and those of a
    tile are products of transforms of its pixels and of the weights (Winograd 1980; Lavin and Gray 2016, Fast
    algorithms for convolutional neural networks): for each point one matrix product over the channels of all tiles.
    """
    (count, *size, channels), library = images.shape, images.__array_namespace__()
    above, beside = (tiling(many, taps(stride)) for many in outputs(size, stride))
    height, width = above.of_pixels.shape[1], beside.of_pixels.shape[1]  # of a phase
    images = images[:, : stride * height, : stride * width]
    missing = stride * height - images.shape[1], stride * width - images.shape[2]
    if any(missing):  # of the last tiles
        images = library.pad(images, ((0, 0), (0, missing[0]), (0, missing[1]), (0, 0)))
    phases = images.reshape(count, height, stride, width, stride, channels).transpose(1, 3, 0, 2, 4, 5)
    seen = (above.of_pixels @ phases.reshape(height, -1)).reshape(len(above.of_pixels), width, -1)
    # As many copies as there are rows: else XLA would move the axes of all of `seen`.
    seen = library.matmul(library.broadcast_to(beside.of_pixels, (len(seen), *beside.of_pixels.shape)), seen)
    points = TILE + taps(stride) - 1
    seen = seen.reshape(points, above.tiles, points, beside.tiles, -1).transpose(0, 2, 1, 3, 4)
    seen = seen.reshape(points**2, above.tiles * beside.tiles * count, -1)
    of_outputs = np.einsum("yat,xbu->yxabtu", above.of_outputs, beside.of_outputs)
    rows, columns, *products = of_outputs.shape
    made = of_outputs.reshape(rows * columns, -1) @ library.matmul(seen, weights).reshape(np.prod(products), -1)
    return made.reshape(rows, columns, count, -1).transpose(2, 0, 1, 3) + offset


def transformed(weights, stride):
    """Transforms (points^2, stride^2 channels, filters) of weights (KERNEL^2 channels, filters), for `by_tiles`."""
    library, side, filters = weights.__array_namespace__(), taps(stride), weights.shape[-1]
    kernels, zeros = weights.reshape(KERNEL, KERNEL, -1, filters), (0, stride * side - KERNEL)
    kernels = library.pad(kernels, (zeros, zeros, (0, 0), (0, 0)))
    phases = kernels.reshape(side, stride, side, stride, -1, filters).transpose(0, 2, 1, 3, 4, 5)
    _, of_weights, _ = transforms(side)
    both = np.kron(of_weights, of_weights)
    return (both @ phases.reshape(side**2, -1)).reshape(len(both), -1, filters)


@functools.cache
def transforms(side):
    """Matrices A, B and C, float32, of TILE outputs of a kernel with `side` taps: C (A pixels * B weights).

    A: (points, points), B: (points, side), C: (TILE, points). The product of two polynomials follows from their values
    at the points (Toom and Cook; Blahut 2010, Fast algorithms for signal processing, sec. 5.2), and a correlation is
    its transpose.
    """
    finite = np.array(POINTS[: TILE + side - 2], float)

    def values(terms):
        return np.vstack([finite[:, None] ** np.arange(terms), np.eye(terms)[-1]])

    of_pixels, of_weights = np.linalg.inv(values(TILE + side - 1)).T, values(side)
    # Rows of equal length, so that rounding has the same weight in both; powers of two are exact.
    ratio = 2.0 ** np.round(np.log2(np.linalg.norm(of_pixels, axis=1) / np.linalg.norm(of_weights, axis=1)) / 2)
    matrices = of_pixels / ratio[:, None], of_weights * ratio[:, None], values(TILE).T
    return [matrix.astype(np.float32) for matrix in matrices]


class Tiling(NamedTuple):
    """Matrices for tiles along an axis: of_pixels (points tiles, pixels), of_outputs (outputs, points, tiles)."""

    tiles: int
    of_pixels: np.ndarray
    of_outputs: np.ndarray


@functools.cache
def tiling(outputs, side):
    """The `Tiling` of so many outputs of a kernel with `side` taps."""
    of_pixels, _, of_outputs = transforms(side)
    tiles, points = -(-outputs // TILE), len(of_pixels)
    every = np.zeros((points, tiles, TILE * tiles + side - 1), np.float32)
    for tile in range(tiles):
        every[:, tile, TILE * tile : TILE * tile + points] = of_pixels
    back = np.einsum("oa,tu->toau", of_outputs, np.eye(tiles, dtype=np.float32)).reshape(-1, points, tiles)
    return Tiling(tiles, every.reshape(points * tiles, -1), back[:outputs])


def transforms_pay(shape, filters, stride):
    """Tell whether tiles take less time than slices.

    shape: (n, rows, columns, channels) of the images; the weights are transformed once for all n of them. Slices write
    KERNEL^2 numbers for each place and channel, and most of their time goes with these.
    """
    points = TILE + taps(stride) - 1
    if points > len(POINTS) + 1:
        return False
    count, *size, channels = shape
    places, inputs = np.prod(outputs(size, stride)), stride**2 * channels
    products = np.prod([tiling(many, taps(stride)).tiles for many in outputs(size, stride)]) * points**2
    # A pixel of a tile meets `points` others along each of two axes.
    image = products * (2 * points * inputs + inputs * filters + filters * places + MOVED * (inputs + filters))
    weights = points**2 * (taps(stride) ** 2 + MOVED) * inputs * filters
    return count * image + weights <= count * places * KERNEL**2 * channels * (filters + MOVED)


def outputs(size, stride):
    """Number of rows and columns of the outputs, from those of the images."""
    return [(pixels - KERNEL) // stride + 1 for pixels in size]


def taps(stride):
    """Taps a side of a phase's kernel."""
    return -(-KERNEL // stride)
