"""EM routing beside its procedure, number by number, and what it is to do."""

import math

import jax
import numpy as np
import pytest
from scipy.special import expit

from isarflow.learning.networks import capsules, matrix_capsules
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


def test_the_order_of_capsules_means_nothing():
    random = np.random.default_rng(2)
    votes, activations, order = random.standard_normal((3, 9, 2, 16)), random.random((3, 9)), random.permutation(9)
    first = route(votes, activations, np.zeros(2), np.zeros(2), 3)
    second = route(votes[:, order], activations[:, order], np.zeros(2), np.zeros(2), 3)
    np.testing.assert_allclose(np.concatenate(first, axis=None), np.concatenate(second, axis=None), rtol=1e-9)


def test_twice_the_capsules_cost_the_same():
    random = np.random.default_rng(3)
    votes, activations = random.standard_normal((2, 6, 3, 4)), random.random((2, 6))
    first = route(votes, activations, np.ones(3), np.zeros(3), 2)
    second = route(np.tile(votes, (1, 2, 1, 1)), np.tile(activations, 2), np.ones(3), np.zeros(3), 2)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4)


def weights_of(random, shape, classes):
    weights = matrix_capsules.initial_weights(random, shape, classes, width=3, channels=2, decoder=5)
    return weights | {"primary": 30 * weights["primary"]}  # so that votes and activations differ


def test_votes_are_poses_times_matrices_and_the_place():
    random = np.random.default_rng(4)
    weights = weights_of(random, (21, 23, 1), 3)
    images = random.random((2, 21, 23, 1)).astype(np.float32)
    found = capsules.encoded(weights, images)  # (n, 3 rows, 4 columns, channels)
    votes, active = np.zeros((2, 24, 3, 16)), np.zeros((2, 24))
    for capsule, (row, column, channel) in enumerate(np.ndindex(3, 4, 2)):
        numbers = found[:, row, column, 17 * channel : 17 * channel + 17]
        active[:, capsule] = expit(numbers[:, 16])
        for number in range(3):
            vote = numbers[:, :16].reshape(2, 4, 4) @ weights["votes"][channel][:, 4 * number : 4 * number + 4]
            vote[:, :2, 3] += [(row + 0.5) / 3, (column + 0.5) / 4]
            votes[:, capsule, number] = vote.reshape(2, 16)
    poses, activations = route(votes, active, weights["use"], weights["activate"], 3)
    own = matrix_capsules.activations(weights, images, 3)
    np.testing.assert_allclose(own[..., :16], poses, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(matrix_capsules.lengths(own), activations, rtol=1e-3)
    assert np.ptp(activations) > 0.01


def test_numpy_and_jax_agree_and_black_images_have_a_finite_gradient():
    random = np.random.default_rng(5)
    weights = weights_of(random, (19, 21, 1), 2)
    images, truth = random.random((3, 19, 21, 1)).astype(np.float32), np.eye(3, 2, dtype=np.float32)

    def loss(weights, images):
        found = matrix_capsules.activations(weights, images, 3)
        made = capsules.reconstruct(weights, found, truth, True)
        return matrix_capsules.margin_loss(found, truth).sum() + made.sum(), found

    gradient = jax.jit(jax.grad(loss, has_aux=True))
    (_, mine), (_, traced) = loss(weights, images), gradient(weights, images)
    assert isinstance(mine, np.ndarray) and mine.dtype == np.float32 and mine.shape == (3, 2, 17)
    np.testing.assert_allclose(mine, traced, rtol=1e-3, atol=1e-4)
    black, _ = gradient(weights, 0 * images)
    assert all(np.isfinite(value).all() for value in black.values())


def test_spread_loss_by_hand():
    active, truth = np.array([[0.7, 0.3, 0.6], [0.5, 0.1, 0.0]]), np.array([[1.0, 0, 0], [0, 0, 0]])
    found = np.concatenate([np.zeros((2, 3, 16)), active[..., None]], axis=-1)
    # The second image is of no class: its classes shall stay below 1 by the margin.
    np.testing.assert_allclose(matrix_capsules.margin_loss(found, truth, 0), [0.1**2, 0])
    np.testing.assert_allclose(matrix_capsules.margin_loss(found, truth), [0.5**2 + 0.8**2, 0.4**2])
    half = matrix_capsules.margin_loss(found, truth, np.array([0.5, 1]))
    np.testing.assert_allclose(half, [0.15**2 + 0.45**2, 0.4**2])
