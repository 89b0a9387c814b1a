"""Which SNRs are one job of a target's images, and of a model's predictions: those that came into the config together.

A job for each SNR would be mostly its start, and one job for all of them would repeat them all for one more. Snakemake
reruns a job whose inputs are others, so the sets have to stay as they were: they are kept beside the images.
"""

import json
from pathlib import Path

FILE = "imaging/sets.json"


def sets(results, labels, is_main=True):
    """The labels of the config's SNRs (as 'snr_6dB') as sets, lists in the config's order; the oldest set is first.

    What no images were made at yet is in the last set, and so is what has to be predicted again because an SNR of its
    set is gone. results: the run's folder. is_main: False in a job, for which the sets stand fast, whatever images have
    been made since the run began.
    """
    file = Path(results, FILE)
    there = {label for label in labels if not is_main or any(file.parent.glob(f"*/{label}.zarr"))}
    parts = [part for part in (json.loads(file.read_text()) if file.exists() else []) if there.issuperset(part)]
    new = [label for label in labels if not any(label in part for part in parts)]
    return [*parts, new] if new else parts


def keep(results, parts):
    """Note the sets of a run that begins."""
    file = Path(results, FILE)
    file.parent.mkdir(parents=True, exist_ok=True)
    part = Path(f"{file}.part")
    part.write_text(json.dumps(parts))
    part.rename(file)
