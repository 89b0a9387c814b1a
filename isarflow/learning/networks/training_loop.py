"""Training by gradient descent: epochs with a curve, progress, early stopping, and a state that outlives the job."""

import os
import time
from pathlib import Path

import joblib
import numpy as np
from tqdm import tqdm

from isarflow.core.errors import InputError
from isarflow.learning.classifier import ANY_SNR

BETWEEN = 20.0  # seconds between two writings of a checkpoint, at least
COLUMNS = ("epoch", "seconds", "loss", "accuracy", "validation_loss", "validation_accuracy", "learning_rate")


class Batches:
    """The row numbers of each batch's images, in an order that `random` shuffles again for every epoch.

    count: images; size: images a batch; random: a NumPy generator.
    snrs: None, or the SNR's name of each image (count,), ANY_SNR for one that goes with all: then the images of a batch
    are all of one SNR, drawn for each batch, and an epoch shows as many images as one SNR has, so that more SNRs do not
    make it longer.
    """

    def __init__(self, count, size, random, snrs=None):
        self.random, self.size = random, size
        self.epochs = 0  # made before the present one
        if snrs is None:
            self.pools = [np.arange(count)]
        else:
            names = np.unique(snrs[snrs != ANY_SNR])
            self.pools = [np.flatnonzero((snrs == name) | (snrs == ANY_SNR)) for name in names]

    @property
    def count(self):
        """Batches an epoch."""
        return -(-max(map(len, self.pools)) // self.size)

    def epoch(self):
        """Yield one epoch's batches: arrays of row numbers. The last may be smaller."""
        orders = [self.random.permutation(pool) for pool in self.pools]
        longest = max(map(len, orders))
        for start in range(0, longest, self.size):
            order = orders[self.random.integers(len(orders))] if len(orders) > 1 else orders[0]
            yield np.take(order, np.arange(start, min(start + self.size, longest)), mode="wrap")


def glorot(random, shape, fans):
    """Weights before training, float32, uniform in +-sqrt(6 / fans) (Glorot and Bengio 2010, eq. 16).

    fans: the sum of the layer's inputs and outputs.
    """
    bound = np.sqrt(6 / fans)
    return random.uniform(-bound, bound, shape).astype(np.float32)


def minimize(loss, weights, batches, inputs, rate, epochs, validate=None, patience=None, checkpoint=None, warm_up=0):
    """Weights after training by Adam, a mapping of name to NumPy array, and the curve, a mapping of COLUMNS to lists.

    loss: a function of weights and a batch's arrays, in JAX, to three arrays (n,): the loss of each image, and 1 or 0
    for whether it is classified correctly, and for whether it is of a class. weights: those to begin with, a mapping of
    name to array.
    batches: a `Batches`; inputs: a function of a batch's row numbers to its arrays. rate: Adam's learning rate, a
    function of the number of epochs made. epochs: passes over the images, at most.
    validate: a function of weights to loss and accuracy at the validation azimuths; without one both are NaN.
    patience: None, or the number of epochs without a smaller validation loss after which training stops; the weights
    with the smallest are then the result, else the last ones.
    checkpoint: None, or a `Checkpoint`: training goes on from what it holds, as if it had never stopped.
    warm_up: the number of first steps in which the rate rises linearly.
    Raises InputError for a loss that is not a finite number.
    """
    import jax  # predictions do without it
    import optax

    from isarflow.core.compiled import keep_compiled

    keep_compiled()
    adam = optax.scale_by_adam()

    # Compiling takes longer than many a training. To use one program for all trainings of a kind, the rate is an
    # argument of it, and the last batch of an epoch is filled up with images that do not count.
    @jax.jit
    def step(weights, state, rate, count, *arrays):
        def mean(weights):
            counts = jax.numpy.arange(batches.size) < count
            cost, right, of_class = (jax.numpy.where(counts, each, 0).sum() for each in loss(weights, *arrays))
            return cost / count, (right, of_class)

        (cost, shares), gradient = jax.value_and_grad(mean, has_aux=True)(weights)
        change, state = adam.update(gradient, state)
        weights = jax.tree.map(lambda weight, by: weight - rate * by, weights, change)
        return weights, state, (cost, *shares)

    weights = jax.tree.map(jax.numpy.asarray, weights)
    now = {"weights": weights, "state": adam.init(weights), "best": weights}
    notes = {"rows": [], "least": np.inf, "waited": 0, "seconds": 0.0, "random": None}
    if checkpoint is not None and (kept := checkpoint.read()) is not None:
        now, notes = kept
        batches.random.bit_generator.state = notes["random"]
        print(f"goes on after epoch {len(notes['rows'])}, from {checkpoint.path}")
    rows, before, begin = notes["rows"], notes["seconds"], time.perf_counter()
    much = {"total": epochs * batches.count, "initial": len(rows) * batches.count, "unit": "batch"}
    bar = tqdm(**much, desc="training", leave=False, mininterval=5, miniters=0)  # by time alone, as batches are long
    while len(rows) < epochs and (patience is None or notes["waited"] < patience):
        results, sizes, full = [], [], rate(len(rows))
        batches.epochs = len(rows)
        for batch in batches.epoch():
            arrays = [np.resize(array, (batches.size, *array.shape[1:])) for array in inputs(batch)]
            risen = full * min(1.0, (len(rows) * batches.count + len(sizes) + 1) / (warm_up + 1))
            now["weights"], now["state"], result = step(now["weights"], now["state"], risen, len(batch), *arrays)
            results.append(result)
            sizes.append(len(batch))
            bar.update()
        costs, right, of_class = np.array(results, float).T
        cost, accuracy = np.average(costs, weights=sizes), right.sum() / max(of_class.sum(), 1)
        if not np.isfinite(cost):
            raise InputError(f"the loss became {cost} in epoch {len(rows) + 1}; take a smaller learning rate.")
        held_out = validate(arrays_of(now["weights"])) if validate else (np.nan, np.nan)
        notes["seconds"] = before + time.perf_counter() - begin
        rows.append([len(rows) + 1, round(notes["seconds"], 3), *map(float, (cost, accuracy, *held_out, full))])
        validation_loss, validation_accuracy = rows[-1][-3:-1]
        better = patience is None or not validation_loss >= notes["least"]  # also if there is no validation image
        notes["waited"] = 0 if better else notes["waited"] + 1
        if better:
            notes["least"], now["best"] = validation_loss, now["weights"]
        bar.set_postfix_str(f"loss {cost:.4g}, validation accuracy {validation_accuracy:.4f}", refresh=False)
        if checkpoint is not None:
            checkpoint.write(jax.tree.map(np.asarray, now), notes | {"random": batches.random.bit_generator.state})
    bar.close()
    curve = {name: list(values) for name, values in zip(COLUMNS, zip(*rows, strict=True), strict=True)}
    reached = f"loss {curve['loss'][-1]:.4g}, accuracy {curve['accuracy'][-1]:.4f} on the training images"
    validated = f"{curve['validation_accuracy'][-1]:.4f} at the validation azimuths"
    print(f"{len(rows)} epochs in {notes['seconds']:.1f} s: {reached}, {validated}")
    return arrays_of(now["best"]), curve


def arrays_of(weights):
    """Copy weights to NumPy arrays."""
    return {name: np.array(value) for name, value in weights.items()}


class Checkpoint:
    """The state of one training, in a file of its own in `folder`, which outlives the job that writes it.

    identity: arrays and plain values that the training follows from, and the files of its code in addition to this one:
    another training, or the same by other code, does not find this state.
    """

    def __init__(self, folder, *identity):
        parts = [part.read_bytes() if isinstance(part, Path) else part for part in (Path(__file__), *identity)]
        self.path, self.written = Path(folder) / f"{joblib.hash(parts)}.joblib", -np.inf

    def read(self):
        """The arrays and notes that `write` was last given; None if there is no whole file."""
        try:
            return joblib.load(self.path)
        except Exception:  # of many kinds, by where a file was cut short
            return None

    def write(self, arrays, notes):
        """Write arrays and notes, whole or not at all, at least BETWEEN seconds after the last time."""
        if time.monotonic() - self.written < BETWEEN:
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.path.with_suffix(".part")
        joblib.dump((arrays, notes), fresh)
        os.replace(fresh, self.path)
        self.written = time.monotonic()
