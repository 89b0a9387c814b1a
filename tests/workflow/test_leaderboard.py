"""A benchmark as a stranger meets it: `snakemake benchmark`, and the example of docs/benchmark.md beside others."""

import subprocess
import sys

import pandas as pd
import pytest
from sklearn.metrics import accuracy_score, f1_score, roc_auc_score
from test_docs import blocks
from test_learning import with_fields

from isarflow.learning.evaluation import thresholds
from isarflow.learning.evaluation.judge import MIXES
from isarflow.learning.evaluation.leaderboard import BOARD, KEY, images
from isarflow.setup.config import ROOT
from isarflow.setup.yaml_file import read_yaml

CONFIG = """
name: benchmark
targets:
  '*': null
  dart: {field: fields/dart.zarr, role: known, class: arrow, symmetry: [xz]}
  lance: {field: fields/lance.zarr, role: known, class: arrow}
  disc: {field: fields/disc.zarr, role: known, class: lump}
  ball: {field: fields/ball.zarr, role: known, class: lump}
  kite: {field: fields/kite.zarr, role: unknown}
  cube: {field: fields/cube.zarr, role: other}
radar: {center_frequency: 1.0e+9, bandwidth: 0.4e+9, frequencies: 6, polarizations: [VV, HH]}
aspect: {elevation: {start: 0, stop: 30, step: 10}, azimuth: {count: 40}}
imaging: {aperture: 5}
noise: {snr_db: [12], realizations: 1}
learning:
  experiments:
    '*': null
    variant:
      train: {elevation: all, snr_db: clean}
      models: [knn_magnitude, likelihood]
      open: true
      split: elevation
      without: [lance, ball]
"""
# Point scatterers in metres.
POINTS = {
    "dart": [(0.4, 0, 0), (-0.3, 0.1, 0), (-0.3, -0.1, 0)],
    "lance": [(0.45, 0, 0), (-0.3, 0.15, 0), (-0.3, -0.1, 0)],
    "disc": [(0.05, 0, 0)],
    "ball": [(0.02, 0.02, 0)],
    "kite": [(0.2, 0.2, 0), (-0.2, 0.2, 0), (0.2, -0.3, 0)],
    "cube": [(0.1, 0.1, 0.1), (-0.1, 0.1, -0.1)],
}


@pytest.fixture(scope="module")
def folder(project_of):
    """The folder in which such a benchmark has run."""
    project = with_fields(project_of("benchmark"), "small", CONFIG, POINTS)
    finished = project.run("--cores", 2, "benchmark", "--configfile", "config/small.yaml")
    assert finished.returncode == 0, finished.stdout
    return project.folder


@pytest.fixture(scope="module")
def board(folder):
    return pd.read_csv(folder / "results/benchmark/learning/leaderboard.csv")


def test_every_method_has_a_row_and_the_best_is_first(board):
    methods = [("knn_magnitude", "distance"), *(("likelihood", name) for name in ("likelihood", "rice", "coherence"))]
    assert set(board[["model", "score"]].itertuples(index=False, name=None)) == set(methods) and len(board) == 4
    assert board["f1_weighted_blind"].is_monotonic_decreasing
    assert (board["n"] == 3 * 2 * 40).all()  # lance, ball and kite, at two elevations
    assert not {*MIXES} & {*board}  # no experiment is by family
    for name in (column for column in BOARD if column not in MIXES):
        assert board[name].between(0, 1).all()
        assert ((board[f"{name}_low"] <= board[name]) & (board[name] <= board[f"{name}_high"])).all()


def test_its_metrics_are_those_of_scikit_learn(folder, board):
    (row,) = board[board["model"] == "knn_magnitude"].to_dict("records")
    parts, areas = [], []
    for path in sorted(folder.glob("results/benchmark/learning/predictions/*/knn_magnitude/snr_12dB.csv")):
        table = pd.read_csv(path)
        threshold, test = thresholds.choose(table, "known_distance", "blind"), table[table["side"] == "test"]
        parts.append(test.assign(final=thresholds.apply(test["known_distance"], test["predicted"], threshold)))
        areas.append(roc_auc_score(test["role"] == "known", test["known_distance"]))
    test = pd.concat(parts)
    closed = test[test["role"] == "known"]
    assert set(closed["target"]) == {"lance", "ball"}
    assert row["accuracy"] == pytest.approx(accuracy_score(closed["truth"], closed["predicted"]), abs=1e-4)
    assert row["f1_weighted_blind"] == pytest.approx(
        f1_score(test["truth"], test["final"], average="weighted", zero_division=0), abs=1e-4
    )
    assert row["auroc"] == pytest.approx(sum(areas) / len(areas), abs=1e-4)


def test_the_forest_of_the_page_stands_among_them(folder, board):
    (forest,) = blocks("benchmark.md", "python")
    (command,) = [block for block in blocks("benchmark.md", "sh") if "forest.csv" in block]
    assert len(forest.splitlines()) <= 25
    subprocess.run([sys.executable, "-c", forest], cwd=folder, check=True)
    asked = images(folder / "results/benchmark", "variant", [12])
    assert len(pd.read_csv(folder / "forest.csv")[KEY]) == len(asked)
    scored = subprocess.run(
        [sys.executable, *command.split()[1:]], cwd=folder, check=True, capture_output=True, text=True
    ).stdout
    rows = [line.split()[1:3] for line in scored.splitlines()[1:]]
    assert len(rows) == len(board) + 1 and ["forest", "confidence"] in rows


def test_predictions_of_a_closed_set_have_an_accuracy_alone(folder):
    mine = pd.read_csv(folder / "forest.csv").drop(columns="confidence")
    mine.to_csv(folder / "closed.csv", index=False)
    command = ["-m", "isarflow.learning.evaluation.leaderboard", "results/benchmark", "variant", "closed.csv"]
    scored = subprocess.run([sys.executable, *command], cwd=folder, check=True, capture_output=True, text=True).stdout
    (line,) = [line for line in scored.splitlines() if " closed " in line]
    assert len(line.split()) == 4  # SNR, name, accuracy, its interval


def test_the_benchmark_has_the_dataset_s_targets_and_its_sweep():
    config, default, full, fields = (
        read_yaml(ROOT / f"config/{name}.yaml") for name in ("benchmark", "config", "thesis", "fields")
    )
    solved, mine = default["targets"] | fields["targets"], config["targets"]
    assert mine.pop("*", "") is None and set(mine) == set(solved) and len(mine) == 15
    for name, target in mine.items():
        store = f"resources/fields/{name}.zarr"
        assert "mesh" not in target and target["field"] == store and (ROOT / store).exists()
        assert [target[key] for key in ("role", "symmetry")] == [solved[name][key] for key in ("role", "symmetry")]
    assert config["radar"] == {key: full["radar"][key] for key in ("center_frequency", "bandwidth", "frequencies")}
    assert config["aspect"] == full["aspect"]
