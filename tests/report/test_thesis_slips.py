"""Predictions judged as the thesis's program did, and its own slips, against slow plain ways to compute them."""

import itertools

import fake
import fake_thesis
import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import f1_score
from study import anew
from thesis_pages import parts, tables

from isarflow.learning import images, thresholds
from isarflow.learning.classifier import OTHER
from isarflow.learning.model_folder import load
from isarflow.report.results import Results


def _slow_f1(truth, predicted):
    return f1_score(truth, predicted, average="weighted", zero_division=0)


@pytest.mark.parametrize(("run", "reading"), [("fcnn_open", "all azimuths"), ("fcnn_listing", "24 dB, all azimuths")])
def test_all_azimuths_are_counted_as_one_image_at_a_time_would_be(thesis_page, run, reading):
    folder = thesis_page.parents[1]
    network = load(folder / "learning" / "models" / run / "fcnn")
    said = tables(parts(thesis_page)[""])[1].set_index("what")["read otherwise"]
    predictions = pd.read_csv(folder / "learning/predictions" / run / "fcnn" / "snr_24dB.csv", keep_default_na=False)
    for score, heading in (("softmax", "softmax"), ("openmax", "OpenMax")):
        threshold = thresholds.choose(predictions, f"known_{score}", "thesis")
        truth, predicted = [], []
        for target in ("drone", "missile", "ufo", "disc"):
            store = folder / "imaging" / target / "snr_24dB.zarr"
            pixels, _ = images.read([store], {target: images.azimuths(store)})
            for image in pixels:
                outcome = network.evaluate(image[None])
                known = outcome.known[score][0] >= threshold
                truth.append(target if target in ("drone", "missile") else OTHER)
                predicted.append(outcome.labels[0] if known else OTHER)
        assert len(truth) == 4 * 3 * 24 * 2  # targets, elevations, azimuths, realizations
        expected = _slow_f1(truth, predicted)
        tested = predictions[(predictions["side"] == "test")]
        kept = np.where(tested[f"known_{score}"] >= threshold, tested["predicted"], OTHER)
        own = _slow_f1(tested["truth"], kept)
        assert abs(expected - own) > 1e-3  # else the test could not tell them apart
        assert f"{reading} {expected:.3f}" in said[f"FCNN, {heading}, weighted F1"].replace("**", "")


def _slow_threshold(scores, known):
    """The lowest threshold with the fewest errors, by trying all."""
    levels = sorted(set(scores))
    tried = [levels[0], *((a + b) / 2 for a, b in itertools.pairwise(levels)), np.nextafter(levels[-1], np.inf)]
    errors = []
    for threshold in tried:
        below = sum(1 for score, is_known in zip(scores, known, strict=True) if is_known and score < threshold)
        above = sum(1 for score, is_known in zip(scores, known, strict=True) if not is_known and score >= threshold)
        errors.append(below + above)
    return tried[errors.index(min(errors))]


@pytest.mark.parametrize("seed", range(12))
def test_the_threshold_of_the_fewest_errors_against_all_of_them(seed):
    random = np.random.default_rng(seed)
    known = random.uniform(size=40) < (0.5, 0.9, 0.1)[seed % 3]
    scores = (random.normal(size=40) + known * (0, 1, 4)[seed % 3]).round(1)  # with many that are equal
    found = anew.fewest_errors(scores, known)
    assert found == pytest.approx(_slow_threshold(scores.tolist(), known.tolist()), abs=1e-12)


def test_thresholds_from_test_images_change_the_f1_as_the_page_says(thesis_page):
    folder = thesis_page.parents[1]
    results = Results(folder, fake_thesis.settings(), fake.names(fake_thesis.settings()))
    for network, scores in (("fcnn_open/fcnn", ("softmax", "openmax")), ("capsule_open/capsule", ("mse", "zncc"))):
        table = pd.read_csv(folder / "learning/predictions" / network / "snr_24dB.csv", keep_default_na=False)
        test = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
        for score in scores:
            column = test[f"known_{score}"]
            f1 = []
            chosen = thresholds.choose(table, f"known_{score}", "thesis")
            for threshold in (chosen, _slow_threshold(column.tolist(), (test["role"] == "known").tolist())):
                f1.append(_slow_f1(test["truth"], np.where(column >= threshold, test["predicted"], OTHER)))
            judged = anew.judged(results, *network.split("/"), score, 24)
            of = [judged.metrics[name]["f1_weighted"] for name in ("validation", "errors")]
            assert of == pytest.approx(f1, abs=1e-12)
            assert judged.gain.split()[0] == f"{f1[1] - f1[0]:+.4f}".replace("-", "−")
    assert abs(f1[1] - f1[0]) > 1e-3


def test_the_document_s_own_tables_are_added_up(thesis_page):
    """Fig. 5.4 by hand: of the first matrix the classes have F1 0.7204, 0.9428 and 0.7609."""
    drone = 2 * 12928 / (13794 + 12928 + 2256 + 6912)
    missile = 2 * 12360 / (13794 + 12360 + 67)
    other = 2 * (11471 + 6882) / (2 * 13794 + 866 + 1434 + 11471 + 6882)
    expected = 0.25 * drone + 0.25 * missile + 0.5 * other
    text = parts(thesis_page)["Slips of the document"]
    assert f"softmax with a threshold 0.7981 printed, {expected:.4f} from the matrix" in text
    assert "class 'other' 0.9179 printed, 0.9179 from the matrix" in text


def test_the_bias_of_the_two_classes_is_that_of_the_predictions(thesis_page):
    path = thesis_page.parents[1] / "learning/predictions/capsule_open/capsule/snr_-6dB.csv"
    table = pd.read_csv(path, keep_default_na=False).query("side == 'test' and role == 'known'")
    by_score = (table["score_drone"] - table["score_missile"]).to_numpy()
    drone = (table["target"] == "drone").to_numpy()
    pairs = np.sign(by_score[drone][:, None] - by_score[~drone])
    right = np.mean((by_score > 0) == drone)
    text = parts(thesis_page)["Fig. 5.6"]
    assert f"ranks them with an AUROC of {(1 + pairs.mean()) / 2:.3f}, but" in text
    assert f"{np.mean(by_score > 0):.0%} of them are named drone, and {right:.3f} are right" in text
