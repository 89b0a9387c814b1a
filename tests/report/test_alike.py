"""Mistakes beside their nearest training images, and the map of what is alike."""

import copy

import fake
import numpy as np
import pandas as pd
import pytest
from fake_learning import TESTED

from isarflow.report import section_alike, selection
from isarflow.report.results import Results


@pytest.fixture
def results(whole):
    return Results(whole.parent, fake.SETTINGS, fake.names(fake.SETTINGS))


def azimuths_of(stack):
    return np.unique(stack.azimuth.values)


def test_whose_mistakes_are_shown_follows_from_the_config_alone():
    run = {"first": True, "open": False, "split": "random", "models": ["lr", "knn"]}
    runs = {"a": run}
    assert selection.mistaken(runs) == ("a", "knn")
    runs["b"] = run | {"models": ["mine"], "open": True}
    assert selection.mistaken(runs) == ("b", "mine")
    runs["d_fold2"] = run | {"open": True, "split": "sector", "first": False}
    runs["d_fold1"] = run | {"open": True, "split": "sector"}
    assert selection.mistaken(dict(reversed(runs.items()))) == ("d_fold1", "knn")
    runs["e_fold1"] = runs["d_fold1"] | {"models": ["capsule", "matched_filter"]}
    assert selection.mistaken(runs) == ("e_fold1", "matched_filter")
    # Only of an SNR of which there are images of all these targets.
    assert selection.mistaken_snr([-24, -20, 2, 3, 4, 20, 24, 30, 40]) in selection.noise_snrs(
        [-24, -20, 2, 3, 4, 20, 24, 30, 40]
    )


def test_likeness_is_one_for_the_same_image_and_none_without_contrast():
    images = np.random.default_rng(3).normal(size=(4, 5, 6, 2)) @ [1, 1j]
    rows = section_alike.standardized(images)
    same = section_alike.standardized((3 * np.abs(images) + 2).astype(complex))
    np.testing.assert_allclose(np.diag(rows @ same.T), 1)
    assert np.abs(rows @ rows.T - np.eye(4)).max() <= 1
    assert not section_alike.standardized(np.ones((1, 5, 6))).any()


def test_mistakes_stand_beside_the_training_image_most_like_them(results, whole):
    run, model = "capsule_sector_fold2", "capsule"
    data = pd.read_csv(whole / "tables" / "figure_mistaken.csv")
    table = results.predictions(run, model, 2.5).query(
        "side == 'test' and target == 'missile' and predicted == 'drone'"
    )
    titles = list(dict.fromkeys(data["image"]))
    pairs = list(zip(titles[::2], titles[1::2], strict=True))
    assert len(pairs) == section_alike.EXAMPLES  # missile for drone; a ufo's confidence is below the threshold
    train = azimuths_of(section_alike._stacked(results, run, "drone", "train"))
    store = results.images("drone", "clean").image.sel(azimuth=train)
    for seen, near in pairs:
        shown, nearest = (data[data["image"] == title] for title in (seen, near))
        assert seen.startswith(("1: missile", "2: missile")) and near.partition(": ")[2].startswith("drone, ")
        where = shown.iloc[0]
        assert ((table["elevation"] == where["elevation_deg"]) & (table["azimuth"] == where["azimuth_deg"])).any()
        noisy = results.images("missile", "snr_2.5dB").image.isel(realization=0)
        noisy = np.abs(noisy.sel(elevation=where["elevation_deg"], azimuth=where["azimuth_deg"]).values).ravel()
        likeness = [np.corrcoef(noisy, np.abs(one).ravel())[0, 1] for row in store.values for one in row]
        assert near.partition("drone, ")[2].startswith(f"{max(likeness):.2f}")
        place = np.unravel_index(np.argmax(likeness), store.shape[:2])
        assert nearest.iloc[0]["azimuth_deg"] == train[place[1]]
    missiles = section_alike._judged(results, run, model, 2.5)[0].query("target == 'missile'")
    assert ((missiles["taken_for"] == "drone").sum(), len(missiles)) == (len(table), TESTED)


def test_what_is_rejected_is_no_mistake(results):
    shown, score = section_alike._judged(results, "capsule_sector_fold2", "capsule", 2.5)
    assert score in ("mse", "zncc") and set(shown["side"]) == {"test"}
    assert set(shown[shown["role"] == "unknown"]["taken_for"]) == {"other"}


def test_the_map_is_of_test_images_by_their_nearest_training_images(results, whole):
    data = pd.read_csv(whole / "tables" / "figure_map.csv")
    assert set(data["images"]) == {"no noise", "2.5 dB"} and set(data["target"]) == {"drone", "missile", "ufo"}
    (row,) = data[(data["images"] == "no noise") & (data["target"] == "ufo")].iloc[4:5].to_dict("records")
    own = results.images("ufo", "clean").image.sel(elevation=row["elevation"], azimuth=row["azimuth"]).values
    for known in ("drone", "missile"):
        train = results.images(known, "clean").image
        there = azimuths_of(section_alike._stacked(results, "capsule_sector_fold2", known, "train"))
        train = train.sel(azimuth=there).values
        likeness = [np.corrcoef(np.abs(own).ravel(), np.abs(one).ravel())[0, 1] for rows in train for one in rows]
        assert row[f"like_{known}"] == pytest.approx(max(likeness), abs=1e-6)
    assert (row["x"], row["y"]) == (row["like_drone"], row["like_missile"])
    test = azimuths_of(section_alike._stacked(results, "capsule_sector_fold2", "ufo", "test"))
    assert set(data[data["target"] == "ufo"]["azimuth"]) <= set(test)


def test_three_known_targets_are_mapped_by_components(whole, monkeypatch):
    settings = copy.deepcopy(fake.SETTINGS)
    settings["targets"]["ufo"]["role"] = "known"
    results = Results(whole.parent, settings, fake.names(settings))
    monkeypatch.setattr(section_alike, "MOST_POINTS", 6)
    drawn = section_alike.map_figure(results)
    values = drawn.data[["x", "y"]].to_numpy()
    np.testing.assert_allclose(values.mean(axis=0), 0, atol=1e-6)
    assert values[:, 0].var() >= values[:, 1].var() > 0
    assert abs(np.corrcoef(values.T)[0, 1]) < 1e-3
    assert "dotted" not in drawn.caption
