"""Matrix capsules with EM routing: their layers, their loss, and their weights, as functions of arrays.

Hinton, Sabour and Frosst 2018, Matrix capsules with EM routing. A capsule is a pose, a matrix of SIDE x SIDE, and its
activation, 0 to 1. Convolutions, decoder and names of weights are the capsule network's; see there.
"""

import numpy as np

from isarflow.learning.networks import capsules
from isarflow.learning.networks.capsules import CLASS, sigmoid

SIDE = 4  # of a pose
TINY = 1e-6  # added to variances and sums, which may be zero
# The paper's is 0.01, of costs that are sums over all votes and dimensions; with it a class that no vote supports is
# active by 0.5 unless its beta_a is of the order of -1000.
STEEPEST = 10.0  # inverse temperature that the iterations approach
COOLING = 0.95  # of what is missing to it, an iteration
MARGIN = 0.2, 0.9  # of the spread loss, at the beginning and at the end of training
START = -1.0  # of beta_a: a class without votes is then active by 0.19
WEIGHTS = (*capsules.WEIGHTS, "use", "activate")


def route(votes, activations, use, activate, routings):
    """Poses (n, classes, d) and activations (n, classes) of capsules that others vote for.

    Procedure 1 of Hinton et al. votes: (n, capsules, classes, d); activations: (n, capsules), 0 to 1; use, activate:
    (classes,), beta_u and beta_a of the procedure. Each vote begins with the same share in all classes. A class is a
    Gaussian of the votes, weighed by their shares (the M-step); it is active where it costs little to describe these by
    it. Shares then follow from the densities of these Gaussians (the E-step). Costs are a mean over the d dimensions,
    and the votes of a class count in multiples of the mean over classes, so that costs do not grow with the number of
    capsules (Gritzman 2019, Avoiding implementation pitfalls of matrix capsules with EM routing).
    """
    library = votes.__array_namespace__()
    shares = library.ones_like(votes[..., 0]) / votes.shape[2]
    mean = activations.sum(1)[:, None] / votes.shape[2] + TINY
    for routing in range(routings):
        weights = (shares * activations[..., None])[..., None]
        total = weights.sum(1) + TINY
        poses = (weights * votes).sum(1) / total
        variance = (weights * (votes - poses[:, None]) ** 2).sum(1) / total + TINY
        costs = (use[:, None] + library.log(variance) / 2).mean(-1) * total[..., 0] / mean
        active = sigmoid(STEEPEST * (1 - COOLING ** (routing + 1)) * (activate - costs))
        if routing < routings - 1:
            off = (votes - poses[:, None]) ** 2 / variance[:, None]
            logs = -(off + library.log(2 * np.pi * variance)[:, None]).sum(-1) / 2 + library.log(active + TINY)[:, None]
            shares = library.exp(logs - logs.max(-1)[..., None])
            shares = shares / shares.sum(-1)[..., None]
    return poses, active


def activations(weights, images, routings):
    """Class capsules (n, classes, CLASS + 1), of images (n, rows, columns, channels): poses by rows, and activations.

    The pose of each primary capsule times a matrix of its channel and the class is its vote. The place of the capsule,
    0 to 1, is added to the first two elements of the last column (coordinate addition).
    """
    library, found = images.__array_namespace__(), capsules.encoded(weights, images)
    (count, rows, columns, _), types = found.shape, len(weights["votes"])
    found = found.reshape(count, rows * columns, types, CLASS + 1)
    poses = found[..., :CLASS].transpose(2, 0, 1, 3).reshape(types, -1, SIDE)
    votes = library.matmul(poses, weights["votes"]).reshape(types, count, rows * columns, SIDE, -1, SIDE)
    place = np.zeros((rows, columns, SIDE, 1, SIDE), np.float32)
    place[..., 0, 0, -1] = (np.arange(rows)[:, None] + 0.5) / rows
    place[..., 1, 0, -1] = (np.arange(columns) + 0.5) / columns
    votes = (votes + place.reshape(rows * columns, SIDE, 1, SIDE)).transpose(1, 2, 0, 4, 3, 5)
    votes = votes.reshape(count, rows * columns * types, -1, CLASS)
    active = sigmoid(found[..., CLASS]).reshape(count, -1)
    poses, active = route(votes, active, weights["use"], weights["activate"], routings)
    return library.concatenate([poses, active[..., None]], axis=-1)


def lengths(capsules):
    """Activations (n, classes) of class capsules (n, classes, CLASS + 1): what the length is of a vector."""
    return capsules[..., CLASS]


def margin_loss(capsules, truth, made=1):
    """The spread loss (n,) of capsules (n, classes, CLASS + 1) where truth (n, classes) is 1 for the image's class.

    Eq. 3 of Hinton et al.: the activation of the image's class is to exceed all others by a margin that grows with the
    share `made` of the training. An image of none of the classes has zeros; its own class's activation counts as 1.
    """
    library, active = capsules.__array_namespace__(), lengths(capsules)
    own = (truth * active).sum(-1) + 1 - truth.sum(-1)
    below = own - (MARGIN[0] + (MARGIN[1] - MARGIN[0]) * made)
    return ((1 - truth) * library.maximum(active - below[:, None], 0) ** 2).sum(-1)


def initial_weights(random, shape, classes, width, channels, decoder):
    """Weights before training, as of `capsules.initial_weights`, with `channels` of primary capsules."""
    votes = (channels, SIDE, classes * SIDE), 2 * SIDE
    weights = capsules.initial_weights(random, shape, classes, width, channels, decoder, CLASS + 1, votes)
    return weights | {"use": np.zeros(classes, np.float32), "activate": np.full(classes, START, np.float32)}
