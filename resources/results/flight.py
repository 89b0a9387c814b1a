"""Publish the run in flight, or one of those that lead there: `make flight`, `make flight-steps`.

    flight.py results/flight
    flight.py results/flight-metal
    flight.py results/flight-otherwise

Writes a run's scores into the folder of its name beside this file, compressed (xz), and of the one in flight how well
drones and birds alone are told apart, and each class from the rest. Then, of all three as they are kept, it writes the
tables of docs/flight.md between their marks, and its figure, which the repository's README.md shows.
"""

import itertools
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from recognition import ROOT, head, keep, put, whole
from sklearn.metrics import roc_auc_score

from isarflow.core.sweep import azimuths
from isarflow.learning.classifier import OTHER
from isarflow.learning.evaluation import judge, metrics, thresholds
from isarflow.learning.evaluation.looks import fused
from isarflow.learning.tables import KNOWN, SCORE, read_table
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

METAL, OTHERWISE, FLIGHT = "flight-metal", "flight-otherwise", "flight"
LIBRARY, BEST = ("likelihood_other", "likelihood"), ("sum", "sum")  # models, and their scores
STEPS = {  # words of a curve: run, experiment, model, its score
    "laboratory": (METAL, "laboratory", "likelihood", "likelihood"),
    "+ place unknown": (METAL, "place", "likelihood", "likelihood"),
    "+ drift, jitter, lost pulses": (METAL, "drift", "likelihood", "likelihood"),
    "+ other models": (METAL, "models", *LIBRARY),
    "+ materials": (OTHERWISE, "still", *LIBRARY),
    "+ blades and wings move: in flight": (FLIGHT, "flight", *LIBRARY),
}
WHAT_IF = {  # what is otherwise than in flight: run, experiment
    "in flight": (FLIGHT, "flight"),
    "blades and wings that stand still": (OTHERWISE, "still"),
    "on a turntable: place and path known, all pulses": (OTHERWISE, "placed"),
    "VV alone": (OTHERWISE, "one_channel"),
}
MODELS = {"likelihood_other": "likelihood", "cnn": "margin", "sum": "sum"}  # with their score
LOOKS = 1, 3, 5
PAIR = "drone", "bird"
THRESHOLD = "blind"
SHOWN_SNR = 12  # dB
COLOURS = ("C0", "C9", "C2", "C4", "C1", "C3")
METRICS = {"accuracy": "accuracy", "f1_weighted": "weighted F1, open set"}
# Of the steps, whose shares of things to be rejected differ: F1 where each true label weighs the same.
COMPARABLE = {"accuracy": "Drone, bird or missile", "f1_balanced": "Drone, bird, missile or none of them"}
BALANCED = "F1, all labels weigh alike"


def main():
    here, run = Path(__file__).parent, Path(sys.argv[1])
    keep(run / "learning", here / run.name)
    config = load_config(read_yaml(ROOT / "config/flight.yaml"))
    made = {FLIGHT: (pair, apart, bounds), METAL: (balanced,)}
    for of_run in made.get(run.name, ()):
        path = here / run.name / f"{of_run.__name__}.csv"
        of_run(run / "learning", config).to_csv(path, index=False, float_format="%.6g")
    tables = {name: whole(here / name / "scores.csv.xz") for name in (METAL, OTHERWISE, FLIGHT)}
    tables[METAL] = pd.concat([tables[METAL], pd.read_csv(here / METAL / "balanced.csv", keep_default_na=False)])
    draw(tables, ROOT / "docs/img/flight.svg")
    page = ROOT / "docs/flight.md"
    for metric in COMPARABLE:
        put(page, metric, ladder(tables, metric))
    for metric in METRICS:
        put(page, f"{metric} in flight", in_flight(tables[FLIGHT], metric))
    confusion = pd.read_csv(here / FLIGHT / "confusion.csv.xz", keep_default_na=False)
    put(page, "taken for", taken_for(confusion))
    put(page, "otherwise", otherwise(tables))
    put(page, "apart", of_apart(pd.read_csv(here / FLIGHT / "apart.csv")))
    put(page, "bounds", of_bounds(pd.read_csv(here / FLIGHT / "bounds.csv")))
    put(page, "drone or bird", of_pair(pd.read_csv(here / FLIGHT / "pair.csv")))


def of(table, experiment, model, score, metric, count=1):
    """Values and intervals of a metric of so many looks by SNR. Of a known target's label there is no score."""
    name, threshold = metric if count == 1 else f"{metric}_{count}_looks", THRESHOLD
    score, threshold = ("", "") if metric == "accuracy" else (score, threshold)
    rows = table[(table["experiment"] == experiment) & (table["model"] == model) & (table["metric"] == name)]
    rows = rows[(rows["score"] == score) & (rows["threshold"] == threshold)].set_index("test_snr_db").sort_index()
    return rows[["value", "low", "high"]].apply(pd.to_numeric)


def ladder(tables, metric):
    """A metric of one look at each of STEPS against SNR with its 95 % interval, in Markdown."""
    return _table({words: of(tables[run], *what, metric) for words, (run, *what) in STEPS.items()}, "what is lifted")


def in_flight(table, metric):
    """The same of each model, and of several looks, in flight."""
    rows = {}
    for model, score in MODELS.items():
        for count in LOOKS:
            found = of(table, FLIGHT, model, score, metric, count)
            if len(found):
                rows[f"{model}, {_looks(count)}"] = found
    return _table(rows, "model")


def otherwise(tables):
    """METRICS of the library at SHOWN_SNR, of one look and of five, where one thing is otherwise, in Markdown."""
    cases = [(metric, count) for metric in METRICS for count in (LOOKS[0], LOOKS[-1])]
    lines = head([f"{METRICS[metric]}, {_looks(count)}" for metric, count in cases], "library")
    for name, (run, experiment) in WHAT_IF.items():
        rows = (of(tables[run], experiment, *LIBRARY, *case).loc[SHOWN_SNR] for case in cases)
        lines.append(f"| {name} | {' | '.join(map(_cell, rows))} |")
    return "\n".join(lines) + "\n"


def folds_of(learning, experiment, model, snr):
    """The prediction tables of each fold of an experiment at one SNR."""
    return [*map(read_table, sorted(learning.glob(f"predictions/{experiment}_fold*/{model}/snr_{snr}dB.csv")))]


def decision(folds, score, kinds=None):
    """The `judge.Decision` of all folds' tables by a score and THRESHOLD."""
    decided = judge.decide(pd.concat(folds, ignore_index=True), kinds=kinds)
    (found,) = (one for one in decided if (one.score, one.threshold) == (score, THRESHOLD))
    return found


def pair(learning, config):
    """Accuracy in flight where only PAIR are known and tested: model, looks, SNR, its value and interval, of each."""
    kinds = {name: target["kind"] for name, target in config["targets"].items()}
    step, rows = np.diff(azimuths(config["aspect"]))[0], []
    for model, snr in itertools.product(MODELS, config["noise"]["snr_db"]):
        table = pd.concat(folds_of(learning, FLIGHT, model, snr), ignore_index=True)
        table = table[table["truth"].isin(PAIR)].drop(columns=[name for name in table if name.startswith(KNOWN)])
        scores = table[[SCORE + label for label in PAIR]]
        table = table.drop(columns=[name for name in table if name.startswith(SCORE)]).join(scores)
        table["predicted"] = scores.idxmax(axis=1).str.removeprefix(SCORE)
        for count in LOOKS:
            (closed,) = judge.decide(fused(table, count, step, config["imaging"]["aperture"]), kinds=kinds)
            (found,) = (row for row in judge.rows(closed, config["seed"]) if row[:2] == ("", "accuracy"))
            rows.append((model, count, snr, *found[2:5]))
    return pd.DataFrame(rows, columns=["model", "looks", "test_snr_db", "value", "low", "high"])


def apart(learning, config):
    """AUROC in flight of each class against what is of none, one look, mean over folds: model, class, SNR, value."""
    rows = []
    for (model, score), snr in itertools.product(MODELS.items(), config["noise"]["snr_db"]):
        values = {}
        for table in folds_of(learning, FLIGHT, model, snr):
            table = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
            for label in set(table["truth"]) - {OTHER}:
                both = table[table["truth"].isin([label, OTHER])]
                value = roc_auc_score(both["truth"] == label, both[KNOWN + score])
                values.setdefault(label, []).append(value)
        rows += [(model, label, snr, np.mean(of)) for label, of in sorted(values.items())]
    return pd.DataFrame(rows, columns=["model", "class", "test_snr_db", "auroc"])


def bounds(learning, config):
    """Weighted F1 in flight of BEST at SHOWN_SNR, one look, with all images and without missiles: case and both."""
    model, score = BEST
    kinds = {name: target["kind"] for name, target in config["targets"].items()}
    judged = decision(folds_of(learning, FLIGHT, model, SHOWN_SNR), score, kinds)
    values, truth, named = (judged.test[name].to_numpy() for name in (KNOWN + score, "truth", "predicted"))
    cases = {
        f"thresholds `{THRESHOLD}`": judged.predicted,
        "the threshold that is best for the tested images": thresholds.apply(
            values, named, thresholds.best(values, truth, named)
        ),
        "every image is rejected": np.full(len(truth), OTHER),
    }
    rows = [
        (case, _f1(truth, of), _f1(*(part[truth != "missile"] for part in (truth, of)))) for case, of in cases.items()
    ]
    return pd.DataFrame(rows, columns=["case", "all", "without missiles"])


def _f1(truth, predicted):
    return metrics.metrics_of_labels(truth, predicted)["f1_weighted"]


def of_bounds(table):
    """The table of `bounds` in Markdown."""
    lines = head(table.columns[1:], "weighted F1")
    lines += [
        f"| {row.iloc[0]} | {' | '.join(f'{value:.3f}' for value in row.iloc[1:])} |" for _, row in table.iterrows()
    ]
    return "\n".join(lines) + "\n"


def balanced(learning, config):
    """F1 with each true label of the same weight, of the steps whose targets trained: as rows of a table of scores."""
    rows = []
    for _, experiment, model, score in STEPS.values():
        for snr in config["noise"]["snr_db"]:
            folds = folds_of(learning, experiment, model, snr)
            if model == LIBRARY[0] or not folds:  # by family the scores have it
                continue
            judged = decision(folds, score)
            # Of one kind all, so that arcs of azimuth are drawn without strata.
            judged = replace(judged, kinds=dict.fromkeys(judged.test["target"], ""))
            (found,) = (row for row in judge.rows(judged, config["seed"]) if row[:2] == ("", "f1_balanced"))
            rows.append((experiment, model, score, THRESHOLD, snr, *found[1:5]))
    columns = ["experiment", "model", "score", "threshold", "test_snr_db", "metric", "value", "low", "high"]
    return pd.DataFrame(rows, columns=columns)


def of_apart(table):
    """The table of `apart` in Markdown, of BEST."""
    cells = table[table["model"] == BEST[0]].pivot(index="class", columns="test_snr_db", values="auroc")
    lines = head([f"{snr:g} dB" for snr in cells], "class")
    lines += [f"| {label} | {' | '.join(f'{value:.2f}' for value in row)} |" for label, row in cells.iterrows()]
    return "\n".join(lines) + "\n"


def of_pair(table):
    """The table of `pair` in Markdown."""
    rows = {f"{model}, {_looks(count)}": of for (model, count), of in table.groupby(["model", "looks"], sort=False)}
    return _table({words: of.set_index("test_snr_db") for words, of in rows.items()}, "model")


def _looks(count):
    return f"{count} look{'s' if count > 1 else ''}"


def _table(rows, first):
    snrs = sorted(set().union(*(values.index for values in rows.values())))
    lines = head([f"{snr:g} dB" for snr in snrs], first)
    for words, values in rows.items():
        lines.append(
            f"| {words} | {' | '.join(_cell(values.loc[snr]) if snr in values.index else '' for snr in snrs)} |"
        )
    return "\n".join(lines) + "\n"


def _cell(row):
    interval = "" if pd.isna(row.low) else f" ({row.low:.2f}\N{EN DASH}{row.high:.2f})"
    return f"{row.value:.3f}{interval}"


def taken_for(confusion):
    """What images of each kind are taken for in flight at SHOWN_SNR, in shares, in Markdown."""
    rows = confusion[(confusion["experiment"] == FLIGHT) & (confusion["model"] == BEST[0])]
    rows = rows[(rows["threshold"] == THRESHOLD) & (rows["test_snr_db"] == SHOWN_SNR) & (rows["elevation"] == "all")]
    rows = rows.assign(kind=rows["target"].str.replace(r"_\d+$", "", regex=True))
    counts = rows.pivot_table(index="kind", columns="predicted", values="count", aggfunc="sum").fillna(0)
    shares = counts.div(counts.sum(axis=1), axis=0)
    labels = [label for label in ("drone", "bird", "missile", "other") if label in shares]
    lines = head(labels, "kind")
    for kind, row in shares.sort_values(labels, ascending=False).iterrows():
        lines.append(f"| {kind} | {' | '.join(f'{row[label]:.2f}' for label in labels)} |")
    return "\n".join(lines) + "\n"


def draw(tables, path):
    """Draw COMPARABLE of each of STEPS against SNR with 95 % intervals, and in flight of BEST, too."""
    plt.rcParams.update({"svg.hashsalt": "isarflow", "font.size": 10})
    figure, columns = plt.subplots(1, 2, figsize=(10, 4.2), sharex=True, layout="constrained")
    for axes, (metric, title) in zip(columns, COMPARABLE.items(), strict=True):
        curves = {words: (of(tables[run], *what, metric), "o-") for words, (run, *what) in STEPS.items()}
        for style, count in (("o--", LOOKS[0]), ("s:", LOOKS[-1])):
            rows = of(tables[FLIGHT], FLIGHT, *BEST, metric, count)
            curves[f"in flight, with a network, {_looks(count)}"] = rows, style
        for colour, (words, (rows, style)) in zip((*COLOURS, "k", "k"), curves.items(), strict=True):
            width = 3 if words.endswith("materials") else 1.5  # it lies under that of turning blades
            axes.plot(rows.index, rows["value"], style, color=colour, label=words, ms=4, lw=width)
            axes.fill_between(rows.index, rows["low"], rows["high"], color=colour, alpha=0.08, lw=0)
        axes.set(title=title, xlabel="SNR [dB]", xticks=rows.index, ylim=(None, 1.01))
        axes.grid(alpha=0.3)
    columns[0].set_ylabel("accuracy")
    columns[1].set_ylabel(BALANCED)
    columns[0].legend(loc="lower right", fontsize=8)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    main()
