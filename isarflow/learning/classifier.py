"""The interface of every model, `fit`, `evaluate`, `predict`, `save` and `load`, and a fitted model's folder."""

import contextlib
import itertools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.kinds import MODELS, file_of, file_of_object, load_class
from isarflow.learning.data.features import of
from isarflow.learning.data.moves import Moves, moves_of

CONFIG, SPLIT, STATE = "config.json", "split.json", "model.npz"  # in a fitted model's folder, models/<run>/<model>
NOT_HYPER = ("kind", "other")  # settings of a model that are not its own hyper-parameters
OTHER = "other"  # the label of images of none of the known classes
PLUS = " + "  # between names in the setting `of` of a model that combines others
ANY_SNR = "any"  # in place of the SNR, for images that go with every SNR


class Outcome(NamedTuple):
    """A model's result for n images.

    An image whose confidence score is below a threshold is rejected. In tables their columns are called known_<name>,
    and those of what a model found of a target's place and motion found_<name>.
    """

    labels: np.ndarray  # (n,), names of classes
    scores: np.ndarray  # (n, classes), one column per class also for two classes: larger = likelier
    known: dict[str, np.ndarray]  # confidence scores by name, each (n,), larger = more like the known classes
    found: Mapping[str, np.ndarray] = {}  # place and drift by name, each (n,), m and wavelengths


def best_known(scores: np.ndarray, classes: np.ndarray) -> np.ndarray:
    """The known class of the largest score, (n,), of scores (n, classes): that of a model whose confidence has OTHER's.

    Whether an image is of none of them follows from the threshold of the confidence score alone.
    """
    known = classes != OTHER
    best: np.ndarray = classes[known][scores[:, known].argmax(axis=1)]
    return best


class Classifier:
    """A classifier of complex images (observations, range, crossrange), complex64.

    Where a run sees several polarizations, images are (observations, channel, range, crossrange); `features` makes
    rows of both, `features.by_channel` the form with channels.

    A model is a class `Model` in a file of its own, models/<name>.py; it defines `fit` and `evaluate`.
    What `fit` learns are arrays whose names end with an underscore: those are saved and loaded.

    settings: the model's hyper-parameters, `learning.models.<name>` in the config.
    seed: an integer; all randomness of `fit` follows from it.
    A model that keeps training images may state that it `leaves_out`: `fit` then finds each image's aspect in `aspects`
    and keeps those of its templates as `aspects_`, and `evaluate(images, without)` judges each image without the
    templates of the aspect that `without` (n,) names. Thresholds that keep a share of the known images then follow from
    the training views (see `thresholds`).
    """

    classes_: np.ndarray  # names of the classes, sorted; OTHER is one of them if such a class was trained
    curve_: Mapping[str, list] | None = None  # the training curve, a mapping of column name to values
    by_snr = False  # True if `fit` keeps SNRs apart: it draws each batch at one SNR, or learns each separately
    smallest = 1  # pixels a side that an image must have at least
    covariances = False  # True if `fit` keeps a matrix of pixels by pixels for each SNR: memory and pixels are limited
    pairs = False  # True if `fit` keeps a matrix of images by images, which counts in the memory that is planned
    fewest: str | None = None  # the name of the setting that is the least number of images that `fit` must learn from
    additive = False  # True if all scores are logarithms of likelihoods or of their ratios: those of looks add up
    learns_noise = False  # True if `fit` finds images of noise alone, (m, ...), in `noise`
    noise: np.ndarray | None = None
    leaves_out = False
    aspects: np.ndarray | None = None  # of training images, (observations,) as text
    aspects_: np.ndarray
    searches = False  # True if `evaluate` finds the place of a target that moved; else its training images move, too
    moves: Moves | None = None  # what may have happened to the images of the run; None on a turntable
    combines = False  # True if `fit` finds fitted models of the same run in `beside`, those of the setting `of`
    beside: Path | None = None  # the folder of the run's models
    checkpoints: Path | None = None  # a folder in which `fit` may keep its state, to go on if the job was killed
    FEATURES = "parts"  # the kind of `features.of` where the setting `features` names no other

    def __init__(self, settings: Mapping[str, Any], seed: int) -> None:
        self.settings, self.seed = settings, seed

    def fit(
        self,
        images: np.ndarray,
        labels: np.ndarray,
        validation: tuple | None = None,
        snrs: np.ndarray | None = None,
        views: np.ndarray | None = None,
    ) -> Self:
        """Learn from images and their class names; return the model.

        validation: None, or images, labels, snrs and views of the validation azimuths, for the training curve and for
        stopping. snrs: None, or the SNR's name of each image, to be kept apart: 'clean', 'snr_6dB', or ANY_SNR.
        views: None, or numbers (observations,), the same for all images of one target from one direction.
        """
        raise NotImplementedError

    def evaluate(self, images: np.ndarray) -> Outcome:
        """The Outcome of images, each judged separately: the other images do not change its result."""
        raise NotImplementedError

    @property
    def is_searched(self) -> bool:
        """Tell whether `evaluate` looks for the place of targets, which move."""
        return self.searches and self.moves is not None and self.settings.get("place", "search") == "search"

    def _aspects(self, order: np.ndarray) -> np.ndarray:
        """The aspects of the training images `order`; '' where `fit` was given none."""
        return np.full(len(order), "") if self.aspects is None else self.aspects[order]

    def _masked(self, likeness: np.ndarray, without: np.ndarray | None, least: float) -> np.ndarray:
        """Likeness to templates, (n, templates), set to `least` where an image is judged without a template."""
        if without is not None:
            likeness[np.asarray(without)[:, None] == self.aspects_] = least
        return likeness

    @property
    def sees(self) -> str:
        """The kind of features that the model sees of images."""
        return self.settings.get("features", self.FEATURES)

    def features(self, images: np.ndarray, dtype: type = np.float32) -> np.ndarray:
        """Features (observations, d) of images, which the model sees."""
        return of(images, self.sees, dtype)

    def predict(self, images: np.ndarray) -> np.ndarray:
        """Predicted labels, shape (observations,)."""
        return self.evaluate(images).labels

    def save(self, folder: Path) -> None:
        """Write what was learned to `folder`: plain arrays, no pickle, the same bytes for the same model.

        Raises InputError, before anything is written, for an attribute that is no array and cannot be made one.
        """
        names = sorted(name for name in vars(self) if name.endswith("_") and name != "curve_")
        arrays: dict[str, Any] = {name: self._array(name) for name in names}
        np.savez(folder / STATE, **arrays)

    def _keep(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Make arrays, a mapping of name to array, attributes that are saved: <name>_."""
        for name, array in arrays.items():
            setattr(self, f"{name}_", array)

    def _array(self, name: str) -> np.ndarray:
        value = getattr(self, name)
        with contextlib.suppress(TypeError, ValueError):  # lists of several lengths, objects that become no array
            array = np.asarray(value)
            if not array.dtype.hasobject:
                return array
        file = file_of_object(self)
        raise InputError(
            f"{file}: '{name}' is a {type(value).__name__}; what a model keeps under names that end with an underscore "
            "must be plain arrays of numbers or text. Keep the arrays that it is made of, or give it another name and "
            "write methods save and load of the model's own (docs/adding-a-model.md)."
        )

    def load(self, folder: Path) -> Self:
        """Read what `save` wrote; return the model."""
        with np.load(folder / STATE, allow_pickle=False) as state:
            for name in state.files:
                setattr(self, name, state[name])
        return self


def build_classifier(kind: str, settings: Mapping[str, Any], seed: int) -> Classifier:
    """An unfitted model: class `Model` of models/<kind>.py.

    Raises InputError as of `load_class`, and when the model asks for a setting that is not there.
    """
    model: Classifier = load_class(MODELS, kind, Classifier)(_Settings(kind, settings), seed)
    return model


def config_of(folder: str | Path) -> dict[str, Any]:
    """What a fitted model's folder says of it: run (as of `experiments.runs`), model (its name), kind, settings ..."""
    return json.loads((Path(folder) / CONFIG).read_text())


def load_classifier(folder: str | Path) -> Classifier:
    """The fitted model of a folder."""
    config = config_of(folder)
    model = build_classifier(config["kind"], config["settings"], config["seed"])
    model.moves = moves_of(config["run"])
    return model.load(Path(folder))


class _Settings(dict):
    """The settings of a model; one that is missing is named."""

    def __init__(self, kind: str, settings: Mapping[str, Any]) -> None:
        super().__init__(settings)
        self.kind = kind

    def __missing__(self, key: str) -> Any:
        said = f"{file_of(MODELS, self.kind)} asks for the setting '{key}', which the model does not have"
        raise InputError(f"{said}; add it to the model's entry in 'learning.models' of the config.")


def choices(settings: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All combinations of the settings that are lists: a list of mappings without any list."""
    hyper = {key: value for key, value in sorted(settings.items()) if key not in NOT_HYPER}
    values = [value if isinstance(value, list) else [value] for value in hyper.values()]
    return [dict(zip(hyper, combination, strict=True)) for combination in itertools.product(*values)]
