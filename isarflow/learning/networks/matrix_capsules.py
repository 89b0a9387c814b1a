"""EM routing of matrix capsules (Hinton, Sabour and Frosst 2018, Matrix capsules with EM routing), of NumPy's or JAX's arrays."""

import numpy as np

TINY = 1e-6  # added to variances and sums, which may be zero
STEEPEST = 0.01  # inverse temperature that the iterations approach
COOLING = 0.95  # of what is missing to it, an iteration


def route(votes, activations, use, activate, routings):
    """Poses (n, classes, d) and activations (n, classes) of capsules that others vote for.

    Procedure 1 of Hinton et al. votes: (n, capsules, classes, d); activations: (n, capsules), 0 to 1; use, activate:
    (classes,), the costs beta_u of a vote's dimension and beta_a of an active capsule. Each vote begins with the same
    share in all classes. A class is a Gaussian of the votes, weighed by their shares (the M-step); it is active where it
    costs little to describe these by it. Shares then follow from the densities of these Gaussians (the E-step).
    """
    library = votes.__array_namespace__()
    shares = library.ones_like(votes[..., 0]) / votes.shape[2]
    for routing in range(routings):
        weights = (shares * activations[..., None])[..., None]
        total = weights.sum(1) + TINY
        poses = (weights * votes).sum(1) / total
        variance = (weights * (votes - poses[:, None]) ** 2).sum(1) / total + TINY
        costs = (use[:, None] + library.log(variance) / 2) * total
        steepness = STEEPEST * (1 - COOLING ** (routing + 1))
        active = 1 / (1 + library.exp(-steepness * (activate - costs.sum(-1))))
        if routing < routings - 1:
            off = (votes - poses[:, None]) ** 2 / variance[:, None]
            logs = -(off + library.log(2 * np.pi * variance)[:, None]).sum(-1) / 2 + library.log(active + TINY)[:, None]
            shares = library.exp(logs - logs.max(-1)[..., None])
            shares = shares / shares.sum(-1)[..., None]
    return poses, active
