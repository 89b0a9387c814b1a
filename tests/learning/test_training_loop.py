"""Training: what a killed one goes on from, early stopping, and losses that are no numbers."""

import numpy as np
import optax
import pytest

from core.errors import InputError
from learning import training_loop
from learning.training_loop import COLUMNS, Batches, Checkpoint, Settings, minimize

X = np.random.default_rng(1).standard_normal((40, 3)).astype(np.float32)
Y = X @ np.array([1.0, -2.0, 0.5], np.float32)


def loss(weights, x, y):
    error = x @ weights["slope"] - y
    return (error**2).mean(), ((abs(error) < 0.5).sum(), len(x))


def validated(weights):
    cost, (right, count) = loss(weights, X, Y)
    return cost, right / count


def train(epochs=6, validate=validated, patience=None, checkpoint=None, rate=0.05):
    random = np.random.default_rng(5)
    start = {"slope": random.standard_normal(3).astype(np.float32)}
    settings = Settings(optax.adam(rate), lambda steps: rate / (1 + steps), epochs, patience, checkpoint)
    return minimize(loss, start, Batches(len(X), 8, random), lambda rows: (X[rows], Y[rows]), settings, validate)


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
