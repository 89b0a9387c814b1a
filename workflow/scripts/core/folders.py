"""Where the results of a run lie."""

from pathlib import Path


def of_fields(results, config):
    """The folder with the meshes and fields of a run.

    results: the run's own folder, where they are unless the config takes them `from` another run.
    """
    return Path(results).parent / config["from"] if "from" in config else Path(results)
