"""The numbers that the report works out itself; sections, metrics and models, each declared at one place."""

import re
from types import SimpleNamespace

import fake
import matplotlib.colors
import numpy as np
import pandas as pd
import pytest

from isarflow import report
from isarflow.core import kinds, words
from isarflow.core.sweep import C0
from isarflow.imaging.outline import OUTLINE, outline
from isarflow.imaging.range_profiles import range_profiles
from isarflow.report import (
    layout,
    page,
    plots,
    section_mesh,
    section_open,
    section_run,
    selection,
    vocabulary,
)
from isarflow.report.published import beside, holds
from isarflow.report.section_headline import curves
from isarflow.report.thesis import full_size, size
from isarflow.report.vocabulary import Names, select

STATED = {"lr": {}, "svm": {}, "knn": {}, "capsule": {}, "own": {"kind": "lr"}, "lr_tuned": {"kind": "lr"}}
STATED["likelihood"] = {}
NAMES = Names(kinds.page_names(STATED))
SECTION = (
    "from isarflow.report.layout import Section\nPLACE, NEEDS = ('recognition', 2.5), 'learns'\n"
    "def section(results):\n    return Section('mine', 'My own', (f'{len(results.targets)} targets',))\n"
)
MODEL = "class Model:\n    LABELS = {'mine': ('Mine', 'my model', 1)}\n    SCORES = {'mine': ('my score', 1)}\n"


@pytest.mark.parametrize("distance", [-0.4, 0.0, 0.55])
def test_point_scatterer_stands_at_its_range(distance):
    frequency = np.linspace(2e9, 3.5e9, 14)
    # Farther from the radar than the origin: positive range, phase exp(-2jkd).
    field = np.exp(-4j * np.pi * frequency / C0 * distance)[:, None]
    ranges, profile = range_profiles(field, frequency)
    assert abs(ranges[np.abs(profile[:, 0]).argmax()] - distance) <= np.diff(ranges)[0] / 2 + 1e-9
    assert np.abs(profile).max() == pytest.approx(1, abs=0.02)
    assert np.ptp(ranges) + np.diff(ranges)[0] == pytest.approx(C0 / 2 / np.diff(frequency)[0])


def test_what_is_shown_does_not_depend_on_the_file():
    picked = selection.evenly(list(range(-24, 25, 3)), 7)
    assert (picked[0], picked[-1], len(picked)) == (-24, 24, 7)
    assert selection.evenly([5], 7) == [5] and selection.noise_snrs([12, -3, 0]) == [-3, 0, 12]
    assert selection.decoded_snrs([-3, 0, 4, 21, 30]) == [4, 21] and selection.decoded_snrs([10]) == [10]
    targets = {"z": {"role": "other"}, "b": {"role": "known"}, "u": {"role": "unknown"}, "a": {"role": "known"}}
    for order in (targets, dict(reversed(targets.items()))):
        assert selection.target_order(order) == ["a", "b", "u", "z"]
    shown = selection.images_shown({"targets": targets, "noise": {"snr_db": [12, 0]}})
    assert shown == [(name, "clean") for name in "abuz"] + [("a", "snr_0dB"), ("a", "snr_12dB")]
    # Of several models of a kind the first is drawn; other roles, and targets that state no kind, are apart.
    models = {f"m{number}": {"role": "known", "kind": "bird"} for number in (1, 2, 3)}
    models |= {"o": {"role": "other", "kind": "bird"}, "bird": {"role": "known"}}
    assert selection.drawn(models) == ["bird", "m1", "o"]


def test_shapes_are_drawn_true_in_colours_that_stand_out_and_paths_to_a_hundredth_of_a_point():
    # Projections keep lengths and hands.
    np.testing.assert_allclose(np.square(plots.project(np.eye(3), *plots.OBLIQUE)).sum(axis=0), 1)
    # x to the right, y up, z towards the eye: from above, right-handed.
    np.testing.assert_allclose(np.diagonal(plots.project(np.eye(3), *plots.TOP)), 1)
    corners = np.array([[x, y, 0.0] for x in (-0.3, 0.3) for y in (-0.1, 0.1)])
    plate = np.array([[0, 2, 1], [1, 2, 3]])
    cross, distance, covered = outline(corners, plate, 0.0, 0.0)
    inside = covered > OUTLINE
    assert np.ptp(distance[inside.any(axis=1)]) == pytest.approx(0.6, rel=0.03)  # along x, towards the radar
    assert np.ptp(cross[inside.any(axis=0)]) == pytest.approx(0.2, rel=0.06)
    for turn in (0.0, 30.0, 45.0):  # a vertical sheet in the plane of x and z, seen along its edge from above
        upright = corners[:, [0, 2, 1]]
        assert outline(upright, plate, 0.0, turn)[2].max() > OUTLINE
    # Graphics need a contrast of 3 to 1 (WCAG 2.1, 1.4.11).
    rgb = np.array([matplotlib.colors.to_rgb(color) for color in layout.PALETTE])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    assert (1.05 / (linear @ [0.2126, 0.7152, 0.0722] + 0.05) >= 3).all()
    figure = layout.canvas(2, 2)
    figure.add_subplot().plot([0, 1 / 3, 1], [0, 1 / 7, 1])
    svg = layout.to_svg(figure)
    numbers = re.findall(rb"\d+\.\d+", b" ".join(re.findall(rb' d="([^"]*)"', svg)))
    assert numbers and max(len(number.partition(b".")[2]) for number in numbers) == 2


def _curve(model, values, split="sector", score="", train="clean", **columns):
    """Rows of one method, as in scores.csv, at SNRs about 0 dB: values, each without width."""
    frame = pd.DataFrame({"test_snr_db": [-20.0, 0.0, 20.0], "value": values, "low": values, "high": values, "n": 10})
    method = {"split": split, "experiment": "one", "model": model, "training": train, "score": score}
    return frame.assign(**{**method, "threshold": "kept" if score else "", "metric": "f1_weighted"} | columns)


def test_methods_rank_by_their_mean_on_validation_images_over_the_middle_within_each_split():
    tested, held_out = [], []
    for split, score, low, high, reached in (
        ("random", "a", 0.2, 1.0, 0.1),
        ("sector", "a", 0.5, 0.9, 0.8),  # worse on the test images, better on the validation images
        ("sector", "b", 0.6, 0.6, 0.7),
    ):
        for protocol in ("kept", "thesis"):
            tested.append(_curve("m", [high, low, high], split, score, threshold=protocol))
        # What is outside of the middle, or another protocol's, does not count.
        held_out.append(_curve("m", [1 - reached, reached, 1 - reached], split, score))
        held_out.append(_curve("m", 1 - reached, split, score, threshold="thesis"))
    ranks = section_open.summary(pd.concat(tested), pd.concat(held_out))
    assert ranks[["split", "score"]].to_numpy().tolist() == [["sector", "a"], ["sector", "b"], ["random", "a"]]
    np.testing.assert_allclose(ranks["mean_kept"], [0.5, 0.6, 0.2])
    np.testing.assert_allclose(ranks["validation"], [0.8, 0.7, 0.1])
    assert "gain_kept" not in ranks
    # Of methods that are tested at fewer SNRs only these compare, in their split.
    few = vocabulary.comparable(pd.concat([_curve("knn", 1.0).query("test_snr_db != 0"), *tested]).replace(20.0, 12.0))
    assert sorted(few[few["split"] == "sector"]["test_snr_db"].unique()) == [12.0]
    assert sorted(few[few["split"] == "random"]["test_snr_db"].unique()) == [0.0, 12.0]
    assert vocabulary.middle([24, 18]) == [18, 24]  # where none lies between -12 and 12 dB
    assert vocabulary.middle([24, 12, 0, -12, -15]) == [-12, 0, 12]


def test_headline_picks_the_best_model_by_its_main_score_on_the_validation_images_and_the_thesis_s_own():
    curves_held_out = [
        _curve("knn", [0.9, 0.6, 0.9]),  # better only outside of the middle
        _curve("svm", [0.3, 0.7, 0.8]),
        _curve("svm", [0.3, 0.5, 0.6], split="random"),
        _curve("knn", [0.9, 0.8, 0.9], split="random"),  # at random better than all by sector
        _curve("capsule", [0.3, 0.9, 1.0]),  # the thesis's
        _curve("capsule", [0.3, 0.95, 1.0], train="6 dB"),  # not as the thesis trains it
    ]
    held_out = pd.concat(curves_held_out)
    # On the test images all is the other way round: nothing is chosen by them.
    part = held_out.assign(value=1 - held_out["value"])
    lines = curves(part, held_out, NAMES)
    assert lines["curve"].unique().tolist() == ["best: capsule (sector)", "thesis: capsule (sector)"]
    assert lines["training"].unique().tolist() == ["6 dB", "clean"]
    # The thesis's may be the best.
    lines = curves(*(select(of, training="clean") for of in (part, held_out)), NAMES)
    assert (
        lines["curve"].unique().tolist() == ["best: capsule (sector)"] and lines["best"].all() and lines["theirs"].all()
    )
    held_out = held_out.assign(value=held_out["value"].where(held_out["model"] != "capsule", 0.1))
    lines = curves(*(select(of, training="clean") for of in (part, held_out)), NAMES)
    shown = ["best: SVM (sector)", "best: SVM (random)", "thesis: capsule (sector)"]
    assert lines["curve"].unique().tolist() == shown
    assert select(lines, curve=shown[1])["value"].tolist() == pytest.approx([0.7, 0.5, 0.4])
    assert select(lines, theirs=True)["curve"].unique().tolist() == select(lines, best=False)["curve"].unique().tolist()
    assert select(lines, theirs=True)["curve"].unique().tolist() == shown[2:]
    # Of several scores the thesis's method is that by ZNCC.
    part = pd.concat([_curve("knn", 0.7, score="distance"), _curve("capsule", 0.5, score="zncc")])
    lines = curves(part, part, NAMES)["curve"].unique().tolist()
    assert lines == ["best: KNN, nearest distance (sector)", "thesis: capsule, ZNCC (sector)"]


def test_a_model_s_main_score_is_the_first_that_its_file_states_or_else_that_it_gives():
    """However good another is in noise."""
    scores = {"coherence": [0.9, 0.9, 0.8], "likelihood": [0.2, 0.7, 0.9], "rice": 0.3}
    part = pd.concat(_curve("likelihood", values, score=score) for score, values in scores.items())
    assert curves(part, part, NAMES)["curve"].unique().tolist() == ["best: likelihood (sector)"]
    unstated = part.assign(model="mine")
    assert curves(unstated, unstated, NAMES)["curve"].unique().tolist() == ["best: mine, coherence (sector)"]
    lacking = select(part, score=["rice", "coherence"])  # not the stated one
    assert set(NAMES.by_main_score(lacking)["score"]) == {"coherence"}
    assert len(NAMES.by_main_score(pd.concat([part, _curve("likelihood", 0.5)]))) == 6  # and all of the closed set
    assert kinds.page_names({"wide": {"kind": "fcnn"}, "capsule": {}})["main"] == {"capsule": "zncc", "wide": "softmax"}


def test_one_answer_for_all_images_by_hand():
    results, tables = fake.results("nowhere"), []
    for experiment, threshold, drones, missiles, ufos in (
        ("a", "blind", 70, 70, 140),
        ("b", "blind", 70, 70, 140.5),
        ("c", "blind", 70, 70, 70),
        ("a", "", 30, 10, 0),
    ):
        counts = pd.DataFrame({"target": ["drone", "missile", "ufo"], "count": [drones, missiles, ufos]})
        case = {"experiment": experiment, "threshold": threshold, "model": "m", "training": "clean", "score": "s"}
        tables.append(counts.assign(**case, elevation="all", test_snr_db=0.0).query("count > 0"))
    results.confusion = pd.concat(tables)
    # Half of the images are unknown: precision 1/2, recall 1, F1 2/3 for a half of the weight. b is alike: one line.
    # One unknown target of three: 1/3 of the weight, with precision 1/3: F1 1/2.
    assert results.rejecting(["c", "a"]) == pytest.approx([1 / 6, 1 / 3])
    assert results.rejecting(["a", "c", "b"]) == pytest.approx([1 / 6, 1 / 3], abs=2e-3)
    assert results.guessing(["a"]) == pytest.approx([0.75 * 2 * 0.75 / 1.75])


def test_a_capsule_network_is_the_thesis_s_only_at_its_size():
    settings = fake.changed()
    for name, width, capsules in (("mine", 16, 2), ("wide", 256, 2), ("large", 256, 32)):
        settings["learning"]["models"][name] = {"kind": "capsule", "width": width, "capsules": capsules}
    sizes = {"capsule": False, "mine": False, "wide": False, "large": True, "fcnn": True, "knn": True}
    assert {model: full_size(model, settings) for model in sizes} == sizes
    assert size("mine", settings) == "16 filters, 2 capsule channels"


def test_published_values_are_drawn_beside_curves_by_their_definition_of_snr():
    rows = pd.concat(_curve(model, 0.9, snr_definition="peak_3db") for model in ("lr", "knn"))
    lr, knn, svm = (_curve(model, 0.8, snr_definition="mean") for model in ("lr", "knn", "svm"))
    there = pd.concat([lr[:2], knn[:1], svm[:1]])
    results = SimpleNamespace(definition="peak_3db", mean_scores=there)
    statements = pd.DataFrame({"snr_db": [6.0], "value": ["0.90"]})
    drawn, kept, words = beside(results, rows.assign(panel="left"), statements)
    assert drawn[["model", "test_snr_db"]].to_numpy().tolist() == [["lr", -20], ["lr", 0], ["knn", -20]]
    assert set(drawn["snr_definition"]) == {"mean"} and set(drawn["panel"]) == {"left"}
    assert kept["snr_db"].tolist() == [6.0] and "at SNRs by mean power" in words
    # A figure without published values stays as the config defines the SNR.
    drawn, _, words = beside(results, rows, statements.iloc[:0])
    assert set(drawn["snr_definition"]) == {"peak_3db"} and words == ""
    # So does one of whose curves any has no row by mean power, and it says why.
    results.mean_scores = select(there, model="lr")
    drawn, kept, words = beside(results, rows, statements)
    assert len(drawn) == 6 and len(kept) == 0 and set(drawn["snr_definition"]) == {"peak_3db"}
    assert words.startswith(" Published values are left out")


def test_published_statements_count_to_their_printed_decimals():
    for relation, printed, holding, failing in (
        (">=", "1.00", 0.9996, 0.994),
        (">", "0.99", 0.991, 0.99),
        ("<=", "0.63", 0.634, 0.64),
        ("=", "0.7981", 0.79814, 0.79816),
    ):
        line = {"relation": relation, "value": printed}
        ours = [{"ours": value, "low": np.nan, "high": np.nan} for value in (holding, failing)]
        assert [holds(here, line) for here in ours] == [True, False], relation


def test_models_and_scores_have_the_names_that_their_files_state_and_all_come_in_order():
    table = pd.DataFrame({"model": ["own", "capsule", "lr_tuned", "mine", "lr"]}).assign(score="energy")
    assert NAMES.values(table, "model") == ["lr", "lr_tuned", "capsule", "mine", "own"]
    assert [NAMES.model(name).label for name in ("lr_tuned", "own", "my_net")] == ["LR, tuned", "own", "my_net"]
    assert NAMES.model("capsule").words == "the capsule network" and NAMES.model("my_net").words == "my net"
    assert [NAMES.score(name).label for name in ("noise_zncc", "my_error")] == ["ZNCC, noise taken out", "my error"]
    assert NAMES.method("capsule", "zncc") == "capsule, ZNCC" and NAMES.method("knn", "") == "KNN"
    # Each of those that state a place has a colour and marker of its own; models of one's own, colours of no other.
    looks = [NAMES.model(name) for name in ("lr", "lr_tuned", "svm", "knn", "capsule")]
    assert len({(look.color, look.marker) for look in looks}) == len(looks)
    few, many = ["svm", "knn", "mine", "yours"], [f"own{number}" for number in range(30)]
    for models, colors in ((few, 4), (many, 12)):
        names = Names(kinds.page_names({"svm": {}, "knn": {}}), models)
        assert len({names.model(model).color for model in models}) == colors
    # Groups stand in the order of the page.
    rows = [
        ("random", "a", "svm", "clean", np.nan),
        ("random", "a", "svm", "12 dB", 12.0),
        ("random", "a", "svm", "2.5 dB", 2.5),
        ("random", "a", "lr", "clean", np.nan),
        ("sector", "z", "lr", "clean", np.nan),
    ]
    table = pd.DataFrame(rows, columns=["split", "experiment", "model", "training", "train_snr_db"])
    assert NAMES.values(table, "experiment") == ["z", "a"]
    groups = [values for values, _ in NAMES.groups(table, "experiment", "model", "training")]
    assert groups == [rows[place][1:4] for place in (4, 3, 2, 1, 0)]


def test_rows_are_selected_and_values_runs_and_tables_are_written_as_a_reader_expects():
    table = pd.DataFrame({"model": ["lr", "lr", "svm"], "test_snr_db": [0, 6, 6]})
    assert select(table, model="lr", test_snr_db=6).index.tolist() == [1]
    assert select(table, test_snr_db=[0, 6], model=("svm",)).index.tolist() == [2]
    data = pd.DataFrame({"target": ["a", "b"], "count": [1234, 5], "share": [0.25, np.nan]})
    shown = {"target": "{target}", "count": "{count:,}", "share": lambda row: words.number(row["share"], 1)}
    table = layout.table("x", data, shown, "")
    assert [[*row.values()] for row in table.shown.to_dict("records")] == [["a", "1,234", "0.2"], ["b", "5", "–"]]
    assert table.data is data and table.text_columns == ["target"]
    values = {None: "–", 0: "0", 0.03654: "0.0365", 48.8: "48.8", 1234: "1234", 5e-6: "5.00×10⁻⁶"}
    assert {value: words.number(value) for value in values} == values
    row = {"value": 0.91239, "low": 0.8, "high": 0.95}
    assert vocabulary.with_interval(row) == "0.912 [0.800, 0.950]"
    assert vocabulary.with_interval(row | {"low": np.nan, "high": np.nan}) == "0.912"
    run = {"name": "sector_fold1_snr_6dB_fold3", "division": {"fold": 3}}
    assert vocabulary.run_title(run) == "sector fold1 snr 6dB"
    assert vocabulary.run_title(run, fold=True) == "sector fold1 snr 6dB, fold 3"
    assert vocabulary.run_title({"name": "multi_elevation", "division": {"fold": 0}}, fold=True) == "multi elevation"


def test_a_curve_has_its_band_and_the_panels_their_labels_at_the_edges():
    rows = pd.DataFrame({"test_snr_db": [6, 0], "value": [0.9, 0.5], "low": [0.8, 0.4], "high": [1.0, 0.6]})
    drawing, grid = plots.panels(2, 2, 4, 4)
    for axes in grid.flat[:3]:
        plots.draw_curve(axes, rows, "red", label="a model")
    plots.finish(drawing, grid, vocabulary.snr_axis("mean"), "F1")
    label = "test SNR by mean power [dB]"
    (line,), (band,) = grid[0, 0].lines, grid[0, 0].collections
    assert line.get_xydata().tolist() == [[0, 0.5], [6, 0.9]]
    assert band.get_paths()[0].get_extents().bounds == pytest.approx((0, 0.4, 6, 0.6))
    assert [axes.get_xlabel() for axes in grid.flat] == ["", label, label, ""]
    assert [axes.get_ylabel() for axes in grid.flat] == ["F1", "", "F1", ""]
    assert grid[1, 0].axison and not grid[1, 1].axison
    assert [text.get_text() for text in drawing.legends[0].get_texts()] == ["a model"]


def test_a_section_is_one_file(results, tmp_path, monkeypatch):
    (tmp_path / "section_mine.py").write_text(SECTION)
    before = page._modules(results)
    monkeypatch.setattr(report, "__path__", [*report.__path__, str(tmp_path)])
    after = page._modules(results)
    place = before.index(section_open) + 1
    assert [*after[:place], *after[place + 1 :]] == before
    (section,) = page._drawn(after[place].section, results)
    assert section.title == "My own" and section.text == ("3 targets",)


def test_a_metric_is_one_line(results, monkeypatch):
    area = select(results.scores, metric="auroc").assign(metric="area", value=0.4321)
    scores = select(pd.concat([results.scores, area]).query("score != ''"), elevation="all")
    monkeypatch.setitem(section_open.SEPARATION, "area", "my area")
    ranks = section_open.summary(scores, select(results.validation, elevation="all"))
    assert set(section_open.tried_table(results, scores, ranks).shown["my area"]) == {"0.432"}


def test_a_model_is_one_file(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(MODEL)
    monkeypatch.setattr(kinds, "MODELS", kinds.MODELS._replace(folder=str(tmp_path)))
    names = Names(kinds.page_names({"mine": {}}), {"mine"})
    assert (names.model("mine").label, names.model("mine").words) == ("Mine", "my model")
    assert names.method("mine", "mine") == "Mine, my score"


def test_of_a_kind_one_model_stands_in_the_table_of_meshes_and_each_that_misses_something():
    shown = pd.DataFrame({"target": ["box_01", "box_02", "box_03"], "area": ["+0.1", "+0.2", "+2.0 ✗"]})
    every = layout.Table("meshes", shown, shown, "Quality.")
    folded = section_mesh.folded(every, ["box_01"])
    assert [*folded.shown["target"]] == ["box_01", "box_03"] and folded.data is every.data
    assert folded.caption.startswith("Quality; 1 row") and section_mesh.folded(every, [*shown["target"]]) is every


@pytest.mark.parametrize("split, looks", [("family, novel others", 5), ("family, novel others", 0), ("random", 5)])
def test_the_first_screen_says_what_is_named_of_models_that_never_trained(split, looks):
    case = {"split": split, "experiment": "flight", "model": "knn", "training": "clean", "threshold": ""}
    metrics = {"accuracy": 0.9, f"accuracy_{looks}_looks": 0.97, "f1_weighted": 0.5}
    rows = [
        case | {"test_snr_db": snr, "metric": metric, "value": value + snr / 1000, "elevation": "all"}
        for snr in (0.0, 12.0)
        for metric, value in metrics.items()
    ]
    lead, results = pd.DataFrame([case | {"best": True}]), SimpleNamespace(scores=pd.DataFrame(rows), names=NAMES)
    several = ", of single looks and of 5 looks together: 0.90 and 0.97 at 0 dB, 0.91 and 0.98 at 12 dB."
    single = ", of single looks: 0.90 at 0 dB, 0.91 at 12 dB."
    said = f"Of models that never trained KNN names rightly{several if looks else single}"
    assert section_run._named(results, lead) == ("" if split == "random" else said)
