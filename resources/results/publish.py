"""Publish a run's page of the reference thesis, and the scores that it is made of: `make results`.

    publish.py results/thesis

Writes docs/results.md with its pictures in docs/img/results/, and into this folder scores.csv, confusion.csv and
validation.csv of the run, whole, each compressed (xz), with a README.md that says where they come from.
"""

import argparse
import lzma
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
TABLES = {
    "scores": "every metric of every model at every SNR, with 95 % intervals",
    "confusion": "how often each target was taken for which class",
    "validation": "accuracy and weighted F1 on the validation images, by which methods are compared",
}
ABOUT = """# Scores of the reference experiment

The tables that [docs/results.md](../../docs/results.md) is made of, as the run wrote them, nothing left out. pandas
reads them as they are: `pandas.read_csv("resources/results/scores.csv.xz")`. Their columns are those of
`learning/scores.csv` and its siblings, as `workflow/scripts/learning/scores.py` says.

{files}

{facts}

The scores and the page were made by `snakemake thesis_page` with the config of this name, and published by
`make results RUN={name}`.
"""


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
    facts = re.search(r"(?:^\|.*\n)+", text, re.MULTILINE)[0].strip()  # the first table: the run
    (folder / "README.md").write_text(ABOUT.format(files="\n".join(head + rows), facts=facts, name=run.name))
    megabytes = sum(path.stat().st_size for path in (*pictures.iterdir(), *folder.glob("*.xz"))) / 1e6
    print(f"docs/results.md, {len(list(pictures.iterdir()))} pictures and {len(rows)} tables: {megabytes:.1f} MB")
    if "-dirty" in facts:
        print("Warning: the page was made by code that is not committed; make it anew after the commit.")


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
