"""The sum of other models' scores, each over its spread on validation images."""

import numpy as np

from isarflow.learning.classifier import Classifier, Outcome, best_known, build
from isarflow.learning.data.features import by_channel
from isarflow.learning.models.invariants import with_noise


class Model(Classifier):
    """Models that err in different ways, fitted to the same images; their scores are added.

    members: a mapping of names to their settings, with `kind` where that is not the name. The spread of a member is the
    standard deviation of its first confidence score over the validation images with noise of their own; without
    validation images over those that train. spreads_: (members,), in the order of their names.
    """

    LABELS = {"sum": ("sum", "the sum of several models", 25)}
    SCORES = {"sum": ("sum", 20)}
    SETTINGS = {"members": {"type": "object", "minProperties": 1, "description": "models by name, with their settings"}}
    learns_noise = True
    additive = True

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        self.members = self._built()
        random = np.random.default_rng(self.seed)
        held_out = with_noise(by_channel((validation or [images])[0]), self.noise, random).astype(np.complex64)
        held_out = held_out.reshape(-1, *images.shape[1:])
        self.spreads_ = np.empty(len(self.members))
        for number, member in enumerate(self.members.values()):
            member.noise, member.aspects, member.moves = self.noise, self.aspects, self.moves
            member.fit(images, labels, validation, snrs, views)
            self.spreads_[number] = max(np.std(_first(member.evaluate(held_out))), 1e-12)
        self.classes_ = next(iter(self.members.values())).classes_
        return self

    def evaluate(self, images):
        outcomes = [member.evaluate(images) for member in self.members.values()]
        scores = sum(of.scores / spread for of, spread in zip(outcomes, self.spreads_, strict=True))
        known = sum(_first(of) / spread for of, spread in zip(outcomes, self.spreads_, strict=True))
        return Outcome(best_known(scores, self.classes_), scores, {"sum": known})

    def save(self, folder):
        super().save(folder)
        for name, member in self.members.items():
            (folder / name).mkdir(exist_ok=True)
            member.save(folder / name)

    def load(self, folder):
        super().load(folder)
        self.members = self._built()
        for name, member in self.members.items():
            member.moves = self.moves
            member.load(folder / name)
        return self

    def _built(self):
        every = sorted(self.settings["members"].items())
        return {name: build(own.get("kind", name), _without_kind(own), self.seed) for name, own in every}


def _first(outcome):
    return next(iter(outcome.known.values()))


def _without_kind(settings):
    return {key: value for key, value in settings.items() if key != "kind"}
