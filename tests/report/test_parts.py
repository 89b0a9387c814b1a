"""The numbers that the report works out itself: range profiles, selections, what a published statement says."""

import copy
import re
import types
from urllib.parse import unquote

import fake
import fake_learning
import matplotlib.colors
import numpy as np
import pandas as pd
import pytest
import xarray as xr

from isarflow.core.kinds import page_names
from isarflow.core.sweep import C0
from isarflow.report import (
    draw_images,
    draw_mesh,
    layout,
    published,
    section_headline,
    section_learning,
    section_tried,
    thesis,
    vocabulary,
)
from isarflow.report.plots import holds
from isarflow.report.rcs_figures import rcs_dbsm
from isarflow.report.results import Results, rejecting_f1
from isarflow.report.section_scattering import range_profiles
from isarflow.report.selection import decoded_snrs, evenly, noise_snrs, noise_target, noisy_targets, target_order
from isarflow.report.vocabulary import select

NAMES = vocabulary.Names(page_names({"svm": {}, "knn": {}, "capsule": {}}))


@pytest.mark.parametrize("distance", [-0.4, 0.0, 0.55])
def test_point_scatterer_stands_at_its_range(distance):
    frequency = np.linspace(2e9, 3.5e9, 14)
    # Farther from the radar than the origin: positive range, phase exp(-2jkd).
    field = np.exp(-4j * np.pi * frequency / C0 * distance)[:, None]
    ranges, profile = range_profiles(field, frequency)
    found = ranges[np.abs(profile[:, 0]).argmax()]
    assert abs(found - distance) <= np.diff(ranges)[0] / 2 + 1e-9
    assert np.abs(profile).max() == pytest.approx(1, abs=0.02)
    assert np.ptp(ranges) + np.diff(ranges)[0] == pytest.approx(C0 / 2 / np.diff(frequency)[0])


def test_rcs_of_a_scattering_amplitude():
    assert rcs_dbsm(np.array([1 / np.sqrt(4 * np.pi)])) == pytest.approx([0], abs=1e-12)
    assert np.isfinite(rcs_dbsm(np.zeros(1))).all()


def test_evenly_keeps_both_ends_and_the_count():
    values = list(range(-24, 25, 3))
    picked = evenly(values, 7)
    assert (picked[0], picked[-1], len(picked)) == (-24, 24, 7)
    assert evenly([5], 7) == [5]
    assert noise_snrs([12, -3, 0]) == [-3, 0, 12]


def test_order_of_targets_does_not_depend_on_the_file():
    targets = {"z": {"role": "other"}, "b": {"role": "known"}, "u": {"role": "unknown"}, "a": {"role": "known"}}
    assert target_order(targets) == target_order(dict(reversed(targets.items()))) == ["a", "b", "u", "z"]
    assert noise_target(targets) == "a"


@pytest.mark.parametrize(
    ("ours", "relation", "printed", "expected"),
    [
        (0.9996, ">=", "1.00", True),
        (0.994, ">=", "1.00", False),
        (0.991, ">", "0.99", True),
        (0.99, ">", "0.99", False),
        (0.634, "<=", "0.63", True),
        (0.64, "<=", "0.63", False),
        (0.79814, "=", "0.7981", True),
    ],
)
def test_published_statement_counts_to_its_printed_decimals(ours, relation, printed, expected):
    assert holds(ours, relation, printed) == expected


def test_projection_keeps_lengths_and_hands():
    right, up, depth = draw_mesh.project(np.eye(3), *draw_mesh.OBLIQUE)
    np.testing.assert_allclose(right**2 + up**2 + depth**2, 1)
    # x to the right, y up, z towards the eye: from above, right-handed.
    right, up, depth = draw_mesh.project(np.eye(3), *draw_mesh.TOP)
    np.testing.assert_allclose([right[0], up[1], depth[2]], 1)


def _luminance(color):
    rgb = np.array(matplotlib.colors.to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


def test_colours_stand_out_from_white():
    """Graphics need a contrast of 3 to 1 (WCAG 2.1, 1.4.11)."""
    for color in layout.PALETTE:
        assert 1.05 / (_luminance(color) + 0.05) >= 3, color


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0, "0"), (0.03654, "0.0365"), (48.8, "48.8"), (1234, "1234"), (5e-6, "5.00×10⁻⁶")],
)
def test_numbers_read_as_numbers(value, text):
    assert layout.number(value) == text


def test_outline_of_a_box_is_its_shadow_and_a_sheet_on_edge_has_one():
    corners = np.array([[x, y, 0.0] for x in (-0.3, 0.3) for y in (-0.1, 0.1)])
    plate = np.array([[0, 2, 1], [1, 2, 3]])
    cross, distance, covered = draw_images.outline(corners, plate, 0.0, 0.0)
    inside = covered > draw_images.OUTLINE
    assert np.ptp(distance[inside.any(axis=1)]) == pytest.approx(0.6, rel=0.03)  # along x, towards the radar
    assert np.ptp(cross[inside.any(axis=0)]) == pytest.approx(0.2, rel=0.06)
    for turn in (0.0, 30.0, 45.0):  # a vertical sheet in the plane of x and z, seen along its edge from above
        upright = corners[:, [0, 2, 1]]
        assert draw_images.outline(upright, plate, 0.0, turn)[2].max() > draw_images.OUTLINE


def test_decoded_snrs_are_those_nearest_3_and_24_db():
    assert decoded_snrs([-3, 0, 4, 21, 30]) == [4, 21]
    assert decoded_snrs([10]) == [10]


def test_a_gain_counts_where_its_interval_is_above_0_and_the_thesis_is_not_there_yet():
    curve = pd.DataFrame(
        {
            "test_snr_db": [-15, -12, 0, 3, 12, 15],
            "reference": [0.5, 0.7, 0.85, 0.96, 0.99, 0.7],
            "gain": [0.3, 0.1, 0.05, -0.01, 0.01, 0.3],
            "low": [0.2, 0.05, -0.01, -0.02, 0.005, 0.2],
        }
    )
    judged = section_tried.judged(curve)
    # At 12 dB the thesis's method has 0.99; -15 and 15 dB are outside the range.
    assert judged["test_snr_db"].tolist() == [-12, 0, 3]
    assert (judged["low"] > 0).tolist() == [True, False, False]


def test_a_gain_stands_beside_the_thesis_s_network_trained_at_the_same_snrs():
    rows = []
    for experiment, model, training, score, f1 in (
        ("clean", "capsule", "clean", "zncc", 0.5),
        ("noisy", "capsule", "all: clean, 0 dB", "zncc", 0.7),
        ("noisy", "capsule", "all: clean, 0 dB", "mse", 0.1),
        ("noisy", "knn", "all: clean, 0 dB", "softmax", 0.9),
    ):
        method = dict(zip(vocabulary.METHOD, ("sector", experiment, model, training, score), strict=True))
        case = {"threshold": "blind", "test_snr_db": 0.0, "low": 0.1, "high": 0.3}
        rows += [{**method, **case, "metric": "f1_weighted", "value": f1}]
        rows += [{**method, **case, "metric": "f1_weighted_gain", "value": 0.2}] if model == "knn" else []
    curve = section_tried._curve(pd.DataFrame(rows), method, "blind").iloc[0]
    assert (curve["f1"], curve["reference"], curve["gain"], curve["low"]) == (0.9, 0.7, 0.2, 0.1)


def test_methods_rank_by_their_mean_on_validation_images_over_the_middle_within_each_split():
    columns = [*vocabulary.METHOD, "threshold", "metric", "test_snr_db", "value"]
    tested, held_out = [], []
    for split, score, low, high, reached in (
        ("random", "a", 0.2, 1.0, 0.1),
        ("sector", "a", 0.5, 0.9, 0.8),  # worse on the test images, better on the validation images
        ("sector", "b", 0.6, 0.6, 0.7),
    ):
        method = [split, "one", "m", "clean", score]
        for snr, value in ((0, low), (12, low), (24, high)):
            tested += [[*method, protocol, "f1_weighted", snr, value] for protocol in ("blind", "thesis")]
            # What is outside of the middle, or another protocol's, does not count.
            held_out.append([*method, "blind", "f1_weighted", snr, reached if snr < 24 else 1 - reached])
            held_out.append([*method, "thesis", "f1_weighted", snr, 1 - reached])
    ranks = section_tried.summary(*(pd.DataFrame(rows, columns=columns) for rows in (tested, held_out)))
    assert ranks[["split", "score"]].to_numpy().tolist() == [["sector", "a"], ["sector", "b"], ["random", "a"]]
    np.testing.assert_allclose(ranks["mean_blind"], [0.5, 0.6, 0.2])
    np.testing.assert_allclose(ranks["validation"], [0.8, 0.7, 0.1])
    assert ranks["gain_blind"].isna().all()
    assert vocabulary.middle([24, 18]) == [18, 24]  # where none lies between -12 and 12 dB


def _curve(model, values, split="sector", score="", experiment="one", train="clean"):
    """Rows of weighted F1 of one method, as in scores.csv."""
    method = {"split": split, "experiment": experiment, "model": model, "training": train, "score": score}
    frame = pd.DataFrame({"test_snr_db": [-20.0, 0.0, 20.0], "value": values, "low": values, "high": values})
    return frame.assign(**method, threshold="blind" if score else "")


def test_headline_picks_the_best_by_the_middle_snrs_of_the_validation_images_and_the_thesis_s_own():
    held_out = pd.concat(
        [
            _curve("knn", [0.9, 0.6, 0.9]),  # better only outside of the middle
            _curve("svm", [0.3, 0.7, 0.8]),
            _curve("svm", [0.3, 0.5, 0.6], split="random"),
            _curve("knn", [0.9, 0.8, 0.9], split="random"),  # at random better than all by sector
            _curve("capsule", [0.3, 0.9, 1.0]),  # the thesis's, however good it is
            _curve("capsule", [0.3, 0.95, 1.0], train="6 dB"),  # not as the thesis trains it
        ]
    )
    # On the test images all is the other way round: nothing is chosen by them.
    part = held_out.assign(value=1 - held_out["value"])
    lines = section_headline.curves(part, held_out, NAMES, "the network (tiny)")
    assert [label for label, _, _ in lines] == ["best: capsule (sector)", "the network (tiny) (sector)"]
    assert lines[0][1]["training"].unique().tolist() == ["6 dB"]
    clean = part["training"] == "clean"
    lines = section_headline.curves(part[clean], held_out[clean], NAMES, "the network (tiny)")
    assert [label for label, _, _ in lines] == [
        "best: SVM (sector)",
        "best: SVM (random)",
        "the network (tiny) (sector)",
    ]
    assert lines[1][1]["value"].tolist() == pytest.approx([0.7, 0.5, 0.4])
    assert [theirs for _, _, theirs in lines] == [False, False, True]


def test_headline_knows_the_thesis_s_method_by_its_score():
    part = pd.concat(
        [_curve("capsule", [0.3, 0.5, 0.6], score="zncc"), _curve("capsule", [0.4, 0.9, 1.0], score="mixture")]
    )
    assert [label for label, _, _ in section_headline.curves(part, part, NAMES, "the capsule network")] == [
        "best: capsule, Gaussian mixture (sector)",
        "the capsule network, ZNCC (sector)",
    ]


def test_lines_of_rejecting_everything_that_lie_on_each_other_are_one():
    results = types.SimpleNamespace(_rejecting={"a": 0.333, "b": 0.3343, "c": 0.25, "d": 0.9})
    assert Results.rejecting(results, ["a", "c", "b"]) == [0.25, 0.3343]


def test_rejecting_everything_by_hand():
    # Half of the images are unknown: precision 1/2, recall 1, F1 2/3 for a half of the weight.
    assert rejecting_f1(pd.Series(dict.fromkeys("abcd", 70)), ["a", "b"]) == pytest.approx(1 / 3)
    # One unknown target of three: 1/3 of the weight, with precision 1/3: F1 1/2.
    assert rejecting_f1(pd.Series(dict.fromkeys("abc", 70)), ["a", "b"]) == pytest.approx(1 / 6)


def _networks(**sizes):
    """Settings with a capsule network of these sizes, one that inherits it, and a fully connected network."""
    settings = copy.deepcopy(fake.SETTINGS)
    own = settings["learning"]["models"]
    own["capsule"] |= sizes
    own["capsule_denoise"] |= sizes
    own["mine"] = {"kind": "capsule", "width": 16, "capsules": 2}
    return settings


def _words(model, settings):
    return thesis.network(model, Results("nowhere", settings, fake.names(settings)))


def test_a_capsule_network_is_the_thesis_s_only_at_its_size():
    small, full = _networks(), _networks(width=256, capsules=32)
    assert _words("capsule", small) == "the reduced capsule network (16 filters, 2 capsule channels)"
    assert _words("capsule", full) == "the thesis's capsule network"
    assert _words("mine", full) == "the reduced capsule network mine (16 filters, 2 capsule channels)"
    assert _words("capsule_denoise", full) == "the capsule network that takes out noise"
    assert [thesis.full_size(model, small) for model in ("capsule", "mine", "fcnn", "knn")] == [
        False,
        False,
        True,
        True,
    ]
    assert thesis.full_size("capsule", full) and not thesis.full_size("capsule", _networks(width=256))
    # Of 1 and 2 in 32 x 32 pixels: 82 weights of the convolution, 81 x 16 + 16 of the primary capsules, 8 x 8 places
    # of 2 capsules with 8 x 32 votes; of 256 and 32 the same with 256 and 32.
    large = 81 * 256 + 256 + 81 * 256 * 256 + 256 + 64 * 32 * 8 * 32
    tiny = 82 + 81 * 16 + 16 + 64 * 2 * 8 * 32
    assert thesis.ratio("capsule", _networks(width=1)) == pytest.approx(large / tiny)
    assert "the thesis's has 256 and 32, 107 times the weights" in thesis.difference("capsule", small)
    assert thesis.difference("capsule", full) == ""


def _curves(model, snrs, definition):
    """Rows of accuracy of one model, as in scores.csv."""
    columns = {"split": "random", "experiment": "one", "model": model, "training": "clean", "train_snr_db": np.nan}
    columns |= {"score": "", "elevation": "all", "threshold": "", "metric": "accuracy", "fold": ""}
    columns |= {"value": 0.01 * np.array(snrs), "low": 0.0, "high": 1.0, "n": 10, "snr_definition": definition}
    return pd.DataFrame({"test_snr_db": np.array(snrs, float), **columns})


def test_published_values_are_drawn_beside_curves_by_their_definition_of_snr():
    rows = pd.concat([_curves("lr", [0, 6, 12], "peak_3db"), _curves("knn", [0, 6, 12], "peak_3db")])
    there = pd.concat([_curves("lr", [0, 6], "mean"), _curves("knn", [0], "mean"), _curves("svm", [0], "mean")])
    results = types.SimpleNamespace(definition="peak_3db", mean_scores=there)
    statements = pd.DataFrame({"snr_db": [6.0], "value": ["0.90"]})
    drawn, kept, definition, words = published.beside(results, rows.assign(panel="left"), statements)
    assert drawn[["model", "test_snr_db", "snr_definition", "panel"]].to_numpy().tolist() == [
        ["lr", 0, "mean", "left"],
        ["lr", 6, "mean", "left"],
        ["knn", 0, "mean", "left"],
    ]
    assert kept["snr_db"].tolist() == [6.0] and definition == "mean" and "at SNRs by mean power" in words
    # A figure without published values stays as the config defines the SNR.
    drawn, _, definition, words = published.beside(results, rows, statements.iloc[:0])
    assert set(drawn["snr_definition"]) == {definition} == {"peak_3db"} and words == ""
    # So does one of whose curves any has no row by mean power, and it says why.
    results.mean_scores = select(there, model="lr")
    drawn, kept, definition, words = published.beside(results, rows, statements)
    assert len(drawn) == 6 and len(kept) == 0 and definition == "peak_3db"
    assert words.startswith(" Published values are left out")


def test_the_confusion_matrices_published_are_sought_by_the_mean_offset_of_the_open_set():
    measured = {"a": 2.0, "b": 3.0, "u": 7.0, "other": 90.0}
    results = types.SimpleNamespace(
        definition="peak_3db",
        of_role={"known": ["a", "b"], "unknown": ["u"]}.get,
        images=lambda target, store: xr.Dataset(attrs={"snr_definition_offset_db": measured[target]}),
    )
    assert published._offset(results) == 4.0
    results.definition = "mean"
    assert published._offset(results) == 0.0


def test_compare_opens_on_the_headline_s_curves(whole):
    results = Results(whole.parent, fake.SETTINGS, fake.names(fake.SETTINGS))
    found = section_headline.comparison(results)["curves"]
    opened = [one for one in found if one["set"] == "open set, blind thresholds"]
    shown = [one["words"] for one in opened if one["shown"]]
    assert any(words.startswith("capsule, ZNCC: capsule open (random), trained without noise") for words in shown)
    assert {one["dashes"] for one in found if "(sector)" in one["words"]} == {""}
    assert {one["dashes"] for one in found if "(random)" in one["words"]} == {"6 4"}
    # One of three targets is unknown.
    lines = section_headline.comparison(results)["rejecting"]
    assert lines == {f"open set, {name} thresholds": [0.1667] for name in ("blind", "thesis", "kept")}
    # One known score of each model in each experiment is the best of them.
    best = [(one["words"].partition(": ")[2], one["model"]) for one in opened if one["best"]]
    assert len({(words, model) for words, model in best}) == len(best)
    assert len(best) < len(opened)


def test_noisy_images_are_shown_of_what_is_tested():
    targets = {"b": {"role": "known"}, "a": {"role": "known"}, "u": {"role": "unknown"}, "o": {"role": "other"}}
    assert noisy_targets(targets, {}) == ["a"]
    assert noisy_targets(targets, {"closed": {"open": False}}) == ["a", "b"]
    assert noisy_targets(targets, {"closed": {"open": False}, "open": {"open": True}}) == ["a", "b", "u", "o"]


def test_a_path_keeps_its_place_to_a_hundredth_of_a_point():
    with layout.style():
        figure = layout.canvas(2, 2)
        figure.add_subplot().plot([0, 1 / 3, 1], [0, 1 / 7, 1])
        svg = layout.to_svg(figure)
    numbers = re.findall(rb"\d+\.\d+", b" ".join(re.findall(rb' d="([^"]*)"', svg)))
    assert numbers and max(len(number.partition(b".")[2]) for number in numbers) == 2
    shown = layout.Figure("x", svg, pd.DataFrame(), "", "")
    assert unquote(shown.uri.partition(",")[2]).encode() == svg
    assert not set(shown.uri) & set('"<>#\n')


def test_precision_of_a_class_that_no_image_is_taken_for_is_undefined_and_not_drawn(tmp_path):
    (tmp_path / "learning").mkdir()
    settings = copy.deepcopy(fake.SETTINGS)
    settings["learning"]["experiments"] = {"e": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["lr"]}}
    fake_learning.learn(tmp_path / "learning", settings)
    scores = pd.read_csv(tmp_path / "learning/scores.csv")
    lowest = (scores["metric"] == "precision_drone") & (scores["test_snr_db"] == scores["test_snr_db"].min())
    for gap in (False, True):
        scores.assign(value=scores["value"].mask(lowest & gap)).to_csv(tmp_path / "learning/scores.csv", index=False)
        results = Results(tmp_path, settings, fake.names(settings))
        with layout.style():
            picture, *_ = section_learning.section(results).figures
        assert picture.data.query("metric == 'precision_drone'")["value"].isna().sum() == gap
