"""Folders of the results of a run."""

from pathlib import Path

from isarflow.core.errors import InputError

SCORES = "learning/scores.csv"
# The repository that this file is in, also where a copy has folders in place of links; none of an installed package.
ROOT = next((path for path in Path(__file__).resolve().parents if (path / "config/schema.yaml").exists()), Path())


def of_fields(results, config):
    """The folder with the meshes and fields of a run.

    results: the run's own folder, which has them unless the config takes them `from` another run.
    """
    return Path(results).parent / config["from"] if "from" in config else Path(results)


def of_others(names, there):
    """The results folders of other runs, by name. there: number of runs that are compared with these.

    Raises InputError where one has no scores, and where there would be nothing to compare.
    """
    key = "config key 'compare'"
    if there + len(names) < 2:
        raise InputError(
            f"{key}: there is nothing to compare this run with. Name other runs of this folder (--config "
            "compare='[quick]'), or give 'seed' several values."
        )
    roots = {name: f"results/{name}" for name in names}
    for root in (root for root in roots.values() if not Path(root, SCORES).is_file()):
        have = sorted(path.parents[1].name for path in Path("results").glob(f"*/{SCORES}"))
        raise InputError(
            f"{key}: there is no {root}/{SCORES}; make that run first, with its own config. "
            f"There are: {', '.join(have) or 'none'}."
        )
    return roots


def judged(root):
    """The scores of a finished run and the files they come from: predictions, and the descriptions of its models."""
    learning = Path(root, "learning")
    files = [*learning.glob("predictions/*/*/*.csv"), *learning.glob("models/*/*/config.json")]
    return [str(Path(root, SCORES)), *sorted(map(str, files))]
