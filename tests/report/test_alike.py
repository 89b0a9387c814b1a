"""Mistakes beside their nearest training images."""

import numpy as np
import pandas as pd
from fake_learning import TESTED

from isarflow.report import section_alike, selection


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
    snrs = [-24, -20, 2, 3, 4, 20, 24, 30, 40]
    assert selection.mistaken_snr(snrs) in selection.noise_snrs(snrs)


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
    table = results.predictions(run, model, 2.5)
    table = table.query("side == 'test' and target == 'missile' and predicted == 'drone'")
    titles = list(dict.fromkeys(data["image"]))
    pairs = list(zip(titles[::2], titles[1::2], strict=True))
    assert len(pairs) == section_alike.EXAMPLES  # missile for drone; a ufo's confidence is below the threshold
    train = np.unique(section_alike._stacked(results, run, "drone", "train").azimuth.values)
    store = results.images("drone", "clean").image.sel(azimuth=train)
    for number, (seen, near) in enumerate(pairs, 1):
        shown, nearest = (data[data["image"] == title].iloc[0] for title in (seen, near))
        assert seen.startswith(f"{number}: missile")
        where = {"elevation": shown["elevation_deg"], "azimuth": shown["azimuth_deg"]}
        assert (table[list(where)] == list(where.values())).all(axis=1).any()
        noisy = np.abs(results.images("missile", "snr_2.5dB").image.isel(realization=0).sel(where).values).ravel()
        likeness = [np.corrcoef(noisy, np.abs(one).ravel())[0, 1] for row in store.values for one in row]
        assert near.startswith(f"{number}: drone, {max(likeness):.2f}")
        assert nearest["azimuth_deg"] == train[np.unravel_index(np.argmax(likeness), store.shape[:2])[1]]
    judged, score = section_alike._judged(results, run, model, 2.5)
    missiles = judged.query("target == 'missile'")
    assert ((missiles["taken_for"] == "drone").sum(), len(missiles)) == (len(table), TESTED)
    # What is rejected is no mistake.
    assert score in ("mse", "zncc") and set(judged["side"]) == {"test"}
    assert set(judged[judged["role"] == "unknown"]["taken_for"]) == {"other"}
