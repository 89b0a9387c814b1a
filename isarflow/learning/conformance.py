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
UNSAVED = {"curve_", "checkpoints", "noise", "aspects", "moves", "beside", "_search"}  # what predictions do without
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
    classes, trained = getattr(model, "classes_", None), np.unique(labels)
    is_array = isinstance(classes, np.ndarray) and classes.ndim == 1
    stated = classes.tolist() if is_array else []
    if sorted(map(str, stated)) not in (trained.tolist(), trained[trained != OTHER].tolist()) or not stated:
        wanted = f"a numpy array of the classes it was trained with, {', '.join(trained)}, each once"
        there = f"they are {', '.join(map(str, stated))}" if is_array else f"it is {_shown(classes)}"
        yield f"after fit its classes_ must be {wanted}, as np.unique(labels) gives it; {there}."
    if model.curve_ is not None:
        shapes = {np.shape(values) for values in model.curve_.values()} if isinstance(model.curve_, Mapping) else set()
        if [len(shape) for shape in shapes] != [1] or not set(CURVE) <= set(model.curve_):
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
    known = outcome.known
    if not isinstance(known, Mapping):
        yield f"known of the Outcome that its evaluate gives must be a mapping, {{}} without any, not {_shown(known)}."
    for name in known:
        if not isinstance(name, str) or not name:
            yield f"a known score's name must be text, not {name!r}."
    parts = {"labels": outcome.labels, "scores": outcome.scores}
    for what, values in (parts | {f"known score '{name}'": values for name, values in known.items()}).items():
        shape = (count, len(classes)) if what == "scores" else (count,)
        kind, dtypes = ("names", "OSTU") if what == "labels" else ("real numbers", "fiub")
        if not isinstance(values, np.ndarray) or values.shape != shape or values.dtype.kind not in dtypes:
            wanted = f"must be a numpy array of {kind} of shape {shape}; it is {_shown(values)}"
            yield f"the {what} that its evaluate gives for {count} images {wanted}."
        if what == "labels":
            continue
        wrong = np.isnan(values).any(axis=1) if what == "scores" else ~np.isfinite(values)
        if wrong.any():
            verb = "are" if what == "scores" else "is"
            yield f"its {what} {verb} not a finite number for {wrong.sum()} of {count} images{where}."
    for label in sorted({str(label) for label in outcome.labels} - set(classes.tolist())):
        yield f"its evaluate gives the label '{label}', and its classes_ are {', '.join(classes.tolist())}."


def of_restored(model, fresh, folder, images):
    """Yield the problem of a model that gives another result for some images when `fresh` loads it from a folder."""
    images, loaded, why = images[:FEW], model, None
    before = model.evaluate(images)
    try:
        loaded = fresh.load(folder)
        if not _alike(before, loaded.evaluate(images)):
            why = "it says something else of the same images"
    except Exception as error:  # of any kind: it worked before it was saved
        why = f"it ends with {type(error).__name__}: {error}"
    if why:
        names = sorted(vars(model).keys() - vars(loaded).keys() - UNSAVED)
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
    mine, theirs = (np.column_stack([of.scores, *of.known.values()]).astype(float) for of in (one, other))
    limit = near * np.abs(mine[np.isfinite(mine)]).max(initial=0)
    return one.known.keys() == other.known.keys() and np.allclose(mine, theirs, near, limit)


def _shown(value):
    """Describe a value in a few words."""
    if isinstance(value, np.ndarray):
        return f"one of {value.dtype} of shape {value.shape}"
    return "nothing" if value is None else f"a {type(value).__name__}"
