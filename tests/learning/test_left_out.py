"""Libraries judge training views without themselves, and the threshold that keeps a share follows from these."""

import copy

import numpy as np
import pandas as pd
import pytest
from scenes import ALL_TARGETS, ROLES, aspects, fitted, sides_of, tables_of

from isarflow.learning.classifier import build_classifier
from isarflow.learning.data import images
from isarflow.learning.data.images import aspects as names_of
from isarflow.learning.data.split import LEFT_OUT
from isarflow.learning.evaluation import thresholds

KINDS = {
    "knn": {"k": 1},
    "matched_filter": {},
    "likelihood": {"candidates": 3, "mismatch": 0.03},
}
OF_TEMPLATES = ("templates_", "references_", "aspects_", "squared_norms_")


def library(count=40):
    """Images of two classes, their labels, and an aspect for every four of them."""
    random = np.random.default_rng(0)
    images = random.standard_normal((2 * count, 4, 4)) + 1j * random.standard_normal((2 * count, 4, 4))
    labels = np.repeat(["a", "b"], count)
    return images.astype(np.complex64), labels, np.array([f"{label} {n // 4}" for n, label in enumerate(labels)])


def learned(name, images, labels, aspects, **settings):
    model = build_classifier(name, KINDS[name] | settings, 0)
    model.aspects = aspects
    random = np.random.default_rng(1)
    model.noise = (random.standard_normal((300, 4, 4)) + 1j * random.standard_normal((300, 4, 4))).astype(np.complex64)
    return model.fit(images, labels)


def reduced(model, kept):
    """The model with only some of its templates."""
    less = copy.copy(model)
    for made in ("_white", "_bank"):
        vars(less).pop(made, None)
    for name in OF_TEMPLATES:
        if hasattr(model, name):
            array = getattr(model, name)
            setattr(less, name, np.compress(kept, array, axis=array.shape.index(len(kept))))
    owners = np.repeat(model.classes_, np.diff(np.append(model.starts_[: len(model.classes_)], len(kept))))[kept]
    starts = np.unique(owners, return_index=True)[1]
    less.starts_ = np.append(starts, kept.sum()) if len(model.starts_) > len(model.classes_) else starts
    return less


@pytest.mark.parametrize("settings", [{}, {"k": 5}, {"features": "magnitude"}])
@pytest.mark.parametrize("name", KINDS)
def test_what_is_left_out_might_as_well_not_be_there(name, settings):
    if not settings.keys() <= build_classifier(name, KINDS[name], 0).SETTINGS.keys():
        pytest.skip("the model has no such setting")
    images, labels, own = library()
    model = learned(name, images, labels, own, **settings)
    found = model.evaluate(images, own)
    assert not np.allclose(found.scores, model.evaluate(images).scores)  # of which each image is its own template
    for number in (0, 17, 79):
        alone = reduced(model, model.aspects_ != own[number]).evaluate(images[number : number + 1])
        np.testing.assert_allclose(found.scores[number], alone.scores[0], rtol=1e-4, atol=1e-4)
        assert found.labels[number] == alone.labels[0]
        for score, values in found.known.items():
            assert values[number] == pytest.approx(alone.known[score][0], rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("name", KINDS)
def test_a_class_of_one_aspect_can_be_left_out(name):
    images, labels, own = library()
    own[labels == "a"] = "a 0"
    outcome = learned(name, images, labels, own).evaluate(images[:3], own[:3])
    assert (outcome.labels == "b").all() and all(np.isfinite(values).all() for values in outcome.known.values())


def test_a_mirror_image_has_the_same_aspect():
    origin = pd.DataFrame({"target": ["cube", "cube", "dart", "dart"], "azimuth": [30.0, 330.0, 30.0, 330.0]})
    found = names_of(origin, {"cube": ["xz"], "dart": []})
    assert found[0] == found[1] and len(np.unique(found)) == 3


def test_training_views_are_judged_where_the_split_is_at_random(stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "knn", open=True)
    table = tables_of(stores("snr_0dB", ALL_TARGETS), folder, tmp_path, is_open=True)["snr_0dB"]
    rows, trained = table[table["side"] == LEFT_OUT], sides_of(folder)["train"]["index"]
    assert set(rows["role"]) == {"known"} and set(rows["realization"]) == {0}
    assert np.allclose(np.sort(rows["azimuth"].unique()), aspects()[trained])
    known = sum(role == "known" for role in ROLES.values())
    assert len(rows) == known * len(trained) * table["elevation"].nunique()
    threshold = thresholds.choose(table, "known_distance", "kept", 0.9)
    assert threshold == np.quantile(rows["known_distance"], 0.1)
    for protocol in ("thesis", "blind"):
        less = table[table["side"] != LEFT_OUT]
        assert thresholds.choose(table, "known_distance", protocol) == thresholds.choose(
            less, "known_distance", protocol
        )
    validation = (table["side"] == "validation") & table["role"].isin({"known", "other"})
    assert thresholds.threshold_and_f1(table, "known_distance", "kept")[2] == validation.sum()


def test_all_sides_of_a_store_are_read_at_once(stores, tmp_path, monkeypatch):
    folder, read, seen = fitted(stores("clean"), tmp_path / "knn", open=True), images._read, []
    monkeypatch.setattr(images, "_read", lambda store, *how: seen.append(store) or read(store, *how))
    paths = stores("snr_0dB", ALL_TARGETS)
    table = tables_of(paths, folder, tmp_path, is_open=True)["snr_0dB"]
    assert set(table["side"]) == {"validation", "test", LEFT_OUT}
    assert sorted(map(str, seen)) == sorted(map(str, paths))


@pytest.mark.parametrize(
    ("model", "how"),
    [
        ("knn", {"open": False}),
        ("fcnn", {"open": True}),
        ("knn", {"open": True, "split": "sector"}),
        ("knn", {"open": True, "selection": {"elevation": [0], "snr_db": "clean"}}),
    ],
)
def test_elsewhere_they_are_not(model, how, stores, tmp_path):
    folder = fitted(stores("clean"), tmp_path / "model", model, **how)
    targets = ALL_TARGETS if how["open"] else ("dart", "disc")
    table = tables_of(stores("snr_0dB", targets), folder, tmp_path, is_open=how["open"])["snr_0dB"]
    assert set(table["side"]) == {"validation", "test"}
