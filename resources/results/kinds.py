"""Publish the run by family: `make kinds`.

    kinds.py results/kinds

Writes its scores into kinds.csv.xz beside this file, and the tables of docs/kinds.md between their marks.
"""

import lzma
import sys
from pathlib import Path

import pandas as pd
from recognition import ROOT, head, put

OTHERS = {"novel": "of kinds that never trained", "seen": "of kinds that trained, other models"}
MODELS = "likelihood_other", "invariants", "cnn", "sum"
LOOKS = 1, 3, 5
METRICS = {"auroc": "", "f1_mix": "mix", "f1_balanced": "blind"}  # with the protocol of their thresholds


def main():
    path = Path(sys.argv[1], "learning/scores.csv")
    Path(__file__).with_name("kinds.csv.xz").write_bytes(lzma.compress(path.read_bytes(), preset=9))
    table = pd.read_csv(path, keep_default_na=False)
    table = table[(table["elevation"] == "all") & (table["fold"].astype(str) == "")]
    for snr in sorted(table["test_snr_db"].unique()):
        put(ROOT / "docs/kinds.md", f"{snr:g} dB", by_split(table[table["test_snr_db"] == snr]))


def by_split(table):
    """The closed set's accuracy and METRICS of one or more looks, of each model by each split, in Markdown."""
    columns = [f"{name}, {words}" for name in ("AUROC", "F1 mix", "F1 balanced") for words in ("1 look", "3", "5")]
    lines = head(["closed", *columns], "other things")
    for others, words in OTHERS.items():
        lines.append(f"| **{words}** {'| ' * (1 + len(columns))}|")
        for model in MODELS:
            rows = table[(table["split"] == f"family, {others} others") & (table["model"] == model)]
            # The first confidence score of a model is the one by which it is told from other things.
            score = next(iter(rows.loc[rows["score"] != "", "score"]), "")
            cells = [_value(rows, "accuracy", "", "")]
            for metric, threshold in METRICS.items():
                names = [metric if count == 1 else f"{metric}_{count}_looks" for count in LOOKS]
                cells += [_value(rows, name, threshold, score) for name in names]
            lines.append(f"| {model} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _value(rows, metric, threshold, score):
    """A metric with its interval, if it has one, as text."""
    of = rows[(rows["metric"] == metric) & (rows["threshold"] == threshold) & (rows["score"] == score)]
    if of.empty:
        return ""
    value, low, high = of.iloc[0][["value", "low", "high"]]
    interval = f" ({float(low):.2f}\N{EN DASH}{float(high):.2f})" if low != "" else ""
    return f"{float(value):.3f}{interval}"


if __name__ == "__main__":
    main()
