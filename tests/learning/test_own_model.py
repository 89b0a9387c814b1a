"""Models of a user's own that are not what classifier.py asks for: one message at the training, and no traceback."""

import re
import shutil
import sys
import types

import numpy as np
import pandas as pd
import pytest
from scenes import ROLES, digest, fitted, tables_of

from isarflow.core.errors import InputError
from isarflow.learning.classifier import load_classifier
from isarflow.setup.config import ROOT

PLAIN = """

import numpy as np

from isarflow.learning.classifier import Classifier, Outcome


class Model(Classifier):
    def fit(self, images, labels, validation=None, snrs=None, views=None):
        self.classes_ = np.unique(labels)
        self.means_ = np.stack([np.abs(images[labels == name]).mean(axis=0) for name in self.classes_])
        return self

    def evaluate(self, images):
        scores = -np.stack([((np.abs(images) - mean) ** 2).sum(axis=(1, 2)) for mean in self.means_], axis=1)
        return Outcome(self.classes_[scores.argmax(axis=1)], scores, {"likeness": scores.max(axis=1)})
"""
LEARNED = "        return self\n"
MEANS = "self.means_"
GIVEN = 'Outcome(self.classes_[scores.argmax(axis=1)], scores, {"likeness": scores.max(axis=1)})'
KNOWN = '{"likeness": scores.max(axis=1)}'
AFTER = PLAIN[PLAIN.index(LEARNED) :]
LABELS = "self.classes_[scores.argmax(axis=1)]"


@pytest.fixture
def own(monkeypatch, stores, tmp_path):
    """A function that trains the model of a text, as models/mine.py, and gives its folder."""

    def trained(code, settings=None, **more):
        module = types.ModuleType("isarflow.learning.models.mine")
        monkeypatch.setitem(sys.modules, module.__name__, module)
        exec(compile(code, "mine.py", "exec"), module.__dict__)
        settings = settings or {"kind": "mine", "power": 1}
        return fitted(stores("clean"), tmp_path / "mine", "mine", settings=settings, **more)

    return trained


def test_a_plain_model_is_taken(own, stores, tmp_path):
    table = tables_of(stores("snr_30dB", sorted(ROLES)), own(PLAIN), tmp_path, is_open=True)["snr_30dB"]
    assert "known_likeness" in table


# What is written instead of a part of the model above, and what the message says.
WRONG = {
    "a library's object": (
        LEARNED,
        "        self.machine_ = object()\n" + LEARNED,
        "'machine_' is a object.*plain arr",
    ),
    "a list of several lengths": (LEARNED, "        self.odd_ = [[1], [2, 3]]\n" + LEARNED, "'odd_' is a list"),
    "a mapping": (LEARNED, "        self.table_ = {'a': 1}\n" + LEARNED, "'table_' is a dict.*methods save and load"),
    "nothing": (LEARNED, "        self.none_ = None\n" + LEARNED, "'none_' is a NoneType"),
    "an attribute that is not saved": (
        MEANS,
        "self.means",
        "model mine of multi: after it was saved and loaded.*means",
    ),
    "another answer each time": (
        "scores = -np",
        'self.asked = getattr(self, "asked", 0) + 100\n        scores = self.asked - np',
        "mine of multi: asked twice .* gives two answers.* self.seed",
    ),
    "a confidence score that is another each time": (KNOWN, '{"likeness": np.random.rand(len(images))}', "two answers"),
    "a confidence score of what is not saved": (
        AFTER,
        "        self.lost = 3\n" + AFTER.replace(KNOWN, '{"likeness": scores.max(axis=1) + getattr(self, "lost", 0)}'),
        r"saved and loaded, it says something else of the same images.*\(not loaded: lost\)",
    ),
    "an answer that is the others' of its batch": (
        "        return Outcome",
        "        scores = scores - scores.mean(axis=0)\n        return Outcome",
        "something else of an image alone than among others",
    ),
    "an evaluate of no argument": ("def evaluate(self, images)", "def evaluate(self)", "its evaluate cannot be called"),
    "no images that are left out": (
        "    def fit",
        "    leaves_out = True\n\n    def fit",
        r"evaluate\(self, images, without=None\)",
    ),
    "a setting that is not there": (LEARNED, "        self.settings['depth']\n" + LEARNED, "the setting 'depth'"),
    "a fit of two arguments": (", validation=None, snrs=None, views=None", "", "fit cannot be called"),
    "no classes": (LEARNED, "        self.classes_ = None\n" + LEARNED, "classes_ must be a numpy array.*nothing"),
    "classes as a list": ("np.unique(labels)", "np.unique(labels).tolist()", "classes_ must be a numpy array.*a list"),
    "numbers of classes": (
        LEARNED,
        "        self.classes_ = np.arange(2)\n" + LEARNED,
        "classes it was trained with, dart, disc.*0, 1",
    ),
    "a class too many": (
        LEARNED,
        "        self.classes_ = np.array(['dart', 'disc', 'ufo'])\n" + LEARNED,
        "they are dart, disc, ufo",
    ),
    "labels alone": (f"return {GIVEN}", f"return {LABELS}", "must return an Outcome.*of shape"),
    "labels of another name": (
        LABELS,
        "np.full(len(scores), 'ufo')",
        "the label 'ufo', and its classes_ are dart, disc",
    ),
    "too few labels": (LABELS, LABELS + "[:1]", r"the labels .* 8 images .* of shape \(8,\); .* of shape \(1,\)"),
    "scores of one class": (f"{LABELS}, scores,", f"{LABELS}, scores.max(axis=1),", r"scores .*\(8, 2\); .*\(8,\)"),
    "complex scores": (f"{LABELS}, scores,", f"{LABELS}, scores + 0j,", "scores .*real numbers.*complex64"),
    "scores that are no numbers": (
        f"{LABELS}, scores,",
        f"{LABELS}, scores * np.nan,",
        "scores are not a finite number",
    ),
    "known scores without a name": (KNOWN, "scores.max(axis=1)", "known of the Outcome .* a mapping"),
    "a known score a class": (KNOWN, '{"likeness": scores}', r"known score 'likeness' .* of shape \(8,\)"),
    "a known score that is no number": (KNOWN, '{"likeness": scores[:, 0] * np.inf}', "'likeness' is not a finite"),
    "a known score with a number for a name": (KNOWN, "{3: scores[:, 0]}", "name must be text, not 3"),
    "a curve without its columns": (LEARNED, "        self.curve_ = {'loss': [1]}\n" + LEARNED, "curve_ .*epoch, loss"),
    "no Classifier": ("(Classifier)", "", "must be one of isarflow.learning.classifier.Classifier"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_a_model_lacks_is_said_at_its_training(own, case, tmp_path):
    old, new, said = WRONG[case]
    assert old in PLAIN
    with pytest.raises(InputError, match=said) as error:
        own(PLAIN.replace(old, new))
    assert "models/mine.py" in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "mine" / "config.json").exists()


def test_nothing_is_written_of_a_model_that_cannot_be_saved(own, tmp_path):
    with pytest.raises(InputError):
        own(PLAIN.replace(LEARNED, "        self.machine_ = object()\n" + LEARNED))
    assert not list((tmp_path / "mine").glob("*"))


def test_what_is_not_installed_is_named(stores, tmp_path, monkeypatch):
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "torchy.py").write_text("import no_such_library\n")

    import isarflow.learning.models

    monkeypatch.setattr(isarflow.learning.models, "__path__", [str(folder)])
    with pytest.raises(InputError, match=r"models/torchy.py cannot be imported: No module named 'no_such_library'"):
        fitted(stores("clean"), tmp_path / "torchy", "torchy", settings={"depth": 1})


def test_an_open_run_needs_a_known_score(own, stores, tmp_path):
    folder = own(PLAIN.replace(KNOWN, "{}"))
    some = stores("snr_30dB", sorted(ROLES))
    assert len(tables_of(some, folder, tmp_path))  # a closed run does without
    with pytest.raises(InputError, match=r"gives no known score.*'multi'"):
        tables_of(some, folder, tmp_path, is_open=True)


def test_scores_that_are_no_numbers_at_some_snr_alone_are_refused_there(own, stores, tmp_path):
    folder = own(
        PLAIN.replace(f"{LABELS}, scores,", f"{LABELS}, np.where(np.abs(images).mean() < 0.1, scores, np.nan),")
    )
    with pytest.raises(InputError, match=r"scores are not a finite number for \d+ of \d+ images of .*snr_0dB"):
        tables_of(stores("snr_0dB"), folder, tmp_path)


def test_a_model_whose_arrays_lie_in_another_order_when_loaded_is_taken(own):
    own(PLAIN.replace(LEARNED, "        self.means_ = np.repeat(self.means_, 2, axis=2)[:, :, ::2]\n" + LEARNED))


def example(word):
    """The example of docs/adding-a-model.md that holds a word."""
    page = (ROOT / "docs" / "adding-a-model.md").read_text()
    (code,) = re.findall(rf"```python\n([^`]*{word}[^`]*?)```", page, re.DOTALL)
    return code


def test_the_forest_of_the_docs_learns_and_is_kept(own, stores, tmp_path):
    code = example("RandomForest").replace('settings["trees"]', 'settings["power"] * 20')
    table = tables_of(stores("snr_30dB", sorted(ROLES)), own(code), tmp_path, is_open=True)["snr_30dB"]
    known = table[table["role"] == "known"]
    assert (known["truth"] == known["predicted"]).mean() > 0.9
    assert known["known_probability"].mean() > table.loc[table["role"] == "unknown", "known_probability"].mean()
    first = digest(tmp_path / "mine")
    assert set(first) >= {"estimator.joblib", "model.npz"}
    shutil.rmtree(tmp_path / "mine")
    assert digest(own(code)) == first  # the same config, the same bytes
    with pytest.raises(InputError, match=r"after it was saved and loaded.*not loaded: .*fitted"):
        own(code + "\n    def load(self, folder):\n        return self\n")


def test_a_forest_sees_the_features_that_it_is_told(own, stores, tmp_path):
    code = example("RandomForest").replace('settings["trees"]', 'settings["power"] * 20')
    plain, log = (digest(own(code, {"kind": "mine", "power": 1} | more)) for more in ({}, {"features": "log"}))
    same = digest(own(code, {"kind": "mine", "power": 1, "features": "magnitude"}))
    assert plain["estimator.joblib"] == same["estimator.joblib"] != log["estimator.joblib"]
    with pytest.raises(InputError, match="'features' is 'phase'"):
        own(code, {"kind": "mine", "power": 1, "features": "phase"})


def test_an_estimator_without_probabilities_gives_its_decision_function(own, stores, tmp_path):
    code = example("RandomForest").replace("sklearn.ensemble", "sklearn.linear_model")
    code = re.sub(r"RandomForestClassifier\(.*\)", "RidgeClassifier()", code).replace("RandomForest", "Ridge")
    table = tables_of(stores("snr_30dB"), own(code), tmp_path, is_open=True)["snr_30dB"]
    assert (table["truth"] == table["predicted"]).mean() > 0.9
    np.testing.assert_allclose(table["score_dart"], -table["score_disc"])
    np.testing.assert_allclose(table["known_max_logit"], table[["score_dart", "score_disc"]].max(axis=1))


def test_an_estimator_that_is_no_classifier_is_refused(own):
    code = example("RandomForest").replace("sklearn.ensemble", "sklearn.svm")
    code = re.sub(r"RandomForestClassifier\(.*\)", "OneClassSVM()", code).replace(
        "RandomForestClassifier", "OneClassSVM"
    )
    with pytest.raises(InputError, match=r"its estimator, OneClassSVM, is none of scikit-learn's classifiers"):
        own(code)


def test_what_goes_wrong_within_a_fit_names_the_model_and_its_settings(own):
    with pytest.raises(ZeroDivisionError) as error:
        own(PLAIN.replace(LEARNED, "        1 / 0\n" + LEARNED))
    assert re.search("fit of .*models/mine.py.*with the settings {", error.value.__notes__[0])


ADAPTERS = {"scikit_learn import ScikitLearn": "estimator", "pytorch import PyTorch": "network"}


@pytest.mark.parametrize("base", ADAPTERS)
def test_a_model_without_the_one_method_is_told_so(own, base):
    if "torch" in base:
        pytest.importorskip("torch", reason="PyTorch is not installed")
    with pytest.raises(InputError, match=f"isarflow.learning.models.mine: its Model lacks {ADAPTERS[base]}"):
        own(f"from isarflow.learning.{base}\n\n\nclass Model({base.split()[-1]}):\n    pass\n")


def test_the_pytorch_network_of_the_docs_learns_and_is_kept(own, stores, tmp_path):
    pytest.importorskip("torch", reason="PyTorch is not installed")
    settings = {"kind": "mine", "width": 8, "epochs": 12, "batch": 16, "learning_rate": 0.01, "patience": 4}
    folder = own(example("Conv2d"), settings=settings)
    table = tables_of(stores("snr_30dB", sorted(ROLES)), folder, tmp_path, is_open=True)["snr_30dB"]
    known = table[table["role"] == "known"]
    assert (known["truth"] == known["predicted"]).mean() > 0.9
    curve = pd.read_csv(folder / "curve.csv")
    assert curve["loss"].iloc[-1] < 0.5 * curve["loss"].iloc[0]
    assert len(curve) == min(
        12, curve["validation_loss"].idxmin() + 1 + 4
    )  # it ends after four epochs without a smaller
    model = load_classifier(folder)
    assert sorted(name for name in vars(model) if name.startswith("weights.")) == sorted(
        f"weights.{layer}.{what}_" for layer in (0, 4) for what in ("weight", "bias")
    )
    first = digest(folder)
    shutil.rmtree(folder)
    assert digest(own(example("Conv2d"), settings=settings)) == first  # the same config, the same bytes


def test_a_last_batch_of_one_image_is_left_out(own):
    pytest.importorskip("torch", reason="PyTorch is not installed")
    code = example("Conv2d").replace("nn.Flatten(),", "nn.Flatten(), nn.BatchNorm1d(16 * width),")
    assert "BatchNorm1d" in code
    for batch in (2, 3, 4, 5, 7):  # one of them leaves one over
        own(code, settings={"kind": "mine", "width": 4, "epochs": 1, "batch": batch, "learning_rate": 0.01})


def test_integers_and_text_are_kept_too(own):
    own(PLAIN.replace(LEARNED, "        self.count_, self.word_ = 3, 'three'\n" + LEARNED))
