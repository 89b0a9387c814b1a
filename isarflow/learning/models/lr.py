"""Logistic regression with a quadratic penalty."""

import numpy as np

from isarflow.learning import confidence
from isarflow.learning.classifier import Classifier, Outcome


class Model(Classifier):
    """Minimises the summed cross-entropy plus w'w / (2 penalty) over the image's `features`.

    Scores are logits: their softmax gives the class probabilities.
    coef_: (features, classes), intercept_: (classes,).
    """

    LABELS = {
        "lr": ("LR", "logistic regression (LR)", 0),
        "lr_tuned": ("LR, tuned", "tuned logistic regression", 1),
    }
    SCORES = {"softmax": ("softmax", 0), "max_logit": ("maximum logit", 3), "energy": ("energy", 4)}
    SETTINGS = {
        "penalty": {"type": "number", "exclusiveMinimum": 0, "description": "lambda of the penalty w'w / (2 lambda)"},
        "features": {"$ref": "#/$defs/features", "default": "parts"},
    }

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        from sklearn.linear_model import LogisticRegression  # predictions do without scikit-learn

        x = self.features(images, np.float64)
        fitted = LogisticRegression(C=self.settings["penalty"], tol=1e-6, max_iter=5000).fit(x, labels)
        weights, offsets = fitted.coef_, fitted.intercept_
        if len(fitted.classes_) == 2:
            # One logit z for two classes is the pair -z/2, z/2.
            weights, offsets = np.concatenate([-weights, weights]) / 2, np.concatenate([-offsets, offsets]) / 2
        self.classes_, self.coef_, self.intercept_ = fitted.classes_, weights.T.copy(), offsets
        return self

    def evaluate(self, images):
        logits = self.features(images, np.float64) @ self.coef_ + self.intercept_
        return Outcome(self.classes_[logits.argmax(axis=1)], logits, confidence.of_logits(logits, self.classes_))
