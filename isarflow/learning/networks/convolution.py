"""The capsule network's convolutions: by slices, or that of stride STRIDE by Winograd's products where they are faster.

All functions of arrays take NumPy's as well as JAX's, and give the same kind back.
"""

import functools
from collections import namedtuple

import numpy as np

KERNEL = 9  # pixels a side
STRIDE = 2  # of the primary capsules' convolution; at stride 1 tiles take more time
TAPS = 5  # a side of a phase's kernel, one of STRIDE^2 in which the kernel's pixels take turns
TILE = 4  # outputs a side of a tile
# Where the polynomials of a tile are evaluated, and at infinity: as many as a tile has pixels a side. With these the
# outputs are right to 4e-6 of the largest; eight outputs a side would take five points more, and keep 1e-4.
FINITE = 0.0, 1, -1, 0.5, -2, 2, -0.5
POINTS = TILE + TAPS - 1
MOVED = 200  # multiplications in the time in which a number and its gradient are written to memory


def convolve(images, weights, offset, stride):
    """Images (n, rows, columns, channels) to outputs (n, rows', columns', filters).

    weights: (KERNEL^2 channels, filters), or for STRIDE the result of `transformed`; offset: (filters,).
    """
    pays = stride == STRIDE and weights.ndim == 2 and transforms_pay(images.shape, weights.shape[-1])
    if pays and not _on_device(images):
        weights = transformed(weights)
    return by_tiles(images, weights, offset) if weights.ndim == 3 else by_slices(images, weights, offset, stride)


def _on_device(images):
    """Tell whether JAX computes with these images on a GPU, which has multiplications to spare: slices are faster."""
    if images.__array_namespace__() is np:
        return False
    import jax  # predictions do without it

    return jax.default_backend() != "cpu"


def by_slices(images, weights, offset, stride):
    """As `convolve`, by slices and one matrix product.

    XLA's own convolution has a gradient that is 30 times slower on CPUs. One slice for each of the weights takes XLA
    three times as long to compile as slices of a row first and then of a column.
    """
    rows, columns = (stride * (size - 1) + 1 for size in outputs(images.shape[1:3], stride))
    library = images.__array_namespace__()
    if library is np:  # the same in one copy
        seen = np.lib.stride_tricks.sliding_window_view(images, (KERNEL, KERNEL), axis=(1, 2))[:, ::stride, ::stride]
        seen = seen.transpose(0, 1, 2, 4, 5, 3)
    else:
        concatenate = library.concatenate
        seen = concatenate([images[:, :, first : first + columns : stride] for first in range(KERNEL)], axis=-1)
        seen = concatenate([seen[:, first : first + rows : stride] for first in range(KERNEL)], axis=-1)
    # With four dimensions NumPy would compute many small products.
    return (seen.reshape(-1, len(weights)) @ weights + offset).reshape(*seen.shape[:3], -1)


def by_tiles(images, weights, offset):
    """As `convolve` of STRIDE, with `transformed` weights (points^2, STRIDE^2 channels, filters).

    Every second row and column, from one of the first on, are a phase of the image, of which there are four. On each
    the convolution has stride 1 and TAPS a side, and the sum over phases is one over more channels (Vaidyanathan 1993,
    Multirate systems and filter banks, sec. 4.3). The outputs are cut into tiles of TILE a side, and those of a
    tile are products of transforms of its pixels and of the weights (Winograd 1980; Lavin and Gray 2016, Fast
    algorithms for convolutional neural networks): for each point one matrix product over the channels of all tiles.
    """
    (count, *size, channels), library = images.shape, images.__array_namespace__()
    above, beside = map(tiling, outputs(size, STRIDE))
    height, width = above.of_pixels.shape[1], beside.of_pixels.shape[1]  # of a phase
    images = images[:, : STRIDE * height, : STRIDE * width]
    missing = STRIDE * height - images.shape[1], STRIDE * width - images.shape[2]
    if any(missing):  # of the last tiles
        images = library.pad(images, ((0, 0), (0, missing[0]), (0, missing[1]), (0, 0)))
    phases = images.reshape(count, height, STRIDE, width, STRIDE, channels).transpose(1, 3, 0, 2, 4, 5)
    seen = (above.of_pixels @ phases.reshape(height, -1)).reshape(len(above.of_pixels), width, -1)
    # As many copies as there are rows: else XLA would move the axes of all of `seen`.
    seen = library.matmul(library.broadcast_to(beside.of_pixels, (len(seen), *beside.of_pixels.shape)), seen)
    seen = seen.reshape(POINTS, above.tiles, POINTS, beside.tiles, -1).transpose(0, 2, 1, 3, 4)
    seen = seen.reshape(POINTS**2, above.tiles * beside.tiles * count, -1)
    of_outputs = np.einsum("yat,xbu->yxabtu", above.of_outputs, beside.of_outputs)
    rows, columns, *products = of_outputs.shape
    made = of_outputs.reshape(rows * columns, -1) @ library.matmul(seen, weights).reshape(np.prod(products), -1)
    return made.reshape(rows, columns, count, -1).transpose(2, 0, 1, 3) + offset


def transformed(weights):
    """Transforms (points^2, STRIDE^2 channels, filters) of weights (KERNEL^2 channels, filters), for `by_tiles`."""
    library, filters = weights.__array_namespace__(), weights.shape[-1]
    kernels, zeros = weights.reshape(KERNEL, KERNEL, -1, filters), (0, STRIDE * TAPS - KERNEL)
    kernels = library.pad(kernels, (zeros, zeros, (0, 0), (0, 0)))
    phases = kernels.reshape(TAPS, STRIDE, TAPS, STRIDE, -1, filters).transpose(0, 2, 1, 3, 4, 5)
    both = np.kron(OF_WEIGHTS, OF_WEIGHTS)
    return (both @ phases.reshape(TAPS**2, -1)).reshape(len(both), -1, filters)


def _transforms():
    """Matrices A (points, points), B (points, TAPS), C (TILE, points), float32: outputs are C (A pixels * B weights).

    The product of two polynomials follows from their values at the points (Toom and Cook; Blahut 2010, Fast algorithms
    for signal processing, sec. 5.2), and a correlation is its transpose.
    """

    def values(terms):
        return np.vstack([np.array(FINITE)[:, None] ** np.arange(terms), np.eye(terms)[-1]])

    of_pixels, of_weights = np.linalg.inv(values(POINTS)).T, values(TAPS)
    # Rows of equal length, so that rounding has the same weight in both; powers of two are exact.
    ratio = 2.0 ** np.round(np.log2(np.linalg.norm(of_pixels, axis=1) / np.linalg.norm(of_weights, axis=1)) / 2)
    matrices = of_pixels / ratio[:, None], of_weights * ratio[:, None], values(TILE).T
    return [matrix.astype(np.float32) for matrix in matrices]


OF_PIXELS, OF_WEIGHTS, OF_OUTPUTS = _transforms()
# Tiles along an axis: their number, and matrices of_pixels (points tiles, pixels), of_outputs (outputs, points, tiles).
Tiling = namedtuple("Tiling", "tiles of_pixels of_outputs")


@functools.cache
def tiling(outputs):
    """The `Tiling` of so many outputs."""
    tiles = -(-outputs // TILE)
    every = np.zeros((POINTS, tiles, TILE * tiles + TAPS - 1), np.float32)
    for tile in range(tiles):
        every[:, tile, TILE * tile : TILE * tile + POINTS] = OF_PIXELS
    back = np.einsum("oa,tu->toau", OF_OUTPUTS, np.eye(tiles, dtype=np.float32)).reshape(-1, POINTS, tiles)
    return Tiling(tiles, every.reshape(POINTS * tiles, -1), back[:outputs])


def transforms_pay(shape, filters):
    """Tell whether tiles take less time than slices.

    shape: (n, rows, columns, channels) of the images; the weights are transformed once for all n of them. Slices write
    KERNEL^2 numbers for each place and channel, and most of their time goes with these.
    """
    count, *size, channels = shape
    places, inputs = np.prod(outputs(size, STRIDE)), STRIDE**2 * channels
    products = np.prod([tiling(many).tiles for many in outputs(size, STRIDE)]) * POINTS**2
    # A pixel of a tile meets POINTS others along each of two axes.
    image = products * (2 * POINTS * inputs + inputs * filters + filters * places + MOVED * (inputs + filters))
    weights = POINTS**2 * (TAPS**2 + MOVED) * inputs * filters
    return count * image + weights <= count * places * KERNEL**2 * channels * (filters + MOVED)


def outputs(size, stride):
    """Number of rows and columns of the outputs, from those of the images."""
    return [(pixels - KERNEL) // stride + 1 for pixels in size]
