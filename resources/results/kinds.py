"""Publish the run by family: `make kinds`.

    kinds.py results/kinds

Writes its scores and leaderboard into the folder kinds/ beside this file, scores compressed (xz), the tables of
docs/kinds.md between their marks, and its figure of who is taken for whom.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import picture
from PIL import Image
from recognition import ROOT, head, keep, put, whole

from isarflow.learning.classifier import OTHER
from isarflow.mesh.families import solid
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

OTHERS = {"novel": "of kinds that never trained", "seen": "of kinds that trained, other models"}
MODELS = {"likelihood_other": "likelihood", "invariants": "margin", "cnn": "margin", "sum": "sum"}  # with their score
SHOWN, SHOWN_SNR = "sum", 12  # of the figure
LOOKS = 1, 3, 5
METRICS = {"auroc": ("AUROC", ""), "f1_mix": ("F1 at the mix", "mix"), "f1_balanced": ("balanced F1", "blind")}
COLORS = {"drone": "#4477aa", "missile": "#228833", OTHER: "#cccccc"}


def main():
    learning, folder = Path(sys.argv[1], "learning"), Path(__file__).parent / "kinds"
    keep(learning, folder)
    (folder / "leaderboard.csv").write_bytes((learning / "leaderboard.csv").read_bytes())
    table, page = whole(folder / "scores.csv.xz"), ROOT / "docs/kinds.md"
    for snr in sorted(set(table["test_snr_db"])):
        put(page, f"{snr:g} dB", by_split(table[table["test_snr_db"] == snr]))
    draw(pd.read_csv(folder / "confusion.csv.xz", keep_default_na=False), ROOT / "docs/img/kinds.png")


def by_split(table):
    """The closed set's accuracy and METRICS of one or more looks, of each model by each split, in Markdown."""
    columns = [f"{name}, {count}" for name, _ in METRICS.values() for count in LOOKS]
    lines = head(["closed", *columns], "other things")
    for others, words in OTHERS.items():
        lines.append(f"| **{words}** {'| ' * (1 + len(columns))}|")
        for model, score in MODELS.items():
            rows = table[(table["split"] == f"family, {others} others") & (table["model"] == model)]
            cells = [_value(rows, "accuracy", "", "")]
            for metric, (_, threshold) in METRICS.items():
                names = [metric if count == 1 else f"{metric}_{count}_looks" for count in LOOKS]
                cells += [_value(rows, name, threshold, score, name == metric) for name in names]
            lines.append(f"| {model} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _value(rows, metric, threshold, score, with_interval=True):
    (of,) = rows[(rows["metric"] == metric) & (rows["threshold"] == threshold) & (rows["score"] == score)].itertuples()
    interval = f" ({float(of.low):.2f}\N{EN DASH}{float(of.high):.2f})" if with_interval else ""
    return f"{float(of.value):.3f}{interval}"


def draw(confusion, path):
    """Draw what images of each kind are taken for, by the split `novel`, with a picture of a model of each."""
    rows = confusion[(confusion["split"] == "family, novel others") & (confusion["model"] == SHOWN)]
    rows = rows[(rows["threshold"] == "blind") & (rows["test_snr_db"] == SHOWN_SNR) & (rows["elevation"] == "all")]
    targets = load_config(read_yaml(ROOT / picture.FAMILIES))["targets"]
    rows = rows.assign(kind=rows["target"].map(lambda name: targets[name]["kind"]))
    shares = rows.pivot_table(index="kind", columns="predicted", values="count", aggfunc="sum")
    shares = shares.div(shares.sum(axis=1), axis=0)[[*COLORS]]
    first = {of["kind"]: of for of in targets.values() if of["family"]["number"] == 1}
    classes = {kind: of.get("class", OTHER) for kind, of in first.items()}
    wrong = {kind: 1 - shares.loc[kind, label] for kind, label in classes.items()}
    order = [sorted((kind for kind in first if (classes[kind] == OTHER) == other), key=wrong.get) for other in (0, 1)]
    figure, columns = plt.subplots(1, 2, figsize=(11, 6.4))
    figure.subplots_adjust(left=0.17, right=0.985, top=0.9, bottom=0.08, wspace=0.42)
    most = max(map(len, order))
    for axes, kinds, title in zip(
        columns, order, ("kinds of the known classes", "other kinds, none trained"), strict=True
    ):
        places, left = np.arange(len(kinds)), np.zeros(len(kinds))
        for label, color in COLORS.items():
            share = shares.loc[kinds, label].to_numpy()
            axes.barh(
                places, share, left=left, color=color, height=0.72, label="rejected" if label == OTHER else f"a {label}"
            )
            left += share
        axes.set(ylim=(most - 0.5, -0.5), xlim=(0, 1), title=title, xlabel="share of the images, taken for")
        axes.set_yticks(places, [kind.replace("_", " ") for kind in kinds])
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.tick_params(axis="y", length=0, pad=34)
        for place, kind in enumerate(kinds):
            inset = axes.inset_axes((-0.115, 1 - (place + 1) / most, 0.1, 1 / most), projection="3d")
            mesh = solid(first[kind]["family"])
            picture.draw(inset, mesh, picture.COLORS[classes[kind]], 0.72 * np.linalg.norm(np.ptp(mesh[0], axis=0)))
    figure.legend(*columns[0].get_legend_handles_labels(), loc="upper center", ncols=3, frameon=False)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    Image.open(path).quantize(128).save(path, optimize=True)


if __name__ == "__main__":
    main()
