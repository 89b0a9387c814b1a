"""The sum of other models' scores, each over its spread on validation images."""

import numpy as np

from isarflow.learning.classifier import PLUS, Classifier, Outcome, best_known, load_classifier
from isarflow.learning.data.features import by_channel
from isarflow.learning.models.invariants import with_noise


class Model(Classifier):
    """Models of the same run that err in different ways, fitted before; their scores are added.

    In a run these are taken from the tables of its members, which need not be tested twice.

    The spread of a member is the standard deviation of its first confidence score over the validation images with noise
    of their own; without validation images over those that train. spreads_: (members,), in the order of `of`.
    """

    LABELS = {"sum": ("sum", "the sum of several models", 25)}
    SCORES = {"sum": ("sum", 20)}
    SETTINGS = {
        "of": {
            "type": "string",
            "pattern": r"^[a-z][a-z0-9_]*( \+ [a-z][a-z0-9_]*)+$",
            "description": "names of models of the same experiment, as in likelihood_other + invariants",
        }
    }
    learns_noise = True
    additive = True
    combines = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        self.members = self._fitted(self.beside)
        random = np.random.default_rng(self.seed)
        held_out = with_noise(by_channel((validation or [images])[0]), self.noise, random).astype(np.complex64)
        held_out = held_out.reshape(-1, *images.shape[1:])
        self.spreads_ = np.array([max(np.std(_first(of.evaluate(held_out))), 1e-12) for of in self.members.values()])
        self.classes_ = next(iter(self.members.values())).classes_
        return self

    def evaluate(self, images):
        return self.added([member.evaluate(images) for member in self.members.values()])

    def added(self, outcomes):
        """The Outcome of images, of those of each member."""
        scores = sum(of.scores / spread for of, spread in zip(outcomes, self.spreads_, strict=True))
        known = {}
        if all(of.known for of in outcomes):  # in a closed run tables have none
            known["sum"] = sum(_first(of) / spread for of, spread in zip(outcomes, self.spreads_, strict=True))
        return Outcome(best_known(scores, self.classes_), scores, known)

    def load(self, folder):
        self.members = self._fitted(folder.parent)
        return super().load(folder)

    def _fitted(self, folder):
        return {name: load_classifier(folder / name) for name in self.settings["of"].split(PLUS)}


def _first(outcome):
    return next(iter(outcome.known.values()))
