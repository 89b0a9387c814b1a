"""Publish a run's page of the reference thesis, and the scores that it is made of: `make results`.

    publish.py results/thesis

Writes docs/results.md with its pictures in docs/img/results/, and into resources/results the run's scores.csv,
confusion.csv and validation.csv, whole, each compressed (xz), with a README.md that says where they are from.
"""

import argparse
import lzma
import re
import shutil
import sys
from pathlib import Path

import pandas as pd
from study import markdown
from study.selection import PAGE

from isarflow.report.vocabulary import select

ROOT = Path(__file__).parents[2]
PUBLISHED = PAGE["published"]
TABLES = PUBLISHED["tables"]  # what each has, in words


def publish(run, root):
    """Copy a run's page and scores into the repository at `root`. run: results/<name>."""
    page, learning = run / "report" / "thesis", run / "learning"
    text = check(page, learning)
    pictures, folder = root / "docs" / "img" / "results", root / "resources" / "results"
    shutil.rmtree(pictures, ignore_errors=True)  # one that the page no longer has shall not stay
    shutil.copytree(page, pictures, ignore=shutil.ignore_patterns("*.md"))
    (root / "docs" / "results.md").write_text(re.sub(r"\]\(([\w-]+\.png)\)", r"](img/results/\1)", text))
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, words in TABLES.items():
        table = (learning / f"{name}.csv").read_bytes()
        packed = lzma.compress(table, preset=9)
        (folder / f"{name}.csv.xz").write_bytes(packed)
        row = {"file": f"`{name}.csv.xz`", "what": words, "rows": f"{table.count(bytes([10])) - 1:,}"}
        files.append(row | {"MB": f"{len(table) / 1e6:.2f}", "compressed, MB": f"{len(packed) / 1e6:.2f}"})
    facts = re.search(r"^\|  \| this run \|\n(?:^\|.*\n)+", text, re.MULTILINE)[0].strip()
    table = scores_table(pd.read_csv(learning / "scores.csv", keep_default_na=False))
    about = PUBLISHED["about"].format(files=markdown.table(files), facts=facts, name=run.name, table=table)
    (folder / "README.md").write_text(about)
    print(f"docs/results.md with {len(list(pictures.iterdir()))} pictures, and {len(files)} tables")
    if "-dirty" in facts:
        print("Warning: the page was made by code that is not committed; make it anew after the commit.")


def scores_table(scores):
    """Return weighted F1 at some SNRs with its 95 % intervals, as Markdown. scores: the table, empty cells as ''."""
    shown = select(scores, metric="f1_weighted", elevation="all")
    shown = shown[shown.fold.astype(str) == ""]
    shown = shown[shown.snr_definition == shown.snr_definition.iloc[0]]  # the config's comes first
    snrs = PUBLISHED["snrs"]
    head = " | ".join(f"{snr} dB" for snr in snrs).replace("-", "\N{MINUS SIGN}")
    lines = [f"| SNR | {head} |", "|---" * (1 + len(snrs)) + "|"]
    for name, (split, threshold) in PUBLISHED["sets"].items():
        rows = []
        for method, (experiment, model, score) in PUBLISHED["methods"].items():
            case = {"experiment": experiment, "model": model, "score": score if threshold else ""}
            mine = select(shown, split=split, threshold=threshold, **case).set_index("test_snr_db")
            rows += [f"| {method} | {' | '.join(_cell(mine, float(snr)) for snr in snrs)} |"] if len(mine) else []
        lines += [f"| **{name}** {'| ' * len(snrs)}|", *rows] if rows else []
    return "\n".join(lines)


def _cell(rows, snr):
    if snr not in rows.index:
        return ""
    value, low, high = (float(rows.loc[snr, name]) for name in ("value", "low", "high"))
    return f"{value:.2f} ({low:.2f}\N{EN DASH}{high:.2f})"


def check(page, learning):
    """Return the page's text. End with a message where it is not there, or is not of the run's scores."""
    readme, scores = page / "README.md", learning / "scores.csv"
    again = "make it: snakemake --cores 2 thesis_page --configfile config/thesis.yaml"
    for path in (readme, *(learning / f"{name}.csv" for name in TABLES)):
        if not path.exists():
            sys.exit(f"There is no {path}; {again}")
    if readme.stat().st_mtime < scores.stat().st_mtime:
        sys.exit(f"{readme} is older than the run's scores; {again}")
    return readme.read_text()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="the run's folder, results/<name>")
    publish(parser.parse_args().run, ROOT)
