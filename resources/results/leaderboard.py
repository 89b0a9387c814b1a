"""Publish the benchmark's leaderboard: `make benchmark`.

    leaderboard.py results/benchmark

Copies it beside this file, and writes the table of docs/benchmark.md between its marks.
"""

import shutil
import sys
from pathlib import Path

import pandas as pd
from recognition import ROOT, head, put

from isarflow.learning.evaluation.leaderboard import LEADERBOARD, RANK, in_words


def main():
    path = Path(__file__).with_name("leaderboard.csv")
    shutil.copyfile(Path(sys.argv[1], LEADERBOARD), path)
    put(ROOT / "docs/benchmark.md", "leaderboard", by_protocol(pd.read_csv(path, keep_default_na=False)))


def by_protocol(board):
    """The weighted F1 of each method at each SNR with its interval, protocol by protocol, in Markdown."""
    board = board.assign(words=in_words(board)[RANK])
    snrs = sorted(board["test_snr_db"].unique())
    lines = head([f"{snr:g} dB" for snr in snrs], "SNR")
    for experiment, of_experiment in board.groupby("experiment"):
        lines.append(f"| **{experiment}** {'| ' * len(snrs)}|")
        for (model, score), rows in of_experiment.groupby(["model", "score"], sort=False):
            words = rows.set_index("test_snr_db")["words"].reindex(snrs, fill_value="")
            lines.append(f"| {model}, {score} | {' | '.join(words)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
