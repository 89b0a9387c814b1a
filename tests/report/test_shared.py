"""What all sections share: the vocabulary of scores, the table builder, panels and curves."""

import numpy as np
import pandas as pd
import pytest

from isarflow.core.kinds import page_names
from isarflow.report import layout, plots, vocabulary

NAMES = vocabulary.Names(
    page_names({"lr": {}, "svm": {}, "knn": {}, "capsule": {}, "own": {"kind": "lr"}, "lr_tuned": {"kind": "lr"}})
)


def test_models_and_scores_have_the_names_that_their_files_state_and_come_in_that_order():
    table = pd.DataFrame({"model": ["own", "capsule", "lr_tuned", "mine", "lr"]}).assign(score="energy")
    assert NAMES.values(table, "model") == ["lr", "lr_tuned", "capsule", "mine", "own"]
    assert [NAMES.model(name).label for name in ("lr_tuned", "own", "my_net")] == ["LR, tuned", "own", "my_net"]
    assert NAMES.model("capsule").words == "the capsule network" and NAMES.model("my_net").words == "my net"
    assert [NAMES.score(name).label for name in ("noise_zncc", "my_error")] == ["ZNCC, noise taken out", "my error"]
    assert NAMES.method("capsule", "zncc") == "capsule, ZNCC" and NAMES.method("knn", "") == "KNN"
    # Each of those that state a place has a colour and marker of its own.
    looks = [NAMES.model(name) for name in ("lr", "lr_tuned", "svm", "knn", "capsule")]
    assert len({(look.color, look.marker) for look in looks}) == len(looks)


def test_groups_stand_in_the_order_of_the_page():
    rows = [
        ("random", "a", "svm", "clean", np.nan),
        ("random", "a", "svm", "12 dB", 12.0),
        ("random", "a", "svm", "2.5 dB", 2.5),
        ("random", "a", "lr", "clean", np.nan),
        ("sector", "z", "lr", "clean", np.nan),
    ]
    table = pd.DataFrame(rows, columns=["split", "experiment", "model", "training", "train_snr_db"])
    assert NAMES.values(table, "experiment") == ["z", "a"]
    assert [values for values, _ in NAMES.groups(table, "experiment", "model", "training")] == [
        ("z", "lr", "clean"),
        ("a", "lr", "clean"),
        ("a", "svm", "2.5 dB"),
        ("a", "svm", "12 dB"),
        ("a", "svm", "clean"),
    ]


def test_rows_are_selected_by_a_value_or_by_several():
    table = pd.DataFrame({"model": ["lr", "lr", "svm"], "test_snr_db": [0, 6, 6]})
    assert vocabulary.select(table, model="lr", test_snr_db=6).index.tolist() == [1]
    assert vocabulary.select(table, test_snr_db=[0, 6], model=("svm",)).index.tolist() == [2]
    assert vocabulary.at_highest(table).index.tolist() == [1, 2]


def test_a_table_is_written_as_its_columns_say():
    data = pd.DataFrame({"target": ["a", "b"], "count": [1234, 5], "share": [0.25, np.nan]})
    shown = {"target": "{target}", "count": "{count:,}", "share": lambda row: layout.number(row["share"], 1)}
    table = layout.table("x", data, shown, "")
    assert table.shown.to_dict("records") == [
        {"target": "a", "count": "1,234", "share": "0.2"},
        {"target": "b", "count": "5", "share": "–"},
    ]
    assert table.data is data and table.text_columns == ["target"]


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


def test_a_value_without_an_interval_stands_alone():
    row = {"value": 0.91239, "low": 0.8, "high": 0.95}
    assert vocabulary.with_interval(row) == "0.912 [0.800, 0.950]"
    assert vocabulary.with_interval(row | {"low": np.nan, "high": np.nan}) == "0.912"


def test_a_run_is_called_by_its_experiment_and_if_asked_for_by_its_fold():
    run = {"name": "sector_fold1_snr_6dB_fold3", "division": {"fold": 3}}
    assert vocabulary.run_title(run) == "sector fold1 snr 6dB"
    assert vocabulary.run_title(run, fold=True) == "sector fold1 snr 6dB, fold 3"
    whole = {"name": "multi_elevation", "division": {"fold": 0}}
    assert vocabulary.run_title(whole, fold=True) == "multi elevation"
