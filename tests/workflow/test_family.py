"""A split by family through Snakemake, on fields of point scatterers: whole models on one side, others rejected."""

import json

import pandas as pd
import pytest
from test_learning import with_fields

from isarflow import benchmark
from isarflow.learning.classifier import load_classifier
from isarflow.learning.evaluation import paired

CONFIG = """
name: kinds
targets:
  '*': null
{targets}
radar: {{center_frequency: 1.0e+9, bandwidth: 0.4e+9, frequencies: 6, polarizations: [VV, HH]}}
aspect: {{elevation: {{start: 0, stop: 30, step: 10}}, azimuth: {{count: 40}}}}
imaging: {{aperture: 5}}
noise: {{snr_db: [20], realizations: 1}}
learning:
  models:
    invariants: {{rounds: 10, leaves: 4}}
    cnn: {{width: 2, epochs: 1}}
  experiments:
    '*': null
    novel:
      train: {{elevation: all, snr_db: clean}}
      models: [likelihood_other, invariants, sum, cnn]
      open: true
      split: {{scheme: family, others: novel}}
      folds: [1, 2]
    seen:
      train: {{elevation: all, snr_db: clean}}
      models: [invariants]
      open: true
      split: {{scheme: family, others: seen}}
      folds: [5]
"""
KINDS = ("--configfile", "config/kinds.yaml")


def models():
    """Lines of targets, and their points: darts, discs of several sizes, and five things of a kind each."""
    lines, points = [], {}
    for number in range(1, 6):
        size = 0.8 + 0.1 * number
        points[f"dart_{number}"] = [(0.4 * size, 0, 0), (-0.3, 0.1 * size, 0), (-0.3, -0.1 * size, 0)]
        points[f"disc_{number}"] = [(0.05 * size, 0, 0), (0, 0, 0.1 * size)]
        points[f"thing_{number}"] = [(0.1 * number, 0.1, 0), (-0.1, 0.06 * number, 0.1), (0.02, -0.4, 0)]
        for name in ("dart", "disc"):
            lines.append(f"{name}_{number}: {{field: fields/{name}_{number}.zarr, role: known, class: {name}}}")
        lines.append(f"thing_{number}: {{field: fields/thing_{number}.zarr, role: other, kind: kind{number}}}")
    return "\n".join(f"  {line}" for line in lines), points


@pytest.fixture(scope="module")
def project(project_of):
    lines, points = models()
    project = with_fields(project_of("family"), "kinds", CONFIG.format(targets=lines), points)
    finished = project.run("--cores", 2, "report", *KINDS)
    assert finished.returncode == 0, finished.stdout
    return project


def test_models_are_tested_that_did_not_train_and_others_as_unknown(project):
    learning = project.folder / "results/kinds/learning"
    for run in ("novel_fold1", "novel_fold2", "seen_fold5"):
        sides = None
        for folder in sorted((learning / "models" / run).iterdir()):
            sides = json.loads((folder / "split.json").read_text())["division"]["settings"]["sides"]
            observed = json.loads((folder / "config.json").read_text())["observations"]
            assert observed == {"dart": 480, "disc": 480, "other": 480}  # three models of 160 views each
            table = pd.read_csv(learning / "predictions" / run / folder.name / "snr_20dB.csv")
            assert {*table["target"]} == {name for name, side in sides.items() if side != "train"}
            roles = table.groupby("target")["role"].unique().map(list)
            for name, role in roles.items():
                tested = {"validation": "other", "test": "unknown"}[sides[name]]
                assert role == ["known" if "thing" not in name else tested]
            assert not table["predicted"].eq("other").any()
        assert sides is not None and sorted(sides.values()).count("test") == 3


def test_scores_have_the_mixes_and_the_page_the_split(project):
    scores = pd.read_csv(project.folder / "results/kinds/learning/scores.csv")
    assert {*scores["split"]} == {"family, novel others", "family, seen others"}
    opened = scores[scores["score"].notna()]
    for model in ("likelihood_other", "invariants", "sum", "cnn"):
        of_model = opened[opened["model"] == model]
        assert {"blind", "kept", "mix"} == {*of_model["threshold"].dropna()}
        assert {"f1_balanced", "f1_mix", "auroc"} <= {*of_model["metric"]}
    page = (project.folder / "results/kinds/report/index.html").read_text()
    assert "split by model, other things of new kinds" in page


def test_a_sum_adds_the_predictions_of_its_members(project):
    learning, run = project.folder / "results/kinds/learning", "novel_fold1"
    model = load_classifier(learning / "models" / run / "sum")
    paths = [
        learning / "predictions" / run / name / "snr_20dB.csv" for name in ("likelihood_other", "invariants", "sum")
    ]
    *members, total = map(pd.read_csv, paths)
    assert all(total[column].equals(member[column]) for member in members for column in ("target", "azimuth", "side"))
    for score, of_members in (
        ("known_sum", ("known_likelihood", "known_margin")),
        ("score_dart", ("score_dart",) * 2),
        ("score_disc", ("score_disc",) * 2),
    ):
        added = sum(member[of] / by for member, of, by in zip(members, of_members, model.spreads_, strict=True))
        assert total[score].to_numpy() == pytest.approx(added.to_numpy(), rel=1e-6, abs=1e-6)
    assert total["predicted"].eq("disc").equals(total["score_disc"] > total["score_dart"])


def test_predictions_of_others_are_scored_by_family_as_the_runs_own(project):
    run = project.folder / "results/kinds"
    paths = sorted(run.glob("learning/predictions/novel_fold*/cnn/snr_20dB.csv"))
    table = pd.concat(map(pd.read_csv, paths)).assign(test_snr_db=20.0)
    mine = benchmark.score(run, "novel", table.rename(columns={"known_margin": "confidence"}))
    ours = pd.read_csv(run / "learning/scores.csv", keep_default_na=False)
    key = ["threshold", "fold", "metric"]
    ours = ours[(ours["model"] == "cnn") & (ours["split"] == "family, novel others") & (ours["elevation"] == "all")]
    ours = ours[~ours["metric"].str.contains("look|gain") & (ours["snr_definition"] == "peak_3db")]
    both = mine.astype({"fold": str}).merge(ours.astype({"fold": str}), on=[*key, "n"], suffixes=("", "_of_run"))
    assert {"f1_mix", "f1_balanced", "auroc"} < {*both["metric"]} and len(both) >= len(mine)
    for name in ("value", "low", "high"):
        assert both[name].to_numpy(float) == pytest.approx(
            pd.to_numeric(both[f"{name}_of_run"]).to_numpy(), nan_ok=True
        )
    compared = paired.differences({"one": run, "other": run}, 0, 0.95)
    assert {*compared["threshold"]} == {"", "blind", "kept", "mix"} and (compared["difference"] == 0).all()
    trained = benchmark.training(run, "novel")
    assert trained.groupby(["fold", "truth"]).size().eq(480).all() and {*trained["truth"]} == {"dart", "disc", "other"}
    board = benchmark.leaderboard(ours.assign(value=pd.to_numeric(ours["value"]), test_snr_db=20.0))
    assert board["f1_mix"].notna().all() and board["f1_balanced"].notna().all()


def test_training_waits_for_no_model_that_is_tested(project):
    sides = json.loads((project.folder / "results/kinds/learning/models/novel_fold1/cnn/split.json").read_text())
    assert {name for name, side in sides["division"]["settings"]["sides"].items() if side == "test"}.isdisjoint(
        sides["targets"]
    )
