"""EM routing beside its procedure, number by number, and what it is to do."""

import math

import numpy as np
import pytest

from isarflow.learning.networks.matrix_capsules import COOLING, STEEPEST, TINY, route


def by_loops(votes, activations, use, activate, routings):
    """Procedure 1 of Hinton et al. for one image: votes (capsules, classes, d), activations (capsules,)."""
    capsules, classes, d = votes.shape
    shares = [[1 / classes] * classes for _ in range(capsules)]
    share = sum(activations) / classes + TINY  # of a class, on average
    for routing in range(routings):
        mean, variance, active = np.zeros((classes, d)), np.zeros((classes, d)), np.zeros(classes)
        for j in range(classes):
            weight = [shares[i][j] * activations[i] for i in range(capsules)]
            total, cost = sum(weight) + TINY, 0
            for h in range(d):
                mean[j, h] = sum(weight[i] * votes[i, j, h] for i in range(capsules)) / total
                spread = sum(weight[i] * (votes[i, j, h] - mean[j, h]) ** 2 for i in range(capsules))
                variance[j, h] = spread / total + TINY
                cost += (use[j] + math.log(math.sqrt(variance[j, h]))) * total / share / d
            active[j] = 1 / (1 + math.exp(-STEEPEST * (1 - COOLING ** (routing + 1)) * (activate[j] - cost)))
        for i in range(capsules):
            density = [active[j] + TINY for j in range(classes)]
            for j in range(classes):
                for h in range(d):
                    off = (votes[i, j, h] - mean[j, h]) ** 2 / (2 * variance[j, h])
                    density[j] *= math.exp(-off) / math.sqrt(2 * math.pi * variance[j, h])
            shares[i] = [each / sum(density) for each in density]
    return mean, active


@pytest.mark.parametrize("routings", [1, 2, 3])
def test_routing_is_its_procedure(routings):
    random = np.random.default_rng(0)
    votes, activations = random.standard_normal((2, 5, 3, 4)), random.random((2, 5))
    use, activate = random.standard_normal((2, 3))
    poses, active = route(votes, activations, use, activate, routings)
    for image in range(2):
        mean, expected = by_loops(votes[image], activations[image], use, activate, routings)
        np.testing.assert_allclose(poses[image], mean, rtol=1e-9)
        np.testing.assert_allclose(active[image], expected, rtol=1e-9)


def test_votes_that_agree_make_a_capsule_active_and_give_its_pose():
    random = np.random.default_rng(1)
    votes = random.standard_normal((1, 12, 2, 4))
    votes[:, :8, 1] = 0.01 * votes[:, :8, 1] + [1, 2, 3, 4]
    poses, active = route(votes, np.ones((1, 12)), np.zeros(2), np.zeros(2), 3)
    np.testing.assert_allclose(poses[0, 1], [1, 2, 3, 4], atol=0.02)
    assert active[0, 1] > active[0, 0]
