"""Group SNRs into jobs for a target's images and a model's predictions: those added to the config together are one.

A job for each SNR would spend most of its time on its start; one job for all would run again for each SNR that is
added. Snakemake reruns a job whose inputs change, so the sets must not change: they are kept beside the images.
"""

import json
from pathlib import Path

FILE = "imaging/sets.json"


def sets(results, labels, is_main=True):
    """The labels of the config's SNRs (as 'snr_6dB') as sets, lists in the config's order; the oldest set is first.

    The last set has the SNRs without images yet, and those to be predicted again because an SNR of their set is gone.
    results: the run's folder. is_main: False in a job, for which the sets are fixed, even if images have been made
    since the run began.
    """
    file = Path(results, FILE)
    there = {label for label in labels if not is_main or any(file.parent.glob(f"*/{label}.zarr"))}
    parts = [part for part in (json.loads(file.read_text()) if file.exists() else []) if there.issuperset(part)]
    new = [label for label in labels if not any(label in part for part in parts)]
    return [*parts, new] if new else parts


def keep(results, parts):
    """Write down the sets of a run that begins."""
    file = Path(results, FILE)
    file.parent.mkdir(parents=True, exist_ok=True)
    part = Path(f"{file}.part")
    part.write_text(json.dumps(parts))
    part.rename(file)
