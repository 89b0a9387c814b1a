"""The capsule network: its layers, its loss, and its weights, as functions of arrays.

Sabour, Frosst and Hinton 2017, Dynamic routing between capsules; sizes as in the reference thesis's figure 5.5.
All but `initial_weights` take NumPy arrays as well as JAX's, and give the same kind back: JAX trains, NumPy predicts.
"""

import math

import numpy as np

from isarflow.learning.networks.convolution import KERNEL, STRIDE, convolve, outputs, transformed, transforms_pay
from isarflow.learning.networks.training_loop import glorot

PRIMARY, CLASS = 8, 16  # dimensions of a primary capsule, and of a class capsule
TINY = 1e-7  # under the root: the length of a zero vector has no gradient
LAYERS = ("convolution", "primary", "decoder0", "decoder1", "decoder2")
WEIGHTS = (*LAYERS, *(f"{layer}_offset" for layer in LAYERS), "votes")
PRESENT, ABSENT, DOWN = 0.9, 0.1, 0.5  # m+, m- and lambda of the margin loss


def sigmoid(x):
    """1 / (1 + exp(-x)), which does not overflow."""
    return 0.5 * (1 + x.__array_namespace__().tanh(x / 2))


def squash(vectors):
    """Vectors (..., d) with length s shortened to s^2 / (1 + s^2) (eq. 1 of Sabour et al.)."""
    square = (vectors**2).sum(-1)[..., None]
    return vectors * (square / (1 + square) / (square + TINY) ** 0.5)


def lengths(vectors):
    """Lengths of vectors (..., d), with a gradient also at zero: shape (...)."""
    return ((vectors**2).sum(-1) + TINY) ** 0.5


def route(votes, routings):
    """Routing by agreement: votes (capsules, n, classes, d) to activation vectors (n, classes, d).

    Procedure 1 of Sabour et al.: each capsule's vote counts in a class by the softmax over classes of its logits; these
    begin at zero and grow by the agreement of its vote with the class's vector, `routings` - 1 times.
    """
    library = votes.__array_namespace__()
    logits = library.zeros_like(votes[..., 0])
    for routing in range(routings):
        coupling = library.exp(logits - logits.max(-1)[..., None])
        coupling = coupling / coupling.sum(-1)[..., None]
        vectors = squash((coupling[..., None] * votes).sum(0))
        if routing < routings - 1:
            logits = logits + (votes * vectors).sum(-1)
    return vectors


def activations(weights, images, routings):
    """Activation vectors (n, classes, CLASS) of images (n, rows, columns, channels).

    A convolution with rectified outputs, then primary capsules, each of which votes for every class. weights: by name,
    as of `initial_weights` or `prepared`.
    """
    library = images.__array_namespace__()
    capsules = squash(encoded(weights, images).reshape(len(images), -1, PRIMARY))
    count, classes = weights["votes"].shape[0], weights["votes"].shape[-1] // CLASS
    votes = library.matmul(capsules.swapaxes(0, 1), weights["votes"])
    return route(votes.reshape(count, len(images), classes, CLASS), routings)


def encoded(weights, images):
    """Numbers (n, rows, columns, filters) of which primary capsules are made: two convolutions, the first rectified."""
    library = images.__array_namespace__()
    features = library.maximum(convolve(images, weights["convolution"], weights["convolution_offset"], 1), 0)
    return convolve(features, weights["primary"], weights["primary_offset"], STRIDE)


def prepared(weights, shape):
    """Weights for many calls of `activations` on images of this shape in all: transformed once if it saves time."""
    features, primary = (shape[0], *outputs(shape[1:3], 1), weights["convolution"].shape[-1]), weights["primary"]
    pays = transforms_pay(features, primary.shape[-1])
    return weights | {"primary": transformed(primary)} if pays else weights


def reconstruct(weights, vectors, mask, bounded):
    """Reconstructed images (n, pixels) from activation vectors of which `mask` (n, classes) keeps one class's.

    bounded: True if a sigmoid keeps the outputs between 0 and 1, as for magnitudes.
    """
    library = vectors.__array_namespace__()
    hidden = (vectors[..., :CLASS] * mask[..., None]).reshape(len(vectors), -1)
    for layer in ("decoder0", "decoder1"):
        hidden = library.maximum(hidden @ weights[layer] + weights[f"{layer}_offset"], 0)
    outputs = hidden @ weights["decoder2"] + weights["decoder2_offset"]
    return sigmoid(outputs) if bounded else outputs


def margin_loss(vectors, truth, made=1):
    """The margin loss (n,) of activation vectors (n, classes, d) where truth (n, classes) is 1 for the image's class.

    Eq. 4 of Sabour et al. An image of none of the classes has zeros. made: the share of training; it changes nothing.
    """
    long = lengths(vectors)
    library = vectors.__array_namespace__()
    present = truth * library.maximum(PRESENT - long, 0) ** 2
    absent = DOWN * (1 - truth) * library.maximum(long - ABSENT, 0) ** 2
    return (present + absent).sum(-1)


def initial_weights(random, shape, classes, width, capsules, decoder, numbers=PRIMARY, votes=None):
    """Weights before training: a mapping of name to array, float32. random: a NumPy generator.

    shape: (rows, columns, channels) of an image; width: filters of the convolution; capsules: channels of primary
    capsules; decoder: outputs of its first layer, of which the second has twice as many. numbers, votes: of a primary
    capsule, and the shape of the votes' weights with the sum of their inputs and outputs, where they are not as here.
    """
    rows, columns, channels = shape
    count = capsules * math.prod(outputs(outputs((rows, columns), 1), STRIDE))
    pixels, primary, vectors = rows * columns * channels, capsules * numbers, classes * CLASS
    layers = {  # the shape of each one's weights, and the sum of its inputs and outputs
        "convolution": ((KERNEL**2 * channels, width), KERNEL**2 * (channels + width)),
        "primary": ((KERNEL**2 * width, primary), KERNEL**2 * (width + primary)),
        "votes": votes or ((count, PRIMARY, vectors), classes * count * (PRIMARY + CLASS)),
        "decoder0": ((vectors, decoder), vectors + decoder),
        "decoder1": ((decoder, 2 * decoder), 3 * decoder),
        "decoder2": ((2 * decoder, pixels), 2 * decoder + pixels),
    }
    weights = {name: glorot(random, *layer) for name, layer in layers.items()}
    offset = [name for name in layers if name != "votes"]
    return weights | {f"{name}_offset": np.zeros(weights[name].shape[-1], np.float32) for name in offset}
