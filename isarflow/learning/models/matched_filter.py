"""Matched filter: correlation with a library of templates, the training images."""

import numpy as np

from isarflow.learning.classifier import OTHER, Outcome
from isarflow.learning.data.features import standardized, unit_rows
from isarflow.learning.library import Library


class Model(Library):
    """The class of the training image with the largest normalised correlation.

    Of the `features` parts it is the complex one, |t^H x| / (|t| |x|). For one known image in white noise this is its
    optimal detector at unknown amplitude and phase (Kay 1998, Fundamentals of Statistical Signal Processing II,
    section 7.4). The noise of the aperture is white, but the window colours it in the image, so the filter is not quite
    optimal. For all other features, which have no phase, it is the zero-mean normalised cross-correlation (ZNCC).
    Scores are the largest correlation with each class, 1 at most. Confidence score: `correlation`, the largest of a
    known class. templates_: (pixels, templates), conjugate, grouped by class; starts_: (classes,), each one's first.
    """

    LABELS = {
        "matched_filter": ("matched filter", "the matched filter", 4),
        "zncc": ("ZNCC", "the correlation of magnitudes (ZNCC)", 14),
    }
    SCORES = {"correlation": ("correlation", 8)}
    leaves_out = True
    SETTINGS = {
        "features": {"$ref": "#/$defs/features", "default": "parts"},
        "place": {"$ref": "#/$defs/place", "default": "search"},
    }

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        order = np.argsort(labels, kind="stable")
        self.classes_, self.starts_ = np.unique(labels[order], return_index=True)
        self.aspects_ = self._aspects(order)
        self.templates_ = np.ascontiguousarray(self._rows(images[order]).conj().T)
        self._keep_library(images[order])
        return self

    def judge(self, images, without=None, received=None):
        correlations = self._rows(images) @ self.templates_
        if self.sees == "parts":
            correlations = np.abs(correlations)
        scores = np.maximum.reduceat(self._masked(correlations, without, -1), self.starts_, axis=1)
        known = scores[:, self.classes_ != OTHER].max(axis=1)
        return Outcome(self.classes_[scores.argmax(axis=1)], scores, {"correlation": known})

    def _rows(self, images):
        return unit_rows(images) if self.sees == "parts" else standardized(self.features(images))
