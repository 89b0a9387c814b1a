"""Check on a few images, right after its training, that a fitted model has the interface of `classifier.py`.

So a faulty model of a user's own is refused there, with one message, and not by a later job that relies on it.
`who` is the model's name in that message, from `describe`. Each generator relies on a stop at its first problem.
"""

import inspect
from collections.abc import Mapping

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.kinds import MODELS, file_of
from isarflow.learning.classifier import OTHER, Outcome

FEW = 8  # images that a model is tried on
FIT = "images, labels, validation=None, snrs=None, views=None"
EVALUATE = {False: "images", True: "images, without=None"}  # by whether the model leaves some of its images out
NEAR, BATCHED = 1e-3, 1e-2  # of the largest score: two answers that differ by less are the same, also in another batch
UNSAVED = {"curve_", "checkpoints", "noise", "aspects"}  # what predictions do without
CURVE = ("epoch", "loss", "accuracy", "validation_loss", "validation_accuracy")  # what the report draws


def describe(model, run, kind):
    """A model as a message names it: its file, its own name and the run's."""
    return f"{file_of(MODELS, kind)}, model {model} of {run}"


def refuse(who, problems):
    """Raise InputError for the first of some problems with a model, if there is one."""
    for problem in problems:
        raise InputError(f"{who}: {problem}")


def of_face(model):
    """Yield problems of a model whose `fit` or `evaluate` does not take its arguments."""
    for name, arguments in (("fit", FIT), ("evaluate", EVALUATE[model.leaves_out])):
        try:
            inspect.signature(getattr(model, name)).bind(*arguments.split(", "))
        except TypeError as error:
            yield f"its {name} cannot be called ({error}); write {name}(self, {arguments})."


def of_fitted(model, labels, images):
    """Yield problems of a model with other classes than its labels, a wrong curve or a wrong Outcome.

    labels: those that it was trained with; images: some that it was not trained with.
    """
    classes = getattr(model, "classes_", None)
    if not isinstance(classes, np.ndarray) or classes.ndim != 1:
        wanted = "a numpy array of the classes' names, as np.unique(labels) gives it"
        yield f"after fit its classes_ must be {wanted}; it is {_shown(classes)}."
    trained, stated = set(np.unique(labels).tolist()), classes.tolist()
    if len(set(stated)) < len(stated) or not trained - {OTHER} <= set(stated) <= trained:
        wanted, there = (", ".join(map(str, names)) or "none" for names in (sorted(trained), stated))
        yield f"after fit its classes_ must be the classes it was trained with, {wanted}, each once; they are {there}."
    if model.curve_ is not None:
        shapes = {np.shape(values) for values in model.curve_.values()} if isinstance(model.curve_, Mapping) else set()
        if {len(shape) for shape in shapes} != {1} or len(shapes) > 1 or not set(CURVE) <= set(model.curve_):
            yield f"its curve_ must be a mapping with columns {', '.join(CURVE)}, each with a value an epoch."
    few = model.evaluate(images[:FEW])
    yield from of_outcome(few, min(FEW, len(images)), classes)
    if not _alike(few, model.evaluate(images[:FEW])):
        rule = "All randomness must follow from self.seed, anew in each call."
        yield f"asked twice about the same images, its evaluate gives two answers. {rule}"
    alone = model.evaluate(images[:1])
    yield from of_outcome(alone, 1, classes)
    # Images come target by target: a model that looks at an image's neighbours could read the answer from them.
    first = Outcome(few.labels[:1], few.scores[:1], {name: values[:1] for name, values in few.known.items()})
    if not _near(first, alone, BATCHED):
        yield "its evaluate says something else of an image alone than among others. It must judge each by itself."


def of_outcome(outcome, count, classes, where=""):
    """Yield problems of a result that is no Outcome of `count` images. where: words after the number."""
    if not isinstance(outcome, Outcome):
        yield f"its evaluate must return an Outcome(labels, scores, known), not {_shown(outcome)}."
    yield from _of_shape("labels", outcome.labels, (count,))
    yield from _of_shape("scores", outcome.scores, (count, len(classes)))
    for label in sorted({str(label) for label in outcome.labels} - set(classes.tolist())):
        yield f"its evaluate gives the label '{label}', and its classes_ are {', '.join(classes.tolist())}."
    if not isinstance(outcome.known, Mapping):
        wanted = "a mapping of the known scores' names to their values, {} without any"
        yield f"known of the Outcome that its evaluate returns must be {wanted}, not {_shown(outcome.known)}."
    bad = {"scores are": np.isnan(outcome.scores).any(axis=1)}
    for name, values in outcome.known.items():
        if not isinstance(name, str) or not name:
            yield f"a known score's name must be text, not {name!r}."
        yield from _of_shape(f"known score '{name}'", values, (count,))
        bad[f"known score '{name}' is"] = ~np.isfinite(values)
    for what, images in bad.items():
        if wrong := np.count_nonzero(images):
            yield f"its {what} not a finite number for {wrong} of {count} images{where}."


def _of_shape(what, values, shape):
    kind = "names" if what == "labels" else "real numbers"
    numbers = what == "labels" or getattr(values, "dtype", np.dtype(object)).kind in "fiub"
    if np.shape(values) != shape or not isinstance(values, np.ndarray) or not numbers:
        wanted = f"must be a numpy array of {kind} of shape {shape}; it is {_shown(values)}"
        yield f"the {what} that its evaluate gives for {shape[0]} images {wanted}."


def of_restored(model, restored, images):
    """Yield the problem of a model that, when it was loaded, gives another result for some images than when saved.

    restored: a function without arguments that loads it.
    """
    images, loaded, why = images[:FEW], None, None
    before = model.evaluate(images)
    try:
        loaded = restored()
        if not _alike(before, loaded.evaluate(images)):
            why = "it says something else of the same images"
    except Exception as error:  # of any kind: it worked before it was saved
        why = f"it ends with {type(error).__name__}: {error}"
    if why:
        names = sorted(vars(model).keys() - vars(loaded).keys() - UNSAVED) if loaded else ()
        lost = f" (not loaded: {', '.join(names)})" if names else ""
        yield (
            f"after it was saved and loaded, {why}. What fit learns must be arrays whose names end with an "
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
