"""A network of PyTorch as a model: its file in isarflow/learning/models defines one method.

PyTorch is not part of the environment: envs/requirements-torch.txt.
"""

import copy
import time

import numpy as np
import torch
from scipy.special import log_softmax

from isarflow.core.errors import InputError
from isarflow.learning import confidence
from isarflow.learning.classifier import Classifier, Outcome
from isarflow.learning.data.features import by_channel
from isarflow.learning.networks.training_loop import COLUMNS, Batches

BATCH = 256  # images at a time in predictions
WEIGHTS = "weights."  # prefix of the names of a network's saved tensors


class PyTorch(Classifier):
    """Base of a model that trains a network on images as channels: real and imaginary parts of each polarization.

    A model defines `network`; Adam trains it on the cross-entropy, in the setting `epochs` passes over the images in
    batches of `batch` at `learning_rate`. With a setting `patience` it ends after so many epochs without a smaller
    validation loss, and keeps the weights that had the smallest. Scores are logits; confidence scores
    `confidence.of_logits`. All on one core: the same config gives the same weights.
    """

    by_snr = True

    def network(self, pixels, classes):
        """A torch.nn.Module of float32 images (n, self.channels, range, crossrange) to logits (n, classes).

        Channels are the real parts of all polarizations, then the imaginary ones: two for one polarization. pixels: of
        an image, (range, crossrange); classes: their number.
        """
        raise InputError(f"{self.__module__}: its Model lacks network(self, pixels, classes), a torch.nn.Module.")

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        torch.use_deterministic_algorithms(True)
        torch.set_num_threads(1)
        torch.manual_seed(self.seed)
        self.classes_, y = np.unique(labels, return_inverse=True)
        self.shape_ = np.array(by_channel(images).shape[1:])
        self.net = self._built()
        held_out = validation and (_channels(validation[0]), np.searchsorted(self.classes_, validation[1]))
        batches = Batches(len(images), self.settings["batch"], np.random.default_rng(self.seed), snrs)
        self._train(_channels(images), torch.from_numpy(y), held_out, batches)
        return self

    def _built(self):
        channels, *pixels = map(int, self.shape_)
        self.channels = 2 * channels
        return self.network(tuple(pixels), len(self.classes_))

    def _train(self, x, y, held_out, batches):
        rate, patience = self.settings["learning_rate"], self.settings.get("patience")
        optimizer = torch.optim.Adam(self.net.parameters(), lr=rate)
        rows, best, since, begin = [], None, 0, time.perf_counter()
        for epoch in range(1, self.settings["epochs"] + 1):
            self.net.train()
            # A last batch of one image is left out: batch normalization cannot learn from one.
            every = [batch for batch in map(torch.from_numpy, batches.epoch()) if len(batch) > 1 or len(x) == 1]
            seen = [self._step(optimizer, x[batch], y[batch]) for batch in every]
            count, loss, right = np.sum(seen, axis=0)
            held = _measured(self._logits(held_out[0]), held_out[1]) if held_out else (np.nan, np.nan)
            rows.append([epoch, time.perf_counter() - begin, loss / count, right / count, *held, rate])
            if patience is not None:
                since += 1
                if not held[0] >= min((row[4] for row in rows[:-1]), default=np.inf):
                    best, since = copy.deepcopy(self.net.state_dict()), 0
                elif since >= patience:
                    break
        if best is not None:
            self.net.load_state_dict(best)
        self.curve_ = dict(zip(COLUMNS, map(list, zip(*rows, strict=True)), strict=True))
        print(f"{len(rows)} epochs: loss {rows[-1][2]:.4g}, accuracy {rows[-1][3]:.4f} on the training images")

    def _step(self, optimizer, x, y):
        """Train on a batch; return its number of images, the sum of losses, and the number classified correctly."""
        logits = self.net(x)
        loss = torch.nn.functional.cross_entropy(logits, y)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        return len(y), len(y) * loss.item(), (logits.argmax(dim=1) == y).sum().item()

    def _logits(self, x):
        self.net.eval()
        with torch.no_grad():
            return np.concatenate([self.net(part).numpy() for part in x.split(BATCH)]).astype(np.float64)

    def evaluate(self, images):
        logits = self._logits(_channels(images))
        return Outcome(self.classes_[logits.argmax(axis=1)], logits, confidence.of_logits(logits, self.classes_))

    def save(self, folder):
        self._keep({WEIGHTS + name: tensor.numpy() for name, tensor in self.net.state_dict().items()})
        super().save(folder)

    def load(self, folder):
        super().load(folder)
        self.net = self._built()
        kept = {name[len(WEIGHTS) : -1]: array for name, array in vars(self).items() if name.startswith(WEIGHTS)}
        self.net.load_state_dict({name: torch.from_numpy(np.array(array)) for name, array in kept.items()})
        return self


def _channels(images):
    """Complex images as a float32 tensor (n, channels, range, crossrange)."""
    every = by_channel(images)
    return torch.from_numpy(np.concatenate([every.real, every.imag], axis=1).astype(np.float32))


def _measured(logits, y):
    """Mean cross-entropy and accuracy of logits (n, classes) with the true classes y (n,)."""
    return float(-log_softmax(logits, axis=1)[np.arange(len(y)), y].mean()), float((logits.argmax(axis=1) == y).mean())
