"""Fully connected network with one hidden layer, by JAX and optax."""

import numpy as np

from learning import known, openmax
from learning.classifier import OTHER, Classifier, Outcome
from learning.descent import Batches, descend, glorot
from learning.features import real_imaginary

KINDS = ("means", "whitening", "background_mean", "background_whitening")


class Model(Classifier):
    """`width` rectified linear units on real and imaginary parts, then a logit for each class (thesis section 5.2).

    Trained by Adam on the cross-entropy for `epochs` passes over the images in batches of `batch`. Known scores: of the
    logits (known.of_logits, and OpenMax as published and with shifted logits), and of the hidden layer's outputs
    (`neighbour`: known.neighbour_score; known.mahalanobis_scores). OpenMax's score is the largest revised probability
    of a known class: below 1/2 where the unknown's is the largest, which OpenMax itself would reject at any threshold.
    A class OTHER is no known class: then OpenMax is left out, for it would be a second way to say the same.
    """

    LABELS = {
        "fcnn": ("FCNN", "the fully connected network (FCNN)", 5),
        "fcnn_other": ("FCNN, other class", "the FCNN with a class 'other'", 6),
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
        "openmax_tail": {
            "type": "integer",
            "minimum": 2,
            "description": "largest distances that a Weibull distribution is fitted to",
        },
        "openmax_alpha": {"type": "integer", "minimum": 1, "description": "largest logits that OpenMax revises"},
    }
    by_snr = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        x = real_imaginary(images)
        self.classes_, y = np.unique(labels, return_inverse=True)
        held_out = None
        if validation is not None:
            held_out = real_imaginary(validation[0]), np.searchsorted(self.classes_, validation[1])
        self._train(x, y, held_out, snrs)

        features = self._features(x)
        own = labels != OTHER
        self.references_ = known.unit(features[own])
        gaussians = known.fit_gaussians(
            features[own].astype(np.float64), labels[own], self.classes_[self.classes_ != OTHER]
        )
        for kind in KINDS:
            setattr(self, f"{kind}_", gaussians[kind])
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
            return costs.mean(), ((logits.argmax(axis=1) == y).sum(), len(y))

        def judge(weights):
            if held_out is None:
                return np.nan, np.nan
            cost, (right, count) = loss(weights, *held_out)
            return cost, right / count

        random = np.random.default_rng(self.seed)
        sizes = (x.shape[1], self.settings["width"], len(self.classes_))
        weights = {}
        for name, rows, columns in zip(("hidden", "output"), sizes[:-1], sizes[1:], strict=True):
            weights[name] = glorot(random, (rows, columns), rows + columns)
            weights[f"{name}_offset"] = np.zeros(columns, np.float32)
        learned, self.curve_ = descend(
            loss,
            weights,
            optax.adam(self.settings["learning_rate"]),
            Batches(len(x), self.settings["batch"], random, snrs),
            lambda rows: (x[rows], y[rows]),
            self.settings["epochs"],
            judge,
        )
        for name, value in learned.items():
            setattr(self, f"{name}_", value)

    def _features(self, x):
        return np.maximum(x @ self.hidden_ + self.hidden_offset_, 0)

    def _logits(self, features):
        return (features @ self.output_ + self.output_offset_).astype(np.float64)

    def decision_function(self, images):
        return self._logits(self._features(real_imaginary(images)))

    def evaluate(self, images):
        features = self._features(real_imaginary(images))
        logits = self._logits(features)
        scores = known.of_logits(logits, self.classes_)
        if OTHER not in self.classes_:
            for name, shifted in (("openmax", False), ("openmax_shifted", True)):
                alpha = self.settings["openmax_alpha"]
                revised = openmax.probabilities(logits, self.mean_logits_, self.tails_, alpha, shifted)
                scores[name] = revised[:, :-1].max(axis=1)
        scores["neighbour"] = known.neighbour_score(features, self.references_)
        scores |= known.mahalanobis_scores(
            features.astype(np.float64), {kind: getattr(self, f"{kind}_") for kind in KINDS}
        )
        return Outcome(self.classes_[logits.argmax(axis=1)], logits, scores)
