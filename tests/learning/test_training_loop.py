"""Training: what a killed one goes on from, early stopping, and losses that are no numbers."""

import jax
import numpy as np
import pytest

from isarflow.core.errors import InputError
from isarflow.learning.networks import training_loop
from isarflow.learning.networks.training_loop import COLUMNS, Batches, Checkpoint, minimize

X = np.random.default_rng(1).standard_normal((40, 3)).astype(np.float32)
Y = X @ np.array([1.0, -2.0, 0.5], np.float32)


def loss(weights, x, y):
    error = x @ weights["slope"] - y
    return error**2, abs(error) < 0.5, np.ones(len(x))


def validated(weights):
    costs, right, _ = loss(weights, X, Y)
    return costs.mean(), right.mean()


def train(epochs=6, validate=validated, patience=None, checkpoint=None, rate=0.05, count=40):
    random = np.random.default_rng(5)
    start = {"slope": random.standard_normal(3).astype(np.float32)}
    how = {"rate": lambda epochs: rate / (1 + epochs), "epochs": epochs, "validate": validate, "patience": patience}
    batches = Batches(count, 8, random)
    return minimize(loss, start, batches, lambda rows: (X[rows], Y[rows]), checkpoint=checkpoint, **how)


@pytest.fixture
def at_once(monkeypatch):
    """Checkpoints are written after every epoch."""
    monkeypatch.setattr(training_loop, "BETWEEN", 0.0)


def killed_after(epochs, checkpoint):
    seen = []

    def validate(weights):
        seen.append(weights)
        if len(seen) > epochs:
            raise KeyboardInterrupt
        return validated(weights)

    with pytest.raises(KeyboardInterrupt):
        train(validate=validate, patience=4, checkpoint=checkpoint)


def test_a_killed_training_ends_like_an_unbroken_one(tmp_path, at_once):
    weights, curve = train(patience=4)
    killed_after(3, Checkpoint(tmp_path, "same"))
    epochs = []
    resumed, after = train(
        validate=lambda weights: epochs.append(1) or validated(weights),
        patience=4,
        checkpoint=Checkpoint(tmp_path, "same"),
    )
    assert len(epochs) == 3  # the others were done
    assert resumed["slope"].tobytes() == weights["slope"].tobytes()
    assert {k: v for k, v in after.items() if k != "seconds"} == {k: v for k, v in curve.items() if k != "seconds"}
    assert tuple(curve) == COLUMNS and np.all(np.diff(after["seconds"]) >= 0)


def test_a_killed_training_is_killed_again(tmp_path, at_once):
    weights, _ = train(patience=4)
    killed_after(2, Checkpoint(tmp_path, "same"))
    killed_after(2, Checkpoint(tmp_path, "same"))
    resumed, _ = train(patience=4, checkpoint=Checkpoint(tmp_path, "same"))
    assert resumed["slope"].tobytes() == weights["slope"].tobytes()


def test_another_training_starts_anew(tmp_path, at_once):
    killed_after(3, Checkpoint(tmp_path, {"width": 3}, X))
    for identity in (({"width": 4}, X), ({"width": 3}, X + 1)):
        assert Checkpoint(tmp_path, *identity).read() is None
    assert Checkpoint(tmp_path, {"width": 3}, X).read() is not None


def test_a_training_by_other_code_starts_anew(tmp_path, at_once):
    code = tmp_path / "code.py"
    code.write_text("a = 1")
    killed_after(3, Checkpoint(tmp_path, code, X))
    assert Checkpoint(tmp_path, code, X).read() is not None
    code.write_text("a = 2")
    assert Checkpoint(tmp_path, code, X).read() is None


def test_half_a_checkpoint_is_none(tmp_path, at_once):
    checkpoint = Checkpoint(tmp_path, "same")
    killed_after(3, checkpoint)
    for size in (0, 10, checkpoint.path.stat().st_size // 2):
        checkpoint.path.write_bytes(checkpoint.path.read_bytes()[:size])
        assert checkpoint.read() is None
    assert train(checkpoint=checkpoint)[0]["slope"].tobytes() == train()[0]["slope"].tobytes()


def test_checkpoints_are_not_written_all_the_time(tmp_path):
    checkpoint = Checkpoint(tmp_path, "same")
    checkpoint.write([np.zeros(2)], {"epoch": 1})
    checkpoint.write([np.ones(2)], {"epoch": 2})
    assert checkpoint.read()[1] == {"epoch": 1}


def test_the_weights_with_the_smallest_validation_loss_are_kept():
    costs, seen = [5.0, 3.0, 4.0, 3.5, 1.0], []

    def validate(weights):
        seen.append(weights)
        return costs[len(seen) - 1], 0.5

    weights, curve = train(validate=validate, patience=2, epochs=5)
    assert curve["validation_loss"] == costs[:4]  # two epochs without a smaller one
    assert weights["slope"].tobytes() == seen[1]["slope"].tobytes()
    seen.clear()
    assert train(validate=validate, patience=3, epochs=5)[1]["validation_loss"] == costs


def test_without_validation_the_last_weights_are_kept():
    weights, curve = train(validate=None, patience=1, epochs=4)
    assert len(curve["loss"]) == 4 and curve["loss"][-1] < curve["loss"][0]
    assert weights["slope"].tobytes() == train(epochs=4)[0]["slope"].tobytes()


def test_a_loss_that_is_no_number_stops_the_training():
    with pytest.raises(InputError, match="epoch 1; take a smaller learning rate"):
        train(rate=1e38)


def test_each_step_is_adams_on_the_mean_over_its_own_images():
    """Also where the last batch of an epoch has five images instead of eight."""
    random = np.random.default_rng(5)
    slope = random.standard_normal(3).astype(np.float32).astype(float)
    batches, mean, square, steps = Batches(37, 8, random), np.zeros(3), np.zeros(3), 0
    for epoch in range(3):
        costs = []
        for rows in batches.epoch():
            error = X[rows] @ slope - Y[rows]
            gradient = 2 * error @ X[rows] / len(rows)
            costs += list(error**2)
            steps += 1
            mean, square = 0.9 * mean + 0.1 * gradient, 0.999 * square + 0.001 * gradient**2
            change = mean / (1 - 0.9**steps) / (np.sqrt(square / (1 - 0.999**steps)) + 1e-8)
            slope -= 0.05 / (1 + epoch) * change
    weights, curve = train(epochs=3, validate=None, count=37)
    assert len(costs) == 37
    np.testing.assert_allclose(weights["slope"], slope, rtol=1e-4)
    np.testing.assert_allclose(curve["loss"][-1], np.mean(costs), rtol=1e-4)


def test_trainings_of_other_sizes_and_rates_share_a_program(monkeypatch):
    programs, jit = [], jax.jit

    def recorded(function):
        compiled = jit(function)

        def call(*arguments):
            programs.append(compiled.lower(*arguments).as_text())
            return compiled(*arguments)

        return call

    monkeypatch.setattr(jax, "jit", recorded)
    for count, rate in ((40, 0.05), (37, 0.01), (5, 0.02)):
        train(epochs=2, count=count, rate=rate)
    assert len(programs) == 2 * (5 + 5 + 1) and len(set(programs)) == 1


@pytest.mark.parametrize("warm_up", [0, 4])
def test_the_rate_rises_in_the_first_steps(warm_up):
    """By gradients that are always the same Adam moves a weight by the rate: 1/5, 2/5 ... of it in four first steps."""

    def linear(weights, x):
        return -weights["slope"] * np.ones(1), np.ones(1), np.ones(1)

    batches = Batches(3, 1, np.random.default_rng(0))
    how = {"rate": lambda epochs: 0.5, "epochs": 2, "warm_up": warm_up}
    made, _ = minimize(linear, {"slope": np.zeros(1, np.float32)}, batches, lambda rows: (X[rows],), **how)
    expected = 0.5 * sum(min(1, step / (warm_up + 1)) for step in range(1, 7))
    assert made["slope"][0] == pytest.approx(expected, rel=1e-3)
