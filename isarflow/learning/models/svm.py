"""Support vector machine with a Gaussian kernel."""

import numpy as np

from isarflow.learning.classifier import OTHER, Classifier, Outcome
from isarflow.learning.data.features import squared_distances


class Model(Classifier):
    """Soft-margin SVM on the image's `features`, kernel exp(-|x - y|^2 / scale^2), one against the rest.

    Scores are signed distances to the separating surface in units of the margin, near the intercept far from every
    support vector. Confidence score: `margin`, the largest of a known class.
    vectors_: all support vectors (vectors, features), squared_norms_: (vectors,), dual_: (vectors, classes),
    intercept_: (classes,).
    """

    LABELS = {
        "svm": ("SVM", "support vector machine (SVM)", 2),
        "svm_magnitude": ("SVM, magnitudes", "the SVM of magnitudes", 21),
        "svm_narrow": ("SVM, narrow kernel", "the SVM with a narrow kernel", 23),
    }
    SCORES = {"margin": ("margin", 10)}
    SETTINGS = {
        "C": {"type": "number", "exclusiveMinimum": 0, "description": "box constraint"},
        "scale": {"type": "number", "exclusiveMinimum": 0, "description": "s of the kernel exp(-|x - y|^2 / s^2)"},
        "features": {"$ref": "#/$defs/features", "default": "parts"},
    }
    pairs = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        from sklearn.svm import SVC  # predictions do without scikit-learn

        x = self.features(images, np.float64)
        kernel = self._kernel(x, x, np.einsum("ij,ij->i", x, x))
        self.classes_ = np.unique(labels)
        dual = np.zeros((len(x), len(self.classes_)))
        intercept = np.zeros(len(self.classes_))
        # With two classes each is the rest of the other.
        fitted = range(1, 2) if len(self.classes_) == 2 else range(len(self.classes_))
        for index in fitted:
            machine = SVC(C=self.settings["C"], kernel="precomputed", cache_size=500)
            machine.fit(kernel, labels == self.classes_[index])
            dual[machine.support_, index] = machine.dual_coef_[0]
            intercept[index] = machine.intercept_[0]
        if len(self.classes_) == 2:
            dual[:, 0], intercept[0] = -dual[:, 1], -intercept[1]
        supports = dual.any(axis=1)
        self.vectors_, self.dual_, self.intercept_ = x[supports], dual[supports], intercept
        self.squared_norms_ = np.einsum("ij,ij->i", self.vectors_, self.vectors_)
        return self

    def _kernel(self, x, references, squared_norms):
        """The kernel between x (n, features) and references (m, features), (n, m), by one product of matrices.

        Dual coefficients reach C in size and cancel, so single precision would not do.
        """
        kernel = squared_distances(x, references, squared_norms)
        kernel *= -(self.settings["scale"] ** -2)
        return np.exp(kernel, out=kernel)

    def evaluate(self, images):
        kernel = self._kernel(self.features(images, np.float64), self.vectors_, self.squared_norms_)
        scores = kernel @ self.dual_ + self.intercept_
        margin = scores[:, self.classes_ != OTHER].max(axis=1)
        return Outcome(self.classes_[scores.argmax(axis=1)], scores, {"margin": margin})
