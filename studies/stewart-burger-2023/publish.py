"""Publish a run's page of the reference thesis, and the scores that it is made of: `make results`.

    publish.py results/thesis

Writes docs/results.md with its pictures in docs/img/results/, and into resources/results scores.csv, confusion.csv and
validation.csv of the run, whole, each compressed (xz), with a README.md that says where they come from and has a table
of some of them.
"""

import argparse
import lzma
import re
import shutil
import sys
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).parents[2]
TABLES = {
    "scores": "every metric of every model at every SNR, with 95 % intervals",
    "confusion": "how often each target was taken for which class",
    "validation": "accuracy and weighted F1 on the validation images, by which methods are compared",
}
SNRS = -12, -6, 0, 6, 12, 24  # dB
SETS = {  # what the table shows: split and threshold protocol
    "open set, by sector, blind thresholds": ("sector", "blind"),
    "open set, at random, blind thresholds": ("random", "blind"),
    "open set, at random, `thesis` thresholds": ("random", "thesis"),
    "closed set, by sector": ("sector", ""),
    "closed set, at random": ("random", ""),
}
METHODS = {  # experiments, model and the known score that rejects
    "capsule network": (("capsule_open", "capsule_sector"), "capsule", "zncc"),
    "capsule network, many SNRs": (("noisy_capsule", "noisy_capsule_sector"), "capsule", "zncc"),
    "denoising capsule network, many SNRs": (("noisy_capsule", "noisy_capsule_sector"), "capsule_denoise", "zncc"),
    "matched filter": (("fcnn_open", "sector"), "matched_filter", "correlation"),
    "adaptive matched filter": (("adaptive", "adaptive_sector"), "adaptive_filter", "coherence"),
}
ABOUT = """# Scores of the reference experiment

The tables that [docs/results.md](../../docs/results.md) is made of, as the run wrote them, nothing left out. pandas
reads them as they are: `pandas.read_csv("resources/results/scores.csv.xz")`. Their columns are those of
`learning/scores.csv` and its siblings, as `workflow/scripts/learning/scores.py` says.

{files}

{facts}

The scores and the page were made by `snakemake thesis_page` with the config of this name, and published by
`make results RUN={name}`.

## Weighted F1

Two classes known, two targets unknown, with 95 % intervals; the SNR is that of `mean`, an image's mean power over the
noise's. By sector, test azimuths are far from those trained at; at random they have near copies among them. Blind
thresholds see no image of an unknown target, those of the `thesis` protocol some at validation azimuths. Rejecting
every image of the open set gives 0.33, and so does naming one class for all in the closed set. The capsule networks
have the thesis's size, and by sector are tested on three of the six sectors. "Many SNRs" are those trained without
noise and at -12 to 24 dB, and so is the adaptive matched filter; all others are trained without noise. Few folds make
intervals wide; where all images are named alike they have no width, and say nothing ([how](../../docs/method.md)).

{table}"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="the run's folder, results/<name>")
    publish(parser.parse_args().run, ROOT)


def publish(run, root):
    """Copy a run's page and scores into the repository at `root`. run: results/<name>."""
    page, learning = run / "report" / "thesis", run / "learning"
    text = check(page, learning)
    pictures, folder = root / "docs" / "img" / "results", root / "resources" / "results"
    shutil.rmtree(pictures, ignore_errors=True)  # one that the page no longer has shall not stay
    pictures.mkdir(parents=True)
    folder.mkdir(parents=True, exist_ok=True)
    for picture in sorted(page.glob("*.png")):
        shutil.copyfile(picture, pictures / picture.name)
    (root / "docs" / "results.md").write_text(re.sub(r"\]\(([\w-]+\.png)\)", r"](img/results/\1)", text))
    rows = []
    for name, words in TABLES.items():
        table = (learning / f"{name}.csv").read_bytes()
        packed = lzma.compress(table, preset=9)
        (folder / f"{name}.csv.xz").write_bytes(packed)
        lines = table.count(b"\n") - 1
        rows.append(f"| `{name}.csv.xz` | {words} | {lines:,} | {len(table) / 1e6:.2f} | {len(packed) / 1e6:.2f} |")
    head = ["| file | what | rows | MB | compressed, MB |", "|---|---|---|---|---|"]
    facts = re.search(r"^\|  \| this run \|\n(?:^\|.*\n)+", text, re.MULTILINE)[0].strip()
    table = scores_table(pd.read_csv(learning / "scores.csv", keep_default_na=False))
    words = {"files": "\n".join(head + rows), "facts": facts, "name": run.name, "table": table}
    (folder / "README.md").write_text(ABOUT.format(**words))
    megabytes = sum(path.stat().st_size for path in (*pictures.iterdir(), *folder.glob("*.xz"))) / 1e6
    print(f"docs/results.md, {len(list(pictures.iterdir()))} pictures and {len(rows)} tables: {megabytes:.1f} MB")
    if "-dirty" in facts:
        print("Warning: the page was made by code that is not committed; make it anew after the commit.")


def scores_table(scores):
    """Weighted F1 at some SNRs with its 95 % intervals, in Markdown. scores: the table, its empty cells as ''."""
    shown = scores[(scores.metric == "f1_weighted") & (scores.elevation == "all") & (scores.fold.astype(str) == "")]
    shown = shown[shown.snr_definition == shown.snr_definition.iloc[0]]  # the config's comes first
    head = " | ".join(f"{snr} dB" for snr in SNRS).replace("-", "\N{MINUS SIGN}")
    lines = [f"| SNR | {head} |", "|---" * (1 + len(SNRS)) + "|"]
    for name, (split, threshold) in SETS.items():
        part, rows = shown[(shown.split == split) & (shown.threshold == threshold)], []
        for method, (experiments, model, score) in METHODS.items():
            mine = part[part.experiment.isin(experiments) & (part.model == model)]
            mine = mine[mine.score == (score if threshold else "")].set_index("test_snr_db")
            if len(mine):
                rows.append(f"| {method} | {' | '.join(_cell(mine, float(snr)) for snr in SNRS)} |")
        lines += [f"| **{name}** {'| ' * len(SNRS)}|", *rows] if rows else []
    return "\n".join(lines) + "\n"


def _cell(rows, snr):
    if snr not in rows.index:
        return ""
    value, low, high = (float(rows.loc[snr, name]) for name in ("value", "low", "high"))
    return f"{value:.2f} ({low:.2f}\N{EN DASH}{high:.2f})"


def check(page, learning):
    """The page's text. Ends with a message where it is not there, or is not of the run's scores."""
    readme, scores = page / "README.md", learning / "scores.csv"
    again = "make it: snakemake --cores 2 thesis_page --configfile config/thesis.yaml"
    for path in (readme, *(learning / f"{name}.csv" for name in TABLES)):
        if not path.exists():
            sys.exit(f"There is no {path}; {again}")
    if readme.stat().st_mtime < scores.stat().st_mtime:
        sys.exit(f"{readme} is older than the run's scores; {again}")
    return readme.read_text()


if __name__ == "__main__":
    main()
