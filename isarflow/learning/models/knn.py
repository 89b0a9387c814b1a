"""K nearest neighbours, Euclidean, as one matrix product."""

import numpy as np

from isarflow.learning.classifier import OTHER, Classifier, Outcome
from isarflow.learning.data.features import squared_distances


class Model(Classifier):
    """The k nearest training images vote; equal votes go to the first class in sorted order.

    Scores are minus the distance to each class's nearest training image, for any k: far from all of them means
    unlike anything known. For k = 1 the largest score is the prediction; for larger k the vote decides.
    Confidence score: `distance`, minus the distance to the nearest image of a known class.
    references_: (references, features), grouped by class; starts_: (classes,), each class's first row.
    """

    LABELS = {
        "knn": ("KNN", "nearest neighbour (KNN)", 3),
        "knn_magnitude": ("KNN, magnitudes", "the nearest neighbour of magnitudes", 13),
    }
    SCORES = {"distance": ("nearest distance", 9)}
    SETTINGS = {
        "k": {"type": "integer", "minimum": 1, "description": "number of neighbours, at most the training images"},
        "features": {"$ref": "#/$defs/features", "default": "parts"},
    }
    fewest = "k"
    leaves_out = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        x = self.features(images)
        order = np.argsort(labels, kind="stable")
        self.classes_, self.starts_ = np.unique(labels[order], return_index=True)
        self.references_, self.aspects_ = x[order], self._aspects(order)
        self.squared_norms_ = np.einsum("ij,ij->i", self.references_, self.references_)
        return self

    def evaluate(self, images, without=None):
        distances = squared_distances(self.features(images), self.references_, self.squared_norms_)
        distances = self._masked(distances, without, np.finfo(distances.dtype).max)
        scores = -np.sqrt(np.minimum.reduceat(distances, self.starts_, axis=1))
        known = {"distance": scores[:, self.classes_ != OTHER].max(axis=1)}
        k = self.settings["k"]
        if k == 1:
            return Outcome(self.classes_[scores.argmax(axis=1)], scores, known)
        nearest = np.argpartition(distances, k - 1, axis=1)[:, :k]
        owners = np.searchsorted(self.starts_, nearest, side="right") - 1
        votes = (owners[:, :, None] == np.arange(len(self.classes_))).sum(axis=1)
        return Outcome(self.classes_[votes.argmax(axis=1)], scores, known)
