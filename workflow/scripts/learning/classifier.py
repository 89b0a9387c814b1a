"""The face that every model has: `fit`, `predict`, `decision_function`, `save` and `load`."""

import numpy as np

STATE = "model.npz"


class Classifier:
    """A classifier of complex images.

    A model is a class `Model` in a file of its own, models/<name>.py; it defines `fit` and `decision_function`.
    What `fit` learns are arrays whose names end with an underscore: those are saved and loaded.

    settings: the model's hyper-parameters, `learning.models.<name>` in the config.
    seed: an integer; all randomness of `fit` follows from it.
    classes_: names of the classes, sorted, shape (classes,).
    curve_: None, or a mapping of column name to values: the training curve.
    """

    curve_ = None

    def __init__(self, settings, seed):
        self.settings, self.seed = settings, seed

    def fit(self, images, labels):
        """Learn from complex images (observations, range, crossrange) and their class names; gives the model back."""
        raise NotImplementedError

    def decision_function(self, images):
        """Scores, shape (observations, classes), one column per class also for two classes: larger = likelier."""
        raise NotImplementedError

    def evaluate(self, images):
        """Predicted labels (observations,) and scores (observations, classes) in one pass over the images."""
        scores = self.decision_function(images)
        return self.classes_[scores.argmax(axis=1)], scores

    def predict(self, images):
        """Predicted labels, shape (observations,)."""
        return self.evaluate(images)[0]

    def save(self, folder):
        """Write what was learned to `folder`: plain arrays, no pickle, the same bytes for the same model."""
        state = {name: value for name, value in vars(self).items() if name.endswith("_") and name != "curve_"}
        np.savez(folder / STATE, **{name: state[name] for name in sorted(state)})

    def load(self, folder):
        """Read what `save` wrote; gives the model back."""
        with np.load(folder / STATE, allow_pickle=False) as state:
            for name in state.files:
                setattr(self, name, state[name])
        return self
