"""Publish what the thesis recommends for later, beside ZNCC and the likelihood: `make recommended`.

    recommended.py results/recommended results/recommended-models

Writes the scores of each run into the folder of its name beside this file, each compressed (xz), and the tables of
docs/recognition.md between their marks.
"""

import sys
from pathlib import Path

import pandas as pd
from recognition import ROOT, head, keep, put, whole

from isarflow.learning.evaluation import judge, paired, record
from isarflow.learning.tables import read_table

RUNS = {  # experiment, which another with the ending CAPSULES goes with: run, words, thresholds
    "random": ("recommended", "azimuths at random", "kept"),
    "elevation": ("recommended", "elevations between the library's", "kept"),
    "place": ("recommended", "the same, place unknown to 0.15 m", "kept"),
    "unseen": ("recommended-models", "models that did not train", "blind"),
}
CAPSULES = "_capsules"
MODELS = {  # words, confidence score of the open set
    "zncc": ("ZNCC", "correlation"),
    "likelihood": ("likelihood", "likelihood"),
    "wiener": ("Wiener filter, then ZNCC", "correlation"),
    "autoencoder": ("autoencoder, then ZNCC", "correlation"),
    "blobs": ("blobs", "assignment"),
    "capsule_small": ("capsule network", "zncc"),
    "capsule": ("capsule network", "zncc"),
    "matrix_capsule": ("matrix capsules", "zncc"),
    "matrix_capsule, activation": ("the same, by activation", "activation"),
}
AGAINST, AT = "zncc", (-6, 0, 6)  # dB, of the differences
SEED = 0
METRICS = "accuracy", "f1_weighted", "auroc"


def main():
    here, roots = Path(__file__).parent, {Path(name).name: Path(name) for name in sys.argv[1:]}
    for name, root in roots.items():
        keep(root / "learning", here / name)
    tables = {name: whole(here / name / "scores.csv.xz") for name in roots}
    page = ROOT / "docs/recognition.md"
    for metric in METRICS:
        put(page, f"recommended {metric}", by_experiment(tables, metric))
    put(page, "recommended costs", costs(roots))
    put(page, "recommended differences", differences(roots))


def of(table, experiment):
    """The rows of an experiment and of that of its capsule networks."""
    return table[table["experiment"].isin([experiment, experiment + CAPSULES])]


def by_experiment(tables, metric):
    """A metric of each model in each of RUNS against SNR with its 95 % interval, in Markdown."""
    lines = []
    for experiment, (run, words, threshold) in RUNS.items():
        table = of(tables[run], experiment)
        threshold = threshold if metric == "f1_weighted" else ""
        table = table[(table["metric"] == metric) & (table["threshold"] == threshold)]
        snrs = sorted(set(table["test_snr_db"]))
        lines = lines or head([f"{snr:g} dB" for snr in snrs], "SNR")
        lines.append(f"| **{words}** {'| ' * len(snrs)}|")
        for model, (title, score) in MODELS.items():
            name, *by = model.split(", ")
            score = "" if metric == "accuracy" else score
            rows = table[(table["model"] == name) & (table["score"] == score)].set_index("test_snr_db")
            if len(rows) and not (by and metric == "accuracy"):
                found = rows.loc[snrs, ["value", "low", "high"]].astype(float).itertuples()
                cells = [f"{one.value:.3f} ({one.low:.2f}\N{EN DASH}{one.high:.2f})" for one in found]
                lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def costs(roots):
    """Processor seconds to train a model, and milliseconds to judge an image, in each of RUNS, in Markdown.

    Those of the jobs as a whole. They are sampled every 30 s: the last seconds of a job are not there.
    """
    lines = head([words for _, words, _ in RUNS.values()], "s to train, ms an image")
    found = {}
    for experiment, (run, *_) in RUNS.items():
        spent = roots[run] / "benchmarks/learning"
        for model, folds in folds_of(roots[run], experiment).items():
            trained, judged = (
                [seconds(spent / job / fold.parent.name, model) for fold in folds] for job in ("train", "predict")
            )
            images = sum(len(read_table(path)) for fold in folds for path in fold.glob("snr_*.csv"))
            found[MODELS[model][0], experiment] = sum(trained) / len(folds), 1000 * sum(judged) / images
    for title in dict.fromkeys(title for title, _ in found):
        cells = [found.get((title, experiment)) for experiment in RUNS]
        cells = [f"{of[0]:.0f}, {of[1]:.{0 if of[1] >= 10 else 1}f}" if of else "" for of in cells]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def seconds(folder, model):
    """Processor seconds of the last run of each of a model's jobs."""
    parts = [folder / f"{model}.tsv", *folder.glob(f"{model}-*.tsv")]
    return sum(float(pd.read_csv(path, sep="\t")["cpu_time"].iloc[-1]) for path in parts if path.exists())


def folds_of(root, experiment):
    """The folders of predictions of each model of an experiment, in order of MODELS and folds."""
    predictions = root / "learning/predictions"
    names = experiment, experiment + CAPSULES
    runs = [path for path in sorted(predictions.iterdir()) if path.name.split("_fold")[0] in names]
    folds = {model: [run / model for run in runs if (run / model).exists()] for model in MODELS}
    return {model: paths for model, paths in folds.items() if paths}


def differences(roots):
    """By how much each model's accuracy and weighted F1 exceed those of AGAINST, image by image, in Markdown."""
    lines = head([f"{name}, {snr} dB" for name in ("accuracy", "F1") for snr in AT], f"less {MODELS[AGAINST][0]}")
    for experiment, (run, words, threshold) in RUNS.items():
        lines.append(f"| **{words}** {'| ' * 2 * len(AT)}|")
        kinds, decided = record.read(roots[run]).kinds if experiment == "unseen" else None, {}
        for model, folds in folds_of(roots[run], experiment).items():
            for snr in AT:
                table = pd.concat([read_table(fold / f"snr_{snr}dB.csv") for fold in folds], ignore_index=True)
                for one in judge.decide(table, kinds=kinds):
                    if (one.score, one.threshold) in (("", ""), (MODELS[model][1], threshold)):
                        decided[model, snr, bool(one.score)] = one
        for model in dict.fromkeys(model for model, *_ in decided if model != AGAINST):
            cells = []
            for is_open, wanted in ((False, "accuracy"), (True, "f1_weighted")):
                for snr in AT:
                    rows = paired.difference(decided[model, snr, is_open], decided[AGAINST, snr, is_open], SEED)
                    ((*_, value, low, high, _),) = [row for row in rows if row[0] == wanted]
                    interval = "" if pd.isna(low) else f" ({low:+.3f} to {high:+.3f})"
                    cells.append(f"{value:+.3f}{interval}".replace("-", "\N{MINUS SIGN}"))
            lines.append(f"| {MODELS[model][0]} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
