"""Check on a few images, right after its training, that a fitted model has the interface of `classifier.py`.

So a faulty model of a user's own is refused there, with one message, and not by a later job that relies on it.
`who` is the model's name in that message, from `describe`.
"""

import inspect
from collections.abc import Mapping

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.kinds import MODELS, file_of
from isarflow.learning.classifier import OTHER, Outcome

FEW = 8  # images that a model is tried on
ARGUMENTS = ("images", "labels", "validation", "snrs", "views")
EVALUATED = {  # arguments of `evaluate`, by whether the model leaves some of its images out
    False: (("images",), "evaluate(self, images)"),
    True: (("images", "without"), "evaluate(self, images, without=None)"),
}
NEAR, BATCHED = 1e-3, 1e-2  # of the largest score: two answers that differ by less are the same, also in another batch
CURVE = ("epoch", "loss", "accuracy", "validation_loss", "validation_accuracy")  # what the report draws


def describe(model, run, kind):
    """A model as a message names it: its file, its own name and the run's."""
    return f"{file_of(MODELS, kind)}, model {model} of {run}"


def check_face(model, who):
    """Raise InputError for a model whose `fit` or `evaluate` does not take its arguments."""
    for method, arguments, wanted in (
        (model.fit, ARGUMENTS, "fit(self, images, labels, validation=None, snrs=None, views=None)"),
        (model.evaluate, *EVALUATED[model.leaves_out]),
    ):
        try:
            inspect.signature(method).bind(*arguments)
        except TypeError as error:
            raise InputError(f"{who}: its {method.__name__} cannot be called ({error}); write {wanted}.") from None


def check_fitted(model, labels, images, who):
    """Raise InputError for a fitted model with other classes than its labels, a wrong curve or a wrong Outcome.

    labels: those that it was trained with; images: some that it was not trained with.
    """
    classes = getattr(model, "classes_", None)
    if not isinstance(classes, np.ndarray) or classes.ndim != 1:
        raise InputError(
            f"{who}: after fit its classes_ must be a numpy array of the classes' names, as np.unique(labels) gives "
            f"it; it is {_shown(classes)}."
        )
    trained, stated = set(np.unique(labels).tolist()), classes.tolist()
    if len(set(stated)) < len(stated) or not trained - {OTHER} <= set(stated) <= trained:
        raise InputError(
            f"{who}: after fit its classes_ must be the classes it was trained with, {', '.join(sorted(trained))}, "
            f"each once; they are {', '.join(map(str, stated)) or 'none'}."
        )
    if model.curve_ is not None:
        shapes = {np.shape(values) for values in model.curve_.values()} if isinstance(model.curve_, Mapping) else set()
        if {len(shape) for shape in shapes} != {1} or len(shapes) > 1 or not set(CURVE) <= set(model.curve_):
            raise InputError(
                f"{who}: its curve_ must be a mapping with columns {', '.join(CURVE)}, each with a value an epoch."
            )
    few = model.evaluate(images[:FEW])
    check_outcome(few, min(FEW, len(images)), classes, who)
    if not _alike(few, model.evaluate(images[:FEW])):
        raise InputError(
            f"{who}: asked twice about the same images, its evaluate gives two answers. All randomness must follow "
            "from self.seed, anew in each call."
        )
    alone = model.evaluate(images[:1])
    check_outcome(alone, 1, classes, who)
    # Images come target by target: a model that looks at an image's neighbours could read the answer from them.
    first = Outcome(few.labels[:1], few.scores[:1], {name: values[:1] for name, values in few.known.items()})
    if not _near(first, alone, BATCHED):
        raise InputError(
            f"{who}: its evaluate says something else of an image alone than among others. It must judge each image by "
            "itself."
        )


def check_outcome(outcome, count, classes, who, where=""):
    """Raise InputError for a result that is no Outcome of `count` images. where: words after the number."""
    if not isinstance(outcome, Outcome):
        raise InputError(f"{who}: its evaluate must return an Outcome(labels, scores, known), not {_shown(outcome)}.")
    _check_shape("labels", outcome.labels, (count,), who)
    _check_shape("scores", outcome.scores, (count, len(classes)), who)
    for label in sorted({str(label) for label in outcome.labels} - set(classes.tolist())):
        have = ", ".join(classes.tolist())
        raise InputError(f"{who}: its evaluate gives the label '{label}', and its classes_ are {have}.")
    if not isinstance(outcome.known, Mapping):
        raise InputError(
            f"{who}: known of the Outcome that its evaluate returns must be a mapping of the known scores' names to "
            f"their values, not {_shown(outcome.known)}; without any it is {{}}."
        )
    for name, values in outcome.known.items():
        if not isinstance(name, str) or not name:
            raise InputError(f"{who}: a known score's name must be text, not {name!r}.")
        _check_shape(f"known score '{name}'", values, (count,), who)
    bad = {"scores are": np.isnan(outcome.scores).any(axis=1)}
    bad |= {f"known score '{name}' is": ~np.isfinite(values) for name, values in outcome.known.items()}
    for what, images in bad.items():
        if wrong := np.count_nonzero(images):
            raise InputError(f"{who}: its {what} not a finite number for {wrong} of {count} images{where}.")


def _check_shape(what, values, shape, who):
    numbers = what == "labels" or getattr(values, "dtype", np.dtype(object)).kind in "fiub"
    if np.shape(values) != shape or not isinstance(values, np.ndarray) or not numbers:
        kind = "names" if what == "labels" else "real numbers"
        raise InputError(
            f"{who}: the {what} that its evaluate gives for {shape[0]} images must be a numpy array of {kind} of shape "
            f"{shape}; it is {_shown(values)}."
        )


def check_restored(model, restored, images, who):
    """Raise InputError where a model that was loaded gives another result for some images than the one that was saved.

    restored: a function without arguments that loads it.
    """
    images, loaded, why = images[:FEW], None, None
    before = model.evaluate(images)
    try:
        loaded = restored()
        after = loaded.evaluate(images)
        if not _alike(before, after):
            why = "it says something else of the same images"
    except Exception as error:  # of any kind: it worked before it was saved
        why = f"it ends with {type(error).__name__}: {error}"
    if why:
        names = sorted(vars(model).keys() - vars(loaded).keys() - {"curve_", "checkpoints", "noise"}) if loaded else ()
        lost = f" (not loaded: {', '.join(names)})" if names else ""
        raise InputError(
            f"{who}: after it was saved and loaded, {why}. What fit learns must be arrays whose names end with an "
            f"underscore{lost}, or the model needs methods save and load of its own (docs/adding-a-model.md)."
        )


def _alike(one, other):
    """Tell whether two Outcomes are the same; not to the last bit, as arrays may have another order in memory."""
    return not (one.labels != other.labels).any() and _near(one, other, NEAR)


def _near(one, other, near):
    """Tell whether the scores of two Outcomes agree within a share of the largest.

    The largest of all scores: the distance to a copy of a training image, 0, is rounding alone.
    """
    numbers = ({"": outcome.scores, **outcome.known} for outcome in (one, other))
    mine, theirs = ({name: np.asarray(values, float) for name, values in named.items()} for named in numbers)
    every = np.concatenate([values.ravel() for values in mine.values()])
    limit = near * np.abs(every[np.isfinite(every)]).max(initial=0)
    return mine.keys() == theirs.keys() and all(np.allclose(mine[name], theirs[name], near, limit) for name in mine)


def _shown(value):
    """Describe a value in a few words."""
    if value is None:
        return "nothing"
    if isinstance(value, np.ndarray):
        return f"one of {value.dtype} of shape {value.shape}"
    return f"a {type(value).__name__}"
