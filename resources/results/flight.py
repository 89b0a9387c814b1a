"""Publish the run in flight, or the one where a thing is otherwise: `make flight`, `make flight-otherwise`.

    flight.py results/flight
    flight.py results/flight-otherwise

Writes a run's scores into the folder of its name beside this file, compressed (xz), and of the one in flight how well
drones and birds alone are told apart, and each class from the rest. Then, of both as they are kept, it writes the
tables of docs/flight.md between their marks, and its figure.
"""

import itertools
import sys
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
from isarflow.learning.evaluation import judge
from isarflow.learning.evaluation.looks import fused
from isarflow.learning.tables import KNOWN, SCORE, read_table
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

OTHERWISE, FLIGHT = "flight-otherwise", "flight"
LIBRARY, BEST = ("likelihood_other", "likelihood"), ("sum", "sum")  # models, and their scores
WHAT_IF = {  # what is otherwise than in flight: run, experiment
    "as it is": (FLIGHT, "flight"),
    "blades that stand still": (OTHERWISE, "still"),
    "on a turntable: place and path known, all pulses": (OTHERWISE, "placed"),
    "VV alone": (OTHERWISE, "one_channel"),
}
MODELS = {"likelihood_other": "likelihood", "cnn": "margin", "sum": "sum"}  # with their score
LOOKS = 1, 3, 5
PAIR = "drone", "bird"
THRESHOLD = "blind"
SHOWN_SNR = 12  # dB
COLOURS = {"likelihood_other": "C0", "cnn": "C1", "sum": "k"}
METRICS = "accuracy", "f1_weighted"
SHOWN = {  # of the figure
    "pair": "Drone or bird: accuracy",
    "accuracy": "Drone, bird or missile: accuracy",
    "f1_weighted": "Or none of them: weighted F1",
}


def main():
    here, run = Path(__file__).parent, Path(sys.argv[1])
    keep(run / "learning", here / run.name)
    if run.name == FLIGHT:
        config = load_config(read_yaml(ROOT / "config/flight.yaml"))
        for name, of_run in (("pair", pair), ("apart", apart)):
            of_run(run / "learning", config).to_csv(here / FLIGHT / f"{name}.csv", index=False, float_format="%.6g")
    tables = {name: whole(here / name / "scores.csv.xz") for name in (OTHERWISE, FLIGHT)}
    drones_or_birds = pd.read_csv(here / FLIGHT / "pair.csv")
    draw(tables[FLIGHT], drones_or_birds, ROOT / "docs/img/flight.svg")
    page = ROOT / "docs/flight.md"
    for metric in METRICS:
        put(page, f"{metric} in flight", in_flight(tables[FLIGHT], metric))
    confusion = pd.read_csv(here / FLIGHT / "confusion.csv.xz", keep_default_na=False)
    put(page, "taken for", taken_for(confusion))
    put(page, "otherwise", otherwise(tables))
    put(page, "apart", of_apart(pd.read_csv(here / FLIGHT / "apart.csv")))
    put(page, "drone or bird", of_pair(drones_or_birds))


def of(table, experiment, model, score, metric, count=1):
    """Values and intervals of a metric of so many looks by SNR. Of a known target's label there is no score."""
    name, threshold = metric if count == 1 else f"{metric}_{count}_looks", THRESHOLD
    score, threshold = ("", "") if metric == "accuracy" else (score, threshold)
    rows = table[(table["experiment"] == experiment) & (table["model"] == model) & (table["metric"] == name)]
    rows = rows[(rows["score"] == score) & (rows["threshold"] == threshold)].set_index("test_snr_db").sort_index()
    return rows[["value", "low", "high"]].apply(pd.to_numeric)


def in_flight(table, metric):
    """A metric of each model in flight, of one look and of several, in Markdown."""
    cases = itertools.product(MODELS, LOOKS)
    rows = {f"{model}, {_looks(n)}": of(table, FLIGHT, model, MODELS[model], metric, n) for model, n in cases}
    return _table(rows)


def otherwise(tables):
    """METRICS of the library at SHOWN_SNR, of one look and of five, where one thing is otherwise, in Markdown."""
    cases = [(metric, count) for metric in METRICS for count in (LOOKS[0], LOOKS[-1])]
    words = {"accuracy": "accuracy", "f1_weighted": "weighted F1, open set"}
    lines = head([f"{words[metric]}, {_looks(count)}" for metric, count in cases], "")
    for name, (run, experiment) in WHAT_IF.items():
        rows = (of(tables[run], experiment, *LIBRARY, *case).loc[SHOWN_SNR] for case in cases)
        lines.append(f"| {name} | {' | '.join(map(_cell, rows))} |")
    return "\n".join(lines) + "\n"


def pair(learning, config):
    """Accuracy in flight where only PAIR are known and tested: model, looks, SNR, its value and interval, of each."""
    kinds = {name: target["kind"] for name, target in config["targets"].items()}
    step, rows = np.diff(azimuths(config["aspect"]))[0], []
    for model, snr in itertools.product(MODELS, config["noise"]["snr_db"]):
        paths = sorted(learning.glob(f"predictions/{FLIGHT}_fold*/{model}/snr_{snr}dB.csv"))
        table = pd.concat(map(read_table, paths), ignore_index=True)
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
        for path in sorted(learning.glob(f"predictions/{FLIGHT}_fold*/{model}/snr_{snr}dB.csv")):
            table = read_table(path)
            table = table[(table["side"] == "test") & table["role"].isin(["known", "unknown"])]
            for label in set(table["truth"]) - {OTHER}:
                both = table[table["truth"].isin([label, OTHER])]
                value = roc_auc_score(both["truth"] == label, both[KNOWN + score])
                values.setdefault(label, []).append(value)
        rows += [(model, label, snr, np.mean(of)) for label, of in sorted(values.items())]
    return pd.DataFrame(rows, columns=["model", "class", "test_snr_db", "auroc"])


def of_apart(table):
    """The table of `apart` in Markdown, of BEST."""
    cells = table[table["model"] == BEST[0]].pivot(index="class", columns="test_snr_db", values="auroc")
    lines = head([f"{snr:g} dB" for snr in cells], "class")
    lines += [f"| {label} | {' | '.join(f'{value:.2f}' for value in row)} |" for label, row in cells.iterrows()]
    return "\n".join(lines) + "\n"


def of_pair(table):
    """The table of `pair` in Markdown."""
    rows = {f"{model}, {_looks(count)}": of for (model, count), of in table.groupby(["model", "looks"], sort=False)}
    return _table({words: of.set_index("test_snr_db") for words, of in rows.items()})


def _looks(count):
    return f"{count} look{'s' if count > 1 else ''}"


def _table(rows):
    snrs = next(iter(rows.values())).index
    lines = head([f"{snr:g} dB" for snr in snrs], "model")
    lines += [f"| {words} | {' | '.join(_cell(of.loc[snr]) for snr in snrs)} |" for words, of in rows.items()]
    return "\n".join(lines) + "\n"


def _cell(row):
    return f"{row.value:.3f} ({row.low:.2f}\N{EN DASH}{row.high:.2f})"


def taken_for(confusion):
    """What images of each kind are taken for in flight at SHOWN_SNR, in shares, in Markdown."""
    rows = confusion[(confusion["experiment"] == FLIGHT) & (confusion["model"] == BEST[0])]
    rows = rows[(rows["threshold"] == THRESHOLD) & (rows["test_snr_db"] == SHOWN_SNR) & (rows["elevation"] == "all")]
    rows = rows.assign(kind=rows["target"].str.replace(r"_\d+$", "", regex=True))
    counts = rows.pivot_table(index="kind", columns="predicted", values="count", aggfunc="sum").fillna(0)
    shares = counts.div(counts.sum(axis=1), axis=0)
    labels = ["drone", "bird", "missile", OTHER]
    lines = head(labels, "kind")
    for kind, row in shares.sort_values(labels, ascending=False).iterrows():
        lines.append(f"| {kind} | {' | '.join(f'{row[label]:.2f}' for label in labels)} |")
    return "\n".join(lines) + "\n"


def draw(table, drones_or_birds, path):
    """Draw what MODELS reach in flight against SNR, of one look and of the most, with 95 % intervals."""
    plt.rcParams.update({"svg.hashsalt": "isarflow", "font.size": 10})
    figure, columns = plt.subplots(1, 3, figsize=(12, 4.2), sharex=True, layout="constrained")
    for axes, (metric, title) in zip(columns, SHOWN.items(), strict=True):
        for model, count in itertools.product(MODELS, (LOOKS[0], LOOKS[-1])):
            if metric == "pair":
                chosen = (drones_or_birds["model"] == model) & (drones_or_birds["looks"] == count)
                rows = drones_or_birds[chosen].set_index("test_snr_db")
            else:
                rows = of(table, FLIGHT, model, MODELS[model], metric, count)
            style = "o-" if count == 1 else "s--"
            axes.plot(rows.index, rows["value"], style, color=COLOURS[model], label=f"{model}, {_looks(count)}", ms=4)
            axes.fill_between(rows.index, rows["low"], rows["high"], color=COLOURS[model], alpha=0.07, lw=0)
        axes.set(title=title, xlabel="SNR [dB]", xticks=rows.index, ylim=(None, 1.01))
        axes.grid(alpha=0.3)
    columns[0].legend(loc="lower right", fontsize=8)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    main()
