"""Fully connected network with one hidden layer, by JAX and optax."""

import numpy as np

from isarflow.learning import confidence
from isarflow.learning.classifier import OTHER, Classifier, Outcome
from isarflow.learning.data.features import unit
from isarflow.learning.networks import openmax
from isarflow.learning.networks.training_loop import Batches, glorot, minimize


class Model(Classifier):
    """`width` rectified linear units on the image's `features`, then a logit for each class (thesis section 5.2).

    Trained by Adam on the cross-entropy for `epochs` passes over the images in batches of `batch`.
    Confidence scores from the logits: `confidence.of_logits`, and OpenMax as published and with shifted logits; from
    the hidden layer's outputs: `neighbour` (confidence.neighbour_score) and `confidence.mahalanobis_scores`. OpenMax's
    score is the largest revised probability of a known class, below 1/2 where OpenMax itself rejects. With a class
    OTHER it is left out, as it would say the same a second time.
    """

    LABELS = {
        "fcnn": ("FCNN", "the fully connected network (FCNN)", 5),
        "fcnn_other": ("FCNN, other class", "the FCNN with a class 'other'", 6),
        "fcnn_magnitude": ("FCNN, magnitudes", "the FCNN of magnitudes", 22),
    }
    SCORES = {
        "softmax": ("softmax", 0),
        "openmax": ("OpenMax", 1),
        "openmax_shifted": ("OpenMax, shifted logits", 2),
        "max_logit": ("maximum logit", 3),
        "energy": ("energy", 4),
        "neighbour": ("5th nearest neighbour", 5),
        "mahalanobis": ("Mahalanobis", 6),
        "relative_mahalanobis": ("relative Mahalanobis", 7),
    }
    SETTINGS = {
        "width": {"type": "integer", "minimum": 1, "description": "units of the hidden layer"},
        "epochs": {"type": "integer", "minimum": 1, "description": "passes over the training images"},
        "batch": {"type": "integer", "minimum": 1, "description": "images a batch"},
        "learning_rate": {"type": "number", "exclusiveMinimum": 0, "description": "Adam's"},
        "openmax_tail": {"type": "integer", "minimum": 2, "description": "largest distances of the Weibull fit"},
        "openmax_alpha": {"type": "integer", "minimum": 1, "description": "largest logits that OpenMax revises"},
        "features": {"$ref": "#/$defs/features", "default": "parts"},
    }
    by_snr = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        x = self.features(images)
        self.classes_, y = np.unique(labels, return_inverse=True)
        held_out = validation and (self.features(validation[0]), np.searchsorted(self.classes_, validation[1]))
        self._train(x, y, held_out, snrs)

        features, known = self._hidden(x), labels != OTHER
        self.references_ = unit(features[known])
        classes = self.classes_[self.classes_ != OTHER]
        self._keep(confidence.fit_gaussians(features[known].astype(np.float64), labels[known], classes))
        if OTHER not in self.classes_:
            logits = self._logits(features)
            self.mean_logits_, self.tails_ = openmax.fit(logits, labels, self.classes_, self.settings["openmax_tail"])
        return self

    def _train(self, x, y, held_out, snrs):
        import jax  # predictions do without it
        import optax

        def loss(weights, x, y):
            logits = jax.nn.relu(x @ weights["hidden"] + weights["hidden_offset"]) @ weights["output"]
            logits += weights["output_offset"]
            costs = optax.softmax_cross_entropy_with_integer_labels(logits, y)
            return costs, logits.argmax(axis=1) == y, jax.numpy.ones(len(y))

        def validate(weights):
            costs, right, _ = jax.jit(loss)(weights, *held_out)
            return costs.mean(), right.mean()

        random = np.random.default_rng(self.seed)
        width, weights = self.settings["width"], {}
        for name, rows, columns in (("hidden", x.shape[1], width), ("output", width, len(self.classes_))):
            weights[name] = glorot(random, (rows, columns), rows + columns)
            weights[f"{name}_offset"] = np.zeros(columns, np.float32)
        batches = Batches(len(x), self.settings["batch"], random, snrs)
        how = {"rate": lambda epochs: self.settings["learning_rate"], "epochs": self.settings["epochs"]}
        how |= {"validate": held_out and validate}
        learned, self.curve_ = minimize(loss, weights, batches, lambda rows: (x[rows], y[rows]), **how)
        self._keep(learned)

    def _hidden(self, x):
        return np.maximum(x @ self.hidden_ + self.hidden_offset_, 0)

    def _logits(self, features):
        return (features @ self.output_ + self.output_offset_).astype(np.float64)

    def evaluate(self, images):
        features = self._hidden(self.features(images))
        logits = self._logits(features)
        scores = confidence.of_logits(logits, self.classes_)
        if OTHER not in self.classes_:
            for name, shifted in (("openmax", False), ("openmax_shifted", True)):
                alpha = self.settings["openmax_alpha"]
                revised = openmax.probabilities(logits, self.mean_logits_, self.tails_, alpha, shifted)
                scores[name] = revised[:, :-1].max(axis=1)
        scores["neighbour"] = confidence.neighbour_score(features, self.references_)
        gaussians = {name: getattr(self, f"{name}_") for name in confidence.GAUSSIANS}
        scores |= confidence.mahalanobis_scores(features.astype(np.float64), gaussians)
        return Outcome(self.classes_[logits.argmax(axis=1)], logits, scores)
