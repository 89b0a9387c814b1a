"""Denoising autoencoder in front of another model, by JAX: it makes the training images from copies in noise."""

import numpy as np

from isarflow.learning.data.features import by_channel, of, unit_rows
from isarflow.learning.denoised import Denoised
from isarflow.learning.models.invariants import with_noise
from isarflow.learning.networks.training_loop import Batches, glorot, minimize

WEIGHTS = ("hidden", "hidden_offset", "output", "output_offset")


class Model(Denoised):
    """Real and imaginary parts of all channels to `width` rectified units and back (Vincent et al. 2008).

    In every batch the training images, of unit energy and with random phases, get noise of their own, whose share of
    the energy is drawn from `invariants.NOISE`; the loss is the squared error of what the network makes of them.
    Weights by name: hidden_ (2 N, width), output_ (width, 2 N), of N pixels in all channels, and their offsets.
    """

    LABELS = {"autoencoder": ("ZNCC, autoencoder", "the ZNCC of images from a denoising autoencoder", 28)}
    SETTINGS = {
        "of": {"$ref": "#/$defs/model", "description": "the model of the same experiment that sees the images"},
        "width": {"type": "integer", "minimum": 1, "description": "units of its only hidden layer"},
        "epochs": {"type": "integer", "minimum": 1, "description": "passes over the training images"},
        "batch": {"type": "integer", "minimum": 1, "description": "images a batch"},
        "learning_rate": {"type": "number", "exclusiveMinimum": 0, "description": "Adam's in the first epoch"},
    }

    def learn(self, images):
        clean, noise = unit_rows(images).reshape(images.shape), by_channel(self.noise)
        random, epochs, rate = np.random.default_rng(self.seed), self.settings["epochs"], self.settings["learning_rate"]
        width, size = self.settings["width"], 2 * np.prod(images.shape[1:])
        weights = {
            "hidden": glorot(random, (size, width), size + width),
            "hidden_offset": np.zeros(width, np.float32),
            "output": glorot(random, (width, size), size + width),
            "output_offset": np.zeros(size, np.float32),
        }

        def loss(weights, seen, aims):
            error = ((_made(weights, seen) - aims) ** 2).sum(axis=1)
            return error, 0 * error, 0 * error  # there is no class

        def inputs(rows):
            phases = np.exp(2j * np.pi * random.random((len(rows), 1, 1, 1)))
            aims = clean[rows] * phases
            return of(with_noise(aims, noise, random), "parts"), of(aims, "parts")

        batches = Batches(len(clean), self.settings["batch"], random)
        how = {"rate": lambda epoch: rate * (1 + np.cos(np.pi * epoch / epochs)) / 2, "epochs": epochs}
        self._keep(minimize(loss, weights, batches, inputs, **how)[0])

    def denoised(self, images):
        made = _made({name: getattr(self, f"{name}_") for name in WEIGHTS}, of(unit_rows(images), "parts"))
        real, imaginary = np.split(made, 2, axis=1)
        return (real + 1j * imaginary).reshape(images.shape)


def _made(weights, x):
    """What the network makes of rows (n, 2 N)."""
    hidden = x.__array_namespace__().maximum(x @ weights["hidden"] + weights["hidden_offset"], 0)
    return hidden @ weights["output"] + weights["output_offset"]
