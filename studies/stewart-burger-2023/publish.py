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

from study import markdown
from study.selection import PAGE

from isarflow.report.results import read_learned
from isarflow.report.vocabulary import F1, at_snrs, select

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
    table = scores_table(read_learned(learning / "scores.csv"))
    about = PUBLISHED["about"].format(files=markdown.table(files), facts=facts, name=run.name, table=table)
    (folder / "README.md").write_text(about)
    print(f"docs/results.md with {len(list(pictures.iterdir()))} pictures, and {len(files)} tables")
    if "-dirty" in facts:
        print("Warning: the page was made by code that is not committed; make it anew after the commit.")


def scores_table(scores):
    """Return weighted F1 at some SNRs with its 95 % intervals, as Markdown. scores: as of `read_learned`."""
    shown, rows = select(scores, metric=F1, elevation="all", fold=""), []
    shown = shown[shown.snr_definition == shown.snr_definition.iloc[0]]  # the config's comes first
    for name, (split, threshold) in PUBLISHED["sets"].items():
        for method, (experiment, model, score) in PUBLISHED["methods"].items():
            case = {"experiment": experiment, "model": model, "score": score if threshold else ""}
            mine = select(shown, split=split, threshold=threshold, **case)
            rows += [{"images": name, "method": method} | at_snrs(mine, PUBLISHED["snrs"])] if len(mine) else []
    return markdown.table(rows)


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
