"""Base of models that keep training images as templates, and find a target's place among them where it may move."""

from functools import cached_property

import numpy as np

from isarflow.learning.classifier import OTHER, Classifier, Outcome
from isarflow.learning.data.features import by_channel, unit_rows
from isarflow.learning.search import BLOCK, HYPOTHESES, Search


class Library(Classifier):
    """A model that defines `judge`: images as they are, without a search; its `fit` ends with `_keep_library`.

    In a run whose targets move an image is judged at each of the hypotheses of `search.Search`, and its scores are the
    largest of them, unless the setting `place` is `known`. Where they are of known classes is `found` of the Outcome.
    library_: (templates, N), complex64, of unit length; starts_: each class's first; library_shape_: of an image.
    """

    searches = True

    def judge(self, images, without=None, received=None):
        """The Outcome of images at a known place. received: None, or the pulses (n, A) that are known to be there."""
        raise NotImplementedError

    def evaluate(self, images, without=None, received=None):
        if not self.is_searched:
            return self.judge(images, without)
        parts = [slice(start, start + BLOCK) for start in range(0, len(images), BLOCK)]
        judged = [
            self._found(images[part], *(None if each is None else each[part] for each in (without, received)))
            for part in parts
        ]
        labels, scores, *maps = zip(*judged, strict=True)
        joined = ({name: np.concatenate([part[name] for part in of]) for name in of[0]} for of in maps)
        return Outcome(np.concatenate(labels), np.concatenate(scores), *joined)

    def _keep_library(self, images):
        """Keep the templates, grouped by class, if they are to be searched."""
        vars(self).pop("_search", None)  # of an earlier fit
        if self.is_searched:
            self.library_, self.library_shape_ = unit_rows(images), np.array(by_channel(images[:1]).shape[1:])

    def _library(self):
        """The templates, (t, channel, R, X)."""
        return self.library_.reshape(-1, *self.library_shape_)

    @cached_property
    def _search(self):
        aspects = getattr(self, "aspects_", None)
        return Search(self.moves, self._library(), self.starts_[: len(self.classes_)], aspects)

    def _found(self, images, without, received):
        count, whole = len(images), np.arange(BLOCK) % len(images)
        without, received = (None if each is None else each[whole] for each in (without, received))
        hypotheses = self._search.hypotheses(images[whole], without, received)
        owners = None if without is None else np.repeat(without, HYPOTHESES)
        outcome = self.judge(hypotheses.images.reshape(-1, *images.shape[1:]), owners, hypotheses.received)
        scores = outcome.scores.reshape(BLOCK, HYPOTHESES, -1)
        best = scores[:, :, self.classes_ != OTHER].max(axis=2).argmax(axis=1)
        rows = np.arange(BLOCK) * HYPOTHESES + best
        searched = ("range", "crossrange", "drift") if self.moves.limits.drift else ("range", "crossrange")
        found = {name: getattr(hypotheses, name)[rows][:count] for name in searched}
        # A confidence less that of OTHER would be largest where OTHER fits least: it is that of the best hypothesis.
        known = {
            name: (of[rows] if OTHER in self.classes_ else of.reshape(BLOCK, HYPOTHESES).max(axis=1))[:count]
            for name, of in outcome.known.items()
        }
        scores = scores.max(axis=1)[:count]
        return Outcome(self.labels_of(scores), scores, known, found)

    def labels_of(self, scores):
        """Predicted labels (n,) of scores (n, classes)."""
        return self.classes_[scores.argmax(axis=1)]
