"""Predictions judged as the thesis's program did, and its own slips, against slow plain ways to compute them."""

import itertools

import numpy as np
import pytest
from sklearn.metrics import f1_score
from study import anew

from isarflow.learning.classifier import OTHER, load_classifier
from isarflow.learning.data import images
from isarflow.learning.evaluation import thresholds
from isarflow.report.vocabulary import select


def _slow_f1(truth, predicted):
    return f1_score(truth, predicted, average="weighted", zero_division=0)


@pytest.mark.parametrize(("run", "reading"), [("fcnn_open", "all azimuths"), ("fcnn_listing", "24 dB, all azimuths")])
def test_all_azimuths_are_counted_as_one_image_at_a_time_would_be(thesis, run, reading):
    network = load_classifier(thesis.run / "learning" / "models" / run / "fcnn")
    said, predictions = thesis.overview.set_index("what")["read otherwise"], thesis.predictions(run, "fcnn")
    outcomes, truth = [], []
    for target in ("drone", "missile", "ufo", "disc"):
        store = thesis.run / "imaging" / target / "snr_24dB.zarr"
        pixels, _ = images.read([store], {target: images.azimuths(store)})
        outcomes += [network.evaluate(image[None]) for image in pixels]
        truth += [target if target in ("drone", "missile") else OTHER] * len(pixels)
    assert len(truth) == 4 * 3 * 24 * 2  # targets, elevations, azimuths, realizations
    for score, heading in (("softmax", "softmax"), ("openmax", "OpenMax")):
        threshold = thresholds.choose(predictions, f"known_{score}", "thesis")
        expected = _slow_f1(truth, [of.labels[0] if of.known[score][0] >= threshold else OTHER for of in outcomes])
        tested = select(predictions, side="test")
        own = _slow_f1(tested["truth"], tested["predicted"].where(tested[f"known_{score}"] >= threshold, OTHER))
        assert abs(expected - own) > 1e-3  # else the test could not tell them apart
        assert f"{reading} {expected:.3f}" in said[f"FCNN, {heading}, weighted F1"].replace("**", "")


def _slow_threshold(scores, known):
    """The lowest threshold with the fewest errors, by trying all."""
    levels = sorted(set(scores))
    tried = [levels[0], *((a + b) / 2 for a, b in itertools.pairwise(levels)), np.nextafter(levels[-1], np.inf)]
    cases = list(zip(scores, known, strict=True))
    errors = [sum((score < threshold) == is_known for score, is_known in cases) for threshold in tried]
    return tried[errors.index(min(errors))]


@pytest.mark.parametrize("seed", range(12))
def test_the_threshold_of_the_fewest_errors_against_all_of_them(seed):
    random = np.random.default_rng(seed)
    known = random.uniform(size=40) < (0.5, 0.9, 0.1)[seed % 3]
    scores = (random.normal(size=40) + known * (0, 1, 4)[seed % 3]).round(1)  # with many that are equal
    assert anew.fewest_errors(scores, known) == pytest.approx(_slow_threshold(scores, known), abs=1e-12)


def test_thresholds_from_test_images_change_the_f1_as_the_page_says(thesis):
    networks = {"fcnn_open/fcnn": ("softmax", "openmax"), "fcnn_listing/fcnn": ("softmax",)}
    networks["capsule_open/capsule"] = ("mse", "zncc")
    for name, scores in networks.items():
        run, model = name.split("/")
        table = thesis.predictions(run, model)
        test = select(table, side="test", role=["known", "unknown"])
        for score in scores:
            column = test[f"known_{score}"]
            chosen = [thresholds.choose(table, f"known_{score}", "thesis")]
            chosen.append(_slow_threshold(column, test["role"] == "known"))
            f1 = [_slow_f1(test["truth"], test["predicted"].where(column >= level, OTHER)) for level in chosen]
            judged = anew.judged(thesis.results, run, model, score, 24)
            of = [judged.metrics[name]["f1_weighted"] for name in ("validation", "errors")]
            assert of == pytest.approx(f1, abs=1e-12)
            assert judged.gain.split()[0] == f"{f1[1] - f1[0]:+.4f}".replace("-", "−")
    assert abs(f1[1] - f1[0]) > 1e-3


def test_the_document_s_own_tables_are_added_up(thesis):
    """Fig. 5.4 by hand: of the first matrix the classes have F1 0.7204, 0.9428 and 0.7609."""
    drone = 2 * 12928 / (13794 + 12928 + 2256 + 6912)
    missile = 2 * 12360 / (13794 + 12360 + 67)
    other = 2 * (11471 + 6882) / (2 * 13794 + 866 + 1434 + 11471 + 6882)
    expected = 0.25 * drone + 0.25 * missile + 0.5 * other
    text = thesis.entries["Slips of the document"]
    assert f"softmax with a threshold 0.7981 printed, {expected:.4f} from the matrix" in text
    assert "class 'other' 0.9179 printed, 0.9179 from the matrix" in text


def test_the_bias_of_the_two_classes_is_that_of_the_predictions(thesis):
    table = select(thesis.predictions("capsule_open", "capsule", "-6dB"), side="test", role="known")
    by_score, drone = table["score_drone"] - table["score_missile"], table["target"] == "drone"
    pairs = np.sign(by_score[drone].to_numpy()[:, None] - by_score[~drone].to_numpy())
    text = thesis.entries["Fig. 5.6"]
    assert f"ranks them with an AUROC of {(1 + pairs.mean()) / 2:.3f}, but" in text
    right = ((by_score > 0) == drone).mean()
    assert f"{(by_score > 0).mean():.0%} of them are named drone, and {right:.3f} are right" in text


def test_reasons_are_measured_by_the_run_that_shows_them(thesis):
    """The SVM's steps from 0 to 3 dB; what the run lacks, the AUROC of a neighbour's distance, is left unsaid."""
    values = [
        thesis.scores(experiment=experiment, model="svm", metric="accuracy", test_snr_db=snr, elevation="all")["value"]
        for experiment in ("multi_elevation", "multi_shuffled")
        for snr in (0, 3)
    ]
    first, second, third, fourth = (f"{float(value.iloc[0]):.3f}" for value in values)
    words = f"The SVM has {first} at 0 dB and {second} at 3 dB, and by the shuffled split {third} and {fourth}"
    assert words in " ".join(thesis.entries["Fig. 4.12"].split())
    assert "fifth neighbour" not in thesis.entries["Fig. 5.4, Table 5.2"]
