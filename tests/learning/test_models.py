import numpy as np
import pytest
from scipy.special import softmax
from sklearn.linear_model import LogisticRegression
from sklearn.multiclass import OneVsRestClassifier
from sklearn.neighbors import KNeighborsClassifier
from sklearn.svm import SVC

from learning.features import real_imaginary, squared_distances
from learning.train import build

SETTINGS = {"lr": {"penalty": 0.02}, "svm": {"C": 3.0, "scale": 2.75}, "knn": {"k": 1}}


def clouds(classes, count=60, seed=0):
    """Overlapping classes of complex images, rows shuffled: (images, labels)."""
    random = np.random.default_rng(seed)
    labels = random.permutation(np.repeat([f"class{index}" for index in range(classes)], count))
    images = random.standard_normal((len(labels), 4, 3)) + 1j * random.standard_normal((len(labels), 4, 3))
    for index in range(classes):
        images[labels == f"class{index}", index, 0] += 1.5 - 0.5j
    return images.astype(np.complex64), labels


def fitted(name, images, labels, **settings):
    return build(name, SETTINGS[name] | settings, seed=3).fit(images, labels)


def test_features_are_real_then_imaginary_parts():
    images = np.arange(6).reshape(1, 2, 3) * (1 - 2j)
    assert real_imaginary(images).tolist() == [[0, 1, 2, 3, 4, 5, 0, -2, -4, -6, -8, -10]]


def test_squared_distances_are_those_of_the_differences():
    x, y = np.random.default_rng(0).standard_normal((2, 7, 5))
    expected = ((x[:, None] - y[None]) ** 2).sum(axis=-1)
    np.testing.assert_allclose(squared_distances(x, y, (y**2).sum(axis=1)), expected, atol=1e-12)
    assert (squared_distances(x, x, (x**2).sum(axis=1)) >= 0).all()


@pytest.mark.parametrize("classes", [2, 3])
@pytest.mark.parametrize("k", [1, 3, 5, 10**6])
def test_knn_equals_scikit_learn(classes, k):
    images, labels = clouds(classes)
    tests, _ = clouds(classes, seed=1)
    neighbours = KNeighborsClassifier(min(k, len(images))).fit(real_imaginary(images), labels)
    model = fitted("knn", images, labels, k=k)
    assert (model.predict(tests) == neighbours.predict(real_imaginary(tests))).all()


def test_knn_scores_are_minus_the_distance_to_each_class():
    images, labels = clouds(3)
    tests, _ = clouds(3, seed=1)
    scores = fitted("knn", images, labels, k=5).decision_function(tests)
    for index, name in enumerate(["class0", "class1", "class2"]):
        one = KNeighborsClassifier(1).fit(real_imaginary(images[labels == name]), labels[labels == name])
        distance, _ = one.kneighbors(real_imaginary(tests))
        np.testing.assert_allclose(scores[:, index], -distance[:, 0], rtol=1e-5)


@pytest.mark.parametrize("classes", [2, 3])
def test_lr_gives_scikit_learns_probabilities(classes):
    images, labels = clouds(classes)
    tests, _ = clouds(classes, seed=1)
    model = fitted("lr", images, labels)
    other = LogisticRegression(C=0.02, tol=1e-8, max_iter=10_000).fit(real_imaginary(images, float), labels)
    expected = other.predict_proba(real_imaginary(tests, float))
    np.testing.assert_allclose(softmax(model.decision_function(tests), axis=1), expected, atol=1e-4)


@pytest.mark.parametrize("classes", [2, 3])
def test_svm_equals_scikit_learn(classes):
    images, labels = clouds(classes)
    tests, _ = clouds(classes, seed=1)
    model = fitted("svm", images, labels)
    machine = SVC(C=3.0, gamma=1 / 2.75**2)
    x, y = real_imaginary(images, float), real_imaginary(tests, float)
    if classes == 2:
        expected = machine.fit(x, labels).decision_function(y)
        expected = np.stack([-expected, expected], axis=1)
    else:
        expected = OneVsRestClassifier(machine).fit(x, labels).decision_function(y)
    np.testing.assert_allclose(model.decision_function(tests), expected, atol=1e-9)


def test_svm_keeps_its_support_vectors_only():
    images, labels = clouds(2)
    images[labels == "class1"] += 5  # far apart: few images carry the surface
    model = fitted("svm", images, labels, scale=30.0)
    machine = SVC(C=3.0, gamma=1 / 30**2).fit(real_imaginary(images, float), labels)
    assert len(model.vectors_) == len(machine.support_) < len(images)


@pytest.mark.parametrize("name", SETTINGS)
def test_classes_are_sorted_and_do_not_depend_on_the_order_of_rows(name):
    images, labels = clouds(3)
    tests, _ = clouds(3, seed=1)
    model, reverse = fitted(name, images, labels), fitted(name, images[::-1], labels[::-1])
    assert model.classes_.tolist() == reverse.classes_.tolist() == ["class0", "class1", "class2"]
    assert (model.predict(tests) == reverse.predict(tests)).mean() > 0.99


@pytest.mark.parametrize("name", SETTINGS)
def test_a_loaded_model_is_the_saved_one(name, tmp_path):
    images, labels = clouds(3)
    model = fitted(name, images, labels)
    bytes_written = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        model.save(folder)
        bytes_written.append((folder / "model.npz").read_bytes())
    assert bytes_written[0] == bytes_written[1]
    loaded = build(name, SETTINGS[name], seed=3).load(tmp_path / "a")
    assert loaded.classes_.tolist() == model.classes_.tolist()
    np.testing.assert_array_equal(loaded.decision_function(images), model.decision_function(images))
    assert (loaded.predict(images) == model.predict(images)).all()


@pytest.mark.parametrize("name", SETTINGS)
def test_one_image_is_classified_as_in_a_batch(name):
    images, labels = clouds(2)
    model = fitted(name, images, labels)
    tests, _ = clouds(2, seed=1)
    single = np.concatenate([model.decision_function(tests[index : index + 1]) for index in range(len(tests))])
    np.testing.assert_allclose(single, model.decision_function(tests), rtol=1e-5, atol=1e-9)
