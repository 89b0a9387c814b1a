"""What training in batches needs: which images a batch holds, the curve, and progress."""

import numpy as np
from scipy.special import log_softmax
from tqdm import tqdm

from common.errors import InputError

ANY_SNR = "any"


class Batches:
    """The rows of each batch, in an order that `random` shuffles anew for every epoch.

    count: images; size: images a batch; random: a numpy generator.
    snrs: None, or the SNR's name of each image (count,), ANY_SNR for one that goes with all: then the images of a batch
    are all of one SNR, drawn for each batch, and an epoch shows as many images as one SNR has, so that more SNRs do not
    make it longer.
    """

    def __init__(self, count, size, random, snrs=None):
        self.random, self.size = random, size
        if snrs is None:
            self.pools = [np.arange(count)]
        else:
            names = np.unique(snrs[snrs != ANY_SNR])
            self.pools = [np.flatnonzero((snrs == name) | (snrs == ANY_SNR)) for name in names]

    def epoch(self):
        """One epoch's batches: arrays of row numbers. The last may be smaller."""
        orders = [self.random.permutation(pool) for pool in self.pools]
        longest = max(map(len, orders))
        for start in range(0, longest, self.size):
            order = orders[self.random.integers(len(orders))] if len(orders) > 1 else orders[0]
            rows = np.take(order, np.arange(start, min(start + self.size, longest)), mode="wrap")
            yield rows


class Curve:
    """The training curve, with a progress bar over the epochs."""

    def __init__(self, epochs):
        self.columns = {name: [] for name in ("epoch", "loss", "accuracy", "validation_loss", "validation_accuracy")}
        self.bar = tqdm(total=epochs, unit="epoch", desc="training", leave=False)

    def add(self, loss, logits, train, validation):
        """Note one epoch: its mean loss, and what `logits`, a function of features, makes of the two sets (x, y).

        validation may be None. Raises InputError for a loss that is not a finite number.
        """
        if not np.isfinite(loss):
            raise InputError(
                f"training: the loss became {loss} in epoch {len(self.columns['epoch']) + 1}; take a smaller "
                "learning rate."
            )
        row = {"epoch": len(self.columns["epoch"]) + 1, "loss": float(loss)}
        row["accuracy"] = _judge(logits(train[0]), train[1])[1]
        held_out = (np.nan, np.nan) if validation is None else _judge(logits(validation[0]), validation[1])
        row |= {"validation_loss": held_out[0], "validation_accuracy": held_out[1]}
        for name, value in row.items():
            self.columns[name].append(value)
        self.bar.set_postfix_str(f"loss {loss:.4g}, validation accuracy {row['validation_accuracy']:.4f}")
        self.bar.update()

    def close(self):
        """End the progress bar and say how training ended; gives the curve, a mapping of column to values."""
        self.bar.close()
        last = {name: values[-1] for name, values in self.columns.items()}
        print(
            f"{last['epoch']} epochs: loss {last['loss']:.4g}, accuracy {last['accuracy']:.4f} on the training images, "
            f"{last['validation_accuracy']:.4f} at the validation azimuths"
        )
        return self.columns


def _judge(logits, y):
    """Mean cross-entropy and accuracy of logits (n, classes) for the classes' numbers y (n,)."""
    cost = -log_softmax(logits, axis=1)[np.arange(len(y)), y]
    return float(cost.mean()), float((logits.argmax(axis=1) == y).mean())
