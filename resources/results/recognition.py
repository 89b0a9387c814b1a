"""Publish the recognition run: `make recognition`.

    recognition.py results/recognition

Writes its scores into the folder recognition/ beside this file, whole, each compressed (xz); the figures of
docs/recognition.md, one of which the repository's README.md shows; and the tables of that page, between their marks.
"""

import argparse
import json
import lzma
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from publish import TABLES

from isarflow.learning.classifier import OTHER
from isarflow.learning.data import features, images
from isarflow.learning.evaluation import judge, paired
from isarflow.learning.tables import read_table

ROOT = Path(__file__).parents[2]
SNRS = -12, -6, 0, 6, 12, 24  # dB
METHODS = {  # experiment of each split, model, known score
    "likelihood": ("", "likelihood", "likelihood"),
    "its magnitudes alone (Rice)": ("", "likelihood", "rice"),
    "its coherence alone": ("", "likelihood", "coherence"),
    "without mismatch": ("", "likelihood_exact", "likelihood"),
    "adaptive filter": ("adaptive", "adaptive_filter", "coherence"),
    "ZNCC of magnitudes": ("", "zncc", "correlation"),
    "KNN on magnitudes": ("", "knn_magnitude", "distance"),
    "matched filter": ("", "matched_filter", "correlation"),
    "likelihood, VV": ("vv", "likelihood", "likelihood"),
    "ZNCC of magnitudes, VV": ("vv", "zncc", "correlation"),
}
SPLITS = {"elevation": "elevations between the library's", "random": "azimuths at random"}
EXPERIMENTS = {  # by split and the first of METHODS
    ("elevation", ""): "elevation",
    ("random", ""): "random",
    ("elevation", "vv"): "elevation_vv",
    ("random", "vv"): "random_vv",
    ("elevation", "adaptive"): "adaptive_elevation",
    ("random", "adaptive"): "adaptive",
}
AGAINST = ("adaptive filter", "ZNCC of magnitudes", "KNN on magnitudes", "matched filter")
SHOWN = ("likelihood", "adaptive filter", "ZNCC of magnitudes", "matched filter", "likelihood, VV")  # of the figure


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="the run's folder, results/recognition")
    run = parser.parse_args().run
    learning, folder = run / "learning", Path(__file__).parent / "recognition"
    keep(learning, folder)
    table = whole(learning / "scores.csv")
    draw(table, ROOT / "docs/img/recognition.svg")
    mistakes(run, ROOT / "docs/img/mistakes.png")
    page = ROOT / "docs/recognition.md"
    put(page, "f1", by_split(table, METHODS, "f1_weighted", "kept"))
    put(page, "auroc", by_split(table, METHODS, "auroc", ""))
    put(page, "looks", looks(table))
    put(page, "paired", differences(learning / "predictions"))
    put(page, "confusion", confusion(pd.read_csv(learning / "confusion.csv", keep_default_na=False)))


def keep(learning, folder):
    """Copy a run's tables of scores into a folder, each compressed."""
    folder.mkdir(exist_ok=True)
    for name in TABLES:
        (folder / f"{name}.csv.xz").write_bytes(lzma.compress((learning / f"{name}.csv").read_bytes(), preset=9))


def whole(path):
    """The rows of a table of scores that count all elevations and folds, by the run's definition of SNR."""
    table = pd.read_csv(path, keep_default_na=False)
    return table[(table.elevation == "all") & (table.fold.astype(str) == "") & (table.snr_definition == "mean")]


def between(path, mark):
    """What stands in a file before, between and after the marks of this name."""
    start, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->\n"
    before, rest = path.read_text().split(start)
    text, after = rest.split(end)
    return before + start, text, end + after


def put(path, mark, text):
    before, _, after = between(path, mark)
    path.write_text(before + text + after)


def of_method(table, split, method, metric, threshold):
    """The rows of a method, by SNR."""
    part, model, score = method
    chosen = (table.experiment == EXPERIMENTS[split, part]) & (table.model == model) & (table.metric == metric)
    return table[chosen & (table.score == score) & (table.threshold == threshold)].set_index("test_snr_db")


def by_split(table, methods, metric, threshold):
    """A metric at some SNRs with its 95 % interval, in Markdown."""
    lines = head([f"{snr} dB" for snr in SNRS], "SNR")
    for split, words in SPLITS.items():
        lines.append(f"| **{words}** {'| ' * len(SNRS)}|")
        for name, method in methods.items():
            rows = of_method(table, split, method, metric, threshold)
            lines.append(f"| {name} | {' | '.join(_cell(rows, float(snr)) for snr in SNRS)} |")
    return "\n".join(lines) + "\n"


def _cell(rows, snr):
    value, low, high = (float(rows.loc[snr, name]) for name in ("value", "low", "high"))
    return f"{value:.2f} ({low:.2f}\N{EN DASH}{high:.2f})"


def looks(table):
    """Weighted F1 of the likelihood of several looks together, in Markdown."""
    lines = head([f"{snr} dB" for snr in SNRS], "looks")
    for split, words in SPLITS.items():
        lines.append(f"| **{words}** {'| ' * len(SNRS)}|")
        for count in (1, 2, 3, 5):
            metric = f"f1_weighted_{count}_looks" if count > 1 else "f1_weighted"
            rows = of_method(table, split, METHODS["likelihood"], metric, "kept")
            values = [f"{float(rows.value.loc[snr]):.3f}" if snr in rows.index else "" for snr in map(float, SNRS)]
            lines.append(f"| {count} | {' | '.join(values)} |")
    return "\n".join(lines) + "\n"


def differences(predictions):
    """By how much the likelihood's weighted F1 is larger than others' on the same images, in Markdown."""
    lines = head([f"{snr} dB" for snr in SNRS], "less")
    kept, seed = 0.95, 0
    for split, words in SPLITS.items():
        lines.append(f"| **{words}** {'| ' * len(SNRS)}|")
        decided = {}
        for name in ("likelihood", *AGAINST):
            part, model, score = METHODS[name]
            folds = sorted(predictions.glob(f"{EXPERIMENTS[split, part]}*/{model}"))
            folds = [one for one in folds if one.parent.name.split("_fold")[0] == EXPERIMENTS[split, part]]
            for snr in SNRS:
                tables = pd.concat([read_table(one / f"snr_{snr}dB.csv") for one in folds], ignore_index=True)
                for one in judge.decide(tables, kept):
                    if (one.score, one.threshold) == (score, "kept"):
                        decided[name, snr] = one
        for name in AGAINST:
            cells = []
            for snr in SNRS:
                for metric, *_, value, low, high, _ in paired.difference(
                    decided["likelihood", snr], decided[name, snr], seed
                ):
                    if metric == "f1_weighted":
                        cells.append(f"{value:+.3f} ({low:+.3f} to {high:+.3f})".replace("-", "\N{MINUS SIGN}"))
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def confusion(table):
    """What the likelihood takes each target for at 6 dB, in shares, in Markdown."""
    lines = ["| split | target | drone | missile | other |", "|---|---|---|---|---|"]
    for split, words in SPLITS.items():
        mine = table[(table.experiment == EXPERIMENTS[split, ""]) & (table.model == "likelihood")]
        mine = mine[(mine.score == "likelihood") & (mine.threshold == "kept") & (mine.test_snr_db == 6)]
        counts = mine[mine.elevation == "all"].pivot_table(
            index="target", columns="predicted", values="count", aggfunc="sum"
        )
        shares = counts.div(counts.sum(axis=1), axis=0).fillna(0)
        for target, row in shares.iterrows():
            cells = " | ".join(f"{row.get(name, 0):.3f}" for name in ("drone", "missile", "other"))
            lines.append(f"| {words} | {target} | {cells} |")
    return "\n".join(lines) + "\n"


def head(columns, first):
    return [f"| {first} | {' | '.join(columns)} |".replace("-", "\N{MINUS SIGN}"), "|---" * (1 + len(columns)) + "|"]


def mistakes(run, path):
    """Images at 6 dB, by elevation, that are taken for what they are not, over the library's view that they resemble.

    Of both folds the unknown ones that the likelihood accepts with the largest scores, and the known ones that it
    rejects with the smallest, each of another azimuth. One row a channel: magnitudes in dB of each image's peak.
    """
    name, (_, model, score) = EXPERIMENTS["elevation", ""], METHODS["likelihood"]
    folds = sorted((run / "learning/predictions").glob(f"{name}_fold*/{model}/snr_6dB.csv"))
    table = pd.concat(map(read_table, folds), ignore_index=True)
    (decided,) = (one for one in judge.decide(table) if (one.score, one.threshold) == (score, "kept"))
    rows = decided.test.assign(decided=decided.predicted, level=decided.test[f"known_{score}"])
    accepted = rows[(rows.role == "unknown") & (rows.decided != OTHER)].sort_values("level", ascending=False)
    rejected = rows[(rows.role == "known") & (rows.decided == OTHER)].sort_values("level")
    chosen = [of.drop_duplicates("azimuth").head(count) for of, count in ((accepted, 4), (rejected, 2))]
    chosen = pd.concat(chosen).to_dict("records")
    figure, axes = plt.subplots(6, len(chosen), figsize=(1.75 * len(chosen), 8.6), layout="constrained")
    for column, row in zip(axes.T, chosen, strict=True):
        folder = run / f"learning/models/{name}_fold{row['fold']}/{model}/split.json"
        trained = json.loads(folder.read_text())["targets"][row["predicted"]]["train"]
        store = run / f"imaging/{row['target']}/snr_6dB.zarr"
        (image,), _ = images.read([store], {row["target"]: [row["azimuth"]]}, [row["elevation"]], realizations=1)
        store = run / f"imaging/{row['predicted']}/clean.zarr"
        views, origin = images.read([store], {row["predicted"]: trained["azimuth"]}, trained["elevation"])
        alike = features.standardized(np.abs(views).reshape(len(views), -1))
        nearest = int((alike @ features.standardized(np.abs(image).reshape(1, -1)).T).argmax())
        angles = [(of["target"], of["elevation"], of["azimuth"]) for of in (row, origin.iloc[nearest])]
        titles = [f"{target} {elevation:g}°, {azimuth:.1f}°" for target, elevation, azimuth in angles]
        titles[0] += f"\ntaken for {row['decided']}"
        for axis, channel in zip(column, (*image, *views[nearest]), strict=True):
            level = 20 * np.log10(np.maximum(np.abs(channel), 1e-3))
            picture = axis.imshow(level, vmin=-30, vmax=0, origin="lower", aspect="auto", cmap="magma")
            axis.set(xticks=[], yticks=[])
        for place, title in zip((0, 3), (titles[0], f"library: {titles[1]}"), strict=True):
            column[place].set_title(title, fontsize=7)
    for axis, label in zip(axes[:, 0], 2 * ["VV", "HH", "HV"], strict=True):
        axis.set_ylabel(label)
    figure.colorbar(picture, ax=axes, label="magnitude / image's peak [dB]", shrink=0.5, aspect=40)
    figure.savefig(path, dpi=90, pil_kwargs={"optimize": True})
    plt.close(figure)


def draw(table, path):
    """The weighted F1 of some methods against the SNR, for each split."""
    plt.rcParams.update({"svg.hashsalt": "isarflow", "font.size": 10})
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True, layout="constrained")
    for axis, (split, words) in zip(axes, SPLITS.items(), strict=True):
        for name in SHOWN:
            rows = of_method(table, split, METHODS[name], "f1_weighted", "kept").sort_index()
            x = rows.index.to_numpy(float)
            value, low, high = (rows[column].astype(float).to_numpy() for column in ("value", "low", "high"))
            (line,) = axis.plot(x, value, marker="o", markersize=3, linestyle="--" if "VV" in name else "-", label=name)
            if name == "likelihood":  # all five would hide each other
                axis.fill_between(x, low, high, color=line.get_color(), alpha=0.15, linewidth=0)
        axis.set(title=words, xlabel="SNR [dB]", xticks=SNRS, ylim=(0.2, 1))
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("weighted F1, open set")
    axes[1].legend(loc="lower right", fontsize=8)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    main()
