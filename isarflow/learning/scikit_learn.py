"""A classifier of scikit-learn as a model: its file in isarflow/learning/models defines one method."""

import joblib
import numpy as np
from sklearn.base import is_classifier

from isarflow.core.errors import InputError
from isarflow.learning import confidence
from isarflow.learning.classifier import OTHER, Classifier, Outcome

FILE = "estimator.joblib"


class ScikitLearn(Classifier):
    """Base of a model that fits an estimator of scikit-learn, or a pipeline that ends in one, to features of images.

    A model defines `estimator`, and a method `features` if it learns from others than the setting `features` offers.
    Scores are the estimator's class probabilities, else its decision function; the largest is the prediction.
    Confidence score: `probability`, the largest of a known class; for decision functions `confidence.of_logits`.
    The estimator is kept by joblib, a pickle: loading it runs the code in it.
    """

    FEATURES = "magnitude"

    def estimator(self):
        """The unfitted estimator, made from self.settings; its random_state is self.seed."""
        raise InputError(f"{self.__module__}: its Model lacks estimator(self), which gives one of scikit-learn.")

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        estimator = self.estimator()
        if not is_classifier(estimator):
            name = type(estimator).__name__
            raise InputError(f"{self.__module__}: its estimator, {name}, is none of scikit-learn's classifiers.")
        self.fitted = estimator.fit(self.features(images), labels)
        self.classes_ = np.asarray(self.fitted.classes_)
        return self

    def evaluate(self, images):
        x = self.features(images)
        if hasattr(self.fitted, "predict_proba"):
            scores = self.fitted.predict_proba(x)
            known = {"probability": scores[:, self.classes_ != OTHER].max(axis=1)}
        else:
            scores = self.fitted.decision_function(x)
            if scores.ndim == 1:  # one number for two classes, positive for the second
                scores = np.stack([-scores, scores], axis=1) / 2
            known = confidence.of_logits(scores, self.classes_)
        return Outcome(self.classes_[scores.argmax(axis=1)], scores, known)

    def save(self, folder):
        super().save(folder)
        joblib.dump(self.fitted, folder / FILE)

    def load(self, folder):
        self.fitted = joblib.load(folder / FILE)
        return super().load(folder)
