"""The interface of every model: `fit`, `evaluate`, `predict`, `decision_function`, `save` and `load`."""

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.kinds import MODELS, file_of, load_class
from isarflow.learning.features import of

STATE = "model.npz"
NOT_HYPER = ("kind", "other")  # settings of a model that are not its own hyper-parameters
OTHER = "other"  # the label of images of none of the known classes
ANY_SNR = "any"  # in place of the SNR, for images that go with every SNR


class Outcome(NamedTuple):
    """A model's result for n images.

    labels: (n,), names of classes. scores: (n, classes), larger = likelier.
    known: confidence scores, a mapping of name to (n,): larger = more like the known classes; an image whose score is
    below a threshold is rejected. In tables their columns are called known_<name>.
    """

    labels: np.ndarray
    scores: np.ndarray
    known: dict[str, np.ndarray]


class Classifier:
    """A classifier of complex images (observations, range, crossrange), complex64.

    Where a run sees several polarizations, images are (observations, channel, range, crossrange); `features` makes
    rows of both, `features.by_channel` the form with channels.

    A model is a class `Model` in a file of its own, models/<name>.py; it defines `fit` and `evaluate`.
    What `fit` learns are arrays whose names end with an underscore: those are saved and loaded.

    settings: the model's hyper-parameters, `learning.models.<name>` in the config.
    seed: an integer; all randomness of `fit` follows from it.
    classes_: names of the classes, sorted, shape (classes,); OTHER is one of them if such a class was trained.
    curve_: None, or a mapping of column name to values: the training curve.
    by_snr: True if `fit` keeps images of several SNRs apart: it draws each batch at one SNR, or learns each separately.
    smallest: pixels a side that an image must have at least.
    covariances: True if `fit` keeps a matrix of pixels by pixels for each SNR: it counts in the memory that is planned,
    and images of more pixels than check.MOST_PIXELS are refused.
    pairs: True if `fit` keeps a matrix of images by images: it counts in the memory that is planned.
    fewest: None, or the name of the setting that is the least number of images that `fit` must learn from.
    additive: True if scores and confidence scores are logarithms of likelihoods or of their ratios, so that those of
    several looks can be added: scores.csv then has the results of several looks, too.
    learns_noise: True if `fit` finds images of noise alone, (m, ...), in the attribute `noise`.
    leaves_out: True if the model keeps training images and can leave some of them out: `fit` finds the aspect of each
    image, (observations,) as text, in the attribute `aspects` and keeps those of its templates as `aspects_`, and
    `evaluate(images, without)` judges each image without the templates of the aspect that `without` (n,) names.
    Thresholds that keep a share of the known images then follow from the training views (see `thresholds`).
    FEATURES: the kind of `features.of` where the setting `features` names no other.
    checkpoints: None, or a folder in which `fit` may keep its state, to go on from it if the job was killed.
    """

    classes_: np.ndarray
    aspects_: np.ndarray
    curve_: Mapping[str, list] | None = None
    by_snr = False
    smallest = 1
    covariances = False
    pairs = False
    fewest: str | None = None
    additive = False
    learns_noise = False
    noise: np.ndarray | None = None
    leaves_out = False
    aspects: np.ndarray | None = None
    checkpoints: Path | None = None
    FEATURES = "parts"

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
        stopping. snrs: None, or the SNR's name of each image, shape (observations,), to be kept apart: 'clean',
        'snr_6dB', or ANY_SNR.
        views: None, or numbers (observations,), the same for all images of one target from one direction.
        """
        raise NotImplementedError

    def evaluate(self, images: np.ndarray) -> Outcome:
        """The Outcome of images, in one pass over them.

        Each image is judged separately: the other images do not change its result.
        """
        raise NotImplementedError

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

    def decision_function(self, images: np.ndarray) -> np.ndarray:
        """Scores, shape (observations, classes), one column per class also for two classes: larger = likelier."""
        return self.evaluate(images).scores

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
        try:
            array = np.asarray(value)
        except (TypeError, ValueError):  # lists of several lengths, or objects that cannot become an array
            array = np.asarray(None)
        if array.dtype.hasobject:
            file = file_of(MODELS, type(self).__module__.rpartition(".")[2])
            raise InputError(
                f"{file}: '{name}' is a {type(value).__name__}, and what a model keeps in attributes whose names end "
                "with an underscore must be plain arrays of numbers or text. Keep the arrays that it is made of, or "
                "give it another name and write methods save and load of the model's own (docs/adding-a-model.md)."
            )
        return array

    def load(self, folder: Path) -> Self:
        """Read what `save` wrote; return the model."""
        with np.load(folder / STATE, allow_pickle=False) as state:
            for name in state.files:
                setattr(self, name, state[name])
        return self


def build(kind: str, settings: Mapping[str, Any], seed: int) -> Classifier:
    """An unfitted model: class `Model` of models/<kind>.py.

    Raises InputError where the file imports what is not installed, where its Model is no Classifier, and when the model
    asks for a setting that is not there.
    """
    model: Classifier = load_class(MODELS, kind, Classifier)(_Settings(kind, settings), seed)
    return model


class _Settings(dict):
    """The settings of a model of some kind; one that is missing is named."""

    def __init__(self, kind: str, settings: Mapping[str, Any]) -> None:
        super().__init__(settings)
        self.kind = kind

    def __missing__(self, key: str) -> Any:
        raise InputError(
            f"{file_of(MODELS, self.kind)} asks for the setting '{key}', which the model does not have; add it to the "
            "model's entry in 'learning.models' of the config."
        )


def choices(settings: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All combinations of the settings that are lists: a list of mappings without any list."""
    hyper = {key: value for key, value in sorted(settings.items()) if key not in NOT_HYPER}
    values = [value if isinstance(value, list) else [value] for value in hyper.values()]
    return [dict(zip(hyper, combination, strict=True)) for combination in itertools.product(*values)]
